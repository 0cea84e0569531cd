"""Records as drops: each once, with a name of its own."""

from __future__ import annotations

import numpy as np
import pytest
from tdbsim.errors import InputError
from tdbsim.machine import EffectSetting, load_machine

from tdbmon.identify.calibrate import fit_drops
from tdbmon.identify.drop import measured_drop
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


def test_where_a_record_cannot_be_used_it_is_said_which_others_can():
    """Of four drops the one that began after its release stopped the diagnosis of all, with no word of the other three."""
    machine, whole = load_machine(shipped("loose/machine.toml")), read(shipped("loose/drop_100.nc"))
    late = whole.sel(time=whole["time"] > whole["time"][0] + 0.105).assign_attrs(source_file="late.nc", sha256="1")
    later = whole.sel(time=whole["time"] > whole["time"][0] + 0.2).assign_attrs(source_file="later.nc", sha256="2")
    with pytest.raises(InputError, match=r"^late.nc: .* of levitation or more; leave it out to use the other drop$"):
        measured_drops([whole, late], machine)
    with pytest.raises(InputError, match=r"; nor can later.nc be used; leave them out to use the other drop$"):
        measured_drops([late, whole, later], machine)
    with pytest.raises(InputError, match=r"of levitation or more; nor can later.nc be used$"):
        measured_drops([late, later], machine)


def test_another_export_of_a_drop_is_not_fitted_beside_it(tmp_path):
    """Its rounding makes it another file; as a second drop it would be held out to prove a fit to itself."""
    source, export = read(shipped("loose/drop_100.nc")), tmp_path / "export.csv"
    names = [str(name) for name in source.data_vars]
    scale = np.array([1e6 if source[name].attrs["units"] == "m" else 1.0 for name in names])
    table = np.column_stack([source["time"].to_numpy(), *(source[name].to_numpy() for name in names)])
    units = ["um" if source[name].attrs["units"] == "m" else source[name].attrs["units"] for name in names]
    head = ",".join(["time [s]", *(f"{name} [{unit}]" for name, unit in zip(names, units, strict=True))])
    np.savetxt(export, table * np.concatenate([[1.0], scale]), fmt="%.5f", delimiter=",", header=head, comments="")
    machine = load_machine(shipped("loose/machine.toml"))
    with pytest.raises(InputError, match=r"export.csv holds the same measurement as drop_100.nc; a drop counts once"):
        measured_drops([source, read(shipped("loose/drop_150.nc")), read(export)], machine)


def test_what_the_machine_file_says_of_a_sensor_is_no_fault_of_the_record():
    """A stated gain had the fall look too fast for gravity, and moved the release."""
    machine, record = load_machine(shipped("loose/machine.toml")), read(shipped("loose/drop_100.nc"))
    gain = EffectSetting(name="probe_gain", where="NDE_A", gain=1.4)
    amplified = record.assign(NDE_A=record["NDE_A"] * 1.4).assign_attrs(sha256="")
    sound = measured_drop(record, machine)
    told = measured_drop(amplified, machine.model_copy(update={"effects": (gain,)}))
    assert told.release == pytest.approx(sound.release, abs=1e-6)
    assert told.remarks == sound.remarks

    assert any("gravity" in each for each in measured_drop(amplified, machine).remarks)
