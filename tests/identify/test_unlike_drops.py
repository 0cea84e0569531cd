"""Drops of a bearing that was changed between them are told, and which; drops of one machine are not (synthetic)."""

import re
from dataclasses import replace

import numpy as np
import pytest

from tdbmon.diagnosis.diagnose import diagnose
from tdbmon.diagnosis.verdict import Kind
from tdbmon.identify.calibrate import fit_drops
from tdbmon.identify.least_squares import linearised
from tdbmon.identify.unlike_drops import unlike_drops
from tests.identify.drops import TRUTH, drop, machine

SPEEDS = (61.0, 97.0, 149.0, 197.0)
SHORT_S = (0.006, 0.01, 0.014, 0.018)


def fitted(gaps):
    """Drops of a machine whose gap at NDE was as given, fitted to the first contacts."""
    records = [
        drop({**TRUTH, "NDE.radial_gap": gap}, speed=speed, seed=k, seconds=0.03)
        for k, (gap, speed) in enumerate(zip(gaps, SPEEDS, strict=True))
    ]
    return fit_drops(machine(), records, SHORT_S)


@pytest.fixture(scope="module")
def alike():
    return fitted([268e-6] * 4)


def as_fitted(calibration):
    return linearised(calibration.problem, calibration.point, calibration.horizon)


def told(calibration):
    return [remark for remark in calibration.remarks if "hardly match" in remark]


def test_drops_of_one_machine_are_alike(alike):
    assert unlike_drops(alike.problem, as_fitted(alike)) == []
    assert told(alike) == []


def test_a_gap_that_changed_between_the_drops_is_told_with_both_sets():
    (remark,) = told(fitted([268e-6, 283e-6, 268e-6, 283e-6]))
    sets = {"drop_61.nc, drop_149.nc", "drop_97.nc, drop_197.nc"}
    high, low = remark.split(": ")[0].split(" hardly match ")
    assert {high, low} == sets
    assert "probe 'NDE_" in remark


def test_one_drop_after_a_change_is_told_from_the_others():
    (remark,) = told(fitted([268e-6, 268e-6, 283e-6, 268e-6]))
    high, low = (set(each.split(", ")) for each in re.split(r" hardly match(?:es)? ", remark.split(": ")[0]))
    assert {"drop_149.nc"} in (high, low)
    assert high | low == {f"drop_{speed:g}.nc" for speed in SPEEDS}


def test_zeros_that_drift_as_usual_are_not_told(alike):
    """Steps just below and above the threshold, put into the fit's zeros of one probe."""
    problem = alike.problem
    names = [p.name for p in problem.parameters]
    at = [k for k, name in enumerate(names) if name == "zero_DE_B"]
    for step, is_told in ((2.9, False), (3.1, True)):
        point = alike.point.copy()
        scale = problem.parameters[at[0]].scale
        point[at] = np.array([0.0, 0.1, step + 0.1, step + 0.2]) * 1e-6 / scale
        said = unlike_drops(problem, replace(as_fitted(alike), point=point))
        assert bool(said) == is_told
        if said:
            assert said[0].startswith("drop_149.nc, drop_197.nc hardly match drop_61.nc, drop_97.nc")


def test_a_drop_without_the_probe_does_not_stand_between_the_others(alike):
    """A zero that nobody read is none: a step of 4 um between two drops is told whatever the third one lacks."""
    problem = alike.problem
    at = [k for k, p in enumerate(problem.parameters) if p.name == "zero_DE_B"][:3]
    lame = problem.drops[2]
    kept = [k for k, probe in enumerate(lame.probes) if probe.name != "DE_B"]
    without = replace(
        lame,
        probes=tuple(lame.probes[k] for k in kept),
        noise=tuple(lame.noise[k] for k in kept),
        reading=lame.reading[kept],
    )
    three = replace(problem, drops=(*problem.drops[:2], without), own=problem.own[:3])
    point = alike.point[: len(three.parameters)].copy()
    point[at] = np.array([-2.0, 2.0, 0.0]) * 1e-6 / problem.parameters[at[0]].scale
    found = as_fitted(alike)
    (said,) = unlike_drops(three, replace(found, point=point, residuals=found.residuals[:3]))
    assert said.startswith("drop_97.nc hardly matches drop_61.nc")
    assert "the zero of probe 'DE_B' is at least 4 um higher" in said


def test_a_single_drop_has_nothing_to_be_unlike(alike):
    one = replace(alike.problem, drops=alike.problem.drops[:1], own=alike.problem.own[:1])
    point = np.concatenate([alike.point[: len(one.shared)], np.full(len(one.own[0]), 20.0)])
    assert unlike_drops(one, linearised(one, one.start, SHORT_S[0])) == []
    assert unlike_drops(one, replace(linearised(one, one.start, SHORT_S[0]), point=point)) == []


def test_a_drop_of_a_machine_with_another_support_fits_far_worse_than_the_others():
    """No zero makes up for that."""
    records = [
        drop({**TRUTH, "DE.support_stiffness": stiffness}, speed=speed, seed=k, seconds=0.03)
        for k, (stiffness, speed) in enumerate(zip((4.4e8, 4.4e8, 3e8, 4.4e8), SPEEDS, strict=True))
    ]
    remark = fit_drops(machine(), records, (*SHORT_S, 0.022)).remarks[0]
    assert re.match(r"drop_149.nc: fits \d+\.\d times worse than the other drops: it is of another machine", remark)


def test_diagnosis_tells_it_too():
    """A zero that drifted by 6 um explains all, so no cause is named."""
    records = [drop(speed=speed, seed=k, seconds=0.026) for k, speed in enumerate(SPEEDS)]
    for record in records[2:]:
        record["DE_A"] = record["DE_A"] + 6e-6
    found = diagnose(machine(), records)
    assert found.verdict.kind is Kind.NONE
    (remark,) = (each for each in found.remarks if "hardly match" in each)
    assert remark.startswith("drop_149.nc, drop_197.nc hardly match drop_61.nc, drop_97.nc")
    assert "probe 'DE_A'" in remark
