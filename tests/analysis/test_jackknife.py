"""The jackknife of a mean is the standard error of the mean, and its 95 % interval Student's."""

import numpy as np
import pytest
from scipy.stats import t as student

from tdbmon.analysis.jackknife import jackknife


def test_of_a_mean_it_is_students_interval():
    values = np.random.default_rng(0).standard_normal((7, 2)) * [1.0, 1e-6]
    left_out = (values.sum(axis=0) - values) / 6
    error = values.std(axis=0, ddof=1) / np.sqrt(7)
    assert 1.96 * np.sqrt(jackknife(left_out)) == pytest.approx(student.ppf(0.975, 6) * error, rel=1e-9)
