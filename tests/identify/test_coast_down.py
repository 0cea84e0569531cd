"""The whole coast-down: the simulated record against the fit's own prediction, features of known courses, a drop end to end."""

import json
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from matplotlib.text import Text
from tdbsim.machine import EffectSetting, SlowRoll
from tdbsim.stated_effects import from_setting

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.lines import Line
from tdbmon.estimate import Estimate
from tdbmon.figures import coast_down as figures
from tdbmon.identify import coast_down as module
from tdbmon.identify.calibrate import fit_drops
from tdbmon.identify.coast_down import CoastDown, coast_down, simulated_record
from tdbmon.identify.coast_down_comparison import course, paired_lines, resonances, scalars
from tdbmon.identify.contract import coast_down_json
from tdbmon.identify.natural_frequencies import natural_frequencies
from tdbmon.record.finding import Check
from tdbmon.report.document import Figure, Paragraph, Table
from tdbmon.report.sections import coast_down as section
from tests.figure_checks import rendered
from tests.identify import drops


@pytest.fixture(scope="module")
def long_drop():
    """(analysis, calibration) of three seconds of a drop, calibrated on its first contact."""
    record = drops.drop(speed=97.0, seed=3, seconds=3.0)
    return analyse(record, drops.machine()), fit_drops(drops.machine(), [record], horizons=(0.006, 0.01, 0.014))


@pytest.fixture(scope="module")
def whole(long_drop):
    found = coast_down(long_drop[1], long_drop[0])
    assert found is not None
    return found


def readings(record, names):
    return np.stack([record[name].to_numpy() for name in names])


@pytest.mark.parametrize("leaks", [(), (EffectSetting(name="probe_crosstalk", where="DE", factor=-0.2, into="first"),)])
def test_the_simulated_record_is_what_the_fit_predicts(calibration, leaks):
    """Two ways through the same model: states held in pieces with steps of 50 us, and the fit's own prediction at 25 us.

    Of probes whose zeros are up to 9 um off, with and without crosstalk.
    """
    problem = replace(calibration.problem, standing=tuple(from_setting(each) for each in leaks))
    point = calibration.point.copy()
    for k, probe in enumerate(calibration.machine.probes):
        at = [p.name for p in problem.own[0]].index(f"zero_{probe.name}")
        column = problem.columns(0)[len(problem.shared) + at]
        point[column] += (3e-6 * k - 4e-6) / problem.parameters[column].scale
    record, _ = simulated_record(replace(calibration, problem=problem, point=point), 0)
    drop = problem.drops[0]
    found = problem.simulated(point, 0, 0.02)
    names = [probe.name for probe in drop.probes]
    here = readings(record, names)[:, found.span]
    for row, simulated, noise in zip(here, found.readings, drop.noise, strict=True):
        left = row - simulated
        assert np.ptp(simulated) > 200e-6
        assert np.std(left) == pytest.approx(noise.sigma, rel=0.15)
        assert abs(left.mean()) < 0.1e-6


def test_the_simulated_record_is_even_whatever_the_clock_wrote(calibration):
    """A microsecond of jitter, as of times written with six digits at 12.8 kHz, and a hole."""
    drop = calibration.problem.drops[0]
    whole, _ = simulated_record(calibration, 0)
    kept = (drop.time < drop.release + 0.03) | (drop.time > drop.release + 0.04)
    jittered = drop.time + np.random.default_rng(0).uniform(-1e-6, 1e-6, len(drop.time))
    sick = replace(drop, time=jittered[kept], reading=drop.reading[:, kept])
    assert np.ptp(np.diff(sick.time)) > 0.01
    problem = replace(calibration.problem, drops=(sick, *calibration.problem.drops[1:]))
    record, _ = simulated_record(replace(calibration, problem=problem), 0)
    assert record.time.to_numpy() == pytest.approx(whole.time.to_numpy(), abs=3e-6)
    assert np.ptp(np.diff(record.time)) < 1e-12
    early = whole.time.to_numpy() < drop.release + 0.02
    names = [probe.name for probe in calibration.machine.probes]
    assert readings(record, names)[:, early] == pytest.approx(readings(whole, names)[:, early], abs=3e-6)  # at 1 m/s


