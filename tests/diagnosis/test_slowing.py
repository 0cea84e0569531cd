"""The slowing of the rotor after paths diverge, on drops of the same simulator (synthetic)."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tdbsim.columns import DECAY_RATE, INERTIA, RING_INERTIA
from tdbsim.machine import Tolerant, load_machine

from tdbmon.diagnosis import slows_otherwise
from tdbmon.diagnosis.contest import contest
from tdbmon.diagnosis.polar_inertia import polar_inertia
from tdbmon.diagnosis.slowing_cause import with_slowing
from tdbmon.diagnosis.slows_otherwise import slowing_beside, slowings_of, torques_beside_lag
from tdbmon.diagnosis.suspects import suspects
from tdbmon.identify.slowing import Factors, Slowing, factors_of, slowing_misfit, slowing_of
from tdbmon.shipped import shipped
from tests.diagnosis import simulated

SPEEDS = ((50.0, 1), (80.0, 2))
TORQUE = 1.2  # N m
HELD = 4.5  # N m


def problem_of(crew, *effects, seconds=0.3):
    return simulated.problem_of(crew, *effects, speeds=SPEEDS, seconds=seconds)


def judged(crew, *effects):
    problem = problem_of(crew, *effects)
    everyone = suspects(problem.model.machine, problem.model.machine.probes, ())
    field = contest(
        problem, [each for each in everyone if each.name == "probe_gain@DE_A"], (0.006, 0.012), lambda _: None
    )
    return with_slowing(field, everyone)


def settled_plain(problem):
    return simulated.settled_plain(problem, 0.006, 0.012)


@given(st.floats(0.6, 2.9), st.lists(st.floats(-2.0, -0.01), min_size=3, max_size=20))
def test_a_lag_by_another_factor_leaves_nothing(factor, lags):
    lag = np.array(lags)
    one = np.ones(len(lag))
    each = Slowing(
        time=one, left=(factor - 1) * lag, lag=lag, drag=0 * one, held=0 * one, sigma=0.02 * one, slips=one > 0
    )
    assert factors_of([each]).lag == pytest.approx(factor)
    assert each.misfit(Factors(factor)) == pytest.approx(0.0, abs=1e-9)


@given(st.floats(0.6, 2.9), st.floats(-0.2, 0.2))
def test_a_drag_that_nothing_told_before_is_told_beside_the_lag(factor, off):
    """The lag ends when the rings turn with the shaft; the drag goes on."""
    time = np.linspace(0.05, 0.5, 23)
    lag, drag, known = -3 * np.minimum(time, 0.2) ** 2, -60 * time**2, 0.125
    each = Slowing(
        time=time,
        left=(factor - 1) * lag + off * drag,
        lag=lag,
        drag=drag,
        held=0 * time,
        sigma=0.005 + 0 * time,
        slips=time < 0.2,
        drag_sigma=known,
    )
    told = factors_of([each])
    assert told.lag == pytest.approx(factor, abs=0.01)
    assert told.drag == pytest.approx(1 + off, abs=1e-3)
    assert slowing_misfit([each]) == pytest.approx((off / known) ** 2, abs=0.01)
    assert slowing_misfit([replace(each, drag_sigma=0.0)]) > slowing_misfit([each]) - 1e-9


def test_the_rotor_loses_the_momentum_that_the_rings_gain(crew):
    problem = problem_of(crew)
    arrays = problem.model.arrays
    slowing = slowing_of(problem, problem.start, 0, 0.04)
    late = slowing.time > 0.22  # both rings turn with the shaft by then
    lost = -np.polyfit(slowing.time[late], slowing.lag[late], 1)[0] * arrays.spin[INERTIA]
    gained = arrays.end[:, RING_INERTIA].sum() * 2 * np.pi * SPEEDS[0][0]
    assert late.sum() >= 3
    # the drag of turning rings adds a little, and speed already lost no longer decays
    assert lost == pytest.approx(gained, rel=0.08)


def test_a_ring_that_is_hard_to_turn_is_found_with_its_place_and_size(crew):
    field, slowed = judged(crew, f"ring_drag:end=DE,torque={TORQUE} N m")
    assert field[0].name == "ring_drag@DE"
    assert slowed is not None
    assert field[0].starts()[0].shared["torque"] == pytest.approx(TORQUE, rel=0.2)  # friction is hardly known so early
    proof = slowed.proof()
    assert proof.seen
    assert proof.drops == ("drop_50.nc", "drop_80.nc")
    assert all(each["ring_drag@DE.torque"] == pytest.approx(TORQUE, rel=0.3) for each in proof.without)


def test_how_hard_a_ring_is_held_that_does_not_turn_is_known_as_a_least_value_only(crew):
    """Friction cannot turn a ring that is held as hard as this: any greater torque acts the same."""
    field, _ = judged(crew, f"ring_drag:end=DE,torque={HELD} N m")
    assert field[0].name == "ring_drag@DE"
    (torque,) = (p for p in field[0].problem.shared if p.name == "ring_drag@DE.torque")
    found = field[0].starts()[0].shared["torque"]
    assert abs(found - HELD) < 2 * torque.sigma
    assert torque.sigma > 0.2 * found


def test_with_nothing_hidden_nothing_is_added(crew):
    field, slowed = judged(crew)
    assert slowed is None
    assert [each.name for each in field] == ["plain model"]
    assert 0 < field[0].later < 40


def test_an_inertia_that_is_not_as_the_file_has_it_is_told(crew):
    problem = problem_of(crew)
    as_it_is = settled_plain(problem)
    assert slowing_beside(as_it_is).remarks == ()
    lighter = problem.model.copy()
    lighter.arrays.spin[INERTIA] *= 1.6
    (said,) = slowing_beside(settled_plain(replace(problem, model=lighter))).remarks
    assert "slow the shaft 1.6" in said or "slow the shaft 1.5" in said
    assert "in all drops" in said
    # a model that does not fit the drops says nothing about the slowing by contacts
    wrong = settled_plain(replace(problem, model=lighter))
    wrong = replace(wrong, fit=replace(wrong.fit, misfit=4 * wrong.fit.count))
    assert slowing_beside(wrong).remarks == ()
    # the unchanged gyroscopic moments speak against another polar inertia
    assert "kg m^2 by the machine file) does not explain it either" in said
    assert "Inertia and drag of the inner rings do not explain it" in said
    one_drop = replace(problem, model=lighter, drops=problem.drops[:1], own=problem.own[:1])
    (said,) = slowing_beside(settled_plain(one_drop)).remarks
    assert "drops" not in said


def test_a_polar_inertia_that_is_wrong_shows_in_the_gyroscopic_motion_too(crew):
    problem = problem_of(crew)
    heavier = problem.model.copy()
    heavier.arrays.spin[INERTIA] /= 1.4
    heavier.arrays.gyro[:] /= 1.4
    plain = settled_plain(replace(problem, model=heavier))
    told = polar_inertia(plain)
    assert told.factor == pytest.approx(1.4, abs=max(0.1, 3 * told.sigma))
    (said,) = slowing_beside(plain).remarks
    assert f"is wrong: the shaft's gyroscopic motion requires {told.factor:.2f} times" in said
    assert "which explains it. The verdict" in said


def test_rings_that_take_less_to_be_turned_are_told_by_when_the_shaft_slows(crew):
    """While the rings slip, friction slows the shaft whatever their inertia."""
    problem = problem_of(crew, seconds=0.5)
    heavier = problem.model.copy()
    heavier.arrays.end[:, RING_INERTIA] *= 2.0
    plain = settled_plain(replace(problem, model=heavier))
    (said,) = slowing_beside(plain).remarks
    assert "so the rings need less torque to turn than by the file" in said


def with_drag_off(problem, factor):
    """The problem with the model's drag scaled by a factor, and a decay time known to 25 %."""
    off = problem.model.copy()
    off.arrays.spin[DECAY_RATE] *= factor
    decay = off.machine.rotor.speed_decay_time.nominal
    loose = {"speed_decay_time": Tolerant(nominal=decay, low=0.75 * decay, high=1.25 * decay)}
    machine = off.machine.model_copy(update={"rotor": off.machine.rotor.model_copy(update=loose)})
    return replace(problem, model=replace(off, machine=machine))


