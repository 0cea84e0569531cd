"""The greatest residual of a model, from residuals made up to a plan."""

from types import SimpleNamespace

import numpy as np
import pytest

from tdbmon.diagnosis.unexplained import unexplained

RATE = 20000.0
TIME = np.arange(-100, 800) / RATE  # s from the release
LINE = 500.0  # Hz


def left_by(*series):
    """A model with the given residuals (n,), m, one per probe of one drop, in noise of 1 um."""
    names = "ABCD"[: len(series)]
    drop = SimpleNamespace(
        name="drop.nc",
        interval=1 / RATE,
        probes=[SimpleNamespace(name=name) for name in names],
        noise=[SimpleNamespace(sigma=1e-6) for _ in names],
    )
    found = SimpleNamespace(since=TIME, left_after=np.array(series)[:, TIME >= 0])
    problem = SimpleNamespace(drops=(drop,), simulated=lambda point, drop, horizon: found)
    return SimpleNamespace(problem=problem, fit=SimpleNamespace(point=None), horizon=0.04, ratio=2.0)


def line(rms, place=0.0):
    return np.sqrt(2) * rms * np.sin(2 * np.pi * LINE * TIME) + place


def without(series, share):
    return np.where(np.random.default_rng(3).uniform(size=len(series)) < share, np.nan, series)


def test_missing_samples_make_nothing_quieter():
    """With four of ten samples missing and taken as zero, an rms of 3 um became 2.3 um, less than the other probe's."""
    found = unexplained(left_by(without(line(3e-6), 0.4), line(2.6e-6)))
    assert found.probe == "A"
    assert found.rms == pytest.approx(3e-6, rel=0.02)
    assert found.frequency == pytest.approx(LINE, rel=0.01)


def test_missing_samples_of_a_probe_that_stays_elsewhere_are_no_motion():
    found = unexplained(left_by(without(line(1e-6, place=8e-6), 0.4), line(2e-6)))
    assert found.probe == "B"
    assert unexplained(left_by(without(line(1e-6, place=8e-6), 0.4))).frequency == pytest.approx(LINE, rel=0.01)


def test_a_probe_without_samples_there_is_not_the_loudest():
    assert unexplained(left_by(np.full(len(TIME), np.nan), line(2e-6))).probe == "B"


def test_the_loudest_stretch_is_told():
    burst = line(1e-6) * np.where((TIME > 0.02) & (TIME < 0.024), 10, 1)
    found = unexplained(left_by(without(burst, 0.1)))
    assert (found.since, found.until) == pytest.approx((0.02, 0.024), abs=3e-4)
