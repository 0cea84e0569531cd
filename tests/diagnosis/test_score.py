"""Scores of causes beside values at their bounds, on drops of the same simulator."""

from tdbmon.diagnosis.contender import Contender, settled, with_cause
from tdbmon.diagnosis.score import scores
from tdbmon.diagnosis.shortlist import worth_fitting
from tdbmon.diagnosis.suspects import Start, suspects
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.least_squares import fit
from tdbmon.identify.problem import build_problem
from tests.diagnosis.simulated import problem_of, record
from tests.identify import drops

FALL_S = 0.006


def by_name(problem):
    machine = problem.model.machine
    return {suspect.name: suspect for suspect in suspects(machine, machine.probes, ())}


def test_what_a_value_at_its_bound_cannot_do_a_cause_can(crew):
    """A usual runout up to 3 um is fitted in every drop: it acts like a cause of 10 um, but is limited."""
    problem = problem_of(crew, "probe_runout:end=NDE,first=10 um,second=1 um")
    fallen = fit(problem, problem.start, FALL_S)
    where = [k for k, p in enumerate(problem.parameters) if p.name.startswith("NDE.runout_cosine_1")]
    at_bound = (fallen.point <= problem.low + 1e-9) | (fallen.point >= problem.high - 1e-9)
    assert at_bound[where].any()
    found = scores(problem, fallen, FALL_S, [by_name(problem)["probe_runout@NDE"]])
    assert found[0].gain > 0.5 * found[0].total


def test_a_further_cause_is_asked_where_the_first_leaves_many_times_the_noise(crew):
    problem = problem_of(crew, "shaft_bow:bow=21 um,phase=2.5 rad", "probe_runout:end=NDE,first=8 um,second=1.5 um")
    suspect = by_name(problem)
    plain = Contender((), problem, fit(problem, problem.start, FALL_S), FALL_S, 0.9)
    bowed = with_cause(plain, suspect["shaft_bow@rotor"], Start({"bow": 21e-6, "phase": 2.5}))
    for horizon in (FALL_S, 0.01, 0.014):
        bowed = settled(bowed, horizon, 8)
    assert bowed.ratio > 3 * bowed.floor
    names = [each.suspect.name for each in worth_fitting(bowed, 0.014, list(suspect.values()), [], thorough=True)]
    assert "probe_runout@NDE" in names


def test_what_acts_in_contacts_is_no_suspect_while_nothing_touches(crew):
    problem = problem_of(crew)
    everyone = list(by_name(problem).values())
    falling = scores(problem, fit(problem, problem.start, FALL_S, 2), FALL_S, everyone)
    touching = scores(problem, fit(problem, problem.start, 0.014, 2), 0.014, everyone)
    assert not any(each.suspect.in_contacts for each in falling)
    assert {each.suspect.name for each in touching} == {each.name for each in everyone}
    assert {each.suspect.name for each in falling} >= {"probe_gain@DE_A", "unbalance@impeller", "shaft_bow@rotor"}


def renamed(machine, old, new):
    """A machine with another name of one end."""
    bearings = tuple(
        each.model_copy(update={"name": new}) if each.name == old else each for each in machine.touchdown_bearings
    )
    probes = tuple(each.model_copy(update={"end": new}) if each.end == old else each for each in machine.probes)
    return machine.model_copy(update={"touchdown_bearings": bearings, "probes": probes})


def test_a_dot_in_the_name_of_an_end_holds_no_value_of_a_drop(crew):
    """The phase of waves differs from drop to drop."""
    machine = renamed(drops.machine(), "NDE", "Brg. 1")
    problem = build_problem(machine, tuple(measured_drop(record(machine, v, 1), machine) for v in (80.0, 150.0)), crew)
    waves = next(each for name, each in by_name(problem).items() if name.startswith("race_waviness@Brg. 1"))
    plain = Contender((), problem, fit(problem, problem.start, 0.014, 1), 0.014, 0.9)
    wavy = with_cause(plain, waves, Start({"amplitude": 2e-6}, ({"phase": 0.2}, {"phase": 1.0})))
    _, slopes = wavy.problem.slopes(wavy.fit.point, 0, 0.014)
    (phase,) = (k for k, each in enumerate(wavy.problem.own[0]) if each.name.endswith(".phase"))
    assert abs(slopes[:, len(wavy.problem.shared) + phase]).max() > 1