@pytest.mark.parametrize("factor", [0.85, 1.12])
def test_a_drag_that_is_a_little_off_is_no_wrong_inertia(crew, factor):
    """A drag error looks like a quarter of the lag or more; in these drops a drive holds the speed up to the release."""
    plain = settled_plain(with_drag_off(problem_of(crew), factor))
    within, as_stated = slowings_of(plain), [replace(each, drag_sigma=0.0) for each in slowings_of(plain)]
    assert abs(factors_of(as_stated).lag - 1) > 0.2
    assert abs(factors_of(within).lag - 1) < 0.08
    assert (factors_of(within).drag - 1) * (1 / factor - 1) > 0
    assert slowing_misfit(within) < slows_otherwise.WORTH
    assert slowing_beside(plain).remarks == ()


def test_a_drag_that_is_told_before_the_release_counts_as_fitted(crew):
    problem = with_drag_off(problem_of(crew), 1.12)
    rate = problem.model.arrays.spin[DECAY_RATE]
    coasted = [
        replace(d, acceleration=-rate * d.omega, acceleration_sigma=0.003 * rate * abs(d.omega)) for d in problem.drops
    ]
    held, told = (settled_plain(replace(problem, drops=tuple(drops))) for drops in (problem.drops, coasted))
    assert slowings_of(held)[0].drag_sigma == pytest.approx(0.125)
    assert slowings_of(told)[0].drag_sigma == 0.0
    assert factors_of(slowings_of(told)).drag == 1.0


