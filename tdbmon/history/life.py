"""Usage of the touchdown bearings: full drops against the agreed number, and accumulated damage in units of the first drop's.

API 617 requires touchdown bearings to survive an agreed number of coast-downs from trip speed, at least two, without
replacement, and ten partial contacts; ISO 14839-4 leaves the number to vendor and user.  So the number is the owner's
setting, without a default.

The damage is a Palmgren-Miner sum with the stress-life exponent 9 of rolling contact (G. Lundberg, A. Palmgren, 1947; ISO
281), in multiples of the machine's first drop.  Each drop contributes the rainflow cycles of its stress history
(`tdbmon.history.fatigue`); if some drops were filed before these were counted, each contributes one cycle at its greatest
stress, with a remark.  The sum compares drops of one machine and is no life in hours: drops involve sliding and stresses near
the static limits, outside the range of that law.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from tdbsim.fatigue import EXPONENT, STATIC_LIMIT

from tdbmon.estimate import Z95, Estimate
from tdbmon.history import settings as settings_of
from tdbmon.history.catalogue import Entry
from tdbmon.history.drop import Drop
from tdbmon.history.fatigue import indented
from tdbmon.history.feature import Feature
from tdbmon.history.matching import counts

_FULL_SHARE = 0.9  # of the full speed, from which on a drop counts as full


@dataclass(frozen=True)
class Life:
    """Usage of an assembly, including the drop compared if it counts (`counts`).

    Attributes
    ----------
    full_drops : int
        Drops from at least 90 % of the full speed or from unknown speed; all if the full speed is not stated.
    partial_drops : int
    agreed : int or None
    damage : Estimate
        In multiples of the first drop, at the most damaged end.
    damages : dict
        The same by end; empty if unknown.
    margin : Estimate
        Agreed drops less the greater of full drops and damage.
    """

    full_drops: int
    partial_drops: int
    agreed: int | None
    damage: Estimate
    damages: dict[str, Estimate]
    margin: Estimate


@dataclass(frozen=True)
class _Wear:
    """Damage by a drop at an end, in any unit, and the standard deviation of its logarithm."""

    size: float
    error: float


def life_of(
    drop: Drop,
    of_machine: list[Entry],
    fatigue: dict[int, tuple[Feature, ...]],
    greatest: dict[int, tuple[Feature, ...]],
    agreed: settings_of.Life,
) -> Life:
    """Return the usage of a drop's assembly up to and including this drop.

    Parameters
    ----------
    drop : Drop
    of_machine : list of Entry
    fatigue, greatest : dict
        The features ``fatigue_cycles`` and ``stress_max_mpa`` by result.
    agreed : Life
        Of the settings.
    """
    earlier = [
        e
        for e in of_machine
        if e.assembly == drop.entry.assembly and e.id != drop.entry.id and e.order < drop.entry.order and counts(e)
    ]
    included = counts(drop.entry)
    speeds = [e.speed for e in earlier] + [drop.entry.speed] * included
    limit = None if agreed.full_speed is None else _FULL_SHARE * agreed.full_speed
    full = sum(limit is None or speed is None or speed >= limit for speed in speeds)
    results = [e.result for e in earlier]
    cycles, stresses = [fatigue.get(each, ()) for each in results], [greatest.get(each, ()) for each in results]
    if included:
        cycles.append(tuple(f for f in drop.features if f.name == "fatigue_cycles"))
        stresses.append(tuple(f for f in drop.features if f.name == "stress_max_mpa"))
    found, why = _damages([_wear(each) for each in cycles], [_wear(each, EXPONENT) for each in stresses])
    damages = {end: _with_indented(each, stresses) for end, each in found.items()}
    worst = max(damages.values(), key=lambda each: each.value or 0.0, default=Estimate.missing("1", why))
    margin = _margin(agreed.agreed_drops, full, worst)
    return Life(full, len(speeds) - full, agreed.agreed_drops, worst, damages, margin)


def _wear(features: tuple[Feature, ...], exponent: float = 1.0) -> dict[str, _Wear]:
    """Return a drop's damage by end: its features' values raised to the exponent."""
    found = {}
    for feature in features:
        e = feature.estimate
        if e.value is not None and e.log_sigma is not None:
            found[feature.end] = _Wear(e.value**exponent, exponent * e.log_sigma)
    return found


def _damages(counted: list[dict[str, _Wear]], greatest: list[dict[str, _Wear]]) -> tuple[dict[str, Estimate], str]:
    """Return the damage by end, from rainflow cycles if every drop has them, and the reason if there is none."""
    if not counted:
        return {}, "no drop of this machine is filed yet"
    without = sum(not a and not b for a, b in zip(counted, greatest, strict=True))
    if without:
        return (
            {},
            f"{without} of {len(counted)} drops were filed without forces, or with a fit that gives none: --forces",
        )
    old = sum(not each for each in counted)
    if not old:
        found = _sums(counted, "sum of the rainflow fatigue of all drops, divided by that of the first")
    else:
        found = _sums(
            greatest,
            f"sum of (greatest stress / that of the first drop)^{EXPONENT:g}, one cycle per drop",
            f"the cycles of {old} of {len(counted)} drops were not counted at filing; add them with --again to count them",
        )
    return found, "no end has stresses in every drop"


def _sums(drops: list[dict[str, _Wear]], rule: str, why: str = "") -> dict[str, Estimate]:
    sums = {}
    for end in sorted(set.intersection(*(set(each) for each in drops))):
        first, *later = (each[end] for each in drops)
        shares = [each.size / first.size for each in later]
        more = math.fsum(shares)
        # the first drop counts 1 by definition; its error is common to all the others
        own = math.hypot(*(share * each.error for share, each in zip(shares, later, strict=True))) / (more or 1.0)
        factor = math.exp(Z95 * math.hypot(own, first.error))
        sums[end] = Estimate(1 + more, 1 + more / factor, 1 + more * factor, "1", f"{rule}, {end}", why)
    return sums


def _with_indented(damage: Estimate, stresses: list[tuple[Feature, ...]]) -> Estimate:
    """Add to a damage a remark on the drops with balls above the static limit, where the sum does not hold."""
    beyond = sum(any((f.estimate.value or 0.0) > STATIC_LIMIT for f in found) for found in stresses)
    if damage.value is None or not beyond:
        return damage
    told = indented(f"in {beyond} of {len(stresses)} drops balls came")
    return replace(damage, why="; ".join(part for part in (damage.why, told) if part))


def _margin(agreed: int | None, full: int, damage: Estimate) -> Estimate:
    if agreed is None:
        return Estimate.missing("1", "no number of drops is agreed for this machine: set agreed_drops in archive.toml")
    rule = "agreed drops minus full drops or damage, whichever is larger"
    if damage.value is None or damage.low is None or damage.high is None:
        return Estimate(float(agreed - full), unit="1", method="agreed drops minus full drops", why=damage.why)
    worst = max(float(full), damage.value)
    return Estimate(agreed - worst, agreed - max(full, damage.high), agreed - max(full, damage.low), "1", rule)
