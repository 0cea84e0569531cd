"""The result of a check of a record, and the formatting of numbers in such results."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tdbmon.runs import Runs


@dataclass(frozen=True)
class Check:
    """The result of one check: its name, the channel ("" for the whole record), whether it passed, and the details."""

    check: str
    channel: str
    passed: bool
    detail: str


def um(length: float) -> str:
    """Return a length in m as text in um: to 0.1 um, about the resolution of probes, or to two digits below 1 um.

    Lengths from 10 mm on, which only a wrong unit can cause, are given in mm.
    """
    value = length * 1e6
    if abs(value) >= 1e4:
        return f"{value * 1e-3:.4g} mm"
    return f"{round(value, 1):.4g} um" if abs(value) >= 1 else f"{value:.2g} um"


def span(time: np.ndarray, runs: Runs) -> str:
    """Return the time span from the first to the last sample of some runs, as text."""
    first, last = time[runs.first[0]], time[runs.first[-1] + runs.length[-1] - 1]
    return f"between {first:.5g} s and {last:.5g} s"
