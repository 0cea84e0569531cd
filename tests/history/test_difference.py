"""The statistics of few drops: probabilities that hold, intervals that cover, changes that are found, none made up."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from tdbmon.estimate import Estimate
from tdbmon.history.change_point import change_point
from tdbmon.history.common_slope import common_slope
from tdbmon.history.common_step import common_step
from tdbmon.history.difference import baseline, biweight, compare_value, summarise
from tdbmon.history.speed_class import speed_classes
from tdbmon.history.trend import trend_of

RUNS = 4000


def p_values(n: int, rng: np.random.Generator, runs: int = RUNS) -> np.ndarray:
    found = [
        compare_value(rng.standard_normal(), 0.0, rng.standard_normal(n), np.zeros(n), 1e-9).p for _ in range(runs)
    ]
    return np.array(found, float)


@pytest.mark.parametrize("n", [2, 3, 7, 14])
def test_below_fifteen_drops_the_probability_is_exact(n):
    assert stats.kstest(p_values(n, np.random.default_rng(n)), "uniform").pvalue > 1e-3


@pytest.mark.parametrize("n", [15, 20, 40])
def test_from_fifteen_drops_on_it_is_no_surer_than_it_says(n):
    p = p_values(n, np.random.default_rng(n), 20000)
    for level in (0.05, 0.01, 0.001):
        # three standard deviations of the count above what is stated
        assert np.mean(p < level) < level + 3 * np.sqrt(level / len(p))


@pytest.mark.parametrize("n", [4, 7, 14, 20])
def test_along_a_slope_the_probability_is_no_surer_than_it_says(n):
    rng, back = np.random.default_rng(n), np.arange(n, 0, -1.0)
    sets = ((rng.standard_normal(), rng.standard_normal(n) - 3.0 * back) for _ in range(RUNS))
    found = [compare_value(value, 0.0, before, np.zeros(n), 1e-9, back=back) for value, before in sets]
    p = np.array([each.p for each in found])
    for level in (0.5, 0.05, 0.01):
        assert np.mean(p < level) == pytest.approx(level, abs=4 * np.sqrt(level * (1 - level) / RUNS))
    assert np.mean([each.before.slope for each in found]) == pytest.approx(3.0, abs=0.05)


def test_a_prediction_interval_covers_nineteen_of_twenty():
    # the interval is that of the difference: where nothing changed it holds zero
    rng = np.random.default_rng(6)
    holds = [
        (d := compare_value(rng.standard_normal(), 0.0, rng.standard_normal(6), np.zeros(6), 1e-9)).low <= 0 <= d.high
        for _ in range(RUNS)
    ]
    assert np.mean(holds) == pytest.approx(0.95, abs=3 * np.sqrt(0.05 * 0.95 / RUNS))


def test_one_drop_before_tells_no_probability():
    found = compare_value(2.0, 0.1, np.array([1.0]), np.array([0.1]), 0.01)
    assert (found.value, found.p, found.low, found.high) == (1.0, None, None, None)
    assert found.detectable(0.05) is None


def test_drops_that_agree_by_luck_do_not_make_a_flag():
    equal = np.full(4, 1.0)
    assert compare_value(1.02, 0.0, equal, np.zeros(4), 0.05).p > 0.5
    assert compare_value(1.02, 0.0, equal, np.zeros(4), 1e-4).p < 1e-3


def test_a_less_certain_drop_is_given_its_own_uncertainty():
    before, sigmas = np.array([1.0, 1.1, 0.9, 1.05, 0.95]), np.full(5, 0.02)
    sure = compare_value(1.5, 0.02, before, sigmas, 1e-3)
    unsure = compare_value(1.5, 0.5, before, sigmas, 1e-3)
    assert sure.p < 0.02 < 0.2 < unsure.p
    assert unsure.error == pytest.approx(np.sqrt(sure.error**2 + 0.5**2 - 0.02**2))


def test_an_error_that_is_a_share_of_the_value_hides_no_rise_of_it():
    """A share of 40 % that all drops have: of ten times the value it is far above what those before have."""
    before, share = np.array([1.0, 1.01, 0.99, 1.005, 0.995]), 0.4
    for factor in (1.3, 10.0):
        assert compare_value(factor, share * factor, before, share * before, 0.01).p > 0.05
        assert compare_value(factor, share * factor, before, share * before, 0.01, relative=True).p < 1e-4
    unsure = compare_value(10.0, 8.0, before, share * before, 0.01, relative=True)
    assert unsure.p > 0.05  # twice the share
    # nor are those before believed to the same share where they may be nought
    before, sigmas = np.array([0.01, 0.02, 0.005, 0.015]), np.full(4, 0.03)
    known = {relative: compare_value(0.1, 0.1, before, sigmas, 1e-3, relative=relative).p for relative in (False, True)}
    assert known[True] == known[False] > 0.05


def test_of_two_drops_nothing_is_detectable_since_nothing_is_flagged():
    found = compare_value(9.0, 0.0, np.array([0.0, 1.0]), np.zeros(2), 1e-9)
    assert found.p is not None and found.detectable(0.05) is None


def test_what_is_detectable_is_just_flagged():
    before = np.random.default_rng(1).standard_normal(8)
    level = 0.05 / 30
    size = compare_value(0.0, 0.0, before, np.zeros(8), 1e-9).detectable(level)
    centre = summarise(before, 1e-9).centre
    assert compare_value(centre + 1.001 * size, 0.0, before, np.zeros(8), 1e-9).p < level
    assert compare_value(centre + 0.999 * size, 0.0, before, np.zeros(8), 1e-9).p > level


def test_odd_drops_do_not_move_the_biweight():
    rng = np.random.default_rng(2)
    good = rng.standard_normal(40)
    spoilt = np.concatenate([good, np.full(4, 50.0)])
    location, scale = biweight(spoilt)
    assert location == pytest.approx(good.mean(), abs=0.2)
    assert scale == pytest.approx(good.std(), rel=0.25)
    assert spoilt.std() > 10


def test_where_more_than_half_of_the_drops_are_equal_the_others_still_count_as_scatter():
    values = np.array([1.0] * 12 + [2.0, 3.0, 4.0])
    assert biweight(values) == pytest.approx((1.0, values.std(ddof=1)))
    assert biweight(np.full(15, 1.1)) == (1.1, 0.0)


@given(st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=30), st.floats(-1e3, 1e3), st.floats(0.1, 10))
def test_moving_and_scaling_all_drops_moves_and_scales_the_result(values, shift, factor):
    plain, moved = np.array(values), np.array(values) * factor + shift
    one, two = summarise(plain, 1e-3), summarise(moved, 1e-3 * factor)
    assert two.centre == pytest.approx(one.centre * factor + shift, abs=1e-6 * (1 + abs(shift) + factor * 1e3))
    assert two.scatter == pytest.approx(one.scatter * factor, rel=1e-4, abs=1e-5 * factor)


def test_a_change_does_not_hide_the_next_drop_with_the_same_change():
    rng = np.random.default_rng(3)
    values = np.concatenate([rng.normal(0, 1, 7), rng.normal(15, 1, 2)])
    kept = baseline(values[:, None], np.array([1e-6]), 0.05 / 30)[:, 0]
    assert kept.tolist() == [True] * 7 + [False] * 2
    assert compare_value(15.0, 0.0, values[kept], np.zeros(7), 1e-6).p < 1e-4
    assert compare_value(15.0, 0.0, values, np.zeros(9), 1e-6).p > 0.01


def test_hardly_any_drop_of_an_unchanged_machine_is_left_out():
    # leaving one out makes the scatter of the others smaller: a little more than the level goes, less than twice of it
    rng = np.random.default_rng(4)
    left = sum(int(np.sum(~baseline(rng.standard_normal((10, 1)), np.array([1e-6]), 0.01))) for _ in range(500))
    assert 0.5 * 0.01 < left / (500 * 7) < 2 * 0.01


def test_a_change_point_is_found_where_it_is():
    rng = np.random.default_rng(7)
    found = change_point(np.concatenate([rng.normal(0, 1, 7), rng.normal(6, 1, 4)]))
    assert found.index == 7
    assert found.p < 0.01
    assert found.after - found.before == pytest.approx(6, abs=1.5)


def test_shuffles_of_one_level_seldom_have_a_change_point():
    rng = np.random.default_rng(8)
    p = np.array([change_point(rng.standard_t(3, 9)).p for _ in range(200)])
    assert np.mean(p <= 0.05) < 0.05 + 3 * np.sqrt(0.05 * 0.95 / 200)
    assert np.mean(p <= 0.5) == pytest.approx(0.5, abs=3 * np.sqrt(0.25 / 200))


def test_below_six_drops_there_is_no_change_point():
    assert change_point(np.array([0.0, 0, 0, 9, 9])) is None


def series(values) -> list[Estimate]:
    return [Estimate(float(v), unit="um", why="made up") for v in values]


def test_the_slope_is_that_of_a_straight_line():
    trend = trend_of(series(2e-6 * np.arange(8) + 1e-4), range(8))
    assert trend.slope.value == pytest.approx(2e-6)
    assert trend.p < 1e-3
    assert trend_of(series(np.arange(3)), range(3)) is None


def test_drops_that_lack_a_feature_count_in_its_slope():
    """Of 24 drops every third is known, say by a probe that is dead in the others: 2 um a drop, not 6."""
    known = np.arange(0, 24, 3)
    trend = trend_of(series(2e-6 * known + 1e-4), known.tolist())
    assert trend.slope.value == pytest.approx(2e-6)


@pytest.mark.parametrize("count", [4, 5, 10])
def test_the_slope_of_noise_covers_zero(count):
    """All slopes of four drops hold the truth in 22 of 24 orders: no 95 % interval is stated of them."""
    rng = np.random.default_rng(9)
    found = [trend_of(series(rng.standard_normal(count)), range(count)) for _ in range(400)]
    known = [t.slope for t in found if t.slope.low is not None]
    if count < 5:
        assert known == []
        return
    assert np.mean([s.low <= 0 <= s.high for s in known]) > 0.95 - 3 * np.sqrt(0.05 * 0.95 / 400)
    assert np.mean([t.p <= 0.05 for t in found]) < 0.05 + 3 * np.sqrt(0.05 * 0.95 / 400)


def test_one_slope_is_seen_under_the_levels_of_two_speeds_and_two_assemblies():
    """The covariance within levels over the variance of the drops' numbers there; the overhaul's step is no slope."""
    rng = np.random.default_rng(10)
    order = np.arange(16)
    levels = [(int(i % 2), "new" if i >= 10 else "old") for i in order]
    values = 0.3 * order + 40.0 * (order % 2) - 90.0 * (order >= 10) + rng.normal(0, 1, 16)
    slope = common_slope(series(values), order.tolist(), levels, "um")
    within = [np.array([level == each for level in levels]) for each in set(levels)]
    at, found = (np.concatenate([x[rows] - x[rows].mean() for rows in within]) for x in (order, values))
    expected = at @ found / (at @ at)
    spread = np.sqrt(np.sum((found - expected * at) ** 2) / (16 - 4 - 1) / (at @ at))
    assert slope.value == pytest.approx(expected)
    assert [slope.low, slope.high] == pytest.approx(expected + spread * stats.t.ppf([0.025, 0.975], 11))
    assert "4 levels" in slope.method


@pytest.mark.parametrize("worn", ["at once", "from drop to drop"])
def test_a_step_of_all_levels_is_told_from_a_slope(worn):
    """Seven drops at one level and three at another were told as a rate a drop."""
    rng, order = np.random.default_rng(12), np.arange(20)
    levels = [(int(i % 2), "new" if i >= 10 else "old") for i in order]
    course = 20.0 * (order >= 14) if worn == "at once" else 2.0 * order
    values = course + 40.0 * (order % 2) - 90.0 * (order >= 10) + rng.normal(0, 1, 20)
    step = common_step(series(values), order.tolist(), levels, "um")
    if worn == "at once":
        assert (step.number, step.size.value) == (14, pytest.approx(20, abs=2))
        assert step.p < 0.01
    else:
        assert step is None


def test_an_overhaul_is_no_step_nor_are_equal_drops():
    rng = np.random.default_rng(13)
    values = np.concatenate([rng.normal(0, 1, 8), rng.normal(30, 1, 8)])
    assert common_step(series(values), range(16), ["old"] * 8 + ["new"] * 8, "um") is None
    assert common_step(series([0.1] * 9), range(9), [0] * 9, "um") is None
    assert common_step(series(values[:7]), range(7), [0] * 7, "um") is None


@pytest.mark.parametrize("count", [8, 12])
def test_the_interval_of_the_slope_holds_with_few_drops_at_two_speeds(count):
    """A mixed model's 95 % held the truth in 88 to 93 % of such series."""
    rng = np.random.default_rng(count)
    order, runs = list(range(count)), 2000
    levels = [i % 2 for i in order]
    found = [common_slope(series(rng.standard_normal(count)), order, levels, "um") for _ in range(runs)]
    held = np.mean([s.low <= 0 <= s.high for s in found])
    assert held == pytest.approx(0.95, abs=3 * np.sqrt(0.05 * 0.95 / runs))


