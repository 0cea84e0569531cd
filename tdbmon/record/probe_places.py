"""Check of the axial probe positions in the machine file: each probe must be near the bearing of its own end."""

from __future__ import annotations

from collections.abc import Iterable

from tdbsim.machine import Machine, Probe

from tdbmon.record.finding import Check

_FARTHER = 3.0  # times as far from its own bearing as from the other one: implausible for a probe plane


def check_places(machine: Machine, probes: Iterable[Probe]) -> list[Check]:
    """Return a failed check for each probe that the machine file places near the bearing of the other end.

    Readings are extrapolated to the bearings by the straight line through the probe planes; a lost digit in a position makes
    this line wrong without necessarily failing any other check.
    """
    found = []
    for probe in probes:
        own = machine.bearing(probe.end)
        other = next(each for each in machine.touchdown_bearings if each.name != probe.end)
        if abs(probe.position - own.position) <= _FARTHER * abs(probe.position - other.position):
            continue
        detail = (
            f"is at {_mm(probe.position)} in the machine file, close to the touchdown bearing of {other.name}"
            f" ({_mm(other.position)}) and far from that of its own end {own.name} ({_mm(own.position)}): check position"
            " and end of this probe; displacements at both bearings depend on them"
        )
        found.append(Check("place", probe.name, False, detail))
    return found


def _mm(length: float) -> str:
    return f"{length * 1e3:.4g} mm"
