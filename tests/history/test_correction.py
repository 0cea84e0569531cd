"""Corrected probabilities of quantities looked at together, by hand."""

from __future__ import annotations

import gc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from statsmodels.stats.multitest import multipletests

from tdbmon.history.correction import corrected


@pytest.mark.parametrize(
    ("method", "expected"),
    [("holm", [3 * 0.01, 2 * 0.03, 2 * 0.03]), ("fdr_bh", [3 * 0.01, 3 / 3 * 0.04, 3 / 3 * 0.04])],
)
def test_probabilities_are_corrected_for_their_number(method, expected):
    """Of 0.01, 0.04 and 0.03; none is below that of a smaller one (Holm), or above that of a larger one."""
    assert corrected([0.01, 0.04, 0.03], method) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("method", ["holm", "fdr_bh"])
def test_none_is_above_one(method):
    assert corrected([0.9, 0.8], method) == pytest.approx([1.0, 1.0] if method == "holm" else [0.9, 0.9])


def test_nothing_to_correct_is_nothing():
    assert corrected([], "holm") == []


@pytest.fixture(scope="module")
def no_garbage():
    """statsmodels collects all garbage at every call, which takes long beside the records of other tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gc, "collect", lambda *_: 0)
        yield


@pytest.mark.parametrize("method", ["holm", "fdr_bh"])
@given(p=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=30))
def test_they_are_those_of_statsmodels(method, p, no_garbage):
    np.testing.assert_allclose(corrected(p, method), multipletests(p, method=method)[1], rtol=1e-12, atol=1e-300)