def test_the_slope_says_what_it_needs_and_leaves_out_levels_of_few_drops():
    assert "needs 8 drops" in common_slope(series(np.arange(7)), list(range(7)), [0] * 7, "um").why
    values = np.random.default_rng(11).normal(0, 1, 11)
    slope = common_slope(series(values), list(range(11)), [0] * 4 + [1] * 4 + [2, 3, 4], "um")
    assert "2 levels" in slope.method
    alike = common_slope(series([0.1] * 9), list(range(9)), [0] * 9, "um")
    assert (alike.value, alike.low) == (0.0, None)


def test_classes_of_speed():
    assert speed_classes([100, 60, 102, 61, None, 104.9, 105.1], 0.05) == [1, 0, 1, 0, 3, 1, 2]
    assert speed_classes([0.02, 100, 0.0, 0.5, 105.0], 0.05) == [0, 1, 0, 0, 1]


def test_values_that_are_all_nought_do_not_differ_and_another_one_does():
    """With a least scatter that is a share of them there is none at all."""
    same = compare_value(0.0, 0.0, np.zeros(4), np.zeros(4), 0.0)
    assert (same.p, same.low, same.high, same.detectable(0.05)) == (1.0, 0.0, 0.0, None)
    assert compare_value(0.1, 0.0, np.zeros(4), np.zeros(4), 0.0).p == 0.0
    kept = baseline(np.array([[0.0], [0.0], [0.0], [0.1]]), np.zeros(1), 0.01)
    assert kept[:, 0].tolist() == [True] * 3 + [False]