def test_pieces_make_no_difference(calibration, monkeypatch):
    whole, _ = simulated_record(calibration, 0)
    monkeypatch.setattr(module, "_CHUNK", 37)
    parts, _ = simulated_record(calibration, 0)
    names = [probe.name for probe in calibration.machine.probes]
    early = whole.time.to_numpy() < calibration.problem.drops[0].release + 0.02
    assert readings(parts, names)[:, early] == pytest.approx(readings(whole, names)[:, early], abs=0.15e-6)


def test_slow_roll_that_stayed_in_the_readings_is_not_put_on_twice(calibration):
    """Without a keyphasor nothing takes it off the record, and the fitted runout holds what there is of it."""
    names = [probe.name for probe in calibration.machine.probes]
    plain = readings(simulated_record(calibration, 0)[0], names)
    roll = SlowRoll(peak_to_peak=20e-6, phase_lag=0.7)
    probes = tuple(probe.model_copy(update={"slow_roll": roll}) for probe in calibration.machine.probes)
    stated = replace(calibration, machine=calibration.machine.model_copy(update={"probes": probes}))
    taken_off = replace(calibration.problem.drops[0], compensated=True)
    stated = replace(stated, problem=replace(calibration.problem, drops=(taken_off, *calibration.problem.drops[1:])))
    with_roll = readings(simulated_record(stated, 0)[0], names)
    assert np.ptp(with_roll - plain, axis=1) == pytest.approx(20e-6, rel=0.01)
    drop = replace(calibration.problem.drops[0], compensated=False)
    without = replace(stated, problem=replace(calibration.problem, drops=(drop, *calibration.problem.drops[1:])))
    assert readings(simulated_record(without, 0)[0], names) == pytest.approx(plain, abs=1e-9)


def test_a_short_record_holds_no_coast_down(calibration, same_model):
    assert coast_down(calibration, analyse(same_model[1][0], drops.machine())) is None


def test_features_of_the_same_model_agree(whole):
    """The record and its simulation obey the same laws; friction and clearance come from the fit of the first contact."""
    found = {name: (a.value, b.value) for name, a, b in scalars(whole)}
    assert found["Speed at the release"][1] == pytest.approx(found["Speed at the release"][0], rel=1e-3)
    decay = found["Decay time of the linear term"]
    assert decay[1] == pytest.approx(decay[0], rel=0.02)
    passed = course(whole)
    assert len(passed.time) == 3 and passed.speed_parts is None
    assert np.all(np.abs(passed.simulated_speed / passed.measured_speed - 1) < 0.01)
    for end, rms in passed.measured_rms.items():
        assert np.all(rms[0] > 20e-6)  # it swings
        assert np.all(np.abs(np.log(passed.simulated_rms[end][0] / rms[0])) < np.log(2))


def test_section_and_json(whole, long_drop):
    natural = natural_frequencies(long_drop[1])
    made = section.section(whole, natural, long_drop[1].horizon)
    names = [block.name for block in made.blocks if isinstance(block, Figure)]
    assert names == ["coast-down", "coast-down-waterfalls", "coast-down-orders"]
    for block in made.blocks:
        if isinstance(block, Figure):
            assert block.image.width_mm == pytest.approx(170)
    assert any(isinstance(b, Paragraph) and "The speeds differ by at most" in b.text for b in made.blocks)
    assert sum(isinstance(b, Table) for b in made.blocks) >= 2
    back = json.loads(json.dumps(coast_down_json(whole, natural), allow_nan=False))
    assert {row["name"] for row in back["quantities"]} >= {"Speed at the release", "Swing 1, small"}


def coasting(analysis, speed, motion, tracks=None, lines=()):
    """The analysis of a record of 20 s at 1 kHz from the release on, with given speed, Hz, and displacement, m."""
    time = np.arange(20_000) / 1000
    ends = list(analysis.machine.ends)
    moved = np.broadcast_to(motion(time), (len(ends), 2, len(time)))
    planes = xr.Dataset(
        {"displacement": (("end", "axis", "time"), moved)},
        coords={"end": ends, "axis": ["x", "y"], "time": time},
        attrs={"sampling_hz": 1000.0},
    )
    return replace(
        analysis, planes=planes, release=None, speed_time=time, speed_hz=speed(time), tracks=tracks, lines=lines
    )


