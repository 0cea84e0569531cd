"""Corrected probabilities are those of statsmodels, without its garbage collection."""

from __future__ import annotations

import gc

import numpy as np
import pytest
from statsmodels.stats.multitest import multipletests

from tdbmon.history.correction import corrected
from tests.history.test_compare import add, judged


@pytest.mark.parametrize("method", ["holm", "fdr_bh"])
@pytest.mark.parametrize("number", [1, 2, 31])
def test_probabilities_are_corrected_as_statsmodels_does(number, method):
    rng = np.random.default_rng(number)
    for _ in range(4):
        p = rng.uniform(size=number) ** 3
        p[: number // 2] = np.round(p[: number // 2], 1)  # ties
        assert corrected(p.tolist(), method) == pytest.approx(multipletests(p, 0.05, method)[1].tolist(), rel=1e-12)


def test_nothing_to_correct_is_nothing():
    assert corrected([], "holm") == []


def test_a_comparison_does_not_collect_garbage(empty, tmp_path, monkeypatch):
    for i in range(5):
        drop = add(empty, tmp_path, i, dropped=f"2020-01-0{i + 1}")

    def refused(*_: object) -> int:
        raise AssertionError("a comparison collected garbage")

    monkeypatch.setattr(gc, "collect", refused)
    assert judged(empty, drop)[0].tested
