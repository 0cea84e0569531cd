"""Measured against simulated, on drops of known values by the same simulator: places, contact times, residuals, friction."""

import json
from dataclasses import replace

import numpy as np
import pytest
from tdbsim.machine import Tolerant
from tdbsim.stated_effects import parse

from tdbmon.analysis.contact_events import Contact
from tdbmon.identify.agreement import _contacts, agreement, at_planes
from tdbmon.identify.contract import agreement_json
from tdbmon.identify.friction_choice import GRID, choose_friction
from tdbmon.machine_file import with_effects
from tdbmon.report.sections.agreement import _friction, _residuals
from tests.identify import drops


@pytest.fixture(scope="module")
def found(calibration):
    return agreement(calibration, drop=0, seconds=0.05)


def test_what_is_left_of_the_fitted_stretch_is_noise(found):
    first = found.residuals[0]
    assert first.horizon == 0.012 < found.fitted_to
    assert first.ratio == pytest.approx(1.0, abs=0.15)
    assert [each.horizon for each in found.residuals] == [0.012, 0.025]  # as far as was simulated


def test_places_at_the_ends_are_those_of_the_drop(found, same_model):
    """The record knows the shaft at the bearings; falling, it is straight, and the line through the probes leads there."""
    record = same_model[1][0]
    inside = (found.time > 0) & (found.time < 0.0065)  # before the first touch
    true_time = record.time.to_numpy() - record.attrs["release_time_s"]
    for name, end in found.ends.items():
        assert np.ptp(end.measured[1, inside]) > 150e-6  # it falls
        for axis, channel in enumerate(("rotor_x", "rotor_y")):
            true = np.interp(found.time[inside], true_time, record[channel].sel(end=name).to_numpy())
            left = end.measured[axis, inside] - true
            # a shaft that is let go loses its sag and whirls on: it is straight to about half a micrometre
            assert np.std(left) < np.hypot(end.noise[axis], 0.5e-6)
            assert abs(left.mean()) < 5e-6  # where the bearing's centre was fitted


def test_contacts_are_when_the_force_was(found, same_model):
    record = same_model[1][0]
    time = record.time.to_numpy() - record.attrs["release_time_s"]
    for name, end in found.ends.items():
        pressed = time[record.normal_force.sel(end=name).to_numpy() > 0]
        pair = end.contacts[0]
        assert pair.measured is not None and pair.simulated is not None and pair.force is not None
        assert pair.force[0] == pytest.approx(pressed[0], abs=1e-4)
        # the ring hangs at the bottom of its balls: within its 10 um or so of play the displacement passes later or earlier
        assert pair.measured.start == pytest.approx(pressed[0], abs=3e-4)
        assert pair.simulated.start == pytest.approx(pair.measured.start, abs=5e-5)
        assert pair.simulated.end == pytest.approx(pair.measured.end, abs=5e-5)


def test_a_ring_that_preloaded_balls_hold_in_the_middle_is_touched_at_the_gap(calibration):
    """Half of a clearance below nought was taken off the gap."""
    machine = calibration.calibrated
    exact = Tolerant(nominal=-20e-6, low=-20e-6, high=-20e-6)
    bearings = [
        b.model_copy(update={"balls": b.balls.model_copy(update={"diametral_clearance": exact})})
        for b in machine.touchdown_bearings
    ]
    held = replace(calibration, calibrated=machine.model_copy(update={"touchdown_bearings": tuple(bearings)}))
    for end in agreement(held, seconds=0.01).ends.values():
        assert end.touching == end.gap


def test_the_orbit_is_that_of_the_shaft_whatever_the_machine_file_says_of_its_probes(calibration):
    """A gain of 1.25 that the file knows made the shaft go 100 um farther out on paper, and all contacts one."""
    machine, measured = calibration.calibrated, calibration.problem.drops[0]
    stated = [parse(f"probe_gain:where={name},gain=1.25") for name in ("NDE_A", "NDE_B")]
    other = with_effects(machine, [*stated, parse("channel_lag:where=DE_A,delay=0.4 ms")])
    off = measured.reading.copy()
    names = [probe.name for probe in measured.probes]
    for name in ("NDE_A", "NDE_B"):
        off[names.index(name)] *= 1.25
    row = off[names.index("DE_A")]
    row[8:] = row[:-8].copy()  # 20 kHz
    sound = at_planes(measured.reading, measured.time, measured, machine).displacement.to_numpy()
    found = at_planes(off, measured.time, measured, other).displacement.to_numpy()
    assert np.isnan(found[..., -8:]).any() and np.isfinite(found[..., 8:-8]).all()
    np.testing.assert_allclose(found[..., 8:-8], sound[..., 8:-8], atol=1e-9)


def test_contacts_that_only_one_of_both_has_stand_alone():
    """Two half sines beyond the radius as measured, of which the simulation has the first, later, and another at the end."""
    time = np.arange(1, 1001) * 1e-4

    def path(*starts):
        radius = np.full(len(time), 250e-6)
        for start in starts:
            inside = (time >= start) & (time <= start + 0.01)
            radius[inside] += 20e-6 * np.sin(np.pi * (time[inside] - start) / 0.01)
        return np.stack([np.zeros_like(radius), -radius])

    simulated = path(0.022, 0.08)
    force = np.where(np.hypot(*simulated) > 252e-6, 100.0, 0.0)
    pairs = _contacts(time, [path(0.02, 0.05), simulated], 251e-6, force)
    assert [(p.measured is None, p.simulated is None, p.force is None) for p in pairs] == [
        (False, False, False),
        (False, True, True),
        (True, False, False),
    ]
    first = pairs[0].measured, pairs[0].simulated
    assert first[1].start - first[0].start == pytest.approx(0.002, abs=1e-5)
    rise = 0.01 / np.pi * np.arcsin(2 / 20)
    assert pairs[2].force == pytest.approx((0.08 + rise, 0.09 - rise), abs=1.1e-4)  # a sample


