"""Records as drops: each once, with a name of its own."""

from __future__ import annotations

import pytest
from tdbsim.errors import InputError
from tdbsim.machine import load_machine

from tdbmon.identify.calibrate import fit_drops
from tdbmon.identify.measured_drops import measured_drops
from tdbmon.record.read import read
from tdbmon.shipped import shipped


def test_files_of_one_name_from_two_folders_are_two_drops(tmp_path):
    other = tmp_path / "drop_100.nc"
    other.write_bytes(shipped("loose/drop_150.nc").read_bytes())
    records = [read(path) for path in (shipped("loose/drop_100.nc"), other)]
    first, second = measured_drops(records, load_machine(shipped("loose/machine.toml")))
    assert (first.name, second.name) == ("drop_100.nc", "drop_100.nc (2)")
    assert abs(second.speed) > 1.2 * abs(first.speed)


def test_a_drop_given_twice_is_not_fitted_twice(tmp_path):
    """Counted twice it would make every interval narrower than what is known."""
    copy = tmp_path / "copy.nc"
    copy.write_bytes(shipped("loose/drop_100.nc").read_bytes())
    records = [read(path) for path in (shipped("loose/drop_100.nc"), copy)]
    with pytest.raises(InputError, match=r"copy.nc is given twice, also as drop_100.nc"):
        fit_drops(load_machine(shipped("loose/machine.toml")), records)
