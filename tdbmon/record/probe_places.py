"""Check of where the machine file puts the probes: along the shaft, each near the bearing of its own end."""

from __future__ import annotations

from collections.abc import Iterable

from tdbsim.machine import Machine, Probe

from tdbmon.record.finding import Check

_FARTHER = 3.0  # times as far from its own bearing as from the other one: no plane of two is meant to stand there


def check_places(machine: Machine, probes: Iterable[Probe]) -> list[Check]:
    """Return a failed check for each probe that the machine file puts by the bearing of the other end.

    The line through the planes carries readings to the bearings: with a digit lost in a position it is steep, and no other
    check need fail.
    """
    found = []
    for probe in probes:
        own = machine.bearing(probe.end)
        other = next(each for each in machine.touchdown_bearings if each.name != probe.end)
        if abs(probe.position - own.position) <= _FARTHER * abs(probe.position - other.position):
            continue
        detail = (
            f"stands at {_mm(probe.position)} by the machine file, by the touchdown bearing of {other.name}"
            f" ({_mm(other.position)}) and far from that of its own end {own.name} ({_mm(own.position)}): check position"
            " and end of this probe; displacements at both bearings rest on them"
        )
        found.append(Check("place", probe.name, False, detail))
    return found


def _mm(length: float) -> str:
    return f"{length * 1e3:.4g} mm"
