"""Causes that show in the rest of the record only, on drops of the same simulator (synthetic)."""

from dataclasses import replace

import numpy as np

from tdbmon.diagnosis.held_out import Judge
from tdbmon.diagnosis.late_cause import departs, explains, with_late_causes
from tdbmon.diagnosis.late_record import acts_later, late_records
from tdbmon.diagnosis.suspects import suspects
from tdbmon.diagnosis.verdict import Kind, verdict
from tests.diagnosis.simulated import problem_of, settled_plain, with_readings

SPEEDS = ((60.0, 1), (80.0, 2))
EXCESS, SPEED = 0.4, 6.0  # of the static coefficient over the sliding one; m/s
ASKED = ("stribeck_friction@both",)
GROWTH = ("thermal_growth@DE",)


def plain_of(crew, *effects):
    """The plain model at the first contacts of two drops that have 0.35 s more."""
    return settled_plain(problem_of(crew, *effects, speeds=SPEEDS, seconds=0.35), 0.006, 0.01, 0.014, 0.018)


def named(plain, names):
    machine = plain.problem.model.machine
    return [each for each in suspects(machine, machine.probes, ()) if each.name in names]


def test_friction_that_shows_late_only_is_found_with_place_and_size(crew, monkeypatch):
    # one of the laws and of the speeds that are tried first: a sixth of the trials
    monkeypatch.setattr("tdbmon.diagnosis.late_cause._SHAPES", (2.0,))
    hidden = f"stribeck_friction:end=both,static_excess={EXCESS},stribeck_speed={SPEED},law=gaussian"
    plain = plain_of(crew, hidden)
    assert not plain.fails
    assert departs(late_records(plain))
    asked = [each for each in named(plain, ASKED) if each.held["law"] == "gaussian"]
    field, cause = with_late_causes(plain, [plain], late_records(plain), asked)
    best, proof = field[0], cause.proof()
    assert best.name == "stribeck_friction@both"
    assert abs(best.starts()[0].shared["static_excess"] - EXCESS) < 2 * cause.sigmas["static_excess"] < EXCESS
    assert proof.judge is Judge.REST
    assert proof.drops == ("drop_60.nc", "drop_80.nc")
    assert proof.seen
    assert verdict(field, proof, 0.0).kind is Kind.NAMED
    assert acts_later(late_records(best)) is None
    assert explains(late_records(plain), late_records(best))
    assert not explains(late_records(best), late_records(plain))


def test_a_probe_that_drifts_is_explained_by_no_cause(crew):
    def drift(since, angle, axes):
        return np.array([[0.0], [0.0], [1.0], [0.0]]) * 3e-5 * np.clip(since / 0.1, 0.0, 1.0)

    plain = plain_of(crew)
    plain = replace(plain, problem=with_readings(plain.problem, drift))
    late = late_records(plain)
    assert departs(late)
    assert with_late_causes(plain, [plain], late, named(plain, GROWTH)) == ([plain], None)


def test_drops_of_the_model_depart_from_nothing(crew):
    late = late_records(plain_of(crew))
    assert sum(each.departure for each in late) > 0.1  # it was computed
    assert not departs(late)
    assert not departs(late[:1])
