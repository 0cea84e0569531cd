"""What rings that still slip take from the speed, in records that end before they turn with the shaft."""

from __future__ import annotations

import numpy as np
import pytest

from tdbmon.analysis.rundown import fit_rundown

RELEASE, LOST, SLIPPED = 0.1, 0.5, 0.6  # s, Hz, s after the release


def course(seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """A driven rotor of 100 Hz whose rings are sped up by a steady friction; times and noisy speeds up to after the release."""
    time = np.arange(0, RELEASE + seconds, 1e-3)
    speed = 100.0 - LOST * np.clip((time - RELEASE) / SLIPPED, 0.0, 1.0)
    return time, speed + np.random.default_rng(0).normal(0, 0.01, time.size)


@pytest.mark.parametrize("seconds", [0.25, 0.4, 0.5])
def test_a_speed_lost_is_not_told_where_rings_still_slip_to_the_end(seconds: float) -> None:
    time, speed = course(seconds)
    run = fit_rundown(time, speed, release_time=RELEASE, polar_inertia=None)
    assert run.law is not None  # a law fits what slip takes
    assert not run.lost_speed.known and "drag of the bearings" in run.lost_speed.why


def test_a_speed_lost_is_told_where_the_record_shows_the_rotor_after_slip() -> None:
    time, speed = course(3.0)
    run = fit_rundown(time, speed, release_time=RELEASE, polar_inertia=None)
    assert run.lost_speed.low <= LOST <= run.lost_speed.high
