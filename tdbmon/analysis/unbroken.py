"""Gaps in a record's time axis, from a pause of the logger or a clock jump, and the unbroken stretches between them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from tdbmon.analysis.drag_law import Coast
from tdbmon.analysis.missing_stretches import too_long


def pieces(time: np.ndarray) -> list[slice]:
    """Return slices of the stretches of a time axis (n,) between gaps of more than a few samples."""
    if len(time) < 2:
        return [slice(0, len(time))]
    edges = [0, *(np.flatnonzero(too_long(np.diff(time))) + 1).tolist(), len(time)]
    return [slice(begin, end) for begin, end in pairwise(edges)]


def stretches(time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the first and last times of the `pieces` of a time axis, s."""
    found = pieces(time)
    return time[[each.start for each in found]], time[[each.stop - 1 for each in found]]


def longest_stretch(time: np.ndarray, since: float) -> tuple[float, float]:
    """Return start and end of the longest unbroken stretch after an instant, s."""
    begin, end = stretches(time)
    begin = np.maximum(begin, since)
    longest = int(np.argmax(end - begin))
    return float(begin[longest]), float(end[longest])


def without_holes(coast: Coast, time: np.ndarray) -> Coast:
    """Return the spans of mean speed that cross no gap in a time axis, where samples and revolutions are not counted."""
    begin, end = stretches(time)
    if len(begin) == 1:
        return coast
    step = float(np.median(np.diff(time)))  # tolerance, as a span extends half a sampling period beyond its last sample
    held = np.searchsorted(begin, coast.begin + step, side="right") - 1
    whole = (held >= 0) & (coast.end <= end[np.maximum(held, 0)] + step)
    return coast.at(whole)
