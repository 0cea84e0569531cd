"""Sizes of causes with their intervals: what a jackknife adds, and a size at the end of what the catalogue allows."""

from dataclasses import replace

import numpy as np
import pytest

from tdbmon.diagnosis.contract import value_and_interval
from tdbmon.diagnosis.parameters import sizes_of
from tests.diagnosis.conftest import GAIN

NAME = "probe_gain@DE_A.gain"


@pytest.fixture
def named(competed):
    return next(each for each in competed if each.name == "probe_gain@DE_A")


def size(contender, *without):
    return sizes_of(contender, without).causes["probe_gain@DE_A"]["gain"]


def test_a_size_that_moves_when_a_drop_is_left_out_is_known_less(named):
    value = size(named).value
    assert size(named).low < GAIN < size(named).high
    once = size(named, {NAME: value + 0.01})
    # n - 1 times the mean square, of two drops; noise alone adds little
    assert (once.high - once.low) / 2 == pytest.approx(1.96 * 0.01, rel=0.05)
    assert size(named, {NAME: value + 0.01}, {NAME: value}).high - value == pytest.approx(
        1.96 * 0.01 / np.sqrt(2), rel=0.05
    )


def test_a_size_at_the_end_of_what_the_catalogue_allows_has_no_interval(named):
    at = [p.name for p in named.problem.parameters].index(NAME)
    point = named.fit.point.copy()
    point[at] = named.problem.high[at]
    stuck = size(replace(named, fit=replace(named.fit, point=point)))
    assert stuck.value == pytest.approx(5.0)  # the greatest gain in the catalogue
    assert stuck.low is None
    assert "may lie beyond" in stuck.why
    assert value_and_interval(stuck.to_json()) == f"5 ({stuck.why})"
