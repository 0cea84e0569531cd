"""A bore that is not round: its arc's curvature is no radius, and the record says so."""

from __future__ import annotations

import re

import pytest
from tdbsim.sensors import ProbeChain, SensorChain
from tdbsim.simulate import DropPlan, simulate
from tdbsim.stated_effects import parse

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.contract import analysis_json
from tdbmon.analysis.summary import summary_lines
from tdbmon.report.document import Paragraph, Table
from tdbmon.report.sections import release
from tests.shipped_drops import analysed, recorded


def oval(machine, seconds):
    """A drop in a bore of 250 um that is 20 um wider to the sides, and narrower up and down."""
    effect = parse("oval_clearance:where=NDE,amplitude=20 um,angle=0 deg")
    plan = DropPlan(
        speed=150.0,
        seconds=seconds,
        levitated=0.1,
        sensors=SensorChain(probe=ProbeChain(noise=0.25e-6), speed_noise_hz=0.03),
        seed=1,
    )
    made = simulate(machine, plan, [effect])
    made.attrs["source_file"] = "oval.nc"
    return made


def checks_of(result, name):
    return {check.channel: check for check in result.checks if check.check == name}


@pytest.mark.parametrize("name", ["short/drop_100", "loose/drop_060"])
def test_a_sound_shaft_levitates_near_the_centre(name):
    found = checks_of(analysed(name), "set point")
    assert set(found) == {"NDE", "DE"}
    assert all(check.passed for check in found.values())


def test_a_probe_that_misreads_blames_no_bore_at_the_other_end():
    """The other end is taken at its own probes: there it levitated, was let go and has its circle."""
    record, whole = recorded("short/drop_100"), analysed("short/drop_100")
    record["NDE_A"] += 5e-3
    result = analyse(record, whole.machine)
    assert {check.channel for check in result.checks if not check.passed} == {"NDE_A"}
    assert checks_of(result, "set point")["DE"].passed
    assert result.levitation["DE"].share.known
    state, levitated = result.release.states["DE"], result.levitation["DE"]
    assert state.levitated == pytest.approx((levitated.x.value, levitated.y.value), abs=1e-6)
    assert "at the probe plane" in state.x.method
    for got, expected in ((state.x, whole.release.states["DE"].x), (state.y, whole.release.states["DE"].y)):
        assert got.value == pytest.approx(expected.value, abs=5e-6)  # the planes are 40 mm apart


def test_an_oval_bore_is_not_silently_a_wide_gap(machine):
    result = analyse(oval(machine, 1.5), machine)
    assert result.ends["NDE"].air_gap.low > 300e-6  # true: 250 um, 230 um at the bottom
    found = checks_of(result, "set point")["NDE"]
    assert not found.passed
    assert "not round" in found.detail
    apart = float(re.search(r"levitated ([\d.]+) um", found.detail)[1])
    assert apart == pytest.approx(352 - 250, abs=25)  # radius of curvature at the bottom less the mean radius
    no_zone_is_told(result)


def no_zone_is_told(result):
    """The oval end's zone is withheld with the reason, everywhere; the round end has its own."""
    assert not result.levitation["NDE"].share.known and result.levitation["NDE"].reach.known
    told = {end: found["zone"] for end, found in analysis_json(result)["levitation"].items()}
    assert told == {"NDE": None, "DE": "A"}
    lines = [line for line in summary_lines(result) if "levitated, from centre" in line]
    assert ["no zone of ISO 14839-2: the check of the set point failed" in line for line in lines] == [True, False]
    blocks = release.section(result).blocks
    table = next(b for b in blocks if isinstance(b, Table) and b.header[-1] == "Zone")
    assert [row.cells[-1] for row in table.rows] == ["–", "A"]
    said = next(b.text for b in blocks if isinstance(b, Paragraph) and b.text.startswith("Zones of ISO 14839-2"))
    assert "NDE has no zone: the check of the set point failed" in said


def test_where_arc_and_swing_disagree_no_circle_is_told(machine):
    result = analyse(oval(machine, 12.0), machine)
    assert not checks_of(result, "gap from arc and swing agree")["NDE"].passed
    end = result.ends["NDE"]
    assert end.gap is None
    assert "no circle is reported" in end.air_gap.why
    assert end.gap_from_swing.known
    assert result.ends["DE"].gap.agrees
