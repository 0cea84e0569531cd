"""Whirl by its rule: rolling round either way, and all that must not be taken for it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tdbsim.errors import InputError

from tdbmon.analysis.whirl import find_whirl
from tests.analysis.planes import G, planes_of

RATE, GAP, CENTRE = 10_000.0, 2.8e-4, (1e-5, -2e-5)


def _planes(radius: np.ndarray, angle: np.ndarray, noise: float = 1e-7):
    """Path about the clearance centre; radius in gaps."""
    rng = np.random.default_rng(1)
    z = CENTRE[0] + 1j * CENTRE[1] + GAP * radius * np.exp(1j * angle)
    xy = np.column_stack([z.real, z.imag]) + noise * rng.standard_normal((len(z), 2))
    return planes_of(np.arange(len(z)) / RATE, {"NDE": xy})


def _swing(seconds: float, amplitude: float) -> np.ndarray:
    """Angle of a swing at the bottom."""
    time = np.arange(int(seconds * RATE)) / RATE
    return -np.pi / 2 + amplitude * np.sin(np.sqrt(G / GAP) * time)


def _ramp(turns: float, hz: float) -> np.ndarray:
    time = np.arange(int(abs(turns) / hz * RATE) + 1) / RATE
    return np.sign(turns) * 2 * np.pi * hz * time


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("way", [1, -1])
def test_rolling_round_is_full_whirl_and_backward_only_against_the_rotation(sense, way):
    swing = _swing(0.5, 1.0)
    roll = swing[-1] + _ramp(way * 6.0, 40.0)
    angle = np.concatenate([swing, roll[1:], np.full(2000, roll[-1])])
    found = find_whirl(_planes(np.ones(angle.size), angle), "NDE", CENTRE, GAP, sense)
    assert found.full
    assert found.backward == (way != sense)
    # the rule cuts at quarter turns, so that begin and end are within one of the truth
    quarter = 0.25 / 40.0
    assert found.full_onset.value == pytest.approx(0.5, abs=quarter)
    assert found.full_longest_s == pytest.approx(6 / 40.0, abs=2 * quarter)
    assert found.frequency.value == pytest.approx(40.0, rel=0.03)
    assert (found.backward_longest_s > 0) == found.backward
    assert found.backward_onset.known == found.backward
    assert found.worst.turns == pytest.approx(sense * way * 6.0, abs=0.5)


def test_whirl_against_the_rotation_is_the_worst_beside_a_longer_one_with_it():
    forward = -np.pi / 2 + _ramp(20.0, 40.0)
    backward = forward[-1] + _ramp(-6.0, 60.0)
    angle = np.concatenate([forward, backward[1:]])
    found = find_whirl(_planes(np.ones(angle.size), angle), "NDE", CENTRE, GAP, 1)
    assert found.frequency.value == pytest.approx(40.0, rel=0.03)  # of the longest
    assert found.worst.turns < 0 and found.worst.frequency.value == pytest.approx(60.0, rel=0.03)
    assert found.worst.start_s == pytest.approx(0.5, abs=0.25 / 40.0)


def test_frequency_of_a_steady_whirl_has_an_interval_that_holds_it():
    angle = -np.pi / 2 + _ramp(-20.0, 63.0)
    found = find_whirl(_planes(np.ones(angle.size), angle, noise=2e-6), "NDE", CENTRE, GAP, 1)
    assert found.frequency.low <= 63.0 <= found.frequency.high
    assert found.frequency.value == pytest.approx(63.0, rel=1e-3)


@given(amplitude=st.floats(0.05, 3.1), noise=st.floats(0.0, 5e-6))
@settings(max_examples=25, deadline=None)
def test_a_swing_of_any_size_is_no_whirl(amplitude, noise):
    angle = _swing(1.0, amplitude)
    found = find_whirl(_planes(np.ones(angle.size), angle, noise), "NDE", CENTRE, GAP, 1)
    assert not found.full and not found.backward
    assert found.full_longest_s == 0.0 and not found.frequency.known


def test_bouncing_through_the_middle_is_no_whirl():
    time = np.arange(20_000) / RATE
    # up and down through the centre, a little beside it, so that the angle jumps by nearly half a turn each time
    z = 1j * np.cos(2 * np.pi * 20.0 * time) + 0.05 * np.exp(2j * np.pi * 3.0 * time)
    found = find_whirl(_planes(np.abs(z), np.angle(z)), "NDE", CENTRE, GAP, 1)
    assert not found.full and not found.backward


def test_levitated_orbit_is_too_small_for_whirl():
    angle = _ramp(-100.0, 100.0)
    found = find_whirl(_planes(np.full(angle.size, 0.2), angle), "NDE", CENTRE, GAP, 1)
    assert not found.full and not found.backward


def test_bouncing_round_backwards_is_backward_but_not_full():
    # chords of 90 degrees between touches: the radius falls to cos(45 deg) = 0.71 of the gap
    share = np.arange(400) / 400
    corners = np.exp(-1j * np.pi / 2 * np.arange(13))
    z = np.concatenate([a + (b - a) * share for a, b in pairwise(corners)])
    found = find_whirl(_planes(np.abs(z), np.angle(z)), "NDE", CENTRE, GAP, 1)
    assert found.backward and not found.full
    assert find_whirl(_planes(np.abs(z), np.angle(z)), "NDE", CENTRE, GAP, -1).backward is False
    # to a quarter turn, which a chord is, and a sample
    assert found.backward_longest_s == pytest.approx(12 * 400 / RATE, abs=400 / RATE + 1 / 2500.0)


def test_three_quarters_round_is_not_round():
    angle = np.concatenate([_ramp(-0.75, 50.0), np.full(500, -1.5 * np.pi)])
    angle = np.concatenate([angle, -1.5 * np.pi - _ramp(-0.75, 50.0)])
    found = find_whirl(_planes(np.ones(angle.size), angle), "NDE", CENTRE, GAP, 1)
    assert not found.full and not found.backward


def test_what_was_before_the_start_and_what_is_not_known_do_not_count():
    angle = _ramp(-5.0, 50.0)
    planes = _planes(np.ones(angle.size), angle)
    assert find_whirl(planes, "NDE", CENTRE, GAP, 1, start_s=0.0).backward
    assert not find_whirl(planes, "NDE", CENTRE, GAP, 1, start_s=0.085).backward  # 0.75 turns are left


@pytest.mark.parametrize(("arc", "found"), [(0.05, True), (0.25, True), (0.45, None)])
def test_a_cut_off_probe_hides_an_arc_of_every_turn(arc, found):
    """A backward whirl that a probe of too small a range sees in part: told as far as the way round is not in doubt."""
    angle = _ramp(-20.0, 50.0)
    planes = _planes(np.ones(angle.size), angle)
    cut = np.abs(np.angle(np.exp(1j * (angle + np.pi / 2)))) < np.pi * arc
    planes.displacement.values[..., cut] = np.nan
    whirl = find_whirl(planes, "NDE", CENTRE, GAP, 1)
    assert whirl.backward is found
    assert whirl.full is found
    if found:
        assert whirl.backward_longest_s == pytest.approx(20 / 50.0, abs=0.5 / 50.0)
        assert whirl.frequency.value == pytest.approx(50.0, rel=0.02)
    else:
        assert whirl.backward_longest_s is None
        assert "% of the orbit is missing" in whirl.backward_onset.why


def test_missing_samples_are_no_turns():
    """A swing whose bottom is cut off turns back, and a hole that may hold whole turns is not bridged by the short way."""
    swing = _swing(0.5, 1.0)
    planes = _planes(np.ones(swing.size), swing)
    planes.displacement.values[..., np.abs(swing + np.pi / 2) < 0.5] = np.nan
    assert not find_whirl(planes, "NDE", CENTRE, GAP, 1).full
    angle = _ramp(-5.0, 50.0)
    planes = _planes(np.ones(angle.size), angle)
    for begin in (160, 440, 720):  # 1.1 turns in each hole: 0.3 of a turn are seen between them
        planes.displacement.values[..., begin : begin + 220] = np.nan
    assert find_whirl(planes, "NDE", CENTRE, GAP, 1).backward is None


@pytest.mark.parametrize("begin", np.arange(0.4, 0.45, 0.01))
@pytest.mark.parametrize("lost_s", [1 / 30, 1 / 12])
def test_a_long_hole_hides_a_whirl_at_whatever_pace_it_is_entered(begin, lost_s):
    """Opposite paces of the swing before and after cancelled, and the hole was filled with a shaft that hung still."""
    time = np.arange(int(1.0 * RATE)) / RATE
    whirls = (time >= begin) & (time < begin + lost_s)
    swing = -np.pi / 2 + 0.5 * np.sin(2 * np.pi * 20.0 * time)
    planes = _planes(np.ones(time.size), swing - 2 * np.pi * 120.0 * (time - begin) * whirls)
    assert find_whirl(planes, "NDE", CENTRE, GAP, 1).backward
    planes.displacement.values[..., whirls] = np.nan
    found = find_whirl(planes, "NDE", CENTRE, GAP, 1)
    assert found.backward is None
    assert found.backward_longest_s is None


def test_a_pause_of_the_logger_hides_a_whirl_as_missing_samples_do():
    time = np.arange(int(3.0 * RATE)) / RATE
    whirls = (time > 1.0) & (time < 1.8)
    swing = -np.pi / 2 + 0.3 * np.sin(2 * np.pi * 8.0 * time)
    planes = _planes(np.ones(time.size), np.where(whirls, -np.pi / 2 - 2 * np.pi * 120.0 * (time - 1.0), swing))
    paused = find_whirl(planes.isel(time=(time < 0.99) | (time > 1.81)), "NDE", CENTRE, GAP, 1)
    assert paused.backward is None
    assert paused.backward_longest_s is None
    assert paused.backward_onset.why.startswith("27 % of the orbit is missing")
    within = find_whirl(planes.isel(time=(time < 1.2) | (time > 1.6)), "NDE", CENTRE, GAP, 1)
    assert within.backward
    assert within.backward_longest_s == pytest.approx(0.2, abs=0.5 / 120.0)


def test_some_lost_samples_hide_no_whirl():
    planes = _planes(np.full(5000, 0.2), _ramp(-25.0, 50.0)[:5000])
    planes.displacement.values[..., 100:150] = np.nan
    assert find_whirl(planes, "NDE", CENTRE, GAP, 1).backward is False


def test_a_gap_must_be_one():
    planes = _planes(np.ones(100), np.zeros(100))
    with pytest.raises(InputError, match="is not positive"):
        find_whirl(planes, "NDE", CENTRE, 0.0, 1)
