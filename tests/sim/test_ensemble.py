"""Many drops at once are the drops one by one."""

from __future__ import annotations

import numpy as np
import pytest
from tdbsim.columns import GAP
from tdbsim.drop_model import build_model
from tdbsim.ensemble import run_many
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
        np.testing.assert_array_equal(found.state, run(model.copy(), plan).state)
    assert np.abs(many[0].state - many[5].state).max() > 1e-6
    np.testing.assert_array_equal(base.arrays.end[:, GAP], [b.radial_gap.nominal for b in machine.touchdown_bearings])


def test_what_cannot_run_is_said(machine):
    model = build_model(machine)
    with pytest.raises(InputError, match="reaches the gap"):
        run_many([(model, DropPlan(100.0, 0.01)), (model.copy(), DropPlan(100.0, 0.01, set_point=((1.0, 0), (0, 0))))])
