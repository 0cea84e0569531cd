"""The size of an effect, counted from where the effect is off: at a finite value mostly; a spring in series, when it is stiff."""

from __future__ import annotations

import math

import numpy as np
from tdbsim.effect import Parameter as Declared


def off_of(size: Declared) -> float:
    """Return the value (SI) at which an effect is off by a parameter: infinite where it is off when stiff, 0 for words."""
    return size.off if isinstance(size.off, float) else 0.0


def off_when_stiff(size: Declared) -> bool:
    """True where the effect grows as the parameter falls."""
    return math.isinf(off_of(size))


def sized(size: Declared, share: float) -> float:
    """Return the value at a share of the typical size; of a spring, where its period is that share of the typical one."""
    if off_when_stiff(size):
        return size.typical / share**2
    return off_of(size) + share * (size.typical - off_of(size))


def share_of(size: Declared, value: float) -> float:
    """Return a value as a share of the typical size; of a spring, by how much it yields."""
    if off_when_stiff(size):
        return size.typical / value
    return abs(value - off_of(size)) / abs(size.typical - off_of(size))


def nearer(size: Declared, value: float, share: float) -> float:
    """Return a value at a share of its own way from where the effect is off, within the bounds."""
    found = value / share if off_when_stiff(size) else off_of(size) + share * (value - off_of(size))
    return min(max(found, size.low), size.high)


def scaled(size: Declared, share: float, amount: float) -> float | None:
    """Return `amount` times the value at a share of the typical size, within the bounds; None where its sign is impossible."""
    trial, off = sized(size, share), off_of(size)
    if off_when_stiff(size):
        return None if amount <= 0 else float(np.clip(trial / amount, size.low, size.high))
    value = off + amount * (trial - off)
    if not size.low <= value <= size.high and (value - off) * (size.typical - off) < 0:
        return None
    return float(np.clip(value, size.low, size.high))
