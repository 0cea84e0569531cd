"""Gaps in a record (stretches without samples) during which the shaft may have touched its bearing unobserved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tdbmon.record.probe_checks import SHORT_GAP

_HIDES_S = 1e-3  # shortest gap that may hide a contact: the duration of a short contact


def too_long(steps: np.ndarray) -> np.ndarray:
    """Return a mask of the time steps (n,) that are too long to interpolate across."""
    return np.asarray(steps > (SHORT_GAP + 1.5) * np.median(steps))


@dataclass(frozen=True)
class MissingStretches:
    """Gaps too long to interpolate across, each as the times of the last sample before and the first one after, s.

    `hiding` holds those that may hide a contact: long enough for one and for the shaft to reach the contact radius and return.
    """

    spans: tuple[tuple[float, float], ...]
    hiding: tuple[tuple[float, float], ...]

    @classmethod
    def between(cls, t: np.ndarray, beyond: np.ndarray) -> MissingStretches:
        """Find the gaps between samples at times `t`, s, where the shaft is `beyond` the contact radius by so much, m."""
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
        """Return the gap that contains an instant, s; None if there is none."""
        return next((span for span in self.spans if span[0] <= instant <= span[1]), None)

    def within(self, start: float, stop: float) -> str:
        """Describe the first gap that may hide a contact and overlaps the interval from `start` to `stop`, s; "" if none does."""
        found = [s for s in self.hiding if s[0] < stop and s[1] > start]
        return said(found[0]) if found else ""


def said(span: tuple[float, float]) -> str:
    """Return the description of a gap, given by its limits, s."""
    return f"no sample has a value between {span[0]:.5f} s and {span[1]:.5f} s"
