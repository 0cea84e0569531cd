"""The search for a cause of the best model's excess."""

import math
from dataclasses import replace

import pytest

from tdbmon.diagnosis.bases import elsewhere, extended_by, only_parts, others_of_the_field
from tdbmon.diagnosis.contender import Contender, plain_of, settled, with_cause
from tdbmon.diagnosis.score import Score
from tdbmon.diagnosis.search import Search, of_size, where_waves_look_likely
from tdbmon.diagnosis.shortlist import promising, siblings_first, worth_fitting
from tdbmon.diagnosis.suspects import Start, suspects
from tdbmon.identify.least_squares import fit, linearised
from tests.diagnosis.made_up import contender
from tests.diagnosis.simulated import problem_of


def test_a_cause_next_to_nothing_may_lead_out_of_a_wrong_minimum(crew, monkeypatch):
    """A suspect whose size ends at zero, but whose fit is better, leaves its other values to the plain model and is dropped."""
    problem = problem_of(crew)
    place = next(k for k, p in enumerate(problem.shared) if p.name == "DE.radial_gap")
    off = problem.start.copy()
    off[place] += 0.5
    stuck = Contender((), problem, linearised(problem, off, 0.012), 0.012, 0.8)
    bare = replace(stuck, fit=fit(problem, problem.start, 0.012))
    assert stuck.misfit > 2 * bare.misfit
    everyone = suspects(problem.model.machine, problem.model.machine.probes, ())
    oval = next(s for s in everyone if s.name == "oval_clearance@DE")
    tiny = with_cause(bare, oval, Start({"amplitude": 1e-8, "angle": 0.3}))
    assert tiny.negligible
    monkeypatch.setattr(
        Search, "_candidates", lambda self, best, horizon, field, thorough: ([] if field else [tiny], False)
    )
    plain, field = Search(stuck, [oval], (0.006, 0.012), lambda _: None).compared(stuck, [], 0.012)
    assert not plain.causes
    assert plain.misfit == pytest.approx(bare.misfit, rel=0.01)
    assert not any(each.causes for each in field)


def test_a_plain_model_that_holds_is_followed_anew_before_a_weak_cause_is_believed(crew, monkeypatch):
    """A better model may only have found the path that the plain one lost within the noise."""
    problem = problem_of(crew)
    bare = Contender((), problem, fit(problem, problem.start, 0.012), 0.012, 0.9)
    place = next(k for k, p in enumerate(problem.shared) if p.name == "DE.radial_gap")
    off = bare.fit.point.copy()
    off[place] += 0.006
    stuck = replace(bare, fit=linearised(problem, off, 0.012))
    assert not stuck.fails
    everyone = suspects(problem.model.machine, problem.model.machine.probes, ())
    oval = next(s for s in everyone if s.name == "oval_clearance@DE")
    weak = with_cause(bare, oval, Start({"amplitude": 2e-6, "angle": 0.3}))
    weak = replace(weak, fit=fit(weak.problem, weak.fit.point, 0.012))
    assert weak.bic < stuck.bic - 20
    monkeypatch.setattr(Search, "_candidates", lambda self, *_: ([weak], frozenset()))
    plain, field = Search(stuck, [oval], (0.006, 0.012), lambda _: None).compared(stuck, [], 0.012)
    assert plain.misfit == pytest.approx(bare.misfit, rel=0.01)
    assert min([plain, *field], key=lambda each: each.bic) is plain


def test_what_else_is_missing_is_sought_beside_the_same_cause_at_another_place_that_comes_near(competed):
    plain = plain_of(competed)
    best = contender(plain, ("hardening_support@NDE",), 100, 1.7)
    near = contender(plain, ("hardening_support@both",), 0, 1.8)
    far = contender(plain, ("hardening_support@DE",), 0, 4.0)
    another = contender(plain, ("loose_support@NDE",), 0, 1.75)
    behind = replace(contender(plain, ("hardening_support@both",), 0, 1.7), horizon=plain.horizon / 2)
    assert elsewhere(best, plain.horizon, [best, near, far, another]) == [near]
    assert elsewhere(best, plain.horizon, [best, far, another, behind]) == []
    assert elsewhere(contender(plain, (), 0, 2.0), plain.horizon, [best, near]) == []


