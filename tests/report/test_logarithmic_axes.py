"""Logarithmic axes of figures: numbers in every range, and no speed where the shaft stands."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.axes import Axes

from tdbmon.figures.coast_down import coast_down
from tdbmon.identify.coast_down_comparison import Course
from tests.figure_checks import faults, rendered, texts

TIME = np.arange(0.5, 30.0)


def _course(speed: np.ndarray, rms: np.ndarray) -> Course:
    both = {"NDE": np.array([rms, rms])}
    return Course(TIME, speed, speed, speed > 5, both, both, None, None)


def _numbers(ax: Axes) -> list[str]:
    low, high = ax.get_ylim()
    ticks = [*ax.yaxis.get_major_ticks(), *ax.yaxis.get_minor_ticks()]
    return [tick.label1.get_text() for tick in ticks if tick.label1.get_text() and low <= tick.get_loc() <= high]


@pytest.mark.parametrize("least", [1.3e-6, 2.2e-6, 5.2e-6])
@pytest.mark.parametrize("times", [1.4, 3.0, 30.0])
def test_a_logarithmic_axis_has_numbers_within_a_power_of_ten_too(least: float, times: float) -> None:
    """Between two powers of ten it had none."""
    drawing = rendered(coast_down(_course(100 * np.exp(-TIME / 60), least * np.geomspace(1, times, len(TIME))), ""))
    assert faults(drawing) == []
    assert "−0.05" in texts(drawing)  # the speed error, which left the page
    for ax in drawing.axes[-2:]:
        assert _numbers(ax)
        assert not any("." in number for number in _numbers(ax)) or times < 2
    assert "$" not in texts(drawing)


def test_a_shaft_that_stands_has_no_speed_on_a_logarithmic_axis() -> None:
    """It was drawn to turn at a thousandth of a hertz, below an axis of five powers of ten."""
    speed = np.maximum(100 - 5 * TIME, 0.0)
    linear, logarithmic = coast_down(_course(speed, np.geomspace(1e-4, 3e-7, len(TIME))), "").axes[:2]
    np.testing.assert_array_equal(linear.lines[0].get_ydata(), speed)
    np.testing.assert_array_equal(logarithmic.lines[0].get_ydata(), np.where(speed > 0, speed, np.nan))
    assert logarithmic.get_ylim()[0] > 1
