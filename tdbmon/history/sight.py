"""What a comparison sees of an end: whether its bearing is worn is told by radius at rest, fall and deepest excursion alone.

An end that rests on its whirl or on the rotor's speed may be worn by half its gap and look as before.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tdbmon.history.change import Change
from tdbmon.history.compare import Comparison
from tdbmon.history.difference import LEAST_JUDGED
from tdbmon.quantity import percent

WEAR = ("gap_um", "fall_time_ms", "deepest_um")  # each grows with the gap, and stands for the others


@dataclass(frozen=True)
class Sight:
    """What a comparison sees of an end.

    Attributes
    ----------
    end : str
    told : tuple of Change
        Of `WEAR`, those that three drops before at least have.
    drops : int
        Drops before that one of `WEAR` was held against, of the one with most; 0 where the drop has none of them.
    growth : float or None
        Smallest growth of the radius at rest that would have been flagged, as a share of it; None where none would.
    slope : bool
        One of `WEAR` drifts: growth is over the slope of the drops before.
    least_drops : int
        As many drops as "as before" takes.
    limit : float
        Growth that must not be missed (`gap_growth`).
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
        """True where drops before show the end and this one does not."""
        return bool(self.told) and not any(change.estimate.known for change in self.told)

    @property
    def enough(self) -> bool:
        """True where so many drops before, and so alike, were compared that growth up to the limit would have been seen."""
        return self.drops >= self.least_drops and self.growth is not None and self.growth <= self.limit

    @property
    def seen_from(self) -> str:
        """The growth as text, rounded up: less would not have been seen; "" where none would."""
        return "" if self.growth is None else percent(math.ceil(round(100 * self.growth, 6)) / 100)


def sights(comparison: Comparison) -> tuple[Sight, ...]:
    """Return what a comparison sees of each end of the machine, and of ends that only older drops or machine files name."""
    ends = dict.fromkeys((*comparison.ends, *(c.end for c in comparison.changes if c.end)))
    return tuple(sight(comparison, end) for end in ends)


def sight(comparison: Comparison, end: str) -> Sight:
    """Return what a comparison sees of an end."""
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
    """Return what the drops before usually have of a quantity; None where none tells it."""
    values = [] if change is None else [e.value for _, e in change.earlier if e.value is not None]
    return float(np.median(values)) if values else None


def place_before(changes: dict[str, Change]) -> tuple[float, float] | None:
    """Return where the drops before begin, x and y from the clearance centre; None where that is not known."""
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
    """Return by which share the radius must grow for a quantity of `WEAR` to be flagged; None where that is not known.

    `smallest` is the difference of the quantity that would be called off.  The deepest excursion grows by what the radius grows
    by, the time of the fall with the root of its height.  What these have grown by along their slope was not seen: the limit
    along a slope is the radius's.
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
    """Return by which share the radius grows where the fall to the ring becomes so many times higher.

    The shaft falls from its place straight down to the ring: from above the centre through more than the radius.  The height is
    that of the circle, not g t²/2: where the other end touches first this one falls on otherwise than by gravity, and the
    height goes with the square of the time about as before.  Of drops that tell no circle the fall counts as the radius.
    """
    if not radius or place is None or math.hypot(*place) >= radius:
        return higher - 1
    x, y = place[0] / radius, place[1] / radius
    height = y + math.sqrt(1 - x**2)
    return math.hypot(x, higher * height - y) - 1
