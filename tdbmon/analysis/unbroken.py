"""Holes in a record's time axis: a pause of the logger, or a clock that jumped.  What spans one measures nothing."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from tdbmon.analysis.drag_law import Coast
from tdbmon.analysis.missing_stretches import too_long


def pieces(time: np.ndarray) -> list[slice]:
    """Return the samples of the stretches of a time axis (n,) without a hole of more than a few samples."""
    if len(time) < 2:
        return [slice(0, len(time))]
    edges = [0, *(np.flatnonzero(too_long(np.diff(time))) + 1).tolist(), len(time)]
    return [slice(begin, end) for begin, end in pairwise(edges)]


def stretches(time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where the `pieces` of a time axis begin and end, s."""
    found = pieces(time)
    return time[[each.start for each in found]], time[[each.stop - 1 for each in found]]


def longest_stretch(time: np.ndarray, since: float) -> tuple[float, float]:
    """Return the longest stretch after an instant, s: from where to where."""
    begin, end = stretches(time)
    begin = np.maximum(begin, since)
    longest = int(np.argmax(end - begin))
    return float(begin[longest]), float(end[longest])


def without_holes(coast: Coast, time: np.ndarray) -> Coast:
    """Return the spans that lie within one stretch of a time axis: across a hole, samples and turns are not counted."""
    begin, end = stretches(time)
    if len(begin) == 1:
        return coast
    step = float(np.median(np.diff(time)))  # a span reaches half a sample beyond its last one
    held = np.searchsorted(begin, coast.begin + step, side="right") - 1
    whole = (held >= 0) & (coast.end <= end[np.maximum(held, 0)] + step)
    return coast.at(whole)
