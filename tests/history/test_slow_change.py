"""A quantity that rises or falls a little with every drop is told, though no drop stands out from those before it."""

from __future__ import annotations

import re
from dataclasses import replace
from math import sqrt

import numpy as np
import pytest

from tdbmon.history.archive import Archive
from tdbmon.history.contract import comparison_json
from tdbmon.history.sight import WEAR, sight
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


def wearing(archive: Archive, folder, steps, end: str = "NDE") -> list:
    """File drops of which an end is worn by shares of the usual radius, as all that tells wear sees it; return them judged."""
    rng = np.random.default_rng(6)
    found = []
    for i, step in enumerate(steps):
        radius, fall, deepest = 1 + step + 0.004 * rng.standard_normal(3)
        values = {("gap_um", end): radius, ("fall_time_ms", end): sqrt(fall), ("deepest_um", end): deepest}
        found.append(judged(archive, add(archive, folder, i, dropped=f"{1990 + i}-01-01", values=values)))
    return found


@pytest.mark.parametrize("step", [0.015, -0.02])
def test_what_would_have_been_seen_is_judged_about_the_slope(empty, tmp_path, step):
    """About their mean drops that wear on scatter by the wear itself: they were "too few", however many, until the limit."""
    found = wearing(empty, tmp_path, step * np.arange(13))
    for comparison, verdict in found[8:]:
        assert verdict.word == "as before"
        assert any("Radius at rest, NDE: " in each and "from drop to drop" in each for each in verdict.reasons)
        assert sight(comparison, "NDE").growth < 0.1
        assert any(each.startswith("NDE: against the slope of ") for each in verdict.reasons)
    gap = next(c for c in comparison.changes if (c.kind.name, c.end) == ("gap_um", "NDE"))
    assert gap.difference.before.slope == pytest.approx(step * 250e-6, rel=0.15)
    assert gap.level == pytest.approx(250e-6, rel=0.02)
    assert abs(gap.difference.before.centre / 250e-6 - 1 - 12 * step) < 0.02


def test_a_drop_that_leaves_the_slope_is_flagged_and_its_growth_counts_from_where_that_began(empty, tmp_path):
    comparison, verdict = wearing(empty, tmp_path, [*(0.01 * np.arange(12)), 0.23])[-1]
    assert verdict.word == "inspect"
    assert re.match(r"NDE: the radius at rest has grown by 2\d\.\d %, more than 20 %", verdict.reasons[0])
    flagged = {change.kind.name for change in comparison.flagged if change.end == "NDE"}
    assert flagged >= set(WEAR)
    assert any(" above the slope of the 12 matching drops before" in each for each in verdict.reasons)


def test_a_fall_that_has_come_beyond_the_limit_along_its_slope_does_not_show_an_end_without_radius(empty, tmp_path):
    found = wearing(empty, tmp_path, 0.03 * np.arange(13))
    comparison = found[-1][0]
    alone = [c for c in comparison.changes if c.end != "NDE" or c.kind.name == "fall_time_ms"]
    seen = sight(replace(comparison, changes=tuple(alone)), "NDE")
    assert 0.25 < seen.growth < 0.45
    assert not seen.enough
    assert sight(comparison, "NDE").enough  # by the radius, which is past its limit


def test_a_step_is_held_against_the_level_before_it(empty, tmp_path):
    """The order of all drops tells a drift; those before the step, which are the measure, lie on no slope."""
    comparison, verdict = wearing(empty, tmp_path, [0.0] * 16 + [0.08] * 16)[-1]
    gap = next(c for c in comparison.changes if (c.kind.name, c.end) == ("gap_um", "NDE"))
    assert gap.drifts and gap.flag
    assert gap.difference.before.slope is None and len(gap.left_out) == 15
    assert verdict.word == "changed"


def test_drops_of_an_unchanged_machine_seldom_drift(empty, tmp_path):
    drops = [add(empty, tmp_path, i, dropped=f"{1990 + i}-01-01") for i in range(40)]
    drifting = [judged(empty, drop)[0].drifting for drop in drops]
    assert sum(map(bool, drifting)) <= 2
