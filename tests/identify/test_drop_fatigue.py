"""The fatigue that the archive files of a drop, against that of the simulation which made the record (same model)."""

from dataclasses import replace

import pytest
from tdbsim.fatigue import drop_fatigue

from tdbmon.history.fatigue import fatigue_of
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.forces import forces_of
from tdbmon.identify.stress import ball_stress
from tests.identify import drops

SECONDS = 0.03
REFERENCE = 2000e6


def fatigue(calibration, members=12):
    """Of each drop, by end."""
    return [
        {end: fatigue_of(each.fatigue, end) for end, each in drop.ends.items()}
        for drop in forces_of(calibration, SECONDS, members)
    ]


@pytest.fixture(scope="module")
def found(calibration):
    return fatigue(calibration)


@pytest.fixture(scope="module")
def stresses():
    """Of each drop the balls' stresses at each end, at so many samples that more do not change their cycles."""
    machine, out = drops.machine(), []
    for speed, seed in ((97.0, 1), (148.0, 2)):
        record = drops.drop(speed=speed, seed=seed, seconds=SECONDS, sampling=320e3)
        part = record.ball_load.sel(time=slice(record.attrs["release_time_s"], None))
        out.append({b.name: ball_stress(b, part.sel(end=b.name).values) for b in machine.touchdown_bearings})
    return out


def test_the_intervals_hold_what_the_balls_went_through(found, stresses):
    for each, true_stress in zip(found, stresses, strict=True):
        for end, stress in true_stress.items():
            true = drop_fatigue(stress, REFERENCE).worst
            assert true > 0.1  # it does hit
            assert each[end].low < true < each[end].high
            assert each[end].value == pytest.approx(true, rel=0.08)


def test_it_counts_the_greatest_stress(found, stresses):
    """At least the half cycle by which it is reached."""
    for each, true_stress in zip(found, stresses, strict=True):
        for end, stress in true_stress.items():
            assert each[end].value > 0.5 * (stress.max() / REFERENCE) ** 9


def test_it_does_not_depend_on_how_often_the_record_was_sampled(calibration, same_model, found):
    """At the samples of a record of 5 kHz blows are missed, and a quarter of the sum with them."""
    machine, records = same_model
    seldom = tuple(measured_drop(record.isel(time=slice(None, None, 4)), machine) for record in records)
    few = replace(calibration, problem=replace(calibration.problem, drops=seldom))
    for again, each in zip(fatigue(few), found, strict=True):
        for end, estimate in again.items():
            assert estimate.value == pytest.approx(each[end].value, rel=0.01)


def test_above_the_static_limit_the_sum_is_said_not_to_hold(calibration, found):
    """Small balls in flat grooves press the same loads into smaller ellipses."""
    assert not any(estimate.why for each in found for estimate in each.values())
    model = calibration.problem.model
    small = {"inner_conformity": 0.95, "outer_conformity": 0.95, "diameter": 6e-3}
    bearings = tuple(
        b.model_copy(update={"balls": b.balls.model_copy(update=small)}) for b in model.machine.touchdown_bearings
    )
    pressed = replace(model, machine=model.machine.model_copy(update={"touchdown_bearings": bearings}))
    hard = replace(calibration, problem=replace(calibration.problem, model=pressed))
    for estimate in fatigue(hard, members=8)[1].values():
        assert estimate.known
        assert estimate.why.startswith("in 8 of 8 simulations balls come above 4200 MPa: they may be indented")
