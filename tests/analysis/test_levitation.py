"""The levitated orbit by least squares, against what was put in."""

from __future__ import annotations

import numpy as np
import pytest

from tdbmon.analysis.gap import Gap
from tdbmon.analysis.levitation import levitation
from tdbmon.estimate import Estimate
from tests.analysis.circles import circle_of
from tests.analysis.planes import planes_of

RATE, SPEED, RELEASE = 10e3, 83.0, 0.2
PLACE, ORBIT, NOISE = (12e-6, -31e-6), 2.4e-6, 0.3e-6
C_MIN = 250e-6


def levitated(seed: int = 0):
    rng = np.random.default_rng(seed)
    t = np.arange(int(0.3 * RATE)) / RATE
    turn = 2 * np.pi * SPEED * t + rng.uniform(0, 6)
    hum = 0.4e-6 * np.sin(2 * np.pi * 50 * t)
    xy = np.column_stack([PLACE[0] + ORBIT * np.cos(turn) + hum, PLACE[1] + ORBIT * np.sin(turn) + hum])
    xy[t > RELEASE, 1] -= 200e-6
    return planes_of(t, {end: xy + NOISE * rng.standard_normal(xy.shape) for end in ("NDE", "DE")})


def test_place_orbit_and_noise_are_those_put_in():
    found = levitation(levitated(), "DE", RELEASE, SPEED, 50.0, None, C_MIN)
    assert found.x.value == pytest.approx(PLACE[0], abs=0.05e-6)
    assert found.y.value == pytest.approx(PLACE[1], abs=0.05e-6)
    assert found.once.value == pytest.approx(np.sqrt(2) * ORBIT, rel=0.01)  # of both axes together
    assert found.noise.value == pytest.approx(NOISE, rel=0.05)


def test_the_intervals_hold_what_was_put_in():
    held = []
    for seed in range(60):
        found = levitation(levitated(seed), "NDE", RELEASE, SPEED, 50.0, None, C_MIN)
        truths = ((found.x, PLACE[0]), (found.once, np.sqrt(2) * ORBIT), (found.noise, NOISE))
        held.append([each.low <= truth <= each.high for each, truth in truths])
    assert (np.mean(held, axis=0) >= 0.88).all()  # 95 % less three standard deviations of 60 trials


def test_without_speed_or_with_a_short_stretch_it_is_missing():
    assert "not known" in levitation(levitated(), "DE", RELEASE, None, 50.0, None, C_MIN).once.why
    assert "too short" in levitation(levitated(), "DE", 0.02, SPEED, 50.0, None, C_MIN).noise.why


def circle(x: float, y: float, sigma: float) -> Gap:
    """A clearance circle about (x, y), as settled positions would give it."""
    radius, *centre = (Estimate.from_sigma(v, s, "um", "") for v, s in ((290e-6, 2e-6), (x, sigma), (y, sigma)))
    return circle_of(radius, *centre, settled_from=1.0)


def test_the_reach_is_the_farthest_point_of_the_orbit_from_the_clearance_centre():
    away = np.hypot(PLACE[0] - 2e-6, PLACE[1] - 5e-6)
    found = levitation(levitated(), "DE", RELEASE, SPEED, 50.0, circle(2e-6, 5e-6, 1e-6), C_MIN).reach
    assert found.kind == "0-pk"
    # x and y turn in phase here, a line of 2.4 um * sqrt(2); hum and noise add to it, never as much as half a micrometre each
    assert away + 1e-6 < found.value < away + np.sqrt(2) * ORBIT + 2e-6
    assert found.low < found.value < found.high
    assert (found.high - found.value) / 1.96 == pytest.approx(1e-6, rel=1e-6)  # what the centre is not known to


def test_what_happens_after_the_release_is_no_levitation():
    found = levitation(levitated(), "DE", RELEASE, SPEED, 50.0, circle(*PLACE, 1e-6), C_MIN).reach
    assert found.value < 10e-6  # the shaft then lies 200 um lower


def test_without_a_clearance_centre_no_reach_is_told():
    assert "centre" in levitation(levitated(), "DE", RELEASE, SPEED, 50.0, None, C_MIN).reach.why


def rotating(seconds: float, speed: float, decay: float = 0.0, seed: int = 0):
    """A round orbit whose speed falls by `decay` Hz/s until it is `speed` at the end."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(seconds * RATE)) / RATE
    since = t - t[-1]
    turn = 2 * np.pi * (speed * since - decay / 2 * since**2) + rng.uniform(0, 6)
    xy = np.column_stack([PLACE[0] + ORBIT * np.cos(turn), PLACE[1] + ORBIT * np.sin(turn)])
    return planes_of(t, {end: xy + NOISE * rng.standard_normal(xy.shape) for end in ("NDE", "DE")})


@pytest.mark.parametrize(("stated", "decay"), [(SPEED, 0.0), (1.001 * SPEED, 0.0), (SPEED, 0.75), (0.99 * SPEED, 3.0)])
def test_over_a_long_levitation_once_per_revolution_stays_whole(stated, decay):
    """Against one frequency a tenth of a per cent off, a phasor of five seconds turns by half and more."""
    found = levitation(rotating(5.0, SPEED, decay), "DE", 5.1, stated, 50.0, None, C_MIN)
    assert found.once.value == pytest.approx(np.sqrt(2) * ORBIT, rel=0.01)
    assert found.noise.value == pytest.approx(NOISE, rel=0.05)


@pytest.mark.parametrize("speed", [50.0, 51.0, 25.0])
def test_a_hum_that_no_stretch_tells_from_an_order_halves_nothing(speed):
    found = levitation(rotating(0.3, speed), "DE", 0.4, speed, 50.0, None, C_MIN)
    truth = np.sqrt(2) * ORBIT
    assert found.once.value == pytest.approx(truth, rel=0.02)
    assert found.once.low <= truth <= found.once.high
