"""Waves, lobes and balls begun where contacts begin, on drops of the same simulator (so no test of the physics)."""

import pytest

from tdbmon.diagnosis.contender import Contender, settled, with_cause
from tdbmon.diagnosis.met_alike import from_the_first_contact
from tdbmon.diagnosis.suspects import Start, suspects
from tdbmon.identify.least_squares import fit
from tests.diagnosis.simulated import problem_of

HORIZONS = (0.006, 0.01, 0.014, 0.018)


@pytest.fixture(scope="module")
def beside_an_oval(crew):
    """The plain model fitted to the fall, its suspects, and the oval that drops have beside waves at the other end."""
    problem = problem_of(
        crew,
        "oval_clearance:end=NDE,amplitude=25 um,angle=20 deg",
        "race_waviness:end=DE,amplitude=8 um,order=4,phase=60 deg,race=outer",
    )
    everyone = suspects(problem.model.machine, problem.model.machine.probes, ())
    fallen = Contender((), problem, fit(problem, problem.start, HORIZONS[0], 3), HORIZONS[0], 0.9)
    oval = next(s for s in everyone if s.name == "oval_clearance@NDE" and s.held["law"] == "radial")
    return fallen, everyone, oval, Start({"amplitude": 25e-6, "angle": 0.349})


def test_waves_are_found_beside_a_known_cause(beside_an_oval):
    fallen, everyone, oval, lies = beside_an_oval
    alone = with_cause(fallen, oval, lies)
    for horizon in HORIZONS:
        alone = settled(alone, horizon, 8)
    outer = [s for s in everyone if s.name == "race_waviness@DE" and s.standing_waves and s.held["order"] in (3, 4)]
    found = from_the_first_contact(fallen, [(oval, lies)], outer, HORIZONS)
    best = found[0]
    assert best.horizon == HORIZONS[-1]
    assert best.name == "oval_clearance@NDE + race_waviness@DE"
    assert best.causes[-1].held["order"] == 4
    assert best.misfit < alone.misfit - 100
    assert best.starts()[-1].shared["amplitude"] == pytest.approx(8e-6, rel=0.2)
    assert found == sorted(found, key=lambda each: each.misfit)


def test_what_was_held_at_the_first_contact_is_free_again(beside_an_oval):
    fallen, everyone, oval, lies = beside_an_oval
    outer = [s for s in everyone if s.name == "race_waviness@DE" and s.standing_waves and s.held["order"] == 4]
    (best, *_) = from_the_first_contact(fallen, [(oval, lies)], outer, HORIZONS[:3])
    wide = {p.name: (p.low, p.high) for p in with_cause(fallen, oval, lies).problem.shared}
    assert {p.name: (p.low, p.high) for p in best.problem.shared if p.name in wide} == wide


def test_two_causes_with_angles_of_their_own_in_every_drop_never_stand_together(beside_an_oval):
    fallen, everyone, *_ = beside_an_oval
    turning = [s for s in everyone if s.turning and s.where == "DE"]
    start = Start({"amplitude": 5e-6}, ({"phase": 0.0},) * len(fallen.problem.drops))
    assert from_the_first_contact(fallen, [(turning[0], start)], turning[1:], HORIZONS) == []


def test_nothing_is_begun_before_both_ends_have_touched(beside_an_oval):
    fallen, everyone, oval, lies = beside_an_oval
    waves = [s for s in everyone if s.standing_waves]
    assert from_the_first_contact(fallen, [(oval, lies)], waves, HORIZONS[:2]) == []
