"""A probe that drifts, on drops of the same simulator (synthetic)."""

import re

import numpy as np
import pytest

from tdbmon.diagnosis.drifting_probe import drifting_probe
from tests.diagnosis.made_up import contender
from tests.diagnosis.simulated import problem_of, settled_plain, with_readings

HORIZONS = (0.006, 0.01, 0.014, 0.018, 0.022)
END_S = HORIZONS[-1]
DRIFT = -6e-6  # m at the end, of which the model's values take up some tenths of a micrometre


@pytest.fixture(scope="module")
def drifted(crew):
    """The plain model fitted to drops in which one probe drifts, not by a parabola."""

    def drift(since, angle, axes):
        moved = DRIFT * (1 - np.exp(-np.maximum(since, 0.0) / 0.03)) / (1 - np.exp(-END_S / 0.03))
        return np.array([[0.0], [0.0], [0.0], [1.0]]) * moved

    return settled_plain(with_readings(problem_of(crew), drift), *HORIZONS)


def test_a_probe_that_drifts_is_told_with_how_far(drifted):
    assert drifted.fails
    said = drifting_probe(drifted, drifted, HORIZONS)
    told = re.match(r"probe 'DE_B' drifts: 22 ms after the release it reads (-[\d.]+) um more than at the release", said)
    assert told and float(told[1]) * 1e-6 == pytest.approx(DRIFT, rel=0.15)


@pytest.mark.parametrize(
    ("cause", "left", "told"), [("thermal_growth@NDE", 0.7, False), ("race_waviness@NDE", 0.7, True)]
)
def test_a_cause_that_leaves_less_than_a_drift_is_likelier_but_for_one_that_fits_much(drifted, cause, left, told):
    """A growth by heat left a sum of squares 2200 less than a drift, but the drift was reported."""
    best = contender(drifted, (cause,), 0, left)
    assert not best.fails
    assert (drifting_probe(drifted, best, HORIZONS) is not None) == told


def test_a_drift_that_leaves_less_than_a_cause_is_told_instead_of_it(drifted):
    best = contender(drifted, ("thermal_growth@NDE",), 0, 1.15 * drifted.floor)
    assert not best.fails
    assert drifting_probe(drifted, best, HORIZONS) is not None


def test_an_oval_clearance_is_no_drift(crew):
    plain = settled_plain(problem_of(crew, "oval_clearance:end=DE,amplitude=20 um"), *HORIZONS)
    assert plain.fails
    assert drifting_probe(plain, plain, HORIZONS) is None


def test_one_probe_with_a_wrong_gain_is_no_drift(crew):
    plain = settled_plain(problem_of(crew, "probe_gain:probe=DE_B,gain=1.05"), *HORIZONS)
    assert plain.fails
    assert drifting_probe(plain, plain, HORIZONS) is None


def test_where_the_plain_model_leaves_noise_alone_nothing_drifts(crew):
    plain = settled_plain(problem_of(crew), *HORIZONS)
    assert not plain.fails
    assert drifting_probe(plain, plain, HORIZONS) is None
