"""A quantity that rises or falls a little with every drop is told, though no drop stands out from those before it."""

from __future__ import annotations

import re

import numpy as np

from tdbmon.history.archive import Archive
from tdbmon.history.contract import comparison_json
from tdbmon.history.summary import comparison_lines
from tests.history.made import add, judged


def worn(archive: Archive, folder, count: int, step: float) -> list:
    """File drops whose radius at rest at NDE grows by a share of the usual one each time; return the judged drops."""
    rng = np.random.default_rng(5)
    found = []
    for i in range(count):
        radius = 1 + step * i + 0.004 * rng.standard_normal()
        drop = add(archive, folder, i, dropped=f"{1990 + i}-01-01", values={("gap_um", "NDE"): radius})
        found.append(judged(archive, drop))
    return found


def test_wear_that_grows_from_drop_to_drop_is_told_though_no_drop_stands_out(empty, tmp_path):
    """The drops before lie on the same slope: their scatter is the wear itself, and none is beyond it."""
    comparison, verdict = worn(empty, tmp_path, 9, 0.015)[-1]
    assert verdict.word == "as before"
    gap = next(c for c in comparison.changes if (c.kind.name, c.end) == ("gap_um", "NDE"))
    assert not gap.flag
    assert gap.drifts
    assert gap.p_drift <= 0.05
    assert comparison.drifting == (gap,)
    (said,) = (reason for reason in verdict.reasons if "from drop to drop" in reason)
    assert said.startswith("beside the verdict: Radius at rest, NDE: rises from drop to drop")
    assert "over 9 drops" in said
    content = next(
        f for f in comparison_json(comparison, verdict)["features"] if (f["name"], f["end"]) == ("gap_um", "NDE")
    )
    assert content["drifts"]
    assert content["trend_p_adjusted"] == gap.p_drift
    assert any("from drop to drop" in line for line in comparison_lines(comparison, verdict))


def test_the_wear_limit_counts_from_the_first_drops_where_the_wear_is_slow(empty, tmp_path):
    """Against the mean of drops that wear on alike a radius never grows by much, however far it has come."""
    found = worn(empty, tmp_path, 20, 0.02)
    words = [verdict.word for _, verdict in found]
    assert words[:10] == ["too few drops"] * 5 + ["as before"] * 5
    assert set(words[12:]) == {"inspect"}  # 24 % at the thirteenth
    assert re.search(r"NDE: the radius at rest has grown by 3\d\.\d %, more than 20 %", found[-1][1].reasons[0])  # 38 %


def test_drops_of_an_unchanged_machine_seldom_drift(empty, tmp_path):
    drops = [add(empty, tmp_path, i, dropped=f"{1990 + i}-01-01") for i in range(40)]
    drifting = [judged(empty, drop)[0].drifting for drop in drops]
    assert sum(map(bool, drifting)) <= 2
