"""What a check of a record found, and how a finding says numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tdbmon.runs import Runs


@dataclass(frozen=True)
class Check:
    """A check that was made: of which channel ("" for the record), whether it passed, and what was found."""

    check: str
    channel: str
    passed: bool
    detail: str


def um(length: float) -> str:
    """Return a length in m as text in um: to a tenth, which is about what probes resolve, with two figures below one.

    From 10 mm on, which only a wrong unit shows, in mm.
    """
    value = length * 1e6
    if abs(value) >= 1e4:
        return f"{value * 1e-3:.4g} mm"
    return f"{round(value, 1):.4g} um" if abs(value) >= 1 else f"{value:.2g} um"


def span(time: np.ndarray, runs: Runs) -> str:
    """Return from when to when runs of samples reach, as text."""
    first, last = time[runs.first[0]], time[runs.first[-1] + runs.length[-1] - 1]
    return f"between {first:.5g} s and {last:.5g} s"
