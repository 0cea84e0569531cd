"""The size of an effect, counted from the value at which it is off: a finite one, or infinite stiffness of a spring in series."""

from __future__ import annotations

import math

import numpy as np
from tdbsim.effect import Parameter as Declared


def off_of(size: Declared) -> float:
    """Return the value (SI) of a parameter at which the effect is off: infinite for a spring in series, 0 for words."""
    return size.off if isinstance(size.off, float) else 0.0


def off_when_stiff(size: Declared) -> bool:
    """True if the effect is off at an infinite value and grows as the parameter falls."""
    return math.isinf(off_of(size))


def sized(size: Declared, share: float) -> float:
    """Return the value at a share of the typical size; of a spring, at that share of the typical period."""
    if off_when_stiff(size):
        return size.typical / share**2
    return off_of(size) + share * (size.typical - off_of(size))


def share_of(size: Declared, value: float) -> float:
    """Return a value as a share of the typical size; of a spring, the share of the typical compliance."""
    if off_when_stiff(size):
        return size.typical / value
    return abs(value - off_of(size)) / abs(size.typical - off_of(size))


def nearer(size: Declared, value: float, share: float) -> float:
    """Return the value at a share of its distance from off, within the bounds."""
    found = value / share if off_when_stiff(size) else off_of(size) + share * (value - off_of(size))
    return min(max(found, size.low), size.high)


def scaled(size: Declared, share: float, amount: float) -> float | None:
    """Return `amount` times the size at a share of the typical one, within the bounds; None if its sign is not allowed."""
    trial, off = sized(size, share), off_of(size)
    if off_when_stiff(size):
        return None if amount <= 0 else float(np.clip(trial / amount, size.low, size.high))
    value = off + amount * (trial - off)
    if not size.low <= value <= size.high and (value - off) * (size.typical - off) < 0:
        return None
    return float(np.clip(value, size.low, size.high))
