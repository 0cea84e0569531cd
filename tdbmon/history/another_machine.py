"""Detection of drops that look like those of another machine, of the same name or filed under a wrong one.

Compared are kinds of features that identify a machine without a fitted model: gaps, place of the clearance, stiffness,
set-point, 1X and noise in levitation, decay of the speed, stated speed over that of the keyphasor.  Wear, a new set-point or a
new balance changes one or two kinds only.  A kind is **far** if, at any end, the drop lies outside the range of all earlier
drops by more than twice that range (or a least range, if larger) plus the half-width of its own interval.  Three far kinds
flag the drop; a flagged drop is no reference for later ones, else it would hide the next like it.  A flag is no proof: the
rule is our own, and `docs/history.md` gives its hit rate on synthetic machines.
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
_MOST = 100  # latest earlier drops used


@dataclass(frozen=True)
class _Kind:
    """Features that identify a machine and count as one, their least credible range (SI or relative), and whether only
    drops at about the same speed are compared."""

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
    """A drop's likeness to the earlier drops of its machine.

    Attributes
    ----------
    compared : tuple of str
        Kinds with a value in the drop and in at least three earlier ones.
    far : tuple of str
        Those of them in which the drop is far from all earlier ones.
    where : tuple of Key
        The features that are far.
    """

    compared: tuple[str, ...]
    far: tuple[str, ...]
    where: tuple[Key, ...]

    @property
    def strange(self) -> bool:
        """True if it looks like a drop of another machine."""
        return len(self.far) >= _LEAST_KINDS

    @property
    def sentence(self) -> str:
        """The remark on a strange drop."""
        return (
            f"looks like a drop of another machine: far outside the range of all earlier drops in {len(self.far)} of"
            f" {len(self.compared)} quantities that distinguish machines ({', '.join(self.far)}); check from which machine it"
            " is, with which probes and after which overhaul"
        )


def likeness(archive: Archive, entry: Entry, features: tuple[Feature, ...]) -> Likeness:
    """Compare a drop with all earlier drops of its machine and assembly, at any speed, whose records passed the checks.

    Parameters
    ----------
    archive : Archive
    entry : Entry
        Of the drop, which need not be filed.
    features : tuple of Feature
        Of the drop.
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
    """Return those of a drop's features that identify its machine."""
    return {f.key: f.estimate for f in features if f.name in _NAMES}


def _held_against(entry: Entry, mine: _Values, earlier: list[tuple[Entry, _Values]], tolerance: float) -> Likeness:
    """Compare the values of a drop with those of earlier ones; speeds within the relative tolerance count as the same."""
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
    """Return whether a value lies far outside the earlier ones; None if these are too few."""
    values = sorted(e.value for e in earlier if e.value is not None)
    if mine.value is None or len(values) < _LEAST_DROPS:
        return None
    low, high = values[0], values[-1]
    least = kind.least * (abs(values[len(values) // 2]) if kind.relative else 1.0)
    own = (mine.width or 0.0) / 2
    return max(low - mine.value, mine.value - high) > _FAR * max(high - low, least) + own
