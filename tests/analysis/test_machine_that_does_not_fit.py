"""A rotor that the machine file makes far too heavy leaves no air gap: that is said, and nothing rests on it (synthetic)."""

from __future__ import annotations

from pathlib import Path

from tdbsim.machine import Machine, load_machine

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.summary import summary_lines
from tdbmon.record.read import read
from tdbmon.shipped import shipped
from tests.shipped_drops import analysed


def _ten_times_as_thick(folder: Path) -> Machine:
    text = shipped("short/machine.toml").read_text(encoding="utf-8")
    changed = text.replace('outer_diameter = "150 mm"', 'outer_diameter = "1500 mm"')
    assert changed != text
    path = folder / "machine.toml"
    path.write_text(changed, encoding="utf-8")
    return load_machine(path)


def test_a_negative_gap_is_withheld_with_the_weight_that_leaves_none(tmp_path: Path) -> None:
    found = analyse(read(shipped("short/drop_100.nc")), _ten_times_as_thick(tmp_path))
    end = found.ends["NDE"]
    for estimate in (end.air_gap, end.stiffness):
        assert not estimate.known
        assert "rotor of 5600 kg, 27" in estimate.why
        assert "Check diameters, lengths and masses" in estimate.why
    assert end.contacts is None
    assert end.no_contact == end.air_gap.why
    # contacts hardly slow so heavy a rotor
    failed = [("machine and record", "NDE"), ("run-down", "")]
    assert [(c.check, c.channel) for c in found.checks if not c.passed] == failed
    assert any(line.startswith("rotor") and "5600 kg" in line for line in summary_lines(found))


def test_a_sound_machine_leaves_a_gap() -> None:
    found = analysed("short/drop_100")
    assert all(check.passed for check in found.checks)
    assert all(end.air_gap.known for end in found.ends.values())
