"""Least-squares fit of a constant and of lines of given frequencies to displacements, and its residual."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def with_lines(t: np.ndarray, lines: Sequence[float]) -> np.ndarray:
    """Return the design matrix (n, p) of a constant, then a cosine and a sine of each frequency, Hz, at times (n,), s."""
    waves = [wave(2 * np.pi * hz * t) for hz in lines for wave in (np.cos, np.sin)]
    return np.column_stack([np.ones_like(t), *waves])


def left_by(t: np.ndarray, data: np.ndarray, lines: Sequence[float]) -> float:
    """Return the residual sum of squares, m^2, of displacements (n, k) fitted by a constant and lines of some frequencies, Hz."""
    design = with_lines(t, lines)
    coefficients, *_ = np.linalg.lstsq(design, data.T, rcond=None)
    return float(np.sum((data.T - design @ coefficients) ** 2))
