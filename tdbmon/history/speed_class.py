"""Drops of about the same speed, as classes."""

from __future__ import annotations

from collections.abc import Sequence


def speed_classes(speeds: Sequence[float | None], tolerance: float) -> list[int]:
    """Return the class of each speed, numbered from the slowest; unknown speeds make a class of their own, the last.

    A class reaches from its slowest drop to `tolerance` (relative) above it.
    """
    known = sorted({s for s in speeds if s is not None})
    starts: list[float] = []
    for one in known:
        if not starts or one > starts[-1] * (1 + tolerance):
            starts.append(one)
    classes = []
    for speed in speeds:
        if speed is None:
            classes.append(len(starts))
        else:
            classes.append(max(i for i, start in enumerate(starts) if speed >= start))
    return classes
