"""Rainflow count against the standard's example and its own invariants; the fatigue sum against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tdbsim.errors import InputError
from tdbsim.fatigue import drop_fatigue, fatigue_sum, rainflow, turning_points

ASTM = [-2, 1, -3, 5, -1, 3, -4, 4, -2]


def test_example_of_the_standard():
    """ASTM E1049-85, figure 6: ranges 3, 4, 6, 8, 9 count 0.5, 1.5, 0.5, 1, 0.5."""
    cycles = rainflow(ASTM)
    counted = {size: float(cycles.count[cycles.range == size].sum()) for size in np.unique(cycles.range)}
    assert counted == {3: 0.5, 4: 1.5, 6: 0.5, 8: 1.0, 9: 0.5}


def test_the_example_s_full_cycle_is_the_inner_one():
    cycles = rainflow(ASTM)
    full = cycles.count == 1
    np.testing.assert_array_equal([cycles.low[full], cycles.high[full]], [[-1], [3]])


def test_a_sine_of_n_periods_is_n_cycles():
    cycles = rainflow(2 - np.cos(2 * np.pi * np.linspace(0, 7, 7 * 64 + 1)))
    np.testing.assert_allclose(cycles.range, 2)
    assert cycles.count.sum() == 7


histories = st.lists(st.floats(0, 4e9, allow_subnormal=False), min_size=1, max_size=60)


@given(histories)
def test_cycles_and_turning_points_agree(history):
    cycles = rainflow(history)
    assert 2 * cycles.count.sum() == len(turning_points(history)) - 1  # each half cycle is one flank
    if cycles.count.size:
        assert cycles.range.max() == pytest.approx(max(history) - min(history), rel=1e-12)
        flanks = np.abs(np.diff(turning_points(history))).sum()
        assert np.sum(2 * cycles.count * cycles.range) == pytest.approx(flanks, rel=1e-9)


@given(histories)
def test_samples_between_the_turning_points_and_the_sign_do_not_matter(history):
    fine = np.concatenate([np.linspace(a, b, 4) for a, b in zip(history, [*history[1:], history[-1]], strict=True)])
    a, b, c = rainflow(history), rainflow(fine), rainflow(-np.array(history))
    np.testing.assert_allclose(np.sort(a.range), np.sort(b.range), rtol=1e-9, atol=1)
    np.testing.assert_array_equal(a.range, c.range)


def test_equal_cycles_sum_as_the_power_law():
    history = [*np.tile([0.0, 1000e6], 50), 0.0]
    assert fatigue_sum(rainflow(history), 2000e6) == pytest.approx(50 / 2**9)
    assert fatigue_sum(rainflow(history), 1000e6, 3) == pytest.approx(50)
    twice_the_load = 2 ** (1 / 3)
    ratio = fatigue_sum(rainflow(np.array(history) * twice_the_load), 2e9) / fatigue_sum(rainflow(history), 2e9)
    assert ratio == pytest.approx(8)  # life falls with the cube of the load


def test_a_drop_ball_by_ball():
    pressure = np.zeros((3, 9))
    pressure[0, 1::4] = 2000e6
    pressure[1, 4] = 4300e6
    drop = drop_fatigue(pressure)
    np.testing.assert_allclose(drop.equivalent_cycles, [2, (4300 / 2000) ** 9, 0])
    assert drop.worst == drop.equivalent_cycles[1]
    assert drop.beyond_static_limit
    assert not drop_fatigue(pressure[:1]).beyond_static_limit


def test_a_constant_stress_and_an_empty_history_have_no_cycles():
    for history in ([], [5.0], [5.0, 5.0, 5.0]):
        assert rainflow(history).count.size == 0


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: rainflow([0.0, np.nan]), "finite"),
        (lambda: rainflow([[0.0, 1.0]]), "one row"),
        (lambda: fatigue_sum(rainflow(ASTM), 0.0), "positive"),
    ],
)
def test_what_is_no_stress_history_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()
