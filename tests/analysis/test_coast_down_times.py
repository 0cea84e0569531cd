"""Coast-down times: true intervals where they are measured and where the law is carried on, and what is not told."""

from __future__ import annotations

import numpy as np
import pytest

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.contract import analysis_json
from tdbmon.analysis.drag_law import DragLaw, slowing_time
from tdbmon.analysis.rundown import RunDown, fit_rundown
from tdbmon.analysis.summary import summary_lines
from tdbmon.record.read import read
from tdbmon.report.sections import rundown as section
from tdbmon.shipped import shipped

RELEASE, SPEED, RATE = 0.5, 70.0, 40.0
LAWS = {
    "exponential": DragLaw(RELEASE, SPEED, 1 / 5.0),
    "exponential + constant": DragLaw(RELEASE, SPEED, 1 / 5.0, 1.5),
    "constant + exponential + quadratic": DragLaw(RELEASE, SPEED, 1 / 8.0, 1.5, 2e-3),
}


def slowed(law: DragLaw, seconds: float, seed: int) -> RunDown:
    """A rotor driven up to the release, then coasting, in a speed signal with noise."""
    time = np.arange(0, seconds, 1 / RATE)
    speed = np.where(time < RELEASE, law.speed, law.speed_at(time))
    speed = speed + np.random.default_rng(seed).normal(0, 0.05, len(time))
    return fit_rundown(time, speed, release_time=RELEASE, polar_inertia=0.3)


def when(law: DragLaw, share: float) -> float:
    row = np.array([[law.speed, law.linear, law.constant, law.quadratic]])
    return RELEASE + float(slowing_time(row, share * law.speed)[0])


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_time_to_a_slower_speed_is_where_the_law_has_it(law: DragLaw):
    for share in (0.9, 0.5, 0.1):
        assert law.speed_at(when(law, share)) == pytest.approx(share * SPEED, rel=1e-9)


def test_a_law_that_drives_the_rotor_never_slows_it_so_far():
    rows = np.array([[70.0, 0.1, -3.0, 0.0], [70.0, 0.1, 0.0, 0.0]])
    assert slowing_time(rows, 20.0)[0] == np.inf  # it turns at 30 Hz in the end
    assert slowing_time(rows, 40.0)[0] == pytest.approx(10 * np.log(4.0))
    assert slowing_time(rows, 0.0)[1] == np.inf


@pytest.mark.parametrize("name", LAWS)
def test_a_measured_time_lies_in_its_interval_as_often_as_stated(name: str):
    law, seeds, hits = LAWS[name], 100, np.zeros(2)
    for seed in range(seeds):
        found = slowed(law, 20.0, seed).coast_down
        for i, (estimate, share) in enumerate(((found.half, 0.5), (found.tenth, 0.1))):
            assert estimate.method.startswith("measured")
            hits[i] += estimate.low <= when(law, share) <= estimate.high
    assert np.all(hits >= 0.88 * seeds)


@pytest.mark.parametrize("name", LAWS)
def test_an_extrapolated_time_lies_in_its_interval_at_least_as_often_as_stated(name: str):
    """The record ends where a third of the speed is left, which no law of fewer terms than the true one needs to show."""
    law, seeds, inside, told = LAWS[name], 60, 0, 0
    for seed in range(seeds):
        run = slowed(law, when(law, 1 / 3), seed)
        if run.coast_down.tenth.known:
            told += 1
            assert run.coast_down.tenth.method.startswith("extrapolated by the chosen law")
            inside += run.coast_down.tenth.low <= when(law, 0.1) <= run.coast_down.tenth.high
        assert run.coast_down.half.method.startswith("measured")
    assert told > seeds / 2
    assert inside >= 0.9 * told


def test_a_record_that_ends_too_early_says_so():
    found = slowed(LAWS["exponential"], 3.0, 0).coast_down
    assert found.half.known
    assert not found.tenth.known and "too early" in found.tenth.why


def test_without_a_levitated_stretch_there_is_no_speed_to_take_a_half_of():
    law = LAWS["exponential"]
    time = RELEASE + np.arange(0, 20, 1 / RATE)
    run = fit_rundown(time, law.speed_at(time), release_time=RELEASE, polar_inertia=0.3)
    assert not run.coast_down.half.known and run.coast_down.half.why == run.initial.why


def test_the_shipped_coast_down_and_its_first_seconds_tell_the_same(coastdown, machine):
    whole = coastdown.coast_down
    assert all(each.method.startswith("measured") for each in (whole.half, whole.tenth))
    record = read(shipped("coastdown/drop_100.nc"))
    cut = record.sel({str(d): slice(None, 7.0) for d in record.dims if str(d).startswith("time")})
    part = analyse(cut, machine).coast_down
    for short, measured in ((part.half, whole.half), (part.tenth, whole.tenth)):
        assert short.method.startswith("extrapolated")
        assert short.low <= measured.value <= short.high
        assert short.high - short.low < 0.01 * measured.value


def test_terminal_json_and_report_tell_them(coastdown):
    told = coastdown.coast_down
    half, tenth = coastdown.rundown.coast_down.half, coastdown.rundown.coast_down.tenth
    assert told.half.value == pytest.approx(half.value - coastdown.release.time.value)
    assert told.half.high - told.half.low > half.high - half.low  # the release is not exact either
    lines = [line for line in summary_lines(coastdown) if line.startswith("coast-down")]
    assert [line.endswith(", measured") for line in lines] == [True, True]
    speed = analysis_json(coastdown)["speed"]
    assert speed["half_speed_after_s"]["value"] == told.half.value
    assert speed["tenth_speed_after_s"]["value"] == pytest.approx(tenth.value - coastdown.release.time.value)
    table = section.section(coastdown).blocks[0]
    rows = [row.cells for row in table.rows if "From the release to" in row.cells[0]]
    assert [cells[1].endswith("measured") for cells in rows] == [True, True]
    assert "(47.5 Hz)" in rows[0][0]
