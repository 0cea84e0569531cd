"""One feature of a drop against the earlier drops: difference, its significance, and drift."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tdbmon.estimate import Estimate
from tdbmon.history.catalogue import Entry
from tdbmon.history.correction import corrected
from tdbmon.history.difference import LEAST_JUDGED, Difference, baseline, compare_value
from tdbmon.history.drop import Drop
from tdbmon.history.feature import KINDS, Feature, FeatureKind, Key, in_order
from tdbmon.history.settings import Settings
from tdbmon.history.trend import Trend, order_p, trend_of

_TREND = 60  # latest drops used for a trend
_NEARER, _ALIKE = 1 / 2, 2 / 3  # shares of this drop's difference: back at the baseline, and alike
_NONE = np.ones(0, dtype=bool)  # mask of no earlier drops
NO_SUCH = "this drop has no such end"  # reason for a feature of earlier drops that this drop's analysis does not have


@dataclass(frozen=True)
class Change:
    """One feature of the drop against the earlier drops.

    Attributes
    ----------
    kind : FeatureKind
    end : str
    estimate : Estimate
        Of the drop.
    earlier : tuple of (str, Estimate)
        Of the matching drops that have it, with their identifiers, in order.
    numbers : tuple of int
        Position of each of these among the matching drops, and of this drop, which is last.
    left_out : tuple of str
        Identifiers of outliers among them, excluded from the baseline.
    difference : Difference or None
        None if the drop or all earlier ones lack the feature.
    p_adjusted : float or None
        p-value of the difference, corrected for multiple testing among the judged features, or among the others.
    differs : bool
        Significantly different, and not `as_in` earlier drops.
    p_drift : float or None
        p-value of the trend (see `trend`), corrected for the number of judged features; None if the feature is not judged or
        the drop lacks it.
    drifts : bool
        It has a significant trend.
    why : str
        Why there is no difference.
    as_in : tuple of str
        Earlier outliers of about the same deviation after which the feature returned to the baseline: an occasional second form.
    """

    kind: FeatureKind
    end: str
    estimate: Estimate
    earlier: tuple[tuple[str, Estimate], ...]
    numbers: tuple[int, ...]
    left_out: tuple[str, ...]
    difference: Difference | None
    p_adjusted: float | None
    differs: bool
    p_drift: float | None
    drifts: bool
    why: str
    as_in: tuple[str, ...] = ()

    @property
    def key(self) -> Key:
        """Name and end."""
        return self.kind.name, self.end

    @property
    def flag(self) -> bool:
        """True if the feature differs and is judged."""
        return self.differs and self.kind.judged

    @property
    def noted(self) -> bool:
        """True if the feature differs but is not judged: reported beside the verdict."""
        return self.differs and not self.kind.judged

    @property
    def title(self) -> str:
        """Title with the end, for reports."""
        return self.kind.title_at(self.end)

    @property
    def p(self) -> float | None:
        """Uncorrected p-value of the difference; None if unknown."""
        return None if self.difference is None else self.difference.p

    @property
    def since(self) -> str:
        """Identifier of the first drop of the unbroken run of outliers in the same direction before this one; "" if none."""
        first = ""
        if self.difference is None:
            return first
        for drop, estimate in reversed(self.earlier):
            off = (estimate.value or 0.0) - self.difference.before.centre
            if drop not in self.left_out or off * self.difference.value <= 0:
                break
            first = drop
        return first

    @property
    def series(self) -> tuple[Estimate, ...]:
        """Its known values in the latest 60 matching drops and in this one."""
        earlier = tuple(e for _, e in self.earlier[-_TREND:])
        return (*earlier, self.estimate) if self.estimate.known else earlier

    @cached_property
    def trend(self) -> Trend | None:
        """Trend of `series`; None below four values."""
        numbers = self.numbers if self.estimate.known else self.numbers[:-1]
        return trend_of(self.series, numbers[-len(self.series) :])

    @property
    def level(self) -> float | None:
        """Reference of its growth: centre of the baseline, or start of the trend line if it has a slope; None without them."""
        if self.difference is None:
            return None
        trend = None if self.difference.before.slope is None else self.trend
        return self.difference.before.centre if trend is None else trend.first

    @property
    def growth_from(self) -> float | None:
        """Reference of its growth; the median of the baseline if this drop lacks the feature; None without a baseline."""
        before = [e.value for drop, e in self.earlier if e.value is not None and drop not in self.left_out]
        return float(np.median(before)) if self.level is None and before else self.level

    @property
    def grown(self) -> float | None:
        """Significant relative growth: against the baseline, or along the trend since the first drop if it drifts.

        None without one, or if the reference is not positive.
        """
        grown = []
        level = self.level
        if self.differs and self.estimate.value is not None and level is not None and level > 0:
            grown.append(self.estimate.value / level - 1)
        if self.drifts and self.trend is not None and self.trend.grown is not None:
            grown.append(self.trend.grown)
        return max(grown, default=None)

    def trend_drops(self, current: str) -> list[str]:
        """Return the identifiers of the drops in the trend, given that of the drop compared."""
        return [drop for drop, _ in self.earlier[-_TREND:]] + ([current] if self.estimate.known else [])


def changes_of(
    drop: Drop, matched: list[Entry], before: dict[int, tuple[Feature, ...]], settings: Settings
) -> tuple[Change, ...]:
    """Return the change of every feature of the drop or of the matching ones (`before`, by result), in the order of reports."""
    mine = {f.key: f.estimate for f in drop.features}
    theirs: dict[Key, list[tuple[str, Estimate]]] = {}
    for entry in matched:
        for feature in before[entry.result]:
            if feature.estimate.known:
                theirs.setdefault(feature.key, []).append((entry.id, feature.estimate))
    keys = [key for key in mine if key[0] in KINDS and (mine[key].known or key in theirs)]
    keys += [key for key in theirs if key not in mine and key[0] in KINDS]
    keys = in_order(keys, drop.ends)
    level = settings.compare.significance
    place = {entry.id: number for number, entry in enumerate(matched)}
    numbers = {key: (*(place[drop] for drop, _ in theirs.get(key, [])), len(matched)) for key in keys}
    kept = _kept({key: (mine.get(key), theirs.get(key, [])) for key in keys}, numbers, settings)
    found = [_compared(key, mine.get(key), theirs.get(key, []), numbers[key], kept[key]) for key in keys]
    drift_of = _together({c.key: _order_p(c) for c in found if c.kind.judged}, settings)
    found = [
        _compared(c.key, c.estimate, c.earlier, c.numbers, kept[c.key], level)
        if drift_of.get(c.key, 1.0) <= level
        else c
        for c in found
    ]
    # judged features and the others are corrected for multiple testing separately
    p_of = {
        key: p
        for counts in (True, False)
        for key, p in _together({c.key: c.p for c in found if c.kind.judged == counts}, settings).items()
    }
    changes = []
    for change in found:
        p, drift = p_of.get(change.key), drift_of.get(change.key)
        n = 0 if change.difference is None else change.difference.before.n
        off = p is not None and p <= level and n >= LEAST_JUDGED
        as_in = _as_in(change) if off and change.kind.two_forms else ()
        changes.append(
            replace(
                change,
                p_adjusted=p,
                differs=off and not as_in,
                as_in=as_in,
                p_drift=drift,
                drifts=drift is not None and drift <= level,
            )
        )
    return tuple(changes)


def _kept(
    series: dict[Key, tuple[Estimate | None, Sequence[tuple[str, Estimate]]]],
    numbers: dict[Key, tuple[int, ...]],
    settings: Settings,
) -> dict[Key, NDArray[np.bool_]]:
    """Return the baseline of each feature as a mask over its earlier drops: those that were no outliers when they came.

    As with flags, judged features and the others are corrected for multiple testing separately.
    """
    kept: dict[Key, NDArray[np.bool_]] = {}
    for counts in (True, False):
        keys = [key for key in series if KINDS[key[0]].judged == counts and series[key][1]]
        drops = max((numbers[key][-1] for key in keys), default=0)
        values = np.full((drops, len(keys)), np.nan)
        for column, key in enumerate(keys):
            values[list(numbers[key][:-1]), column] = [e.value for _, e in series[key][1]]
        least = np.array([_least(key, *series[key]) for key in keys])
        found = baseline(values, least, settings.compare.significance, settings.compare.correction)
        kept |= {key: found[list(numbers[key][:-1]), column] for column, key in enumerate(keys)}
    return {key: kept.get(key, _NONE) for key in series}


def _least(key: Key, estimate: Estimate | None, earlier: Sequence[tuple[str, Estimate]]) -> float:
    """Return the lower bound of a feature's scatter."""
    kind = KINDS[key[0]]
    if not kind.relative:
        return kind.least
    # if the earlier drops are all zero, only this one has a magnitude
    own = None if estimate is None else estimate.value
    return kind.least * (abs(float(np.median([e.value for _, e in earlier]))) or abs(own or 0.0))


