"""A quantity that rises or falls a little with every drop is told, though no drop stands out from those before it."""

from __future__ import annotations

import re
from dataclasses import replace
from math import sqrt

import numpy as np
import pytest

from tdbmon.estimate import Estimate
from tdbmon.history.archive import Archive
from tdbmon.history.change import _compared
from tdbmon.history.contract import comparison_json
from tdbmon.history.feature import KINDS
from tdbmon.history.sight import WEAR, sight
from tdbmon.history.standing import Judged
from tdbmon.history.summary import comparison_lines
from tdbmon.history.trend import order_p
from tdbmon.report.document import Table
from tdbmon.report.sections import trends
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
    gap = next(c for c in comparison.changes if c.key == ("gap_um", "NDE"))
    assert not gap.flag
    assert gap.drifts
    assert gap.p_drift <= 0.05
    assert comparison.drifting == (gap,)
    (said,) = (reason for reason in verdict.reasons if "from drop to drop" in reason)
    assert said.startswith("beside the verdict: Radius at rest, NDE: rises from drop to drop")
    assert "over 9 drops" in said
    content = next(
        f for f in comparison_json(Judged(comparison))["features"] if (f["name"], f["end"]) == ("gap_um", "NDE")
    )
    assert content["drifts"]
    assert content["trend_p_adjusted"] == gap.p_drift
    assert any("from drop to drop" in line for line in comparison_lines(Judged(comparison)))


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
        assert any(each.startswith("NDE: compared with the slope of ") for each in verdict.reasons)
    gap = next(c for c in comparison.changes if c.key == ("gap_um", "NDE"))
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
    gap = next(c for c in comparison.changes if c.key == ("gap_um", "NDE"))
    assert gap.drifts and gap.flag
    assert gap.difference.before.slope is None and len(gap.left_out) == 15
    assert verdict.word == "changed"


def test_a_step_that_no_drop_shows_alone_is_told_as_one_and_as_no_rate_a_drop(empty, tmp_path):
    """It was told as a wear "from drop to drop", by a median slope that is none of its sizes."""
    rng = np.random.default_rng(3)
    for i in range(28):
        radius = 1 + 0.03 * (i >= 14) + 0.02 * rng.uniform(-1, 1)
        drop = add(empty, tmp_path, i, dropped=f"{1990 + i}-01-01", values={("gap_um", "NDE"): radius})
    comparison, verdict = judged(empty, drop)
    gap = next(c for c in comparison.changes if c.key == ("gap_um", "NDE"))
    assert gap.drifts and not gap.flag
    assert gap.trend.step.index == 14
    assert gap.trend.grown == pytest.approx(0.03, abs=0.01)
    (said,) = (reason for reason in verdict.reasons if "Radius at rest, NDE" in reason)
    step = r"NDE: higher by [5-9]\.\d µm from drop_14\.nc on, a step shown by the order of the values over 28 drops "
    assert re.search(step, said)
    assert "from drop to drop" not in said


def test_an_even_wear_is_no_step_in_the_middle(empty, tmp_path):
    """The clearest split of a slope lies in its middle: page and figure told the drop there as the one that it began with."""
    comparison, _ = worn(empty, tmp_path, 12, 0.015)[-1]
    gap = next(c for c in comparison.changes if c.key == ("gap_um", "NDE"))
    assert gap.trend.change.p < 0.05 and gap.trend.step is None
    (table,) = (b for b in trends.section(comparison).blocks if isinstance(b, Table))
    (row,) = (each for each in table.rows if each.cells[0] == "Radius at rest, NDE")
    assert row.cells[3] == "–"


def test_a_drop_that_stands_out_makes_no_slope_of_those_before_it(empty, tmp_path):
    """Its own value was one of those that told whether the drops before the step lie on a slope."""
    level = (
        np.array([0, 3, -2, 1, 5, -1, 4, 2, 6, 3.5]) * 1e-3
    )  # rises by no more than chance, and beyond it with a last one
    steps = [*level, 0.08, 0.083, 0.079, 0.081, 0.082]
    for i, step in enumerate(steps):
        drop = add(empty, tmp_path, i, dropped=f"{1990 + i}-01-01", values={("gap_um", "NDE"): 1 + step})
    comparison, _ = judged(empty, drop)
    gap = next(c for c in comparison.changes if c.key == ("gap_um", "NDE"))
    assert order_p(level) > 0.05 > order_p(np.append(level, 0.08))
    assert gap.drifts and gap.flag and len(gap.left_out) == 4
    assert gap.difference.before.slope is None


def test_a_slope_is_that_of_the_latest_sixty_drops(empty, tmp_path):
    """What the radius did before them decided whether they lie on a slope."""
    course = np.concatenate([np.linspace(0.05, 0.0, 35), np.linspace(0.0, 0.03, 61)])
    values = course + 1e-3 * np.random.default_rng(2).standard_normal(len(course))
    kind, numbers = KINDS["gap_um"], tuple(range(len(values)))
    earlier = [(f"{i}", Estimate(value, unit=kind.unit)) for i, value in enumerate(values[:-1])]
    found = _compared(("gap_um", "NDE"), Estimate(values[-1], unit=kind.unit), earlier, numbers, values[:-1] > -1, 0.05)
    assert order_p(values) > 0.05
    assert found.difference.before.n == 60
    assert found.difference.before.slope == pytest.approx(0.0005, rel=0.1)


def test_drops_of_an_unchanged_machine_seldom_drift(empty, tmp_path):
    drops = [add(empty, tmp_path, i, dropped=f"{1990 + i}-01-01") for i in range(40)]
    drifting = [judged(empty, drop)[0].drifting for drop in drops]
    assert sum(map(bool, drifting)) <= 2
