"""The verdict of a contest, on models of made-up misfit."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tdbmon.diagnosis.contender import Contender, plain_of, with_cause
from tdbmon.diagnosis.contract import causes_json
from tdbmon.diagnosis.diagnose import Diagnosis
from tdbmon.diagnosis.held_out import HeldOut, Judge, together
from tdbmon.diagnosis.next_test import next_test
from tdbmon.diagnosis.probability import little_gained, wrong_by
from tdbmon.diagnosis.suspects import Start, suspects
from tdbmon.diagnosis.verdict import Kind, clear_of_nothing, doubted, strained, verdict
from tdbmon.estimate import Estimate
from tdbmon.identify.least_squares import Fit, fit
from tdbmon.identify.parameters import stated_parameters
from tests.diagnosis.made_up import contender
from tests.diagnosis.simulated import problem_of


def test_verdicts(competed):
    plain = plain_of(competed)

    def judged(*field):
        return verdict(sorted(field, key=lambda each: each.bic), None)

    bare = contender(plain, (), 0, 8.0)
    gain = contender(plain, ("probe_gain@DE_A",), 0, 0.9)
    angle = contender(plain, ("probe_angle@DE_A",), -4, 0.9)
    assert judged(bare, gain).kind is Kind.NAMED
    both = judged(bare, gain, angle)
    assert both.kind is Kind.AMBIGUOUS
    assert {c.name for each in both.accused for c in each.causes} == {"probe_gain@DE_A", "probe_angle@DE_A"}
    assert judged(bare, contender(plain, ("probe_gain@DE_A",), 0, 4.0)).kind is Kind.UNKNOWN
    assert judged(contender(plain, (), 0, 0.9)).kind is Kind.NONE
    assert isinstance(plain, Contender)
    assert math.isfinite(plain.bic)


def test_an_angle_and_a_leak_of_one_end_need_a_longer_lead_over_each_other(competed):
    """The two differ by the square of their size; a cause at the other end or in contacts differs by more."""
    plain = plain_of(competed)
    lost = contender(plain, (), 0, 8.0)
    angle = contender(plain, ("probe_angle@DE_A",), 900, 0.95)

    def judged(name, behind):
        return verdict([angle, contender(plain, (name,), 900 - behind, 0.95), lost], None)

    beside_a_leak = judged("probe_crosstalk@DE", 300)
    assert beside_a_leak.kind is Kind.AMBIGUOUS
    assert beside_a_leak.probabilities[0] > 2 * beside_a_leak.probabilities[1]
    assert judged("probe_crosstalk@DE", 900).kind is Kind.NAMED
    assert judged("probe_crosstalk@NDE", 300).kind is Kind.NAMED
    assert judged("oval_clearance@DE", 300).kind is Kind.NAMED


def test_what_acts_in_contacts_and_cannot_be_proved_beside_a_plain_model_that_explains_is_not_named(competed):
    plain = plain_of(competed)
    bare = contender(plain, (), 0, 0.92 * plain.floor)
    oval = contender(plain, ("oval_clearance@DE",), 0, 0.85 * plain.floor)
    gain = contender(plain, ("probe_gain@DE_A",), 0, 0.85 * plain.floor)
    little = HeldOut(("drop_80.nc",), 3.1e-7, 3.0e-7, 3.0e-7, 1000.0, 980.0)
    by_chance = replace(little, plain_misfit=1040.0)  # hardly more than noise is left: paths may have diverged
    much = replace(little, plain=5e-7, plain_misfit=1300.0)
    assert verdict([oval, bare], None).kind is Kind.NAMED  # one drop by itself, which proves nothing
    assert sum(verdict([oval, bare], None).probabilities) < 0.86
    assert verdict([oval, bare], little).kind is Kind.NONE
    assert verdict([oval, bare], by_chance).kind is Kind.NONE
    assert verdict([gain, bare], by_chance).kind is Kind.NAMED
    assert verdict([oval, bare], much).kind is Kind.NAMED
    assert verdict([gain, bare], little).kind is Kind.NAMED
    lost = contender(plain, (), 0, 8.0)
    assert verdict([oval, lost], little).kind is Kind.NAMED


def test_a_cause_too_weak_for_readings_is_proved_by_two_drops_held_out_and_is_less_probable(competed):
    """Waves of 0.8 um: the rms in readings was 0.26 um with and without them, the misfit 5 and 6 % less with them."""
    plain = plain_of(competed)
    bare = contender(plain, (), 0, 0.92 * plain.floor)
    field = [contender(plain, ("oval_clearance@DE",), 100, 0.85 * plain.floor), bare]
    one = HeldOut(("drop_80.nc",), 2.6e-7, 2.5e-7, 2.4e-7, 3000.0, 2800.0)
    in_both = together([one, replace(one, drops=("drop_120.nc",))])
    in_one = together([one, replace(one, drops=("drop_120.nc",), extended_misfit=2950.0)])
    assert in_both.gain is None
    assert verdict(field, one).kind is verdict(field, in_one).kind is Kind.NONE
    named = verdict(field, in_both)
    assert named.kind is Kind.NAMED
    assert named.probabilities[0] < 0.51
    assert "not in the readings" in (little_gained(in_both) or "")
    assert little_gained(in_one) is None


def test_waves_that_no_reading_shows_are_none_though_they_do_better_in_every_drop(competed):
    """Of the misfit, 0.4 um with nothing hidden took away 4, 10, 2 and 1 %; true waves of 1.4 um 4.3, 4.5, 5.8 and 0.5 %."""
    plain = plain_of(competed)
    bare = contender(plain, (), 0, 0.92 * plain.floor)
    waves = contender(plain, ("race_waviness@DE",), 300, 0.85 * plain.floor)
    left = [
        HeldOut((f"{k}.nc",), 4.7e-7, 4.6e-7, 4.6e-7, 3500.0, 3500.0 * (1 - share))
        for k, share in enumerate((0.04, 0.1, 0.06, 0.06))
    ]
    assert verdict([waves, bare], together(left)).kind is Kind.NONE
    assert verdict([waves, bare], together(left[1:])).kind is Kind.NONE
    stiff = contender(plain, ("hardening_support@DE",), 300, 0.85 * plain.floor)
    assert verdict([stiff, bare], together(left[1:])).kind is Kind.NAMED


def test_a_cause_that_the_rest_of_one_drop_shows_is_less_probable(competed):
    plain = plain_of(competed)
    field = [contender(plain, ("ring_drag@NDE",), 200, 0.9), contender(plain, (), 0, 0.9)]
    half = HeldOut(("a.nc", "b.nc"), 3.4e-6, 1.9e-6, 4.1e-6, 13.2, 2.2, judge=Judge.REST)
    assert half.gain is None
    assert half.seen
    named = verdict(field, half, 0.0)
    assert named.kind is Kind.NAMED
    assert named.probabilities[0] < 0.51
    assert verdict(field, replace(half, extended_misfit=7.0), 0.0).kind is Kind.NONE
    clear = verdict(field, replace(half, plain=8.1e-6, extended=3.3e-6, noise=3.0e-6), 0.0)
    assert clear.probabilities[0] > 0.9


def test_beside_a_plain_model_that_explains_what_acts_on_the_shaft_must_gain_half(competed):
    """Nothing hidden, strange laws: a cross-coupled stiffness gained a third; so may a bow."""
    plain = plain_of(competed)
    little = HeldOut(("drop_80.nc",), 5.5e-7, 5.0e-7, 4e-7, 3000.0, 2700.0)
    assert little.gain == pytest.approx(1 / 3)
    bare, lost = contender(plain, (), 0, 1.02), contender(plain, (), 0, 8.0)
    for name, kind in (("shaft_bow@rotor", Kind.NONE), ("probe_gain@DE_A", Kind.NAMED)):
        assert {cause.name for cause in contender(plain, (name,), 0, 0.9).causes} == {name}
        assert verdict([contender(plain, (name,), 500, 0.9), bare], little).kind is kind
        assert verdict([contender(plain, (name,), 500, 0.9), bare], replace(little, extended=4.4e-7)).kind is Kind.NAMED
        assert verdict([contender(plain, (name,), 500, 0.9), lost], little).kind is Kind.NAMED


def test_a_named_cause_that_gains_little_on_a_drop_held_out_is_less_probable(competed):
    plain = plain_of(competed)
    field = [contender(plain, ("probe_gain@DE_A",), 0, 0.9), contender(plain, (), 0, 8.0)]
    much = HeldOut(("drop_80.nc",), 9e-7, 4e-7, 3e-7, 9000.0, 2000.0)
    little = replace(much, extended=4.5e-7)
    assert little.gain < 0.8 < much.gain
    by_much, by_little = verdict(field, much), verdict(field, little)
    assert by_much.kind is by_little.kind is Kind.NAMED
    alone = verdict(field, None)
    assert by_little.probabilities[0] < alone.probabilities[0] < by_much.probabilities[0]
    assert by_little.probabilities[0] < 0.5 < by_much.probabilities[0]
    none = [contender(plain, (), 0, 0.9)]
    assert verdict(none, little).probabilities == verdict(none, much).probabilities


def test_nobody_is_accused_beside_a_plain_model_that_is_nearly_as_likely(competed):
    plain = plain_of(competed)
    bare = contender(plain, (), 0, 0.95 * plain.floor)
    little, far = (contender(plain, ("probe_gain@DE_A",), ahead, 0.95 * plain.floor) for ahead in (70, 200))
    assert verdict([little, bare], None).kind is Kind.NONE
    assert verdict([little, bare], None, lead=0.0).accused == (little,)  # few suspects were tried
    assert verdict([far, bare], None).kind is Kind.NAMED
    assert not verdict([far, bare], None).or_nothing
    nearly = verdict([contender(plain, ("probe_gain@DE_A",), 105, 0.95 * plain.floor), bare], None)
    assert (nearly.kind, len(nearly.accused), nearly.or_nothing) == (Kind.AMBIGUOUS, 1, True)
    lost = contender(plain, (), 0, 2.5)
    assert verdict([little, lost], None).kind is Kind.NAMED


def test_what_has_an_angle_of_its_own_in_every_drop_must_take_away_half_of_what_is_left_there(competed):
    plain = plain_of(competed)
    lost = contender(plain, (), 0, 8.0)
    lobed = contender(plain, ("ring_out_of_round@DE",), 0, 0.95)
    oval = contender(plain, ("oval_clearance@DE",), 0, 0.95)
    little = HeldOut(("drop_80.nc",), 9e-7, 7.5e-7, 3e-7, 9000.0, 7000.0)
    much = replace(little, extended=4e-7, extended_misfit=2000.0)
    assert little.gain == pytest.approx(0.25)
    refuted = verdict([lobed, lost], little)
    assert refuted.kind is Kind.UNKNOWN
    assert max(refuted.probabilities) < 0.04  # it was 96 %, with 4 % for causes outside the catalogue
    assert refuted.leading([lobed, lost]) is lobed
    assert verdict([oval, lost], little).kind is Kind.NAMED
    assert verdict([lobed, lost], much).kind is Kind.NAMED
    explained = contender(plain, (), 900, 1.4)
    assert verdict([lobed, explained], little).kind is Kind.NONE
    unseen = replace(much, plain=3.3e-7, extended=3.1e-7)  # only speed and levitation show it, not the readings
    assert unseen.gain is None
    assert verdict([lobed, lost], unseen).kind is Kind.UNKNOWN


def test_what_fits_much_and_fails_further_on_is_one_of_those_that_look_alike_so_far(competed):
    plain = plain_of(competed)
    everyone = suspects(plain.problem.model.machine, plain.problem.model.machine.probes, ())
    lost, proof = contender(plain, (), 0, 8.0), HeldOut(("drop_80.nc",), 9e-7, 4e-7, 3e-7, 9000.0, 2000.0)
    for name, kind in (("off_sized_ball@DE", Kind.AMBIGUOUS), ("oval_clearance@DE", Kind.NAMED)):
        held = contender(plain, (name,), 0, 0.95)
        assert verdict([held, lost], proof, suspects=everyone).kind is Kind.NAMED
        failed = replace(held, failed_s=0.033)
        judged = verdict([failed, lost], proof, suspects=everyone)
        assert judged.kind is kind
        assert judged.accused == (failed,)
        assert ("not the first 33 ms" in judged.why) == bool(judged.alike) == (kind is Kind.AMBIGUOUS)


def test_causes_that_look_alike_share_a_probability_with_the_one_that_was_fitted(competed):
    plain = plain_of(competed)
    everyone = suspects(plain.problem.model.machine, plain.problem.model.machine.probes, ())
    waves = next(s for s in everyone if s.name == "race_waviness@NDE" and s.standing_waves)
    foundation = next(s for s in everyone if s.name == "foundation_mode@DE")
    both = with_cause(plain, waves, Start({**waves.usual_values, "phase": 0.0}))
    both = with_cause(both, foundation, Start(foundation.usual_values))
    both = replace(both, failed_s=0.027, fit=replace(both.fit, misfit=0.95 * both.fit.count))
    field = (both, contender(plain, (), 0, 8.0))
    judged = verdict(field, None, suspects=everyone)
    assert [{c.name for c in each.causes} for each in judged.alike] == [
        {"off_sized_ball@NDE", "foundation_mode@DE"},
        {"ring_out_of_round@NDE", "foundation_mode@DE"},
    ]
    found = causes_json(SimpleNamespace(contenders=field, verdict=judged, parameters={}))
    shares = {f"{each['effect']}@{each['where']}": each["probability"] for each in found}
    assert shares.pop("foundation_mode@DE") == pytest.approx(0.6)
    assert shares == pytest.approx(
        dict.fromkeys(("race_waviness@NDE", "off_sized_ball@NDE", "ring_out_of_round@NDE"), 0.2)
    )
    (unfitted,) = (each["parameters"]["deviation_um"] for each in found if each["effect"] == "off_sized_ball")
    assert unfitted["value"] is None
    assert "not fitted" in unfitted["why"]
    assert "dial gauge" in next_test(judged, field)


def test_nobody_is_accused_who_leaves_most_of_the_little_that_the_plain_model_leaves(competed):
    plain = plain_of(competed)
    bare = contender(plain, (), 0, 1.4)
    gain = contender(plain, ("probe_gain@DE_A",), 0, 1.25)
    assert gain.fails
    assert verdict([gain, bare], None).kind is Kind.NONE
    assert verdict([contender(plain, ("probe_gain@DE_A",), 0, 0.95), bare], None).kind is Kind.NAMED


def test_what_a_cause_has_beside_its_size_does_not_make_it_clear(competed):
    plain = plain_of(competed)
    friction, *_ = contender(plain, ("stribeck_friction@DE",), 0, 0.9).causes
    speed = {"stribeck_speed_m_per_s": Estimate(1.5, 1.2, 1.8, "m/s")}
    assert not clear_of_nothing(friction, speed | {"static_excess": Estimate(0.19, -0.22, 0.6, "1")})
    assert clear_of_nothing(friction, speed | {"static_excess": Estimate(0.17, 0.08, 0.25, "1")})
    # at the limit of its range where the effect is off, it has no interval
    assert not clear_of_nothing(friction, speed | {"static_excess": Estimate(0.0, why="at its bound")})
    assert clear_of_nothing(friction, speed | {"static_excess": Estimate(0.9, why="at its bound")})


def test_a_size_that_may_as_well_be_none_is_not_named(competed):
    plain = contender(plain_of(competed), (), 0, 0.95)
    gain = contender(plain, ("probe_gain@DE_A",), 900, 0.9)
    named = verdict([gain, plain], None)
    assert named.kind is Kind.NAMED

    def sized(low, high):
        return {"probe_gain@DE_A": {"gain": Estimate((low + high) / 2, low, high)}}

    little = HeldOut(("drop_80.nc",), 4e-7, 3.8e-7, 3e-7, 4000.0, 3900.0)
    much = replace(little, extended=3.1e-7, extended_misfit=2000.0)
    assert doubted(named, plain, sized(1.02, 1.06), None).kind is Kind.NAMED
    assert doubted(named, plain, sized(0.98, 1.06), None).kind is Kind.NONE
    assert doubted(named, plain, sized(0.98, 1.06), little).kind is Kind.NONE
    assert doubted(named, plain, sized(0.98, 1.06), much).kind is Kind.NAMED
    assert doubted(named, contender(plain, (), 0, 8.0), sized(0.98, 1.06), None).kind is Kind.NAMED


def test_a_cause_that_explains_a_drop_which_the_plain_model_does_not_is_there_though_the_others_know_no_size(competed):
    like = plain_of(competed)
    plain = contender(like, (), 0, 1.3)
    gain = contender(like, ("probe_gain@DE_A",), 900, 0.9)
    quiet = tuple(np.full(len(each), 0.9) for each in like.fit.residuals)
    gain = replace(gain, fit=replace(gain.fit, residuals=quiet))
    plain = replace(plain, fit=replace(plain.fit, residuals=quiet))
    loud = np.full(len(quiet[0]), 1.8)
    failing = replace(plain, fit=replace(plain.fit, residuals=(loud, *quiet[1:])))
    assert max(failing.fit.ratio_of_drops) > 1.6 > max(gain.fit.ratio_of_drops)
    little = HeldOut(("drop_80.nc",), 4e-7, 3.7e-7, 3e-7, 4000.0, 3500.0)
    assert little.clear and not little.seen
    named = verdict([gain, failing], little)
    assert named.kind is Kind.NAMED
    none = {"probe_gain@DE_A": {"gain": Estimate(1.01, 0.98, 1.04)}}
    assert doubted(named, plain, none, little).kind is Kind.NONE
    assert doubted(named, failing, none, little).kind is Kind.NAMED
    assert doubted(named, failing, none, replace(little, extended_misfit=3900.0)).kind is Kind.NONE
    assert doubted(named, failing, none, None).kind is Kind.NONE


def test_a_number_of_its_own_in_every_drop_is_no_proof_of_a_size_that_may_be_none(competed):
    plain = contender(plain_of(competed), (), 0, 0.95)
    ball = contender(plain, ("off_sized_ball@DE",), 900, 0.9)
    assert ball.drop_specific
    much = HeldOut(("drop_80.nc",), 4e-7, 3.1e-7, 3e-7, 4000.0, 2000.0)
    assert much.seen
    named = verdict([ball, plain], much)
    assert named.kind is Kind.NAMED
    size = ball.causes[0].sizes[0][0].name

    def sized(low, high):
        return {"off_sized_ball@DE": {size: Estimate((low + high) / 2, low, high, "um")}}

    assert doubted(named, plain, sized(-0.4e-6, 2.5e-6), much).kind is Kind.NONE
    assert doubted(named, plain, sized(0.4e-6, 2.5e-6), much).kind is Kind.NAMED


def test_what_looks_alike_leaves_no_more_than_certainty_to_the_others(competed):
    """Three look-alikes share 0.6; a rival nearly as likely as the fitted one has the rest at most."""
    plain = plain_of(competed)
    everyone = suspects(plain.problem.model.machine, plain.problem.model.machine.probes, ())
    ball = replace(contender(plain, ("off_sized_ball@DE",), 10, 0.95), failed_s=0.033)
    rival = contender(plain, ("support_anisotropy@DE",), 9, 0.95)
    judged = verdict([ball, rival, contender(plain, (), 0, 8.0)], None, suspects=everyone)
    assert judged.alike
    assert judged.probabilities[0] == pytest.approx(0.2)
    assert 0 < judged.probabilities[1] <= 0.4
    assert sum(judged.probabilities) + sum(each.probability for each in judged.alike) <= 1
    # its values are reported, though the rival has more than its share
    field = (ball, rival, contender(plain, (), 0, 8.0))
    told = Diagnosis(plain.problem.model.machine, judged, field, None, {}, {}, None, None, None, "", (), 1.0)
    assert judged.probabilities[1] > judged.probabilities[0] and told.best is ball
    alone = verdict([ball, rival, contender(plain, (), 0, 8.0)], None)
    assert alone.probabilities[0] == pytest.approx(0.6)
    assert sum(alone.probabilities) <= 1


def test_waves_of_two_orders_that_are_as_likely_are_one_cause_with_the_values_of_the_likelier_order(crew):
    problem = problem_of(crew)
    bare = Contender((), problem, fit(problem, problem.start, 0.006, 1), 0.006, 0.9)
    everyone = suspects(problem.model.machine, problem.model.machine.probes, ())

    def waves(order, amplitude, bic_less):
        suspect = next(
            s
            for s in everyone
            if s.name == "race_waviness@DE" and s.held["order"] == order and s.held["race"] == "outer"
        )
        found = with_cause(bare, suspect, Start({"amplitude": amplitude, "phase": 0.1}))
        made = Fit(found.fit.point, found.fit.residuals, found.fit.slopes, 0.9 * found.fit.count - bic_less)
        return replace(found, fit=made)

    likelier, other = waves(3.0, 5e-6, 10), waves(4.0, 9e-6, 4)
    lost = replace(bare, fit=Fit(bare.fit.point, bare.fit.residuals, bare.fit.slopes, 9.0 * bare.fit.count))
    field = (other, lost, likelier)
    judged = verdict(field, None)
    assert judged.kind is Kind.NAMED
    assert judged.accused == (likelier, other)
    sizes = {
        each: {"race_waviness@DE": {"amplitude": Estimate(um, unit="um")}}
        for each, um in ((likelier, 5e-6), (other, 9e-6))
    }
    (cause,) = causes_json(SimpleNamespace(verdict=judged, contenders=field, parameters=sizes))
    assert cause["held"]["order"] == 3
    assert cause["parameters"]["amplitude_um"]["value"] == pytest.approx(5)
    assert cause["probability"] == pytest.approx(judged.probabilities[0] + judged.probabilities[2])
    assert cause["probability"] > 0.99 * (1 - wrong_by(None))


def test_a_cause_in_contacts_is_unknown_where_stated_values_had_to_go_to_their_limits(competed):
    plain = plain_of(competed)

    def with_stated(name, limits):
        """The cause with stated values free, `limits` of them at a limit."""
        cause = contender(plain, (name,), 900, 0.9)
        problem = cause.problem
        stated = stated_parameters(problem.model.machine)
        count = len(problem.shared)
        wider = replace(problem, shared=(*problem.shared, *stated))
        begin = np.insert(cause.fit.point, [count] * len(stated), 0.0)
        begin[count : count + limits] = wider.high[count : count + limits]
        return replace(cause, problem=wider, fit=replace(cause.fit, point=begin))

    def judged(name, limits):
        return strained(verdict([with_stated(name, limits), contender(plain, (), 0, 8.0)], None))

    assert judged("oval_clearance@DE", 2).kind is Kind.NAMED
    bent = judged("oval_clearance@DE", 3)
    assert bent.kind is Kind.UNKNOWN
    assert not bent.accused
    assert "only with 3 values" in bent.why and "NDE.contact_stiffness" in bent.why
    assert judged("probe_gain@DE_A", 3).kind is Kind.NAMED