def test_a_speed_error_beyond_the_usual_stays_within_its_panel(long_drop):
    """A simulated rotor that slows by a third too much: the panel of percent reached down to -5 before."""
    one = coasting(long_drop[0], lambda t: 90 - 2 * t, lambda t: 1e-4 * np.sin(2 * np.pi * 30 * t))
    for factor, limits in ((1.01, (-5, 25)), (0.67, (-1.1 * 33, 25)), (1.5, (-5, 1.1 * 50))):
        other = coasting(
            long_drop[0], lambda t, f=factor: f * (90 - 2 * t), lambda t: 1e-4 * np.sin(2 * np.pi * 30 * t)
        )
        figure = rendered(figures.coast_down(course(CoastDown(one, other, 0.0)), "runout in both"))
        assert figure.axes[3].get_ylabel() == "speed error\n[%]"
        assert figure.axes[3].get_ylim() == pytest.approx(limits, rel=1e-3)


@pytest.mark.parametrize("taken_off", [False, True])
def test_the_figure_says_whether_slow_roll_was_taken_off(whole, long_drop, taken_off):
    measured = replace(whole.measured, checks=[Check("slow roll", "", True, "subtracted from all readings")] * taken_off)
    made = section.section(replace(whole, measured=measured), natural_frequencies(long_drop[1]), 0.014)
    figure = next(b for b in made.blocks if isinstance(b, Figure) and b.name == "coast-down")
    words = " ".join(text.get_text() for text in rendered(figure.draw()).findobj(Text))
    assert ("slow roll compensated in both" in words) == taken_off
    assert ("runout in both" in words) != taken_off


def test_course_tells_from_when_speed_and_motion_part(long_drop):
    analysis = long_drop[0]
    one = coasting(analysis, lambda t: 90 - 2 * t, lambda t: 1e-4 * np.sin(2 * np.pi * 30 * t))
    other = coasting(
        analysis,
        lambda t: (90 - 2 * t) * np.where(t < 7, 1.002, 1.015),
        lambda t: np.where(t < 12, 1.2e-4, 1.6e-4) * np.sin(2 * np.pi * 30 * t),
    )
    found = course(CoastDown(one, other, 0.0))
    assert found.time[:2] == pytest.approx([0.5, 1.5]) and len(found.time) == 20
    assert found.measured_speed[:2] == pytest.approx([89, 87], abs=0.01)
    assert found.measured_rms["DE"] == pytest.approx(1e-4 / np.sqrt(2), rel=1e-3)
    assert (found.speed_parts, found.motion_parts) == (7.0, 12.0)
    assert course(CoastDown(one, one, 0.0)).speed_parts is None
    assert "nowhere by more than 1 %" in section.parting(course(CoastDown(one, one, 0.0)))
    assert "for the first time 7 s after it." in section.parting(found)
    assert "12 s after the release" in section.parting(found)


def test_speeds_that_meet_again_are_not_said_to_be_apart_from_there_on(long_drop):
    """Apart in one window of twenty, they were said to differ "from 7 s on"."""
    one = coasting(long_drop[0], lambda t: 90 - 2 * t, lambda t: 1e-4 * np.sin(2 * np.pi * 30 * t))
    other = coasting(
        long_drop[0],
        lambda t: (90 - 2 * t) * np.where((t >= 7) & (t < 8), 1.015, 1.0),
        lambda t: 1e-4 * np.sin(2 * np.pi * 30 * t),
    )
    said = section.parting(course(CoastDown(one, other, 0.0)))
    assert "by more than 1 % for the first time 7 s after it." in said and " s on" not in said


def test_a_pause_takes_from_its_own_window_only(long_drop):
    one = coasting(
        long_drop[0], lambda t: 90 - 2 * t, lambda t: np.where(t < 10, 1e-4, 2e-4) * np.sin(2 * np.pi * 30 * t)
    )
    time = one.planes.time.to_numpy()
    paused = replace(one, planes=one.planes.isel(time=(time < 3.1) | (time >= 5.2)))
    found = course(CoastDown(one, paused, 0.0))
    rms = found.simulated_rms["DE"][0]
    assert len(found.time) == 20
    assert np.flatnonzero(np.isnan(rms)).tolist() == [3, 4]
    assert np.delete(rms, [3, 4]) == pytest.approx(np.delete(found.measured_rms["DE"][0], [3, 4]), rel=0.01)
    assert found.motion_parts is None


