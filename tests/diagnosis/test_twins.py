"""Look-alikes fitted in each other's place, on drops of the same simulator (no test of the physics)."""

import math
from dataclasses import replace

import pytest

from tdbmon.diagnosis.attempt import followed_on
from tdbmon.diagnosis.contender import Contender, settled, with_cause
from tdbmon.diagnosis.suspects import Start, suspects
from tdbmon.diagnosis.twins import twins, with_paths_sought, with_twins
from tdbmon.diagnosis.verdict import verdict
from tdbmon.identify.cages import turning
from tdbmon.identify.least_squares import fit, linearised
from tdbmon.identify.stages import Stages
from tests.diagnosis.made_up import contender
from tests.diagnosis.simulated import problem_of


@pytest.fixture(scope="module")
def leaking(crew):
    """Suspects, the plain model, and the model with the crosstalk that the drops have, fitted to 14 ms."""
    problem = problem_of(crew, "probe_crosstalk:end=DE,factor=-0.04,into=second")
    everyone = suspects(problem.model.machine, problem.model.machine.probes, ())
    bare = Contender((), problem, fit(problem, problem.start, 0.014, 3), 0.014, 0.9)
    leaks = next(s for s in everyone if s.name == "probe_crosstalk@DE" and s.held == {"into": "second"})
    leak = settled(with_cause(bare, leaks, Start({"factor": -0.04})), 0.014, 8)
    return everyone, bare, leak


def test_twins_are_led_along_the_horizons_again(leaking):
    *_, leak = leaking
    for horizon in (0.018, 0.022):
        leak = settled(leak, horizon, 4)
    point = leak.fit.point.copy()
    point[0] += 0.3  # a wrong gap: paths diverge
    lost = replace(leak, fit=linearised(leak.problem, point, 0.022))
    assert lost.misfit > leak.misfit + 100
    (found,) = followed_on([lost], (0.018, 0.022))
    assert found.horizon == 0.022
    assert found.misfit < leak.misfit + 10
    assert followed_on([leak], ()) == [leak]


def test_a_leak_between_channels_is_fitted_in_the_place_of_a_turned_probe(crew):
    """The two differ by the square of 4 %: 0.2 um in a gap of 250 um, two thirds of the noise."""
    problem = problem_of(crew, "probe_crosstalk:end=DE,factor=-0.04,into=second")
    everyone = suspects(problem.model.machine, problem.model.machine.probes, ())
    fallen = Contender((), problem, fit(problem, problem.start, 0.006, 3), 0.006, 0.9)
    turned = next(s for s in everyone if s.name == "probe_angle@DE_B")
    angle = settled(with_cause(fallen, turned, Start({"error": 0.04})), 0.006, 4)
    leak = next(each for each in twins(angle, everyone) if each.name == "probe_crosstalk@DE")
    assert leak.horizon == angle.horizon
    values, _ = leak.problem.values(leak.fit.point, 0)
    assert values["probe_crosstalk@DE.factor"] == pytest.approx(-0.04, abs=0.005)
    bare = contender(fallen, (), 0, 8.0)
    assert {each.name for each in verdict(sorted([angle, leak, bare], key=lambda each: each.bic), None).accused} >= {
        "probe_crosstalk@DE"
    }


def test_twins_are_compared_with_the_paths_of_their_drops_sought(leaking):
    """A wrong cage angle costs more than a turned probe and a crosstalk differ by."""
    everyone, _, leak = leaking
    point = leak.fit.point.copy()
    point[leak.problem.columns(0)[[len(leak.problem.shared) + k for k in turning(leak.problem)]]] += 0.5
    lost = replace(leak, fit=linearised(leak.problem, point, 0.014))
    assert lost.bic > leak.bic + 100
    found = {each.name: each for each in with_paths_sought([lost, *twins(lost, everyone)], lost, (0.014,))}
    assert found["probe_crosstalk@DE"].bic < leak.bic + 10
    assert {"probe_angle@DE_A", "probe_angle@DE_B"} & set(found)


def test_an_effect_at_one_end_is_fitted_in_the_place_of_one_at_both(crew):
    problem = problem_of(crew, "support_anisotropy:end=DE,ratio=0.5,direction=30 deg")
    everyone = suspects(problem.model.machine, problem.model.machine.probes, ())
    bare = Contender((), problem, fit(problem, problem.start, 0.014, 3), 0.014, 0.9)
    at_both = next(s for s in everyone if s.name == "support_anisotropy@both")
    both = settled(with_cause(bare, at_both, Start({"ratio": 0.6, "direction": math.radians(30)})), 0.014, 3)
    found = {each.name: each for each in twins(both, everyone)}
    assert found["support_anisotropy@DE"].bic < both.bic


def test_twins_are_made_of_who_may_be_named_only(leaking):
    """Fitting look-alikes takes long, and a model that leaves so much is not named."""
    everyone, bare, leak = leaking
    hopeless = replace(leak, fit=replace(leak.fit, misfit=4.0 * leak.fit.count))
    assert with_twins([bare, hopeless], hopeless, everyone, (0.014,)) == [bare, hopeless]


def test_a_twin_that_comes_out_ahead_lends_the_others_where_it_stands(leaking, monkeypatch):
    """Else the look-alike that happens to find better values of the machine wins."""
    from tdbmon.diagnosis import twins as module

    everyone, bare, leak = leaking
    point = leak.fit.point.copy()
    point[0] += 0.05
    shallow = replace(leak, fit=linearised(leak.problem, point, 0.014))
    (ahead,) = [each for each in twins(leak, everyone) if each.name == "probe_angle@DE_B"][:1]
    assert ahead.bic < shallow.bic
    monkeypatch.setattr(module, "with_paths_sought", lambda field, best, horizons: [best, ahead])
    found = {each.name: each for each in module.with_twins([bare, shallow], shallow, everyone, (0.014,))}
    assert found["probe_crosstalk@DE"].bic < leak.bic + 10


def test_a_plain_model_that_comes_near_has_its_paths_sought_too(leaking, monkeypatch):
    """Else the model whose paths alone were searched for seems better."""
    from tdbmon.diagnosis import twins as module

    _, bare, leak = leaking
    sought = []
    monkeypatch.setattr(Stages, "loaded", 0.0)
    monkeypatch.setattr(module, "followed_on", lambda field, horizons: list(field))
    monkeypatch.setattr(module, "better_paths", lambda problem, fit, *rest: sought.append(len(problem.free)) or fit)
    near = replace(bare, fit=replace(bare.fit, misfit=1.1 * leak.misfit))
    with_paths_sought([near, leak], leak, (0.014,))
    assert sorted(sought) == [0, 1]
    sought.clear()
    with_paths_sought([replace(near, fit=replace(near.fit, misfit=4.0 * leak.misfit)), leak], leak, (0.014,))
    assert sought == []
