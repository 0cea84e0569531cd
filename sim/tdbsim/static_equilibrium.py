"""Static equilibrium of a bearing's balls under load: Newton's method on a convex potential, vectorised over instants."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tdbsim.errors import InputError

Array = NDArray[np.float64]

# potential (k,), its gradient (k, d), its second derivatives (k, d, d), sum of the ball loads (k,)
Potential = Callable[[Array, NDArray[np.intp]], tuple[Array, Array, Array, Array]]

_RESIDUAL = 1e-11  # of the load or of the sum of the ball loads, whichever is greater
_LEVENBERG = 1e-10  # of the mean stiffness, added: finite steps in directions in which no ball is loaded
_ITERATIONS = 200


def static_equilibrium(potential: Potential, start: Array, load: Array, reach: float, what: str) -> Array:
    """Return the displacements at which the gradient of the potential equals the load.

    Compression-only Hertz springs have a convex potential, so a step that lowers the potential less the work of the load always
    exists, and the equilibrium is unique.

    Parameters
    ----------
    potential : callable
        Of displacements (k, d) and indices (k,) of the instants.
    start, load : (k, d) array
        First guess and load, in coordinates of one unit (angles times a radius, moments over it).
    reach : float
        Longest step, in the same unit.
    what : str
        Name of the loaded part in the message.

    Raises
    ------
    InputError
        If there is no equilibrium: the balls cannot carry a load.
    """
    where = np.array(start, dtype=float)
    open_ = np.arange(len(where))
    for _ in range(_ITERATIONS):
        value, gradient, curvature, carried = potential(where[open_], open_)
        residual = gradient - load[open_]
        size = np.linalg.norm(residual, axis=1)
        left = size > _RESIDUAL * np.maximum(np.linalg.norm(load[open_], axis=1), carried)
        if not left.any():
            return where
        open_, residual, size = open_[left], residual[left], size[left]
        merit = value[left] - np.sum(load[open_] * where[open_], axis=1)
        step = _newton_step(residual, curvature[left], reach)
        where[open_] += _shortened(potential, where[open_], open_, load[open_], step, merit, size)[:, None] * step
    raise InputError(
        f"{what}: {len(open_)} of {len(where)} loads reach no equilibrium within {_ITERATIONS} steps; the balls cannot carry"
        f" a load such as {np.array2string(load[open_[0]], precision=4)} N: check its direction and the preload"
    )


def _newton_step(residual: Array, curvature: Array, reach: float) -> Array:
    d = residual.shape[1]
    mean = np.trace(curvature, axis1=1, axis2=2) / d
    loose = mean <= 0  # no ball is loaded: step along the load until one is
    regular = curvature + np.where(loose, 1.0, _LEVENBERG * mean)[:, None, None] * np.eye(d)
    step = -np.linalg.solve(regular, residual[..., None])[..., 0]
    length = np.linalg.norm(step, axis=1)
    limit = np.where(loose | (length > reach), reach / np.where(length > 0, length, 1.0), 1.0)
    return np.asarray(limit[:, None] * step)


def _shortened(
    potential: Potential, where: Array, index: NDArray[np.intp], load: Array, step: Array, merit: Array, size: Array
) -> Array:
    """Return the factor on each step (k, d) with which it lowers the merit or the residual."""
    share = np.ones(len(where))
    todo = np.arange(len(where))
    for _ in range(40):
        tried = where[todo] + share[todo, None] * step[todo]
        value, gradient, _, _ = potential(tried, index[todo])
        better = value - np.sum(load[todo] * tried, axis=1) < merit[todo]
        better |= np.linalg.norm(gradient - load[todo], axis=1) < size[todo]
        todo = todo[~better]
        if not len(todo):
            break
        share[todo] /= 2
    return share
