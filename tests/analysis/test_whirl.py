"""Whirl: full and backward turns are found, swinging and bouncing are not taken for them."""

from __future__ import annotations

import numpy as np
import pytest

from tdbmon.analysis.whirl import find_whirl
from tests.analysis.planes import planes_of

RATE, R = 10000.0, 300e-6
TIME = np.arange(int(0.5 * RATE)) / RATE


def course(angle, radius=R, centre=(5e-6, -3e-6), seed=0):
    noise = 0.3e-6 * np.random.default_rng(seed).standard_normal((len(TIME), 2))
    xy = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]) + np.array(centre) + noise
    return planes_of(TIME, {"NDE": xy})


def find(planes, sense=1):
    return find_whirl(planes, "NDE", (5e-6, -3e-6), R, sense, 0.0)


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("hz", [35.0, -80.0])
def test_a_whirl_is_found_with_its_sense_and_frequency(sense, hz):
    begins = 0.1
    angle = -np.pi / 2 + 2 * np.pi * hz * np.maximum(TIME - begins, 0)
    whirl = find(course(angle), sense)
    assert whirl.full
    assert whirl.backward == (hz * sense < 0)
    assert whirl.frequency.value == pytest.approx(hz * sense, rel=0.02)
    onset = whirl.backward_onset if whirl.backward else whirl.full_onset
    assert onset.value == pytest.approx(begins, abs=2e-3)


@pytest.mark.parametrize("amplitude", [0.3, 1.5, 3.0])
def test_a_swing_is_no_whirl_however_wide(amplitude):
    whirl = find(course(-np.pi / 2 + amplitude * np.sin(2 * np.pi * 28 * TIME)))
    assert not whirl.full
    assert not whirl.backward
    assert "whole turn" in whirl.full_onset.why


def test_an_orbit_inside_the_clearance_is_no_whirl():
    assert not find(course(2 * np.pi * 100 * TIME, radius=0.4 * R)).full


def test_bounces_across_the_clearance_are_no_whirl():
    """Straight flights from wall to wall: the angle jumps, but the shaft is off the ring in between."""
    corners = np.exp(1j * np.deg2rad(np.arange(0, 3600, 150))) * R
    z = np.interp(TIME * 40, np.arange(len(corners)), corners.real) + 1j * np.interp(
        TIME * 40, np.arange(len(corners)), corners.imag
    )
    planes = planes_of(TIME, {"NDE": np.column_stack([z.real, z.imag])})
    assert not find_whirl(planes, "NDE", (0.0, 0.0), R, 1, 0.0).full


def test_one_turn_with_lift_offs_is_still_a_turn():
    angle = -np.pi / 2 - 2 * np.pi * 50 * np.maximum(TIME - 0.2, 0)
    radius = R * np.where(
        np.sin(2 * np.pi * 200 * TIME) > 0.9, 0.7, 1.0
    )  # off the ring for under a millisecond at a time
    assert find(course(angle, radius)).backward
