"""Does a drop look like one of another machine, whose name is the same or was given by mistake?

What a record shows of its machine without a fitted model, and what wear, a new set-point or another balance change in one
or two kinds only: gaps, place of the clearance, stiffness, set-point, once per revolution and noise in levitation, decay of
the speed, speed over pulses.  A kind is **far** where, at any end, the drop lies beyond all earlier drops by more than
twice their whole range, or than twice a least range where they lie closer together; its own interval is granted to it.
Three kinds that are far flag the drop, and it is no reference for later ones: else it would hide the next like it.  It is a
flag and no proof: the rule is our own, and `docs/history.md` says how often it was right on synthetic machines.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from tdbmon.estimate import Estimate
from tdbmon.history import catalogue
from tdbmon.history.archive import Archive
from tdbmon.history.catalogue import Entry
from tdbmon.history.feature import Feature, Key
from tdbmon.history.matching import doubts
from tdbmon.history.speed_class import same_speed

_FAR = 2.0  # times the range of the earlier drops
_LEAST_DROPS = 3
_LEAST_KINDS = 3
_MOST = 100  # of the earlier drops, the latest


@dataclass(frozen=True)
class _Kind:
    """What tells machines apart: features that count as one, the least range believed (SI or relative), and whether only
    drops of about the same speed compare."""

    title: str
    features: tuple[str, ...]
    least: float
    relative: bool = False
    same_speed: bool = False


_KINDS = (
    _Kind("radius at rest", ("gap_um",), 5e-6),
    _Kind("place of the clearance", ("gap_centre_x_um", "gap_centre_y_um"), 5e-6),
    _Kind("stiffness of bearing and support", ("stiffness_n_per_m",), 0.1, relative=True),
    _Kind("levitated position", ("levitated_x_um", "levitated_y_um"), 5e-6),
    _Kind("once per revolution in levitation", ("levitated_1x_um",), 0.2, relative=True, same_speed=True),
    _Kind("noise in levitation", ("levitated_noise_um",), 0.1, relative=True),
    _Kind("decay time of the speed", ("decay_time_s",), 0.05, relative=True),
    _Kind("stated speed over that of the keyphasor", ("keyphasor_ratio",), 1e-3),
)
_NAMES = {name for kind in _KINDS for name in kind.features}
_Values = dict[Key, Estimate]


@dataclass(frozen=True)
class Likeness:
    """How a drop looks beside the earlier ones of its machine.

    Attributes
    ----------
    compared : tuple of str
        The kinds of which the drop and three earlier ones at least have a value.
    far : tuple of str
        Those in which it lies far outside of all of them.
    where : tuple of Key
        The features of these that do.
    """

    compared: tuple[str, ...]
    far: tuple[str, ...]
    where: tuple[Key, ...]

    @property
    def strange(self) -> bool:
        """It looks like a drop of another machine."""
        return len(self.far) >= _LEAST_KINDS

    @property
    def sentence(self) -> str:
        """What to tell of a strange drop."""
        return (
            f"looks like a drop of another machine: far outside of all earlier drops in {len(self.far)} of"
            f" {len(self.compared)} things that tell machines apart ({', '.join(self.far)}); make sure whose drop it is,"
            " with which probes and after which overhaul"
        )


def likeness(archive: Archive, entry: Entry, features: tuple[Feature, ...]) -> Likeness:
    """Hold a drop against all drops of its machine and assembly before it, of whatever speed, whose records show the machine.

    Parameters
    ----------
    archive : Archive
    entry : Entry
        Of the drop, which need not be filed.
    features : tuple of Feature
        Its own.
    """
    tolerance = archive.settings(entry.machine).matching.speed
    with catalogue.reading(archive.catalogue) as base:
        of_machine = catalogue.entries(base, "machine = ? AND assembly = ?", (entry.machine, entry.assembly))
        before = [e for e in of_machine if e.id != entry.id and e.order < entry.order and not doubts(e.failed_checks)]
        before = before[-_MOST:]
        found = catalogue.features(base, [e.result for e in before])
    kept: list[tuple[Entry, _Values]] = []
    for earlier in before:
        theirs = _telling(found[earlier.result])
        if not _held_against(earlier, theirs, kept, tolerance).strange:
            kept.append((earlier, theirs))
    return _held_against(entry, _telling(features), kept, tolerance)


def _telling(features: Iterable[Feature]) -> _Values:
    """Return what tells machines apart of a drop's features."""
    return {f.key: f.estimate for f in features if f.name in _NAMES}


def _held_against(entry: Entry, mine: _Values, earlier: list[tuple[Entry, _Values]], tolerance: float) -> Likeness:
    """Hold the values of a drop against those of earlier ones; a speed is the same within a tolerance."""
    compared, far, where = [], [], []
    for kind in _KINDS:
        there = [values for e, values in earlier if not kind.same_speed or same_speed(e.speed, entry.speed, tolerance)]
        keys = [key for key in mine if key[0] in kind.features]
        judged = {key: _beyond(mine[key], [v[key] for v in there if key in v], kind) for key in keys}
        beyond = [key for key in keys if judged[key]]
        compared += [kind.title] if any(each is not None for each in judged.values()) else []
        far += [kind.title] if beyond else []
        where += beyond
    return Likeness(tuple(compared), tuple(far), tuple(where))


def _beyond(mine: Estimate, earlier: list[Estimate], kind: _Kind) -> bool | None:
    """Whether a value lies far outside of the earlier ones; None where there are too few to tell."""
    values = sorted(e.value for e in earlier if e.value is not None)
    if mine.value is None or len(values) < _LEAST_DROPS:
        return None
    low, high = values[0], values[-1]
    least = kind.least * (abs(values[len(values) // 2]) if kind.relative else 1.0)
    own = (mine.width or 0.0) / 2
    return max(low - mine.value, mine.value - high) > _FAR * max(high - low, least) + own
