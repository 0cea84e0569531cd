"""Speed classes: drops at about the same speed."""

from __future__ import annotations

from collections.abc import Sequence

from tdbmon.record.speed_checks import STANDSTILL_HZ

STANDSTILL = f"standstill (below {STANDSTILL_HZ:g} Hz)"


def stood(speed: float | None) -> bool:
    """Return whether a speed at the release, Hz, counts as standstill."""
    return speed is not None and speed < STANDSTILL_HZ


def same_speed(one: float | None, other: float | None, tolerance: float) -> bool:
    """Return whether two speeds (Hz) differ by at most `tolerance` of the other, or both are standstill; unknown ones do not."""
    if one is None or other is None:
        return False
    return abs(one - other) <= tolerance * other or max(one, other) < STANDSTILL_HZ


def speed_classes(speeds: Sequence[float | None], tolerance: float) -> list[int]:
    """Return the class of each speed, numbered from the slowest; unknown speeds form the last class.

    A class reaches from its slowest drop to `tolerance` (relative) above it; drops from standstill form one.
    """
    known = sorted({s for s in speeds if s is not None})
    starts: list[float] = []
    for one in known:
        if not starts or (one >= STANDSTILL_HZ and one > starts[-1] * (1 + tolerance)):
            starts.append(one)
    classes = []
    for speed in speeds:
        if speed is None:
            classes.append(len(starts))
        else:
            classes.append(max(i for i, start in enumerate(starts) if speed >= start))
    return classes
