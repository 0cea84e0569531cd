"""Forces that no sensor measured, against the simulation that made the record (same model), and the boxes' arithmetic."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from tdbsim.errors import InputError
from tdbsim.fatigue import DropFatigue
from tdbsim.hertz import BearingGeometry

from tdbmon.estimate import Estimate
from tdbmon.history.fatigue import fatigue_of
from tdbmon.identify.contract import calibration_json, end_json
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.excursions import astray_remarks, later_remarks
from tdbmon.identify.forces import _at_speed, _contacts, _Member, _peak, forces_of
from tdbmon.identify.model_share import FORCE
from tdbmon.identify.stress import ball_stress, stress_box
from tests.identify import drops


@pytest.fixture(scope="module")
def forces(calibration):
    return forces_of(calibration, seconds=0.05, members=12)


def within(record, seconds):
    release = record.attrs["release_time_s"]
    return record.sel(time=slice(release, release + seconds))


def test_peak_force_is_that_of_the_drop(forces, same_model):
    for found, record in zip(forces, same_model[1], strict=True):
        for end, each in found.ends.items():
            true = float(within(record, 0.05).normal_force.sel(end=end).max())
            # the record holds the force at its samples only, the peak is that of all steps
            assert each.peak.value >= 0.97 * true
            assert each.peak.value == pytest.approx(true, rel=0.06)
            assert each.peak.low < each.peak.value < each.peak.high


def test_history_follows_the_force_that_was(forces, same_model):
    for found, record in zip(forces, same_model[1], strict=True):
        for end, each in found.ends.items():
            history = each.history
            assert history.parted > 0.015  # past the first contact
            early = history.time < 0.015
            true = within(record, 0.05)
            since = true.time.values - record.attrs["release_time_s"]
            force = np.interp(history.time[early], since, true.normal_force.sel(end=end).values)
            assert force.max() > 1000  # it does hit
            assert np.sqrt(np.mean((history.force[early] - force) ** 2)) < 0.06 * force.max()
            assert np.all(history.low <= history.force) and np.all(history.force <= history.high)


def test_the_hardest_contact_has_the_greatest_force(forces):
    """The one was of all steps, the other of samples: two numbers for one thing, by one method."""
    for found in forces:
        for each in found.ends.values():
            hardest = max(each.contacts, key=lambda contact: contact.peak.value)
            assert hardest.peak == each.peak
            others = [contact.peak.method for contact in each.contacts if contact is not hardest]
            assert others and all("at its samples" in method for method in others)
            assert each.history.force.max() == pytest.approx(each.peak.value, rel=0.01)


def impulse(record, end, start, stop):
    """Integral of the force of the drop, N s, between two times after the release, s."""
    since = record.time.values - record.attrs["release_time_s"]
    time = np.concatenate([[start], since[(since > start) & (since < stop)], [stop]])
    return np.trapezoid(np.interp(time, since, record.normal_force.sel(end=end).values), time)


def test_impulses_of_the_contacts_are_those_of_the_drop(forces, same_model):
    """To 1 %, or 0.02 N s where the shaft only grazes; together they are all that was up to the last of them."""
    for found, record in zip(forces, same_model[1], strict=True):
        for end, each in found.ends.items():
            assert each.contacts[0].impulse > 5.0  # it does hit
            for c in each.contacts:
                assert c.impulse == pytest.approx(
                    impulse(record, end, c.start, c.start + c.seconds), rel=0.01, abs=0.02
                )
                assert c.impulse_low <= c.impulse_high and c.peak.value > 0
            last = each.contacts[-1]
            true = impulse(record, end, 0.0, last.start + last.seconds)
            assert sum(c.impulse for c in each.contacts) == pytest.approx(true, rel=0.01)


def test_no_force_pulls(forces):
    assert all(contact.peak.low >= 0 for found in forces for end in found.ends.values() for contact in end.contacts)


def test_impulse_of_the_whole_time_is_that_of_the_drop(forces, same_model):
    for found, record in zip(forces, same_model[1], strict=True):
        for end, each in found.ends.items():
            assert each.impulse == pytest.approx(impulse(record, end, 0.0, 0.05), rel=0.01)
            assert each.impulse_low < each.impulse < each.impulse_high


def test_stress_is_hertz_of_the_load(calibration):
    bearing = calibration.machine.bearing("NDE")
    geometry = BearingGeometry(bearing.balls.diameter, bearing.balls.pitch_diameter)
    load = 1000.0
    a, b = (float(axis) for axis in geometry.inner.semi_axes(load))
    assert ball_stress(bearing, np.array([load]))[0] == pytest.approx(3 * load / (2 * math.pi * a * b))


def test_box_of_known_values(calibration):
    bearing = calibration.machine.bearing("NDE")
    values = np.concatenate([np.zeros(50), np.tile([1.0, 2.0, 3.0, 4.0], 100), [40.0, 41.0], [2.0]]) * 1e8
    box = stress_box([values] * 8, bearing, 0.2)
    assert box.greatest.value == 41e8
    assert (box.q1, box.median, box.q3) == (2e8, 3e8, 4e8)
    assert box.least == 1e8  # the lower whisker
    assert box.outliers == (41e8,)  # one stretch, its greatest
    assert box.tukey == (41e8,)
    loaded = values[values > 0]
    assert box.outlier_level == pytest.approx(loaded.mean() + 3 * loaded.std())
    assert box.tukey_level == pytest.approx(4e8 + 1.5 * 2e8)
    assert box.mean == pytest.approx(values[values > 0].mean())


def test_force_stress_and_fatigue_share_one_error_of_the_model(calibration):
    """Of members that agree it alone is left: of a load, of its cube root, and of the ninth power of that."""
    bearing = calibration.machine.bearing("NDE")
    peak = _peak(np.full(8, 4000.0), 0.2)
    stress = stress_box([ball_stress(bearing, np.array([0.0, 4000.0]))] * 8, bearing, 0.2).greatest
    cycles = fatigue_of([DropFatigue(np.array([3.0]), 2e9, False)] * 8, "NDE")
    shares = [e.log_sigma for e in (peak, stress, cycles)]
    assert shares == pytest.approx([FORCE, FORCE / 3, 3 * FORCE], rel=1e-3)


def ring(times, seconds=0.2):
    """Members whose ring turns with the journal from a time on, or never."""
    time = np.linspace(0, seconds, 2001)
    empty = np.zeros((1, 2001))
    return [_Member(time, empty + 0j, empty, empty, (time >= at)[None], np.zeros(1), ()) for at in times]


def test_a_ring_that_stays_slow_in_some_members_bounds_the_time_from_below_only():
    times = np.linspace(0.1, 0.138, 39)
    all_reach = _at_speed(ring(times), 0)
    assert (all_reach.low, all_reach.high) == pytest.approx((0.1, 0.138), abs=2e-4)
    most = _at_speed(ring([*times[:37], math.inf, math.inf]), 0)
    assert most.value == pytest.approx(np.median(times), abs=2e-4)
    assert most.high is None
    assert "in 2 of 39 simulations" in most.why
    few = _at_speed(ring([*times[:15], *[math.inf] * 24]), 0)
    assert few.value is None and "does not reach" in few.why


def test_the_interval_of_an_impulse_holds_the_fitted_drop():
    """Of 39 members with half the force of the fitted one, the 95 % band of all is that half."""
    time = np.linspace(0.0, 0.01, 401)
    blow = np.where((time > 0.002) & (time < 0.006), 1000 * np.sin(np.pi * (time - 0.002) / 0.004), 0.0)
    found = _contacts(time, np.stack([blow, *[0.5 * blow] * 39]), 0.01, 0.01)
    (contact,) = found
    whole = 1000 * 0.004 * 2 / np.pi
    assert contact.impulse == pytest.approx(whole, rel=1e-3)
    assert (contact.impulse_low, contact.impulse_high) == pytest.approx((whole / 2, whole), rel=0.03)
    assert contact.impulse_low <= contact.impulse <= contact.impulse_high


def test_unloaded_bearing_has_no_stress(calibration):
    box = stress_box([np.zeros(10)] * 8, calibration.machine.bearing("DE"), 0.2)
    assert box.greatest.value is None and "no ball" in box.greatest.why


def test_json_is_plain_and_complete(calibration, forces):
    text = json.dumps(calibration_json(calibration, forces), allow_nan=False)
    back = json.loads(text)["drops"][0]["ends"]["NDE"]
    assert set(back) == {"support", "peak_force_n", "stress_mpa", "ring_at_speed_s", "contact_forces"}
    assert back["support"]["stiffness_n_per_m"]["unit"] == "N/m"
    stated = calibration.machine.bearing("NDE").support_damping.nominal
    damping = back["support"]["damping_n_s_per_m"]  # exact in this machine file
    assert damping["value"] == stated and damping["low"] is None and damping["method"] == "machine file"
    release = calibration.drops[0].release.value
    assert end_json(calibration, forces[0].ends["NDE"], release) == back
    # times are from the record's first sample there, and from the release in the forces
    first = forces[0].ends["NDE"].contacts[0]
    assert 0.05 < release == pytest.approx(back["contact_forces"][0]["start_s"] - first.start, abs=1e-9)
    if forces[0].ends["NDE"].ring_at_speed.value is not None:
        assert back["ring_at_speed_s"]["value"] == pytest.approx(release + forces[0].ends["NDE"].ring_at_speed.value)
    first = back["contact_forces"][0]
    assert first["impulse_n_s"]["low"] <= first["impulse_n_s"]["value"] <= first["impulse_n_s"]["high"]
    # a force that rises and falls fills between a third and all of the rectangle under its peak
    assert 0.3 < first["impulse_n_s"]["value"] / (first["peak_n"]["value"] * first["seconds"]) < 1.0


def test_ensembles_are_repeatable(calibration, forces):
    again = forces_of(calibration, seconds=0.05, members=12)
    assert again[0].ends["DE"].peak == forces[0].ends["DE"].peak


def test_the_time_that_a_greatest_force_is_of_is_told_with_it(forces):
    for end in forces[0].ends.values():
        for told in (end.peak, end.stress.greatest):
            assert "of the first 0.05 s after the release" in told.method


@pytest.mark.parametrize(("speed", "seed", "told"), [(700.0, 2, True), (300.0, 1, False)])
def test_a_shaft_that_strikes_as_hard_after_the_time_simulated_is_told(speed, seed, told):
    """At 42000 rpm it bounces on for a second, with the hardest blow after 0.4 s; at 18000 rpm later ones are far weaker."""
    record = drops.drop(speed=speed, seed=seed, seconds=0.5)
    since = record.time.values - record.attrs["release_time_s"]
    force = record.normal_force.sel(end="NDE").values
    before, later = force[(since > 0) & (since <= 0.2)].max(), force[since > 0.2].max()
    assert before > 3000 and later > 1000  # it does strike, also later
    assert (later > before) == told
    remarks = later_remarks(measured_drop(record, drops.machine()), drops.machine())
    assert any("NDE: the shaft has not settled 0.2 s after the release" in remark for remark in remarks) == told


def test_a_shaft_that_goes_otherwise_than_most_simulations_is_told_with_what_the_like_press(calibration, forces):
    """A spindle whirled to 275 um in its record and in a third of the simulations; told were 0.8 kN, of 6.0."""
    found = forces[0].ends["DE"]
    assert astray_remarks(calibration, 0, forces[0]) == ()

    def told(farthest):
        return replace(forces[0], ends=forces[0].ends | {"DE": replace(found, farthest=farthest)})

    (none,) = astray_remarks(calibration, 0, told(0.6 * found.farthest))
    assert ": DE: within 0.05 s of the release the shaft moves out to" in none and "none moves as far" in none
    mixed = np.where(np.arange(len(found.farthest)) < 3, found.farthest, 0.6 * found.farthest)
    (some,) = astray_remarks(calibration, 0, told(mixed))
    low, high = found.peaks[:3].min() / 1e3, found.peaks[:3].max() / 1e3
    assert f"the 3 of {len(mixed)} that move as far have peak forces of {low:.2g} to {high:.2g} kN" in some


def test_bad_requests(calibration):
    with pytest.raises(InputError, match="at least 8"):
        forces_of(calibration, members=3)
    with pytest.raises(InputError, match="not positive"):
        forces_of(calibration, seconds=0.0)
    apart = replace(calibration, point=np.full_like(calibration.point, 1e9), covariance=0 * calibration.covariance)
    with pytest.raises(InputError, match="only 0 of 8 draws from the calibration can be simulated"):
        forces_of(apart, members=8)


def test_a_support_mass_that_was_fitted_is_told_as_fitted(calibration, forces):
    """It has no tolerance, but a fit that leaves too much frees it after all."""
    found, stated = forces[0].ends["NDE"], calibration.machine.bearing("NDE").support_mass
    assert end_json(calibration, found, 0.1)["support"]["mass_kg"]["value"] == stated
    fitted = Estimate(0.9 * stated, 0.8 * stated, stated, "kg", "fit")
    freed = replace(calibration, values=calibration.values | {"NDE.support_mass": fitted})
    assert end_json(freed, found, 0.1)["support"]["mass_kg"] == fitted.to_json()
