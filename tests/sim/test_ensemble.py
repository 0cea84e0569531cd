"""Many drops at once are the drops one by one, to rounding."""

from __future__ import annotations

import numpy as np
import pytest
from tdbsim import state_layout
from tdbsim.columns import GAP
from tdbsim.drop_model import build_model
from tdbsim.ensemble import run_each, run_many
from tdbsim.errors import InputError
from tdbsim.simulate import DropPlan, run


@pytest.mark.parametrize("threads", [1, 2, None])
def test_many_are_the_same_as_one_by_one(machine, threads):
    base = build_model(machine)
    cases = []
    for k in range(6):
        model = base.copy()
        model.arrays.end[:, GAP] += k * 1e-6
        cases.append((model, DropPlan(150.0, 0.03, cage_angle=(0.1 * k, 0.0))))
    many = run_many(cases, threads)
    for (model, plan), found in zip(cases, many, strict=True):
        alone = run(model.copy(), plan)
        assert np.abs(found.state - alone.state)[:, : state_layout.shaft_angle(model.n)].max() < 1e-12
        np.testing.assert_allclose(found.peak_normal, alone.peak_normal, rtol=1e-8)
    assert many[0].peak_normal.min() > 100
    assert np.abs(many[0].state - many[5].state).max() > 1e-6
    np.testing.assert_array_equal(base.arrays.end[:, GAP], [b.radial_gap.nominal for b in machine.touchdown_bearings])


def test_what_cannot_run_is_said(machine):
    model = build_model(machine)
    with pytest.raises(InputError, match="reaches the gap"):
        run_many([(model, DropPlan(100.0, 0.01)), (model.copy(), DropPlan(100.0, 0.01, set_point=((1.0, 0), (0, 0))))])


@pytest.mark.parametrize("others", [0, 1, 4])
def test_what_cannot_run_does_no_harm_to_the_others(machine, others):
    model = build_model(machine)
    off = DropPlan(100.0, 0.01, set_point=((1.0, 0), (0, 0)))
    cases = [(model, off), *[(model, DropPlan(100.0 + k, 0.01)) for k in range(others)]]
    failed, *found = run_each(cases, lambda each: each.plan.speed)
    assert isinstance(failed, InputError) and "reaches the gap" in str(failed)
    assert found == [100.0 + k for k in range(others)]


def test_cases_that_share_nothing_keep_their_order(machine):
    """Other steps, methods, instants, rotors: each goes where it can, and comes back in its place."""
    few, more = build_model(machine, bending=2), build_model(machine)
    plans = [
        DropPlan(150.0, 0.008), DropPlan(150.0, 0.008, step=1e-5), DropPlan(150.0, 0.009), DropPlan(100.0, 0.008),
        DropPlan(150.0, 0.008, method="dormand_prince"), DropPlan(150.0, 0.008, levitated=0.001),
    ]  # fmt: skip
    cases = [(model, plan) for plan in plans for model in (few, more)] * 3
    for (model, plan), found in zip(cases, run_many(cases, 1), strict=True):
        assert found.plan is plan
        assert found.model.n == model.n
        np.testing.assert_allclose(found.state, run(model, plan).state, rtol=1e-9, atol=1e-12)
    assert run_many([]) == []