def test_where_nothing_helps_the_best_a_cause_is_sought_beside_the_others_of_the_field(competed, monkeypatch):
    """Of two causes the first may look like a third: a probe's angle leads, where its gain is wrong."""
    plain = replace(plain_of(competed), horizon=0.04)
    best = contender(plain, ("probe_angle@DE_A",), 100, 3.0)
    rival = contender(plain, ("probe_gain@DE_A",), 0, 3.5)
    pair = contender(plain, ("probe_gain@DE_A", "oval_clearance@DE"), 0, 0.9)
    lost = contender(plain, (), 0, 9.0)
    vain = contender(plain, ("shaft_bow@rotor",), 0, 8.0)  # hardly better than the plain model
    assert others_of_the_field(best, lost, 0.04, [best, rival, vain, pair]) == [rival]
    assert others_of_the_field(best, replace(lost, horizon=0.022), 0.04, [best, rival, vain]) == [rival, vain]
    assert others_of_the_field(lost, lost, 0.04, [best, rival]) == []
    asked = []

    def candidates(self, base, *rest):
        asked.append(base.name)
        return ([pair] if base.name == rival.name else []), False

    monkeypatch.setattr(Search, "_candidates", candidates)
    search = Search(lost, (), (0.006, 0.04), lambda _: None)
    assert search._found_beside(best, lost, 0.04, [best, rival], True) == [pair]
    assert asked == [best.name, rival.name]


def test_beside_lobes_that_explain_the_drops_what_is_simpler_is_fitted_from_the_fall_on(competed, monkeypatch):
    """An oval of 3 um, for which values had compensated, ranked behind lobes with a phase of their own in every drop."""
    plain = contender(replace(plain_of(competed), horizon=0.022), (), 0, 1.4)
    lobes = contender(plain, ("ring_out_of_round@DE",), 100, 0.9)
    failing = contender(plain, ("ring_out_of_round@DE",), 100, 1.3)
    oval = contender(plain, ("oval_clearance@DE",), 200, 0.9)
    found = lobes
    monkeypatch.setattr(Search, "_candidates", lambda self, *_: ([found], frozenset()))
    monkeypatch.setattr(Search, "_begun_in_the_fall", lambda self, *_: [])
    monkeypatch.setattr(Search, "_promised_from_the_fall", lambda self, best, best_scores: [oval])
    search = Search(plain, (), (0.006, 0.022), lambda _: None)
    assert search._found_beside(plain, plain, 0.022, [], True) == [lobes, oval]
    assert search._found_beside(plain, plain, 0.022, [], False) == [lobes]
    for found in (failing, oval):
        assert search._found_beside(plain, plain, 0.022, [], True) == [found]


def test_while_paths_have_hardly_parted_another_in_the_place_of_the_last_cause_comes_first(competed, monkeypatch):
    """A support that looked anisotropic until the second contact is loose: the search goes back to the plain model."""
    plain = plain_of(competed)
    early, late = (contender(replace(plain, horizon=h), (), 0, 1.75) for h in (0.018, 0.022))
    best = contender(early, ("support_anisotropy@NDE",), 0, 1.3)
    pair = contender(early, ("probe_gain@DE_A", "support_anisotropy@NDE"), 0, 1.2)
    gain = contender(early, ("probe_gain@DE_A",), 0, 1.6)
    assert extended_by(best, [early, gain, pair, late], 0.018) == [early]
    assert extended_by(pair, [early, gain, best, late], 0.018) == [gain, best]
    assert extended_by(replace(best, horizon=0.022), [late], 0.022) == []
    loose = contender(early, ("loose_support@NDE",), 0, 0.9)
    asked = []

    def candidates(self, base, *rest):
        asked.append(base.name)
        return ([] if base.causes else [loose]), False

    monkeypatch.setattr(Search, "_candidates", candidates)
    search = Search(early, (), (0.006, 0.018), lambda _: None)
    assert search._found_beside(best, early, 0.018, [best], True) == [loose]
    assert asked == [early.name]
    assert search._found_beside(best, early, 0.018, [best], False) == []
    assert asked == [early.name, best.name]  # the plain model had its search at this horizon


def test_a_soft_direction_that_the_plain_model_made_up_for_is_begun_in_the_fall(crew):
    """The plain model is fitted to 18 ms; the contact causes start in the fall."""
    problem = problem_of(crew, "support_anisotropy:end=DE,ratio=0.4,direction=10 deg")
    everyone = suspects(problem.model.machine, problem.model.machine.probes, ())
    fallen = Contender((), problem, fit(problem, problem.start, 0.006, 3), 0.006, 0.9)
    plain = fallen
    horizons = (0.006, 0.01, 0.014, 0.018)
    for horizon in horizons:
        plain = settled(plain, horizon, 3)
    found = Search(fallen, everyone, horizons, lambda _: None)._begun_in_the_fall([plain], 0.018)
    best = min(found, key=lambda each: each.bic)
    assert best.horizon == 0.018
    assert best.name == "support_anisotropy@DE"
    assert best.excess < 0.1 * plain.excess
    ratio = best.starts()[0].shared["ratio"]
    assert min(ratio, 1 / ratio) == pytest.approx(0.4, rel=0.1)