def _as_in(change: Change) -> tuple[str, ...]:
    """Return the earlier drops that were off about as far as this one and were followed by at least three back at the baseline.

    A feature that depends on how the bounces of both ends coincide has two forms on some sound machines, one of them rare; a
    rare form that has occurred before is no change.  Wear does not come back, and three outliers in a row count as a change.
    """
    if change.difference is None or change.difference.value == 0:
        return ()
    found, back, row = [], 0, 1
    for drop, estimate in reversed(change.earlier):
        share = ((estimate.value or 0.0) - change.difference.before.centre) / change.difference.value
        if drop not in change.left_out:
            back += share < _NEARER
        elif not back:
            row += 1
        elif back >= LEAST_JUDGED and _ALIKE < share < 1 / _ALIKE:
            found.append(drop)
    return tuple(reversed(found)) if row < LEAST_JUDGED else ()


def _order_p(change: Change) -> float | None:
    """Return the p-value of the feature's trend; None if this drop lacks the feature."""
    return order_p(np.array([e.value for e in change.series], float)) if change.estimate.known else None


def _together(p: dict[Key, float | None], settings: Settings) -> dict[Key, float]:
    """Return p-values corrected for multiple testing, by name and end; unknown ones are left out."""
    known = {key: each for key, each in p.items() if each is not None}
    return dict(zip(known, corrected(list(known.values()), settings.compare.correction), strict=True))


