"""Several fits followed side by side; synthetic drops by the model's own simulator."""

from dataclasses import replace

import numpy as np
import pytest
from tdbsim.machine import load_machine

from tdbmon.identify import follow
from tdbmon.identify.crew import Crew
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.follow import followed
from tdbmon.identify.least_squares import Fit, fit
from tdbmon.identify.own_paths import lost_drops
from tdbmon.identify.problem import build_problem
from tdbmon.identify.stages import Stages
from tdbmon.shipped import shipped
from tests.identify import drops

TRUTH = drops.TRUTH | {"NDE.diametral_clearance": 14.5e-6, "DE.diametral_clearance": 14.5e-6}


def test_clearances_come_back_though_the_first_contacts_do_not_tell_them():
    machine = load_machine(shipped("short/machine.toml"))
    records = [drops.drop(TRUTH, speed, seed) for speed, seed in ((60.0, 1), (97.0, 2), (150.0, 3))]
    with Crew() as crew:
        problem = build_problem(machine, tuple(measured_drop(each, machine) for each in records), crew)
        _, passed = followed(problem, Stages().calibration[:7], lambda _: None, may_widen=False)
    found = passed[-1]
    assert lost_drops(problem, found.fit, found.horizon) == []
    values, _ = problem.values(found.fit.point, 0)
    for end in machine.ends:
        assert values[f"{end}.diametral_clearance"] == pytest.approx(14.5e-6, abs=1e-6)
        assert values[f"{end}.radial_gap"] == pytest.approx(TRUTH[f"{end}.radial_gap"], abs=1e-6)


def test_what_only_cages_turned_one_by_one_find_goes_along(monkeypatch):
    """A rival that is not the deepest yet, and is at the next horizon: there it begins where it ended here."""
    machine = load_machine(shipped("short/machine.toml"))
    begun, turned = list[float](), list[Fit]()

    def better_clearances(problem, found, horizon):
        point = found.point.copy()
        point[0] += 0.1
        turned.append(replace(found, point=point, misfit=1.01 * found.misfit))
        return turned[0]

    def fit_or_none(problem, point, horizon):
        if turned and np.array_equal(point, turned[0].point):
            begun.append(horizon)
        return fit(problem, point, horizon, 1)

    monkeypatch.setattr(follow, "begun_at", lambda problem, corner, horizon: None)
    monkeypatch.setattr(follow, "better_clearances", better_clearances)
    monkeypatch.setattr(follow, "fit_or_none", fit_or_none)
    with Crew() as crew:
        problem = build_problem(machine, (measured_drop(drops.drop(TRUTH, seconds=0.03), machine),), crew)
        followed(problem, Stages().calibration[:4], lambda _: None, may_widen=False)
    assert begun == [Stages().calibration[3]]


@pytest.mark.parametrize("horizons", [Stages().calibration[:6], (0.006, 0.01, 0.0145, 0.02, 0.023, 0.03)])
def test_clearances_and_paths_are_sought_whichever_horizons_are_asked_for(horizons, monkeypatch):
    """Without one of exactly 14 ms neither other clearances were tried nor, without 22 and 27 ms, the paths of all drops."""
    machine = load_machine(shipped("short/machine.toml"))
    turned, begun, sought = list[float](), set[float](), list[float]()

    def better_clearances(problem, found, horizon):
        turned.append(horizon)
        return found

    def better_paths(problem, found, horizon, lost):
        assert list(lost) == [0]
        sought.append(horizon)
        return found

    monkeypatch.setattr(follow, "fit_or_none", lambda problem, point, horizon: fit(problem, point, horizon, 1))
    monkeypatch.setattr(follow, "better_clearances", better_clearances)
    monkeypatch.setattr(follow, "begun_at", lambda problem, corner, horizon: begun.add(horizon))
    monkeypatch.setattr(follow, "better_paths", better_paths)
    monkeypatch.setattr(follow, "lost_drops", lambda problem, found, horizon: [])
    monkeypatch.setattr(follow, "stray_drop", lambda found, limit: None)
    monkeypatch.setattr(follow, "FAILING", np.inf)
    with Crew() as crew:
        problem = build_problem(machine, (measured_drop(drops.drop(TRUTH, seconds=0.04), machine),), crew)
        followed(problem, horizons, lambda _: None)
    assert turned == [horizons[2]]
    assert begun == {horizons[2]}
    assert sorted(set(sought)) == [horizons[4], horizons[5]]
