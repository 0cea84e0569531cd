"""Rainflow count of a contact stress, and what a drop uses up of a raceway's or ball's fatigue life.

Counting is ASTM E1049-85, section 5.4.4: the range of a pair of turning points counts one cycle once a later range
encloses it, half a cycle where it holds the record's start, and what is left at the end counts half cycles.

The measure is a Palmgren-Miner sum over the counted cycles with the stress-life exponent of rolling contact: life falls
with the third power of a ball's load (G. Lundberg, A. Palmgren, Dynamic Capacity of Rolling Bearings, 1947; ISO 281),
and Hertz's pressure grows with the cube root of the load, so with the ninth power of the pressure.  Limits: Lundberg and
Palmgren measured steady loads; a drop's loads change from one passage to the next, slide at the start and come near
static limits, where life tests are few.  So the sum is a measure by which drops of one bearing compare and add up, and
no life in hours.  Indentation (ISO 76: permanent set of 1e-4 of the ball's diameter at 4200 MPa) is another damage.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdbsim.errors import InputError

Array = NDArray[np.float64]

EXPONENT = 9.0  # of Hertz's peak pressure
# Pa: ISO 76, ball bearings: ball and race together keep a dent of 1e-4 of the ball's diameter
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
    """Return the peaks and valleys of a history (n,), with its first and last value.

    Raises
    ------
    InputError
        If the history is not a row of finite values.
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
            if len(stack) == 3:  # the range holds the start
                found.append((stack[0], stack[1], 0.5))
                del stack[0]
            else:
                found.append((stack[-3], stack[-2], 1.0))
                del stack[-3:-1]
    found += [(a, b, 0.5) for a, b in pairwise(stack)]
    ends = np.array([pair[:2] for pair in found]).reshape(-1, 2)
    return Cycles(ends.min(axis=1), ends.max(axis=1), np.array([pair[2] for pair in found]))


def fatigue_sum(cycles: Cycles, reference: float, exponent: float = EXPONENT) -> float:
    """Return the sum of n_i (range_i / reference)^exponent: how many cycles from 0 to the reference wear as much.

    Parameters
    ----------
    cycles : Cycles
        Of the peak Hertz pressure at one body, Pa.
    reference : float
        Pressure in which the sum is told, Pa; one for all drops that shall be compared.
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
    """What a drop does to the balls of one row.

    Attributes
    ----------
    equivalent_cycles : (n,) array
        Of each ball: `fatigue_sum` at the reference; sums of drops add.
    reference : float
        Pa.
    beyond_static_limit : bool
        True where the balls came above `STATIC_LIMIT`: then they may be indented and the sum does not hold.
    """

    equivalent_cycles: Array
    reference: float
    beyond_static_limit: bool

    @property
    def worst(self) -> float:
        """Equivalent cycles of the ball that suffers most."""
        return float(self.equivalent_cycles.max())


def drop_fatigue(pressure: ArrayLike, reference: float = 2000e6) -> DropFatigue:
    """Return the fatigue of the balls by a drop.

    Parameters
    ----------
    pressure : (n, k) array
        Peak Hertz pressure of each ball over time, Pa.  A ball is followed, not a place on the race: the stress of the
        ball's contact, whichever of its points is there.
    reference : float
        Pa.
    """
    histories = np.atleast_2d(np.asarray(pressure, dtype=float))
    sums = np.array([fatigue_sum(rainflow(history), reference) for history in histories])
    return DropFatigue(sums, reference, bool(np.any(histories > STATIC_LIMIT)))