def test_a_ring_that_is_hard_to_turn_is_no_drag_that_is_off(crew):
    problem = with_drag_off(problem_of(crew, f"ring_drag:end=DE,torque={TORQUE} N m", seconds=0.5), 1.12)
    everyone = suspects(problem.model.machine, problem.model.machine.probes, ())
    field, slowed = with_slowing([settled_plain(problem)], everyone)
    assert field[0].name == "ring_drag@DE"
    assert slowed is not None
    assert field[0].starts()[0].shared["torque"] == pytest.approx(TORQUE, rel=0.25)


def slowed_from_the_release(problem, torques):
    """The problem with a torque in each drop, N m, that brakes the shaft from the release on."""
    inertia, sense = problem.model.arrays.spin[INERTIA], problem.model.machine.sense
    return replace(
        problem,
        drops=tuple(
            replace(
                drop,
                pulse_angles=drop.pulse_angles
                - sense * 0.5 * torque / inertia * np.clip(drop.pulse_times - drop.release, 0.0, None) ** 2,
            )
            for drop, torque in zip(problem.drops, torques, strict=True)
        ),
    )


@pytest.mark.parametrize("torques", [(25.0, 40.0), (3.0, 3.0), (-3.0, -4.0)])
def test_a_torque_from_the_release_on_is_told_with_its_size(crew, torques):
    """Its lag grows with the square of time, that by contacts ends once the rings turn: no inertia is blamed."""
    plain = settled_plain(slowed_from_the_release(problem_of(crew, seconds=0.6), torques))
    found = torques_beside_lag(slowings_of(plain), plain)
    np.testing.assert_allclose(found, torques, rtol=0.05)
    (said,) = slowing_beside(plain).remarks
    assert slowing_beside(plain).driven
    assert "inertia" not in said
    asked = "does the drive stay on" if torques[0] < 0 else "does the drive brake"
    assert asked in said
    assert ("more than friction in the contacts" in said) == (torques[0] > 20)


def test_a_drag_that_the_machine_file_leaves_out_is_no_drive(monkeypatch):
    """For a file without speed_decay_time the remark said that contacts cannot slow so much, and to cut off the drive."""
    machine = load_machine(shipped("short/machine.toml"))
    bare = machine.model_copy(update={"rotor": machine.rotor.model_copy(update={"speed_decay_time": None})})
    monkeypatch.setattr(slows_otherwise, "slowings_of", lambda _: ())
    for torques, of, driven in (((8.3, 22.0), bare, False), ((8.3, 22.0), machine, True), ((-3.0, -4.0), bare, True)):
        monkeypatch.setattr(slows_otherwise, "torques_beside_lag", lambda *_, found=torques: np.array(found))
        plain = SimpleNamespace(problem=SimpleNamespace(model=SimpleNamespace(machine=of)))
        told = slowing_beside(plain)
        assert told.driven is driven
        assert ("states no speed_decay_time" in told.remarks[0]) is not driven


def test_torques_of_either_sign_are_no_drive(crew):
    plain = settled_plain(slowed_from_the_release(problem_of(crew, seconds=0.6), (4.0, -4.0)))
    assert torques_beside_lag(slowings_of(plain), plain) is None


def test_a_record_that_ends_early_tells_nothing(crew):
    problem = problem_of(crew, seconds=0.03)
    assert slowing_of(problem, problem.start, 0, 0.012) is None


def test_one_drop_alone_proves_no_cause(crew):
    problem = problem_of(crew, f"ring_drag:end=DE,torque={TORQUE} N m")
    alone = replace(problem, drops=problem.drops[:1], own=problem.own[:1])
    everyone = suspects(problem.model.machine, problem.model.machine.probes, ())
    field, slowed = with_slowing([settled_plain(alone)], everyone)
    assert slowed is None
    assert [each.name for each in field] == ["plain model"]
    assert field[0].later > 60  # it shows, but is not proved


def test_of_a_long_record_the_run_out_after_the_drop_is_judged(crew):
    short, long = (problem_of(crew, seconds=seconds) for seconds in (0.7, 1.5))
    one, other = (slowing_of(problem, problem.start, 0, 0.04) for problem in (short, long))
    assert other.time[-1] < 0.6
    np.testing.assert_allclose(other.lag, one.lag[: len(other.lag)], atol=2e-4)
