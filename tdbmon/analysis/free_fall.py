"""The free fall as a check: gravity is known, and so tells whether time base and sensitivity of the record are right."""

from __future__ import annotations

import math

from tdbsim.machine import Machine

from tdbmon.analysis.release import Release
from tdbmon.record.finding import Check

_LEAST = 1 / math.sqrt(2)  # of gravity: nearer to it than to half of it, since a field may hold on
_MOST = 1.15  # of gravity: nothing pulls the shaft down; unbalance and bending make some hundredths
_TELLING = 0.3  # of gravity
_ACROSS = (
    1 / 3
)  # of the other end's orbit: a rotor let go turns about its own axis of inertia, and that moves both ends
_LEAST_GRAVITY = 1.0  # m/s^2: a machine on end does not fall across its bearings


def check_free_fall(release: Release, machine: Machine) -> list[Check]:
    """Check that each end falls with gravity.

    A length read k times too long and times read c times too long make it fall with k / c^2 of gravity.  A field that dies
    away slowly changes it as well, though rarely by so much; and so does a bent shaft, which turns on in the fall, by about
    what its wide orbit turned with.
    """
    if machine.gravity < _LEAST_GRAVITY:
        return []
    found = []
    for end, (_, y) in release.fall.items():
        share = -y / machine.gravity
        detail = f"falls with {-y:.3g} m/s2, {share:.2f} of gravity, before it touches"
        others = [whirl for other, whirl in release.whirl.items() if other != end]
        turning = release.whirl[end] + _ACROSS * max(others, default=0.0)
        doubt = turning / machine.gravity
        passed = _LEAST - doubt < share < _MOST + doubt
        if doubt > _TELLING:
            detail += f", which tells little: the wide orbit turns with {turning:.3g} m/s2"
        cure = "" if passed else f": {_suspects(share, machine, end)}"
        found.append(Check("free fall", end, passed, detail + cure))
    return found


def _suspects(share: float, machine: Machine, end: str) -> str:
    """Return what would make an end fall with this share of gravity, and so what to look at."""
    names = ", ".join(f"'{probe.name}'" for probe in machine.probes_at(end))
    if share <= 0:
        return f"check sign of the sensitivity and angle of {names}"
    times = f"times {_stretch(math.sqrt(1 / share))} would do that (check sampling rate and unit of the time)"
    lengths = f"or displacements {_stretch(share)} (check the sensitivity of {names})"
    field = ", or a magnetic field that holds on for milliseconds" if share < 1 else ", or a great unbalance"
    return f"{times}, {lengths}{field}"


def _stretch(factor: float) -> str:
    """Return a wrong scale in words."""
    return f"read about {factor:.2g} times too long" if factor > 1 else f"read about {1 / factor:.2g} times too short"
