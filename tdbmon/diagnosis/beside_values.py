"""Residuals of a fit, and changes of them, projected onto the orthogonal complement of the fit's Jacobian."""

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
    """Weighted residuals without the part that the free values could explain.

    Rows: the residuals of the drops one after the other, then one prior of each value.

    Attributes
    ----------
    weights : tuple of (m,) array
        Weights of the residuals of each drop.
    basis : (rows, n) array
        Orthonormal basis of the Jacobian's columns for the free values.
    begin : (drops + 1,) array
        The row at which each drop begins.
    left : (rows,) array
        Weighted residuals, orthogonal to `basis`.
    """

    weights: tuple[Array, ...]
    basis: Array
    begin: NDArray[np.intp]
    left: Array

    def of(self, changes: Sequence[Array]) -> Array:
        """Return changes of the drops' residuals, (m,) each, without their part in `basis`, (rows,)."""
        return _beside(self.basis, self.weights, changes, np.zeros(len(self.left) - int(self.begin[-1])))


def beside_values(problem: Problem, fitted: Fit) -> BesideValues:
    """Return a fit's residuals without the part that its values could explain; a value at its bound counts as fixed."""
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
    """Return an orthonormal basis of the weighted Jacobian, and the row at which each drop begins.

    Parameters
    ----------
    problem : Problem
    slopes : sequence of (m, columns) array
        Jacobian of each drop.
    weights : sequence of (m,) array
        Weights of its residuals.
    free : (parameters,) array
        Which values may move.

    Returns
    -------
    basis : (rows, n) array
        n free values.  Rows: the drops one after the other, then one prior of each value.
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
