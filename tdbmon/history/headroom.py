"""Headroom of grown gaps to the limit of their growth (`gap_growth`), relative to the radius at rest."""

from __future__ import annotations

from dataclasses import dataclass

from tdbmon.history.change import Change
from tdbmon.history.compare import Comparison
from tdbmon.history.sight import growth_by_fall, place_before, usual_before

_GAPS = (
    "gap_um",
    "gap_from_swing_um",
    "fall_time_ms",
    "deepest_um",
    "air_gap_fitted_um",
)  # as the radius grows, so do these


@dataclass(frozen=True)
class Headroom:
    """Significant growth of a gap, or of a feature that grows with it.

    Attributes
    ----------
    change : Change
    radius : float or None
        Radius at rest of the earlier drops, m.
    growth : float or None
        Relative growth of the radius inferred from this feature; None if no earlier drop has a radius.
    limit : float
    """

    change: Change
    radius: float | None
    growth: float | None
    limit: float


def headroom(comparison: Comparison) -> tuple[Headroom, ...]:
    """Return the grown gaps and features that grow with them, in the order of reports."""
    return tuple(
        _of(change, comparison)
        for change in comparison.changes
        if change.kind.name in _GAPS and change.flag and change.difference is not None and change.difference.value > 0
    )


def _of(change: Change, comparison: Comparison) -> Headroom:
    of_end = {c.kind.name: c for c in comparison.changes if c.end == change.end}
    radius, limit = usual_before(of_end.get("gap_um")), comparison.settings.inspect.gap_growth
    level, value = change.level, change.estimate.value
    growth = None
    if radius and level and value is not None:
        growth = (value - level) / radius
        if change.kind.name == "gap_um":
            growth = change.grown  # as the limit counts it
        if change.kind.name == "fall_time_ms":
            growth = growth_by_fall((value / level) ** 2, radius, place_before(of_end))
    return Headroom(change, radius, growth, limit)
