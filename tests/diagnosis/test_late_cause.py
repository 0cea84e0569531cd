"""Causes that show in the rest of the record only, on drops of the same simulator (synthetic)."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tdbmon.diagnosis.contender import settled, with_cause
from tdbmon.diagnosis.held_out import Judge
from tdbmon.diagnosis.late_cause import LateCause, Rest, Trial, departs, explains_the_rest, with_late_causes
from tdbmon.diagnosis.late_record import acts_later, late_records
from tdbmon.diagnosis.sizes import sizes_of
from tdbmon.diagnosis.suspects import Start, suspects
from tdbmon.diagnosis.verdict import Kind, verdict
from tests.diagnosis.simulated import problem_of, settled_plain, with_readings
from tests.diagnosis.test_late_record import made

SPEEDS = ((60.0, 1), (80.0, 2))
EXCESS, SPEED = 0.45, 5.5  # of the static coefficient over the sliding one; m/s
ASKED = ("stribeck_friction@both",)
GROWTH = ("thermal_growth@DE",)


def plain_of(crew, *effects):
    """The plain model fitted to the first contacts of two drops with 0.35 s more of record."""
    return settled_plain(problem_of(crew, *effects, speeds=SPEEDS, seconds=0.35), 0.006, 0.01, 0.014, 0.018)


def named(plain, names):
    machine = plain.problem.model.machine
    return [each for each in suspects(machine, machine.probes, ()) if each.name in names]


@pytest.fixture(scope="module")
def unhidden(crew):
    return plain_of(crew)


def test_friction_that_shows_late_only_is_found_with_place_and_size(crew, monkeypatch):
    # one law and one slip speed of the first trials: a sixth of them
    monkeypatch.setattr("tdbmon.diagnosis.late_cause._SHAPES", (2.0,))
    hidden = f"stribeck_friction:end=both,static_excess={EXCESS},stribeck_speed={SPEED} m/s,law=gaussian"
    plain = plain_of(crew, hidden)
    assert not plain.fails
    late = late_records(plain)
    assert departs(late)
    asked = [each for each in named(plain, ASKED) if each.held["law"] == "gaussian"]
    field, causes = with_late_causes(plain, [plain], late, asked)
    best, cause = field[0], causes[field[0]]
    proof = cause.proof()
    assert best.name == "stribeck_friction@both"
    found = best.starts()[0].shared
    for name, truth in (("static_excess", EXCESS), ("stribeck_speed", SPEED)):
        assert abs(found[name] - truth) < 2 * cause.sigmas[name] < truth
    assert proof.judge is Judge.REST
    assert proof.drops == ("drop_60.nc", "drop_80.nc")
    assert proof.seen
    assert verdict(field, proof, 0.0).kind is Kind.NAMED
    after = [each.in_spread_of(wide) for each, wide in zip(late_records(best), late, strict=True)]
    assert acts_later(after) is None
    assert explains_the_rest(late, after)
    assert not explains_the_rest(after, late)


def test_values_and_their_spread_are_those_of_the_trials_by_how_good_they_are(unhidden):
    """Made-up trials, of which each drop fits another best, and one that the readings contradict."""
    suspect = named(unhidden, GROWTH)[0]
    size = suspect.sizes[0][0]
    bare = Rest((made(4.0, name="a.nc"), made(4.0, name="b.nc")), None)

    def trial(share, first, second, readings=0.0):
        late = (made(first, name="a.nc"), made(second, name="b.nc"))
        return Trial({size.name: share * size.typical}, unhidden.fit.point, readings, Rest(late, None))

    trials = (trial(0.5, 1.1, 1.6), trial(1.0, 1.1, 1.1), trial(2.0, 1.6, 1.1), trial(4.0, 1.0, 1.0, readings=99.0))
    cause = LateCause(unhidden, bare, suspect, trials)
    assert cause.promising
    assert cause.best(cause.drops) is trials[1]
    assert cause.best([0]) in trials[:2]
    share = cause.sigmas[size.name] / size.typical
    assert 0.2 < share < math.log(2)
    # values as bad as without the cause do not count
    worse = LateCause(unhidden, bare, suspect, (trial(0.5, 4.0, 4.0), trials[1], trial(2.0, 4.0, 4.0)))
    assert worse.sigmas[size.name] / size.typical < share / 2
    proof = cause.proof()
    assert proof.plain_misfit == pytest.approx(bare.misfit(cause.drops))
    assert proof.extended_misfit < proof.plain_misfit / 10
    assert [set(each) for each in proof.without] == [{f"{suspect.name}.{size.name}"}] * 2
    assert not LateCause(unhidden, bare, suspect, (trials[3],)).promising


def test_sizes_of_a_late_cause_are_as_wide_as_its_trials(unhidden):
    suspect = named(unhidden, GROWTH)[0]
    size = suspect.sizes[0][0]
    held = settled(
        with_cause(unhidden, suspect, Start({size.name: size.typical}, known={size.name: 1e-3 * size.typical})),
        0.018,
        1,
    )
    name, sigma = f"{suspect.name}.{size.name}", 0.3 * size.typical
    narrow, wide = (sizes_of(held, rest=rest).causes[suspect.name][size.name] for rest in ({}, {name: sigma}))
    assert narrow.value == pytest.approx(size.typical, rel=0.01)
    assert narrow.high - narrow.low < 0.1 * size.typical
    assert wide.high - wide.low == pytest.approx(2 * 1.96 * sigma, rel=0.01)


def test_a_probe_that_drifts_is_explained_by_no_cause(unhidden):
    def drift(since, angle, axes):
        return np.array([[0.0], [0.0], [1.0], [0.0]]) * 3e-5 * np.clip(since / 0.1, 0.0, 1.0)

    plain = replace(unhidden, problem=with_readings(unhidden.problem, drift))
    late = late_records(plain)
    assert departs(late)
    assert with_late_causes(plain, [plain], late, named(plain, GROWTH)) == ([plain], {})


def test_drops_of_the_model_depart_from_nothing(unhidden):
    late = late_records(unhidden)
    assert sum(each.departure for each in late) > 0.1  # it was computed
    assert not departs(late)
    assert not departs(late[:1])