def untold_of(drop: Drop, changes: tuple[Change, ...], number: int) -> tuple[Change, ...]:
    """Return the judged features without a value in the drop and in all `number` earlier ones, fitted ones aside."""
    told = {c.key for c in changes}
    lacking = {f.key: f.estimate for f in drop.features if f.name in KINDS and f.key not in told}
    return tuple(
        _compared(key, lacking[key], [], (number,), _NONE)
        for key in in_order(lacking, drop.ends)
        if KINDS[key[0]].judged and not KINDS[key[0]].forces
    )


def _compared(
    key: Key,
    estimate: Estimate | None,
    earlier: Sequence[tuple[str, Estimate]],
    numbers: tuple[int, ...],
    kept: NDArray[np.bool_],
    slow: float = 0.0,
) -> Change:
    """Return one feature against its baseline (the earlier drops in `kept`), before correction for multiple testing.

    For a feature that drifts, `slow` is the significance level of the baseline's trend: below it, the latest 60 drops are
    extrapolated along their slope, unless a step describes them better.  This drop is no part of that trend, since an outlier
    would create a slope.
    """
    kind, end = KINDS[key[0]], key[1]
    if estimate is None:
        estimate = Estimate.missing(kind.unit, NO_SUCH)
    difference, why = None, ""
    left_out: tuple[str, ...] = ()
    if estimate.value is None:
        why = estimate.why
    elif not earlier:
        why = "no earlier matching drop has it"
    else:
        values = np.array([e.value for _, e in earlier], float)
        sigmas = np.array([e.sigma or 0.0 for _, e in earlier])
        least = _least(key, estimate, earlier)
        left_out = tuple(drop for (drop, _), keep in zip(earlier, kept, strict=True) if not keep)
        back = None
        recent = kept & (np.arange(len(kept)) >= len(kept) - _TREND)
        of_recent = np.flatnonzero(recent).tolist()
        course = trend_of([earlier[i][1] for i in of_recent], [numbers[i] for i in of_recent]) if slow else None
        if course is not None and course.p < slow and course.step is None:
            kept = recent
            back = (numbers[-1] - np.array(numbers[:-1], float))[kept]
        difference = compare_value(
            estimate.value, estimate.sigma or 0.0, values[kept], sigmas[kept], least, relative=kind.relative, back=back
        )
    return Change(
        kind, end, estimate, tuple(earlier), numbers, left_out, difference,
        p_adjusted=None, differs=False, p_drift=None, drifts=False, why=why,
    )  # fmt: skip
