"""Rainflow count of a contact stress, and the fatigue damage of balls or raceways by a drop.

Counting follows ASTM E1049-85, section 5.4.4: the range of a pair of turning points counts as one cycle once a later range
encloses it, as half a cycle where it contains the record's start; the remaining ranges count as half cycles.

The measure is a Palmgren-Miner sum over the counted cycles with the stress-life exponent of rolling contact: life falls
with the third power of a ball's load (G. Lundberg, A. Palmgren, Dynamic Capacity of Rolling Bearings, 1947; ISO 281),
and the Hertz pressure grows with the cube root of the load, hence with the ninth power of the pressure.  Limits: Lundberg and
Palmgren measured steady loads; in a drop, loads change from one passage to the next, contacts slide at first and come near
static limits, where life tests are few.  So the sum serves to compare and add up drops of one bearing, and is no life in hours.
Indentation (ISO 76: permanent set of 1e-4 of the ball's diameter at 4200 MPa) is a separate damage.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdbsim.errors import InputError

Array = NDArray[np.float64]

EXPONENT = 9.0  # of the peak Hertz pressure
# Pa; ISO 76, ball bearings: total permanent set of ball and race of 1e-4 of the ball's diameter
STATIC_LIMIT = 4200e6


@dataclass(frozen=True)
class Cycles:
    """Counted cycles.

    Attributes
    ----------
    low, high : (k,) array
        Valley and peak of each, in the unit of the history.
    count : (k,) array
        1 or 0.5.
    """

    low: Array
    high: Array
    count: Array

    @property
    def range(self) -> Array:
        """Peak less valley of each cycle."""
        return self.high - self.low


def turning_points(history: ArrayLike) -> Array:
    """Return the peaks and valleys of a history (n,), including its first and last value.

    Raises
    ------
    InputError
        If the history is not one-dimensional and finite.
    """
    values = np.asarray(history, dtype=float)
    if values.ndim != 1 or not np.all(np.isfinite(values)):
        raise InputError("a stress history must be one row of finite values")
    values = values[np.concatenate([[True], np.diff(values) != 0])] if len(values) else values
    if len(values) < 3:
        return values
    rising = np.diff(values) > 0
    return values[np.concatenate([[True], rising[1:] != rising[:-1], [True]])]


def rainflow(history: ArrayLike) -> Cycles:
    """Return the cycles of a history (n,) by ASTM E1049-85, 5.4.4 (raises as `turning_points`)."""
    found: list[tuple[float, float, float]] = []
    stack: list[float] = []
    for point in turning_points(history):
        stack.append(float(point))
        while len(stack) >= 3 and abs(stack[-1] - stack[-2]) >= abs(stack[-2] - stack[-3]):
            if len(stack) == 3:  # the range contains the start
                found.append((stack[0], stack[1], 0.5))
                del stack[0]
            else:
                found.append((stack[-3], stack[-2], 1.0))
                del stack[-3:-1]
    found += [(a, b, 0.5) for a, b in pairwise(stack)]
    ends = np.array([pair[:2] for pair in found]).reshape(-1, 2)
    return Cycles(ends.min(axis=1), ends.max(axis=1), np.array([pair[2] for pair in found]))


def fatigue_sum(cycles: Cycles, reference: float, exponent: float = EXPONENT) -> float:
    """Return the sum of n_i (range_i / reference)^exponent: the equivalent number of cycles from 0 to the reference.

    Parameters
    ----------
    cycles : Cycles
        Of the peak Hertz pressure at one body, Pa.
    reference : float
        Reference pressure, Pa; the same for all drops to be compared.
    exponent : float
        Stress-life exponent.

    Raises
    ------
    InputError
        If the reference or the exponent is not positive.
    """
    if not (reference > 0 and exponent > 0):
        raise InputError(f"reference {reference * 1e-6:g} MPa and exponent {exponent:g} must be positive")
    return float(np.sum(cycles.count * (cycles.range / reference) ** exponent))


@dataclass(frozen=True)
class DropFatigue:
    """Fatigue of the balls of one row by a drop.

    Attributes
    ----------
    equivalent_cycles : (n,) array
        `fatigue_sum` of each ball at the reference; those of several drops add up.
    reference : float
        Pa.
    beyond_static_limit : bool
        True where the pressure exceeded `STATIC_LIMIT`: balls may be indented, and the sum is not valid.
    """

    equivalent_cycles: Array
    reference: float
    beyond_static_limit: bool

    @property
    def worst(self) -> float:
        """Equivalent cycles of the most damaged ball."""
        return float(self.equivalent_cycles.max())


def drop_fatigue(pressure: ArrayLike, reference: float = 2000e6) -> DropFatigue:
    """Return the fatigue of the balls by a drop.

    Parameters
    ----------
    pressure : (n, k) array
        Peak Hertz pressure of each ball over time, Pa; of the ball's contact, not of a fixed point on ball or race.
    reference : float
        Pa.
    """
    histories = np.atleast_2d(np.asarray(pressure, dtype=float))
    sums = np.array([fatigue_sum(rainflow(history), reference) for history in histories])
    return DropFatigue(sums, reference, bool(np.any(histories > STATIC_LIMIT)))