def test_waves_that_explain_most_of_all_and_yet_not_much_are_begun_anew(competed):
    """Their excess decides, and whether another cause explains more."""
    plain = contender(replace(plain_of(competed), floor=0.9), (), 0, 2.9)
    some = contender(plain, ("race_waviness@DE",), 0, 2.3)  # takes away three tenths of the excess
    hardly = contender(plain, ("race_waviness@DE",), 0, 2.7)
    oval = contender(plain, ("oval_clearance@DE",), 0, 2.2)
    assert where_waves_look_likely(plain, [some, hardly]) == {"DE"}
    # the other end counts too where waves explain at least a third as much
    for ratio, ends in ((2.8, {"DE"}), (2.6, {"DE", "NDE"})):
        assert where_waves_look_likely(plain, [some, contender(plain, ("off_sized_ball@NDE",), 0, ratio)]) == ends
    assert not where_waves_look_likely(plain, [hardly])
    assert not where_waves_look_likely(plain, [some, oval])
    assert not where_waves_look_likely(plain, [])


def test_two_causes_with_angles_of_their_own_in_every_drop_never_stand_together(competed):
    plain = plain_of(competed)
    everyone = suspects(plain.problem.model.machine, plain.problem.model.machine.probes, ())
    lobed = next(s for s in everyone if s.name == "ring_out_of_round@DE" and s.held["order"] == 3)
    asked = [s for s in everyone if s.name in ("off_sized_ball@NDE", "ring_out_of_round@NDE", "probe_gain@DE_A")]
    beside_plain = {each.suspect.name for each in worth_fitting(plain, 0.012, asked, [], True)}
    assert beside_plain == {"off_sized_ball@NDE", "ring_out_of_round@NDE", "probe_gain@DE_A"}
    own = tuple({"phase": 0.0} for _ in plain.problem.drops)
    with_lobes = with_cause(plain, lobed, Start({"amplitude": 5e-6}, own))
    beside_lobes = {each.suspect.name for each in worth_fitting(with_lobes, 0.012, asked, [], True)}
    assert beside_lobes == {"probe_gain@DE_A"}


def test_what_is_weak_is_sought_beside_a_plain_model_that_holds_also_where_laws_are_off(crew, monkeypatch):
    """A growth by heat with a signal of 43 times the noise ended as `none`, since stated values had been freed before."""
    problem = problem_of(crew)
    holds = Contender((), problem, fit(problem, problem.start, 0.012), 0.012, 0.9)
    assert not holds.fails
    asked = []
    monkeypatch.setattr(Search, "_candidates", lambda self, *of: (asked.append(of) or [], False))
    search = Search(holds, (), (0.006, 0.012), lambda _: None)
    search.compared(holds, [], 0.012)
    assert len(asked) == 1  # the last common horizon: weak causes may show
    Search(holds, (), (0.006, 0.012), lambda _: None, weak=False).compared(holds, [], 0.012)
    assert len(asked) == 2


def test_an_effect_at_both_ends_and_at_one_go_on_together(competed):
    plain = plain_of(competed)
    both, one, other, ring = (
        contender(plain, (name,), 0, 1.5)
        for name in ("hardening_support@both", "hardening_support@DE", "hardening_support@NDE", "loose_support@DE")
    )
    assert siblings_first([both, ring, one, other]) == [both, one, ring, other]
    assert siblings_first([one, ring, other, both]) == [one, both, ring, other]
    assert siblings_first([one, other, ring]) == [one, other, ring]
    assert siblings_first([ring, both, one]) == [ring, both, one]
    assert siblings_first([]) == []


def test_a_plain_model_that_parts_late_and_little_is_not_searched(competed):
    plain = plain_of(competed)
    late = replace(contender(plain, (), 0, 1.0), horizon=0.055, floor=0.8)
    assert late.fails
    assert only_parts(late)
    assert not only_parts(replace(late, horizon=0.04))
    assert not only_parts(replace(late, floor=0.7))
    assert not only_parts(replace(contender(plain, ("loose_support@DE",), 0, 1.0), horizon=0.055, floor=0.8))
    search = Search(late, (), (0.006, 0.04, 0.055), lambda _: None)
    assert search.compared(late, [], 0.055) == (late, [])
    assert search.rounds == Search.rounds


def test_rounds_are_kept_for_further_causes(competed):
    plain = plain_of(competed)
    named = contender(plain, ("loose_support@DE",), 0, 1.0)
    search = Search(plain, (), (0.006,), lambda _: None)
    assert search.may_ask(plain)
    assert search.may_ask(named)
    search.rounds -= 3
    assert not search.may_ask(plain)
    assert search.may_ask(named)
    search.rounds = 0
    assert not search.may_ask(named)


