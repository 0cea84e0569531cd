"""Phases of a drop: levitated, fall, contacts, run-down, rest; fall and contacts are one phase if no first contact is known.

A rotor that is relevitated is levitated again after them.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate


@dataclass(frozen=True)
class Phase:
    """A named stretch of the record, from `start` to `end`, s."""

    name: str
    start: float
    end: float


def split_phases(
    start: float,
    end: float,
    release: float | None,
    first_contact: float | None,
    settled: float | None,
    standstill: float | None,
) -> tuple[Phase, ...]:
    """Return the phases that the record contains, in order; one whose start is unknown is merged with the one before.

    Parameters are times in s; None if unknown.  A phase whose start lies before that of an earlier one, such as the standstill
    of a rotor that has not settled yet, begins together with it.
    """
    fall = "fall" if first_contact is not None else "fall and contacts"
    borders = [("levitated", start), (fall, release), ("contacts", first_contact), ("run-down", settled)]
    borders.append(("rest", standstill))
    known = [(name, at) for name, at in borders if at is not None and start <= at < end]
    if release is None:
        known = [(name, at) for name, at in known if name != "levitated"]
    if not known:
        return ()
    starts = list(accumulate((at for _, at in known), max))
    return tuple(
        Phase(name, at, stop)
        for (name, _), at, stop in zip(known, starts, [*starts[1:], end], strict=True)
        if stop > at
    )
