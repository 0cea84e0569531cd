"""What a fit leaves, and what else would change it, beside what the fitted values can do: projected off their slopes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdbmon.identify.least_squares import Fit
from tdbmon.identify.problem import Problem
from tdbmon.identify.robust import huber, spread

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BesideValues:
    """Rows of the drops one after the other, then what is known of each value beforehand.

    Attributes
    ----------
    weights : tuple of (m,) array
        By which the residuals of each drop count.
    basis : (rows, n) array
        What the values can do that are free, as orthonormal columns.
    begin : (drops + 1,) array
        The row at which each drop begins.
    left : (rows,) array
        What the fit leaves beside that.
    """

    weights: tuple[Array, ...]
    basis: Array
    begin: NDArray[np.intp]
    left: Array

    def of(self, changes: Sequence[Array]) -> Array:
        """Return what changes of the drops' residuals, (m,) each, are beside what the values can do, (rows,)."""
        return _beside(self.basis, self.weights, changes, np.zeros(len(self.left) - int(self.begin[-1])))


def beside_values(problem: Problem, fitted: Fit) -> BesideValues:
    """Return what a fit leaves beside what its values can do; one at its bound goes no further, as little as it may be off."""
    weights = tuple(np.sqrt(huber(each, spread(each))) for each in fitted.residuals)
    basis, begin = directions(problem, fitted.slopes, weights, ~problem.at_bound(fitted.point))
    left = _beside(basis, weights, fitted.residuals, problem.prior * fitted.point)
    return BesideValues(weights, basis, begin, left)


def _beside(basis: Array, weights: Sequence[Array], rows: Sequence[Array], last: Array) -> Array:
    column = np.concatenate([*(w * r for w, r in zip(weights, rows, strict=True)), last])
    return column - basis @ (basis.T @ column)


def directions(
    problem: Problem, slopes: Sequence[Array], weights: Sequence[Array], free: NDArray[np.bool_]
) -> tuple[Array, NDArray[np.intp]]:
    """Return what the fitted values can do, as orthonormal columns, and the row at which each drop begins.

    Parameters
    ----------
    problem : Problem
    slopes : sequence of (m, columns) array
        Of each drop.
    weights : sequence of (m,) array
        By which its residuals count.
    free : (parameters,) array
        Which values may move.

    Returns
    -------
    basis : (rows, n) array
        n values that are free.  Rows of the drops one after the other, then what is known of each value beforehand.
    begin : (drops + 1,) array
    """
    begin = np.concatenate([[0], np.cumsum([len(weight) for weight in weights])])
    count = len(problem.parameters)
    design = np.zeros((int(begin[-1]) + count, count))
    for drop, (jacobian, weight) in enumerate(zip(slopes, weights, strict=True)):
        design[begin[drop] : begin[drop + 1], problem.columns(drop)] = jacobian * weight[:, None]
    design[begin[-1] :] = np.diag(np.maximum(problem.prior, 1e-3))
    basis, _ = np.linalg.qr(design[:, free])
    return basis, begin
