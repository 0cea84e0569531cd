"""What a reduced basis of the rotor loses against all modes, for the tests and the benchmark of the rotor's modes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from tdbsim.modes import Modes, Spring, free_free


@dataclass(frozen=True, eq=False)
class TruncationError:
    """What a reduced model loses against all modes, relative: of frequencies on the springs, of local compliance."""

    frequencies: np.ndarray
    compliance: np.ndarray


def compliance(modes: Modes, positions: ArrayLike) -> np.ndarray:
    """Return the elastic static compliance (k, k) between positions that modes hold, m/N."""
    elastic = slice(2, None)
    shapes = modes.at(np.atleast_1d(positions))[:, elastic]
    return (shapes / (2 * math.pi * modes.frequencies[elastic]) ** 2) @ shapes.T


def truncation_error(modes: Modes, springs: Sequence[Spring], n: int = 4) -> TruncationError:
    """Measure a reduced basis against the whole model at standstill in the x plane.

    Parameters
    ----------
    modes : Modes
        The reduced basis.
    springs : sequence of Spring
        Supports (their `stiffness_x`); the stiffer, the more the discarded modes matter.
    n : int
        Number of natural frequencies compared.

    Returns
    -------
    TruncationError
        ``frequencies`` (n,): relative errors of the natural frequencies; never negative, since a reduced model is
        stiffer.  ``compliance`` (springs,): the part of the elastic static compliance at each spring that is missing.
    """
    model = modes.model
    positions = np.array([spring.position for spring in springs])
    whole = free_free(model, len(model.plane_mass) - 2)

    def natural(basis: Modes) -> np.ndarray:
        shapes = basis.at(positions)
        stiffness = np.diag((2 * math.pi * basis.frequencies) ** 2)
        stiffness += (shapes.T * [spring.stiffness_x for spring in springs]) @ shapes
        return np.sqrt(np.linalg.eigvalsh(stiffness)[:n])

    exact = natural(whole)
    full = np.diag(compliance(whole, positions))
    return TruncationError(natural(modes) / exact - 1, 1 - np.diag(compliance(modes, positions)) / full)
