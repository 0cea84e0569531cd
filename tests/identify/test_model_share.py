"""What an ensemble says."""

import numpy as np

from tdbmon.identify.model_share import MEMBERS, band


def test_a_band_holds_a_further_draw_as_often_as_it_says():
    """By ranks that end at the least and the greatest of 32 draws it was 89 %."""
    rng = np.random.default_rng(0)
    low, middle, high = band(rng.standard_normal((MEMBERS, 20000)), axis=0)
    further = rng.standard_normal(20000)
    inside = float(np.mean((low <= further) & (further <= high)))
    assert abs(inside - 0.95) < 0.006
    assert np.all((low < middle) & (middle < high))
