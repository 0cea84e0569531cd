"""Runs of True in a mask, at its edges too."""

from __future__ import annotations

import numpy as np
import pytest

from tdbmon.runs import runs_of


@pytest.mark.parametrize(
    ("mask", "runs"),
    [("", []), ("...", []), ("###", ["###"]), ("#..##.", ["#", "##"]), (".#.###", ["#", "###"])],
)
def test_runs_are_the_stretches_of_true(mask, runs):
    held = np.array([letter == "#" for letter in mask], dtype=bool)
    found = runs_of(held)
    assert [mask[run] for run in found] == runs
    assert len(found) == len(runs) and found.total == sum(map(len, runs))
    assert found.longest == max(map(len, runs), default=0)
    np.testing.assert_array_equal(found.mask(len(mask)), held)
