"""Removal of causes that a model does not need."""

from dataclasses import replace

import pytest

from tdbmon.diagnosis.contender import Contender, plain_of, settled, with_cause
from tdbmon.diagnosis.simplified import only_accompanies, simplified
from tdbmon.diagnosis.suspects import Start, suspects
from tdbmon.identify.least_squares import fit, linearised
from tests.diagnosis.made_up import contender
from tests.diagnosis.simulated import problem_of


def test_a_ball_beside_a_cause_that_explains_nearly_all_only_accompanies_it(competed):
    like = plain_of(competed)
    plain = contender(like, (), 0, 6.0)

    def judged(companion, left):
        near = contender(like, ("probe_gain@DE_A",), 0, left * like.floor)
        both = contender(like, ("probe_gain@DE_A", companion), 900, 1.0)
        return only_accompanies(both, near, plain)

    assert judged("off_sized_ball@NDE", 1.27)
    assert not judged("off_sized_ball@NDE", 1.5)  # the excess is more than inexact laws leave
    assert not judged("probe_angle@DE_B", 1.27)  # has no number of its own in every drop
    alone = contender(like, ("off_sized_ball@NDE",), 900, 1.0)
    assert not only_accompanies(alone, contender(like, (), 0, 1.2 * like.floor), plain)


def test_a_cause_of_no_size_goes_even_where_the_model_fails_without_it(crew):
    """Only its fit is in a better minimum; the plain model is as good there."""
    problem = problem_of(crew)
    everyone = suspects(problem.model.machine, problem.model.machine.probes, ())
    bare = Contender((), problem, fit(problem, problem.start, 0.012, 3), 0.012, 0.5)
    hard = next(s for s in everyone if s.name == "hardening_support@DE")
    nothing = with_cause(bare, hard, Start({"cubic": 0.0}))
    place = next(k for k, p in enumerate(problem.shared) if p.name == "DE.radial_gap")
    off = problem.start.copy()
    off[place] += 0.5
    stuck = replace(bare, fit=linearised(problem, off, 0.012))
    assert stuck.misfit > 2 * bare.misfit
    assert bare.fails
    plain, field = simplified(stuck, [nothing])
    assert plain.misfit == pytest.approx(bare.misfit, rel=0.01)
    assert field == []


def test_one_effect_at_either_end_is_one_at_both(crew):
    """A search that adds causes one by one finds two; if the sizes at the ends differ, they stay two."""
    problem = problem_of(crew, "hardening_support:where=both,cubic=3e18 N/m^3")
    everyone = suspects(problem.model.machine, problem.model.machine.probes, ())
    bare = Contender((), problem, fit(problem, problem.start, 0.012, 3), 0.012, 0.5)

    def simpler(problem, near, far):
        found = replace(bare, problem=problem, fit=linearised(problem, problem.start, 0.012))
        for where, cubic in (("NDE", near), ("DE", far)):
            hard = next(s for s in everyone if s.name == f"hardening_support@{where}")
            found = with_cause(found, hard, Start({"cubic": cubic}))
        return simplified(bare, [settled(found, 0.012, 3)])[1]

    (alike,) = simpler(problem, 2.5e18, 3.5e18)
    assert alike.name == "hardening_support@both"
    assert alike.starts()[0].shared["cubic"] == pytest.approx(3e18, rel=0.1)
    uneven = problem_of(crew, *(f"hardening_support:end={e},cubic={c} N/m^3" for e, c in (("NDE", 1e18), ("DE", 9e18))))
    (two,) = simpler(uneven, 1e18, 9e18)
    assert two.effects == {"hardening_support@NDE", "hardening_support@DE"}
