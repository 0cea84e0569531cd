"""A keyphasor mark that moved between the drops: every probe sees the same surface, turned relative to the mark.

The 2X reading of a levitated shaft is the runout of its surface at any speed; unbalance is 1X.  So relative to a mark that stays,
the 2X phasors of all probes are the same in every drop.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tdbmon.identify.drop import MeasuredDrop

# surfaces at two ends that differ from drop to drop look turned alike in one of nine pairs of drops: too often with three drops
_LEAST_DROPS = 4
_CLEAR = 5.0  # standard deviations, of all phasors together, and of a turn
_ALIKE = 0.15  # share of their size by which phasors may differ beyond noise once turned back
# multiple of the mean square difference of two drops by noise alone that one in a hundred exceeds (chi-square of 8)
_CHANCE = 2.5
_MOVED = math.radians(10)  # least turn; a delay common to all channels turns the phasors by less


def moved_mark(drops: Sequence[MeasuredDrop]) -> str | None:
    """Say by how much the mark has moved, if the levitated shaft shows it; else None.

    Angles are known up to half a turn.
    """
    if len(drops) < _LEAST_DROPS or not all(_orders_told(drop) for drop in drops):
        return None
    names = set.intersection(*({probe.name for probe in drop.probes} for drop in drops))
    (first, chance), *others = (_twice_a_revolution(drop, names) for drop in drops)
    size = float(np.linalg.norm(first))
    if not size > _CLEAR * chance:  # true also if no probe is common to all drops
        return None
    turns, moved = [], False
    for seen, chance_too in others:
        overlap = complex(np.sum(seen * np.conj(first)))
        apart = float(np.linalg.norm(seen * np.exp(-1j * np.angle(overlap)) - first))
        if apart**2 > (_ALIKE * size) ** 2 + _CHANCE * 2 * (chance**2 + chance_too**2):
            return None
        turn, unsure = float(np.angle(overlap)) / 2, math.hypot(chance, chance_too) / size / 2
        moved |= abs(turn) > max(_MOVED, _CLEAR * unsure)
        turns.append(turn)
    if not moved:
        return None
    by = ", ".join(f"{math.degrees(turn):+.0f} deg in {drop.name}" for turn, drop in zip(turns, drops[1:], strict=True))
    return (
        f"the keyphasor's mark has moved between the drops: at 2X all probes see the same surface as in"
        f" {drops[0].name}, turned by {by} (or half a turn more). Nothing that depends on the shaft's angle can be determined"
    )


def _orders_told(drop: MeasuredDrop) -> bool:
    return math.isfinite(drop.angle_sigma) and all(math.isfinite(noise.order_sigma) for noise in drop.noise)


def _twice_a_revolution(drop: MeasuredDrop, names: set[str]) -> tuple[NDArray[np.complex128], float]:
    """Return the 2X phasors of a drop's levitated readings relative to the mark, and the noise of either part of all, m."""
    chosen = [noise for probe, noise in zip(drop.probes, drop.noise, strict=True) if probe.name in names]
    seen = np.array([noise.orders[1] for noise in chosen]) * np.exp(-2j * drop.angle)
    return seen, math.sqrt(sum(noise.order_sigma**2 for noise in chosen))