def tracks(ends, peaks):
    """1X and 2X over speed: a floor of 0.1 um and a resonance of each order at a speed, of a height, 3 % wide."""
    speed = np.linspace(90, 5, 400)
    circle = np.full((2, len(ends), len(speed)), 1e-7)
    for order, (at, height) in enumerate(peaks):
        if height:
            circle[order] += height / np.sqrt(1 + ((speed - at) / (0.015 * at)) ** 2)
    return xr.Dataset(
        {name: (("order", "end", "time"), circle) for name in ("forward", "backward")},
        coords={"order": [1.0, 2.0], "end": ends, "time": np.arange(len(speed)), "speed": ("time", speed)},
    )


def test_resonances_are_found_where_they_are_and_nowhere_else(long_drop):
    analysis, calibration = long_drop
    natural = natural_frequencies(calibration)
    critical = [mode.critical for mode in natural.modes]
    first, second = critical[0][0], critical[0][1]
    ends = list(analysis.machine.ends)
    still = (lambda t: 90 - 2 * t, lambda t: 1e-6 * np.sin(t))
    one = coasting(analysis, *still, tracks(ends, ((1.02 * first, 1e-5), (second, 5e-6))))
    other = coasting(analysis, *still, tracks(ends, ((first, 2e-5), (second, 0.0))))
    found = {(each.mode, each.order): each for each in resonances(CoastDown(one, other, 0.0), natural)}
    swing = found[0, 1.0]
    assert swing.measured == pytest.approx((1.02 * first, 1.01e-5), rel=0.02)
    assert swing.simulated == pytest.approx((first, 2.01e-5), rel=0.02)
    half = found[0, 2.0]
    assert half.measured is not None and half.simulated is None  # a floor is no peak
    assert found[1, 1.0].measured is None  # the flank of another resonance is none either


def test_a_drop_passes_no_resonance_above_its_own_release(long_drop):
    """Of drops fitted together each has a release of its own; the critical speeds are told up to the fastest of them."""
    analysis, calibration = long_drop
    natural = natural_frequencies(calibration)
    every = resonances(CoastDown(analysis, analysis, 0.0), natural)
    assert len(every) == sum(speed is not None for mode in natural.modes for speed in mode.critical)
    highest, *others = every
    slower = replace(analysis.rundown, initial=Estimate(0.99 * highest.critical, unit="Hz", why="made up"))
    found = resonances(CoastDown(replace(analysis, rundown=slower), analysis, 0.0), natural)
    assert [(each.mode, each.order) for each in found] == [(each.mode, each.order) for each in others]
    bare = replace(analysis, rundown=None, speed_hz=np.full(3, 0.99 * highest.critical), speed_time=np.arange(3.0))
    assert len(resonances(CoastDown(bare, analysis, 0.0), natural)) == len(others)


def test_lines_pair_by_name_and_else_by_place(long_drop):
    def line(kind, name, place):
        hz = Estimate(place, unit="Hz", why="made up")
        order = place if kind == "order" else None
        return Line(kind, order, hz, "both", "both", Estimate(1e-6, unit="um", why="made up"), 0.0, 1.0, name)

    still = (lambda t: 90 - 2 * t, lambda t: 1e-6 * np.sin(t))
    one = coasting(long_drop[0], *still, lines=(line("constant", "swing 1", 28.0), line("order", "4.75X", 4.75),
                                                line("mains", "mains", 50.0)))  # fmt: skip
    other = coasting(long_drop[0], *still, lines=(line("constant", "swing 1", 30.0), line("order", "4.71X", 4.71),
                                                  line("constant", "50.1 Hz", 50.1)))  # fmt: skip
    rows = [(name, a and a.name, b and b.name) for name, a, b in paired_lines(CoastDown(one, other, 0.0))]
    assert rows == [
        ("swing 1", "swing 1", "swing 1"),
        ("4.75X", "4.75X", "4.71X"),
        ("mains", "mains", None),
        ("50.1 Hz", None, "50.1 Hz"),
    ]
