"""Stretches of a record without samples, in which the shaft may have touched its bearing unseen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tdbmon.record.probe_checks import SHORT_GAP

_HIDES_S = 1e-3  # of missing samples: as long as a short contact, which nobody then sees


def too_long(steps: np.ndarray) -> np.ndarray:
    """Return which steps (n,) of a time axis are too long to be bridged."""
    return np.asarray(steps > (SHORT_GAP + 1.5) * np.median(steps))


@dataclass(frozen=True)
class MissingStretches:
    """Stretches without samples that are too long to be bridged: the last instant seen before and the next after.

    `hiding` are those that may hide a contact: long enough for one, and for the way to the touching radius and from it.
    """

    spans: tuple[tuple[float, float], ...]
    hiding: tuple[tuple[float, float], ...]

    @classmethod
    def between(cls, t: np.ndarray, beyond: np.ndarray) -> MissingStretches:
        """Find them between instants, s, at which the shaft is so far beyond the touching radius, m."""
        steps = np.diff(t)
        long = too_long(steps)
        fastest = np.max(np.abs(np.diff(beyond))[~long] / np.maximum(steps[~long], 1e-9), initial=0.0)
        way = np.abs(beyond[:-1]) + np.abs(beyond[1:])
        hides = long & (steps > _HIDES_S) & (way < fastest * steps)
        spans, hiding = (
            tuple((float(t[i]), float(t[i + 1])) for i in np.flatnonzero(found)) for found in (long, hides)
        )
        return cls(spans, hiding)

    def at(self, instant: float) -> tuple[float, float] | None:
        """Return the stretch in which an instant lies."""
        return next((span for span in self.spans if span[0] <= instant <= span[1]), None)

    def within(self, start: float, stop: float) -> str:
        """Say which stretch may hide a contact between two instants, one of which may lie in it; "" where none does."""
        found = [s for s in self.hiding if s[0] < stop and s[1] > start]
        return said(found[0]) if found else ""


def said(span: tuple[float, float]) -> str:
    """Return a stretch, s, in words."""
    return f"no sample has a value between {span[0]:.5f} s and {span[1]:.5f} s"
