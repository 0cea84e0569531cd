"""Drops side by side: each as alone, whatever stands beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tdbsim import state_layout
from tdbsim.columns import CONTACT_DAMPING, CONTACT_POWER, FRICTION, FRICTION_POWER, GAP
from tdbsim.drop_model import build_model
from tdbsim.drop_record import drop_record
from tdbsim.effect import catalogue, declaration, places
from tdbsim.errors import InputError
from tdbsim.side_by_side import MOST, run_side_by_side, shared
from tdbsim.simulate import DropPlan, Trajectory, run
from tdbsim.state_layout import LEDGER

DISSIPATED = [kind for kind in LEDGER if not kind.startswith("heat") and kind != "external"]
PLAN = DropPlan(150.0, 0.015)
EVERY = pytest.mark.parametrize("declared", catalogue(), ids=[each.identifier for each in catalogue()])


def varied(machine, plan=PLAN, count=MOST, bending=4):
    """Drops that touch at different instants."""
    base, rng = build_model(machine, bending=bending), np.random.default_rng(7)
    cases = []
    for _ in range(count):
        model = base.copy()
        model.arrays.end[:, GAP] *= rng.uniform(0.95, 1.05, 2)
        model.arrays.end[:, FRICTION] *= rng.uniform(0.7, 1.3)
        model.arrays.unbalance[:] *= rng.uniform(0.5, 2.0)
        angles = tuple(float(each) for each in rng.uniform(0, 6, 3))
        speed = float(rng.choice([60.0, 150.0, 210.0]))
        cases.append((model, replace(plan, speed=speed, shaft_angle=angles[0], cage_angle=angles[1:])))
    return cases


def assert_as_alone(found, case, apart=1e-12):
    """A drop through contacts is what `run` gives, places to so many metres."""
    alone, lengths = run(*case), state_layout.shaft_angle(case[0].n)  # before the angles
    assert alone.peak_normal.max() > 1000
    assert isinstance(found, Trajectory)
    assert np.abs(found.state - alone.state)[:, :lengths].max() < apart
    np.testing.assert_allclose(found.state, alone.state, rtol=1e-6, atol=max(1e-8, apart * 1e4))
    np.testing.assert_allclose(found.peak_normal, alone.peak_normal, rtol=1e-6)
    np.testing.assert_array_equal(found.time, alone.time)
    np.testing.assert_array_equal(found.whirl, alone.whirl)


@pytest.mark.parametrize("count", range(1, MOST + 1))
def test_equal_drops_are_the_drop_alone(machine, count):
    case = build_model(machine), replace(PLAN, levitated=0.0031)
    for found in run_side_by_side([case] * count):
        assert_as_alone(found, case)


@pytest.mark.parametrize("bending", [0, 2, 4, 9, 12])
def test_different_drops_are_the_drops_alone(machine, bending):
    """Each takes its own steps: no lane notices when another touches, with any number of modes."""
    cases = varied(machine, bending=bending)
    for found, case in zip(run_side_by_side(cases), cases, strict=True):
        assert_as_alone(found, case)


def test_laws_and_instants_of_all_kinds(machine):
    """Other exponents, strong damping, weak and strong friction, few instants, long steps: rare ways of a kick too."""
    cases = varied(machine, DropPlan(150.0, 0.06, sampling=1e3, step=1e-5))
    for k, (model, _) in enumerate(cases):
        model.arrays.end[:, CONTACT_POWER] += 0.05 * (k % 3)
        model.arrays.end[0, FRICTION_POWER] = 0.1 * (k % 2)
        model.arrays.end[1, CONTACT_DAMPING] *= 1 + 10 * (k % 4)
        model.arrays.end[1, FRICTION] *= 1 + 2 * (k % 5)
    for found, case in zip(run_side_by_side(cases), cases, strict=True):
        assert_as_alone(found, case, 1e-10)


def test_what_a_nudge_does_not_change_is_the_same_to_the_last_bit(machine):
    """Drops that differ by friction alone, until they touch."""
    base = build_model(machine)
    nudged = base.copy()
    nudged.arrays.end[:, FRICTION] *= 1 + 1e-6
    still, moved = run_side_by_side([(base, PLAN), (nudged, PLAN)])
    fall = still.time < 0.006
    np.testing.assert_array_equal(still.state[fall], moved.state[fall])
    assert np.abs(still.state - moved.state)[~fall].max() > 0


@EVERY
def test_an_effect_in_one_lane(declared, machine):
    """It acts there as alone, and nowhere else."""
    effect = declared.typical(places(declared.place, machine)[0])
    plan = replace(PLAN, levitated=0.002)
    cases = [(build_model(machine), plan) for _ in range(3)]
    cases[1] = build_model(machine, [effect]), plan
    assert shared(*cases[0]) == shared(*cases[1])
    for found, case in zip(run_side_by_side(cases), cases, strict=True):
        assert_as_alone(found, case)


def test_many_effects_in_many_lanes(machine):
    """Lanes with bores, waves, laws and supports of their own, at both ends, through slow slips too."""
    cases = []
    for k in range(MOST):
        chosen = [
            each.typical((several := places(each.place, machine))[k % len(several)]) for each in catalogue()[k::4]
        ]
        cases.append((build_model(machine, chosen), replace(PLAN, seconds=0.03)))
    for found, case in zip(run_side_by_side(cases), cases, strict=True):
        assert_as_alone(found, case, 1e-11)


def test_energies_of_each_lane(machine):
    """Energy lost is energy dissipated, less what unbalance supplied, lane by lane as in a drop alone."""
    cases = varied(machine, DropPlan(150.0, 0.03, step=5e-6))
    for found, case in zip(run_side_by_side(cases), cases, strict=True):
        alone = run(*case)
        np.testing.assert_allclose(found.state[:, -len(LEDGER) :], alone.state[:, -len(LEDGER) :], rtol=1e-6, atol=1e-9)
        drop = drop_record(found)
        total = drop["energy"].sum("energy_kind") + drop["work"].sel(work_kind=DISSIPATED).sum("work_kind")
        balance = total - drop["work"].sel(work_kind="external")
        weight = drop["energy"].sel(energy_kind="weight")
        fallen = float(weight[0] - weight.min())
        assert float(np.abs(balance - balance[0]).max()) < 2e-3 * fallen


def test_a_drop_that_cannot_be_harms_no_other(machine):
    cases = varied(machine, count=5)
    outside = replace(PLAN, set_point=((0.0, -4e-4), (0.0, 0.0)))
    blown = cases[2][0].copy()
    blown.arrays.unbalance[:] = 0.0
    blown.arrays.end[0, FRICTION] = np.inf
    mixed = [cases[0], (cases[1][0], outside), cases[1], (blown, PLAN), *cases[2:]]
    found = run_side_by_side(mixed)
    assert isinstance(found[1], InputError) and "reaches the gap" in str(found[1])
    assert isinstance(found[3], InputError)
    with pytest.raises(InputError) as alone:
        run(blown, PLAN)
    assert str(found[3]) == str(alone.value)
    for k in (0, 2, 4, 5, 6):
        assert_as_alone(found[k], mixed[k])


def test_what_may_go_side_by_side(machine):
    model = build_model(machine)
    common = shared(model, PLAN)
    stiffer = model.copy()
    stiffer.arrays.square[2] *= 1.001
    assert common == shared(model.copy(), replace(PLAN, speed=90.0, shaft_angle=1.0, step=25e-6))
    others = [
        (stiffer, PLAN), (build_model(machine, bending=5), PLAN), (model, replace(PLAN, seconds=0.016)),
        (model, replace(PLAN, step=1e-5)), (model, replace(PLAN, levitated=0.001)), (model, replace(PLAN, sampling=1e4)),
    ]  # fmt: skip
    assert all(shared(*other) not in (common, None) for other in others)
    assert shared(model, replace(PLAN, method="dormand_prince")) is None


def test_an_effect_twice_in_a_lane(machine):
    """Two of one kind at one end, and none in the lane beside."""
    declared = declaration("off_sized_ball")
    many = build_model(machine, [declared.typical("NDE"), declared.typical("NDE")])
    plain = build_model(machine)
    for found, case in zip(run_side_by_side([(plain, PLAN), (many, PLAN)]), [(plain, PLAN), (many, PLAN)], strict=True):
        assert_as_alone(found, case)