def test_what_lies_is_begun_beside_the_rival_that_explains_the_fall_best(gained):
    """After the first contact a wrong cause may lead, with values that compensate for the right one; in the fall none can."""
    problem, everyone = gained
    fallen = Contender((), problem, fit(problem, problem.start, 0.006, 3), 0.006, 0.9)

    def with_probe(name, start):
        suspect = next(s for s in everyone if s.name == name)
        return settled(with_cause(fallen, suspect, Start(start)), 0.006, 3)

    right, wrong = with_probe("probe_gain@DE_A", {"gain": 1.05}), with_probe("probe_angle@DE_A", {"error": 0.05})
    assert right.misfit < wrong.misfit - 5
    later = [replace(each, horizon=0.014) for each in (wrong, right)]
    touching = contender(later[0], ("oval_clearance@DE",), 0.0, 1.0)
    search = Search(fallen, everyone, (0.006, 0.014), lambda _: None)
    assert search._best_in_the_fall([touching, *later]).name == right.name
    assert search._best_in_the_fall([touching, later[0]]) is later[0]
    assert search._best_in_the_fall([touching]) is None


def test_a_large_oval_beside_a_lag_is_begun_in_the_fall(crew):
    """By the first contact gap and clearance have compensated for it; it is found from its usual size and several angles."""
    problem = problem_of(
        crew, "oval_clearance:end=DE,amplitude=30 um,angle=75 deg", "channel_lag:probe=NDE_A,delay=1 ms"
    )
    horizons = (0.006, 0.01, 0.014)
    fallen = Contender((), problem, fit(problem, problem.start, 0.006, 3), 0.006, 0.9)
    everyone = suspects(problem.model.machine, problem.model.machine.probes, ())
    lag = next(s for s in everyone if s.name == "channel_lag@NDE_A")
    best = with_cause(fallen, lag, Start({"delay": 1e-3}))
    for horizon in horizons:
        best = settled(best, horizon, 3)
    assert best.fails
    search = Search(fallen, [s for s in everyone if s.lies and s.where == "DE"], horizons, lambda _: None)
    found = search._begun_in_the_fall([best], 0.014)[0]
    assert found.name == "channel_lag@NDE_A + oval_clearance@DE"
    assert not found.fails
    assert found.starts()[1].shared["amplitude"] > 20e-6  # no better known from the first contact of two drops
    # an excess beside a lag is due to another cause; beside a contact cause an oval is sought like all others
    search.suspects = ()
    assert search._found_beside(contender(best, ("loose_support@DE",), 0.0, 3.0), best, 0.014, [], True) == []


def test_of_weak_causes_those_are_fitted_from_the_fall_on_whose_scores_are_plain(competed, crew):
    plain = plain_of(competed)
    everyone = suspects(plain.problem.model.machine, plain.problem.model.machine.probes, ())

    def score(name, gain, each=()):
        suspect = next(s for s in everyone if s.name == name)
        return Score(suspect, gain, 1e4, Start({size.name: size.typical for size, _ in suspect.sizes}, each))

    phases = tuple({"phase": 0.0} for _ in range(4))
    waves, more = score("race_waviness@DE", 230, phases), score("race_waviness@DE", 225, phases)
    grown, hard = score("thermal_growth@NDE", 220), score("hardening_support@DE", 150)
    price = math.log(plain.fit.count)
    assert 150 < waves.beyond(price) < grown.beyond(price)  # each phase per drop costs its price
    assert promising(plain, [waves, more, grown, hard]) == [grown, waves]
    assert promising(plain, [more, hard]) == [more]
    assert promising(plain, [hard]) == []


def test_what_explains_clearly_less_than_a_cause_next_to_nothing_imitates_it(crew):
    """A gain of 0.3 %: crosstalk explained less, but its size is not negligible, so it alone stayed."""
    problem = problem_of(crew)
    plain = Contender((), problem, fit(problem, problem.start, 0.006, 1), 0.006, 0.9)
    everyone = suspects(problem.model.machine, problem.model.machine.probes, ())

    def found(name, size, misfit):
        suspect = next(s for s in everyone if s.name == name)
        wider = with_cause(plain, suspect, Start({suspect.sizes[0][0].name: size}))
        return replace(wider, fit=replace(wider.fit, misfit=misfit))

    failing = replace(plain, fit=replace(plain.fit, misfit=1.3 * plain.fit.count))
    gain = found("probe_gain@DE_A", 1.0005, 1.2 * plain.fit.count)
    near, far = (found("probe_crosstalk@DE", 0.02, gain.misfit + more) for more in (5.0, 50.0))
    assert gain.negligible and not near.negligible
    assert of_size([gain, near], failing) == [near]
    assert of_size([gain, far], failing) == []
    explains = replace(gain, fit=replace(gain.fit, misfit=0.9 * plain.fit.count))
    assert of_size([explains, far], failing) == [explains, far]
