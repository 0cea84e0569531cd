"""Sensitivity of a comparison to wear at an end, which only radius at rest, fall time and deepest excursion show.

Judged by its whirl or the rotor's speed alone, an end may be worn by half its gap and look as before.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tdbmon.history.change import Change
from tdbmon.history.compare import Comparison
from tdbmon.history.difference import LEAST_JUDGED
from tdbmon.quantity import percent

WEAR = ("gap_um", "fall_time_ms", "deepest_um")  # each grows with the gap, and can replace the others


@dataclass(frozen=True)
class Sight:
    """Sensitivity of a comparison to wear at an end.

    Attributes
    ----------
    end : str
    told : tuple of Change
        Features of `WEAR` in at least three earlier drops.
    drops : int
        Largest baseline, in drops, of a feature of `WEAR`; 0 if the drop has none of them.
    growth : float or None
        Smallest relative growth of the radius at rest that would have been flagged; None if none would.
    slope : bool
        A feature of `WEAR` drifts: growth is relative to its slope.
    least_drops : int
        Number of drops needed for "as before".
    limit : float
        Growth that must be detectable (`gap_growth`).
    """

    end: str
    told: tuple[Change, ...]
    drops: int
    growth: float | None
    slope: bool
    least_drops: int
    limit: float

    @property
    def lost(self) -> bool:
        """True if earlier drops show the end and this one does not."""
        return bool(self.told) and not any(change.estimate.known for change in self.told)

    @property
    def enough(self) -> bool:
        """True if the earlier drops are numerous and similar enough for growth to the limit to be detected."""
        return self.drops >= self.least_drops and self.growth is not None and self.growth <= self.limit

    @property
    def seen_from(self) -> str:
        """The smallest detectable growth as text, rounded up; "" if none is."""
        return "" if self.growth is None else percent(math.ceil(round(100 * self.growth, 6)) / 100)


def sights(comparison: Comparison) -> tuple[Sight, ...]:
    """Return the sight of each end of the machine, and of ends that only older drops or machine files name."""
    ends = dict.fromkeys((*comparison.ends, *(c.end for c in comparison.changes if c.end)))
    return tuple(sight(comparison, end) for end in ends)


def sight(comparison: Comparison, end: str) -> Sight:
    """Return the sight of one end."""
    settings = comparison.settings
    changes = {c.kind.name: c for c in comparison.changes if c.end == end}
    wear = [changes[name] for name in WEAR if name in changes]
    told = tuple(change for change in wear if len(change.earlier) >= LEAST_JUDGED)
    radius, place = usual_before(changes.get("gap_um")), place_before(changes)
    growths = [g for c in wear if (g := _growth(c, comparison.detectable(c), radius, place)) is not None]
    before = [c.difference.before for c in wear if c.difference is not None]
    drops, slope = max((each.n for each in before), default=0), any(each.slope is not None for each in before)
    growth, least, limit = min(growths, default=None), settings.compare.least_drops, settings.inspect.gap_growth
    return Sight(end, told, drops, growth, slope, least, limit)


def usual_before(change: Change | None) -> float | None:
    """Return the usual value of a feature in the earlier drops; None if none has it."""
    values = [] if change is None else [e.value for _, e in change.earlier if e.value is not None]
    return float(np.median(values)) if values else None


def place_before(changes: dict[str, Change]) -> tuple[float, float] | None:
    """Return the usual levitated position of the earlier drops, x and y from the clearance centre; None if unknown."""
    found = []
    for axis in "xy":
        start, centre = (usual_before(changes.get(f"{what}_{axis}_um")) for what in ("levitated", "gap_centre"))
        if start is None or centre is None:
            return None
        found.append(start - centre)
    return found[0], found[1]


def _growth(
    change: Change, smallest: float | None, radius: float | None, place: tuple[float, float] | None
) -> float | None:
    """Return the relative growth of the radius at which a feature of `WEAR` would be flagged; None if unknown.

    `smallest` is the smallest difference of the feature that would be flagged.  The deepest excursion grows by as much as the
    radius, the fall time with the root of the height.  Growth that these have accumulated along their slope counts as
    undetected, since along a slope the limit applies to the radius.
    """
    found, usual = change.difference, change.level
    if found is None or usual is None or smallest is None or usual <= 0:
        return None
    if change.kind.name != "gap_um":
        smallest = max(smallest, found.before.centre - usual)
    if change.kind.name == "fall_time_ms":
        return growth_by_fall((1 + smallest / usual) ** 2, radius, place)
    return smallest / radius if radius else None


def growth_by_fall(higher: float, radius: float | None, place: tuple[float, float] | None) -> float:
    """Return the relative growth of the radius for a fall `higher` times as high.

    The shaft falls straight down from its place to the ring: from above the centre through more than the radius.  The height is
    that within the circle, not g t²/2: if the other end touches first, this one no longer falls by gravity alone, and the height
    still goes about with the square of the time.  Without a circle the height is taken as the radius.
    """
    if not radius or place is None or math.hypot(*place) >= radius:
        return higher - 1
    x, y = place[0] / radius, place[1] / radius
    height = y + math.sqrt(1 - x**2)
    return math.hypot(x, higher * height - y) - 1
