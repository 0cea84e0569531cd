"""What the touchdown bearings have been through: full drops against the number agreed, and stress against the first drop.

API 617 asks that touchdown bearings stand an agreed number of coast-downs from trip speed, at least two, without
replacement, and ten partial contacts; ISO 14839-4 leaves the number to vendor and user.  So the number is the owner's
setting, and there is no default for it.

The damage is a Palmgren-Miner sum with one cycle a drop at the greatest Hertz stress and the stress-life exponent 9 of
rolling contact (G. Lundberg, A. Palmgren, 1947; ISO 281), told in drops like the machine's first: sum over drops of
(stress / stress of the first)^9.  It compares drops of one machine, and is no life in hours: a drop slides, and comes
near the static limits, where that law was not measured.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tdbmon.estimate import Estimate
from tdbmon.history import settings as settings_of
from tdbmon.history.catalogue import Entry
from tdbmon.history.filing import StressBox

if TYPE_CHECKING:
    from tdbmon.history.compare import Drop

EXPONENT = 9.0
_FULL_SHARE = 0.9  # of the full speed: from there on a drop counts as full
_STRESS_SHARE = 0.03  # standard deviation of a drop's greatest stress beside its own interval: the model's own error


@dataclass(frozen=True)
class Life:
    """What a machine's present assembly went through, the drop that is compared included.

    Attributes
    ----------
    full_drops : int
        Drops from at least 90 % of the full speed; all where that is not stated.
    partial_drops : int
    agreed : int or None
    damage : Estimate
        In drops like the first, of the end that suffered most.
    margin : Estimate
        Agreed drops less the greater of full drops and damage.
    """

    full_drops: int
    partial_drops: int
    agreed: int | None
    damage: Estimate
    margin: Estimate


def life_of(
    drop: Drop, of_machine: list[Entry], boxes: dict[int, tuple[StressBox, ...]], agreed: settings_of.Life
) -> Life:
    """Return what the assembly of a drop went through up to and with this drop."""
    earlier = [
        e
        for e in of_machine
        if e.assembly == drop.entry.assembly and e.id != drop.entry.id and e.moment < drop.entry.moment
    ]
    drops = [(e.speed, boxes.get(e.result, ())) for e in earlier] + [(drop.entry.speed, drop.stress)]
    limit = None if agreed.full_speed is None else _FULL_SHARE * agreed.full_speed
    full = sum(limit is None or speed is None or speed >= limit for speed, _ in drops)
    damage = _damage([found for _, found in drops])
    return Life(full, len(drops) - full, agreed.agreed_drops, damage, _margin(agreed.agreed_drops, full, damage))


def _damage(drops: list[tuple[StressBox, ...]]) -> Estimate:
    without = sum(not boxes for boxes in drops)
    if without:
        why = f"{without} of {len(drops)} drops were filed without forces: file them with --forces"
        return Estimate.missing("1", why)
    worst = Estimate.missing("1", "no drop has stresses")
    for end in sorted({box.end for boxes in drops for box in boxes}):
        stresses = [box.greatest for boxes in drops for box in boxes if box.end == end]
        if len(stresses) < len(drops) or stresses[0] <= 0:
            continue
        shares = [(s / stresses[0]) ** EXPONENT for s in stresses]
        total = math.fsum(shares)
        # the first counts 1 by definition; its error is in all the others
        own = math.fsum((EXPONENT * _STRESS_SHARE * share) ** 2 for share in shares[1:])
        common = (EXPONENT * _STRESS_SHARE * math.fsum(shares[1:])) ** 2
        rule = f"sum of (greatest stress / that of the first drop)^9 at {end}, one cycle a drop"
        found = Estimate.from_sigma(total, math.sqrt(own + common), "1", rule)
        if worst.value is None or total > worst.value:
            worst = found
    return worst


def _margin(agreed: int | None, full: int, damage: Estimate) -> Estimate:
    if agreed is None:
        return Estimate.missing("1", "no number of drops is agreed for this machine: set agreed_drops in archive.toml")
    rule = "agreed drops less full drops or damage, whichever is more"
    if damage.value is None or damage.low is None or damage.high is None:
        return Estimate(float(agreed - full), unit="1", method="agreed drops less full drops", why=damage.why)
    worst = max(float(full), damage.value)
    return Estimate(agreed - worst, agreed - max(full, damage.high), agreed - max(full, damage.low), "1", rule)
