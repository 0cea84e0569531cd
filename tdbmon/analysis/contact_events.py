"""Contacts as the time spans in which the shaft centre lies beyond the radius at which it touches its bearing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

NOISE_S = 2e-4  # shorter contacts and gaps between contacts are noise


@dataclass(frozen=True)
class Contact:
    """One contact of the shaft with its bearing.

    Attributes
    ----------
    start, end : float
        Touch and lift-off, s.
    angle : float
        Direction of the deepest point from the clearance centre, rad from +x towards +y.
    depth : float
        How far beyond the touching radius the shaft centre went, m.
    seen : bool
        Whether the record covers all of it; if not, its touch, its lift-off or much of it is missing.
    """

    start: float
    end: float
    angle: float
    depth: float
    seen: bool = True


def contact_events(t: np.ndarray, d: np.ndarray, r: np.ndarray, level: float) -> tuple[Contact, ...]:
    """Return the contacts, which are time spans with the radius beyond a level.

    Gaps and spans under 0.2 ms are noise: the former are bridged, the latter dropped.  Spans last from one interpolated crossing
    of the level to the next, since a contact may have one sample only.

    Parameters
    ----------
    t : (n,) array
        Time, s.
    d : (n, 2) array
        Displacement from the clearance centre, m.
    r : (n,) array
        Its magnitude, m.
    level : float
        Radius at which the shaft touches, m.
    """
    beyond = r > level
    edges = np.flatnonzero(np.diff(beyond.astype(np.int8))) + 1
    if beyond[0]:
        edges = np.concatenate([[0], edges])
    if beyond[-1]:
        edges = np.concatenate([edges, [len(r)]])
    spans: list[tuple[int, int]] = []
    for start, stop in edges.reshape(-1, 2).tolist():
        if spans and crossing(t, r, start, level) - crossing(t, r, spans[-1][1], level) < NOISE_S:
            start = spans.pop()[0]
        spans.append((start, stop))
    out = []
    for start, stop in spans:
        touch, lift_off = crossing(t, r, start, level), crossing(t, r, stop, level)
        if lift_off - touch < NOISE_S:
            continue
        deep = start + int(np.argmax(r[start:stop]))
        angle = float(np.arctan2(d[deep, 1], d[deep, 0]))
        out.append(Contact(touch, lift_off, angle, float(r[deep] - level)))
    return tuple(out)


def crossing(t: np.ndarray, r: np.ndarray, index: int, level: float) -> float:
    """Return the instant, s, at which the radius r (n,), m, crosses a level between index - 1 and index, by interpolation."""
    if index <= 0 or index >= len(r):
        return float(t[min(max(index, 0), len(t) - 1)])
    share = (level - r[index - 1]) / (r[index] - r[index - 1])
    return float(t[index - 1] + np.clip(share, 0, 1) * (t[index] - t[index - 1]))
