"""How residuals count."""

import numpy as np
import pytest

from tdbmon.identify.robust import huber, spread


def test_samples_far_off_count_linearly_and_the_deceleration_by_its_square():
    residual = np.array([0.5, -2.0, 12.0, -12.0, 12.0])
    counted = huber(residual, 1.0) * residual**2
    assert counted == pytest.approx([0.25, 4.0, 36.0, 36.0, 144.0])
    assert huber(residual, 2.0) * residual**2 == pytest.approx([0.0625, 1.0, 18.0, 18.0, 36.0])


def test_spread_is_that_of_most_and_never_below_one():
    rng = np.random.default_rng(1)
    wide = 3 * rng.standard_normal(4000)
    wide[:40] *= 1e3
    assert spread(wide) == pytest.approx(3.0, rel=0.06)
    assert spread(0.1 * wide[40:]) == 1.0