def test_a_contact_with_a_lift_between_is_paired_by_its_begin():
    """Simulated in two parts, of which the second is the longer: the first touch is the same in both."""
    time = np.arange(1, 501) * 1e-4

    def path(*spans):
        radius = np.full(len(time), 250e-6)
        for start, end in spans:
            inside = (time >= start) & (time <= end)
            radius[inside] += 20e-6 * np.sin(np.pi * (time[inside] - start) / (end - start))
        return np.stack([np.zeros_like(radius), -radius])

    whole, parts = path((0.01, 0.03)), path((0.01, 0.018), (0.0185, 0.03))
    first, second = _contacts(time, [whole, parts], 251e-6, np.where(np.hypot(*parts) > 252e-6, 100.0, 0.0))
    assert first.simulated.start == pytest.approx(first.measured.start, abs=2e-4)
    assert second.measured is None
    assert second.simulated.start > first.simulated.end


def test_friction_by_sensitivity_finds_a_common_coefficient():
    """A drop with 0.12 at both ends, and a model that has all else right: the nearest orbit is that of 0.12."""
    from tdbmon.identify.calibrate import fit_drops
    from tdbmon.identify.crew import Crew

    truth = {**drops.TRUTH, "NDE.friction": 0.12, "DE.friction": 0.12}
    calibration = fit_drops(drops.machine(), [drops.drop(truth, speed=97.0)], horizons=(0.006, 0.01, 0.014))
    with Crew() as crew:
        problem = replace(calibration.problem, crew=crew)
        choice = choose_friction(replace(calibration, problem=problem), seconds=0.03)
    assert choice.chosen == pytest.approx(0.12, abs=0.006)
    at = list(choice.tried).index(choice.chosen)
    for end, distance in choice.distance.items():
        assert distance[at] < 3e-6 < 0.2 * distance[0]
        assert choice.deepest[end][at] == pytest.approx(choice.measured_deepest[end], rel=0.01)
        assert choice.fitted[end].low < choice.fitted[end].value < choice.fitted[end].high
    assert len(choice.tried) > len(GRID) and np.all(np.diff(choice.tried) > 0)


def test_friction_by_sensitivity_goes_beyond_the_fitted_one():
    """Of a dry pair with 0.4: the coefficients tried ended at 0.30, and an orbit 120 um off was called nearest."""
    from tdbmon.identify.calibrate import fit_drops
    from tdbmon.identify.crew import Crew

    dry, bearings = Tolerant(nominal=0.4, low=0.3, high=0.5), drops.machine().touchdown_bearings
    bearings = tuple(each.model_copy(update={"friction": dry}) for each in bearings)
    machine = drops.machine().model_copy(update={"touchdown_bearings": bearings})
    record = drops.drop({**drops.TRUTH, "NDE.friction": 0.4, "DE.friction": 0.4}, speed=97.0)
    calibration = fit_drops(machine, [record], horizons=(0.006, 0.01, 0.014, 0.018, 0.022))
    with Crew() as crew:
        problem = replace(calibration.problem, crew=crew)
        choice = choose_friction(replace(calibration, problem=problem))
    assert choice.seconds == 0.022  # as far as was fitted: beyond it the paths may have parted
    assert choice.chosen == pytest.approx(0.4, abs=0.01)
    at = list(choice.tried).index(choice.chosen)
    assert all(distance[at] < 0.1 * distance[len(GRID) - 1] for distance in choice.distance.values())
    assert not choice.at_edge and "may lie beyond" not in _friction(choice)[0].text
    cut = replace(choice, tried=choice.tried[: at + 1])
    assert cut.at_edge and "It is the greatest one tried: the best may lie beyond." in _friction(cut)[0].text


def test_a_probe_without_samples_so_far_has_no_residual(calibration):
    """As of a probe that drops out from the release to past the first horizon: its rms was NaN, which no JSON holds."""
    problem = calibration.problem
    whole = problem.drops[0]
    reading = whole.reading.copy()
    reading[2, (whole.time > whole.release - 0.001) & (whole.time < whole.release + 0.015)] = np.nan
    lost = replace(calibration, problem=replace(problem, drops=(replace(whole, reading=reading), *problem.drops[1:])))
    late = agreement(lost, 0, 0.03)
    first, second = late.residuals
    assert set(second.rms) - set(first.rms) == {whole.probes[2].name}
    assert first.ratio == pytest.approx(1.0, abs=0.3)
    json.dumps(agreement_json(late, None), allow_nan=False)
    assert [row.cells[4] == "–" for row in _residuals(late).rows] == [True, False]


def test_json_is_plain(found):
    back = json.loads(json.dumps(agreement_json(found, None), allow_nan=False))
    assert back["residual"][0]["over_noise"] == found.residuals[0].ratio
    first = back["contacts"]["NDE"][0]
    assert first["measured_s"][0] < first["measured_s"][1]
    assert isinstance(found.ends["NDE"].contacts[0].measured, Contact)
