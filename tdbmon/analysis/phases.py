"""The phases of a drop: levitated, fall, contacts, run-down, rest; fall and contacts are one where no first contact is told.

One that is taken up again is levitated again after them.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate


@dataclass(frozen=True)
class Phase:
    """A stretch of the record, s."""

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
    """Return the phases that the record holds, in order; an unknown border ends the list of what can be told apart.

    Parameters are times in s; None where not known.  One that comes before an earlier border, as the standstill of a rotor that
    has not settled yet, begins there.
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
