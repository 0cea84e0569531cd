"""What a constant and lines of given frequencies leave of displacements, their amplitudes and phases fitted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def with_lines(t: np.ndarray, lines: Sequence[float]) -> np.ndarray:
    """Return the columns (n, p) of a constant, then of a cosine and a sine of each frequency, Hz, at times (n,), s."""
    waves = [wave(2 * np.pi * hz * t) for hz in lines for wave in (np.cos, np.sin)]
    return np.column_stack([np.ones_like(t), *waves])


def left_by(t: np.ndarray, data: np.ndarray, lines: Sequence[float]) -> float:
    """Return the sum of squares that a constant and lines of some frequencies, Hz, leave of displacements (n, k), m^2."""
    design = with_lines(t, lines)
    coefficients, *_ = np.linalg.lstsq(design, data.T, rcond=None)
    return float(np.sum((data.T - design @ coefficients) ** 2))
