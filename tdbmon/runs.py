"""Runs: stretches of consecutive samples that satisfy a condition."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Runs:
    """Runs of consecutive samples: index of the `first` sample and `length` of each, both of shape (n,)."""

    first: np.ndarray
    length: np.ndarray

    def __len__(self) -> int:
        """Return the number of runs."""
        return int(self.first.size)

    def __iter__(self) -> Iterator[slice]:
        """Iterate over the runs, each as a slice of the samples."""
        for first, length in zip(self.first.tolist(), self.length.tolist(), strict=True):
            yield slice(first, first + length)

    @property
    def longest(self) -> int:
        """Number of samples in the longest run, 0 without any."""
        return int(self.length.max()) if self.length.size else 0

    @property
    def total(self) -> int:
        """Number of samples in all runs."""
        return int(self.length.sum())

    def where(self, mask: np.ndarray) -> Runs:
        """Return the runs that a mask selects."""
        return Runs(self.first[mask], self.length[mask])

    def lasting(self, time: np.ndarray, seconds: float) -> Runs:
        """Return the runs longer than `seconds`, s, given the times (n,) of the samples, s."""
        return self.where(time[self.first + self.length - 1] - time[self.first] > seconds)

    def mask(self, size: int) -> np.ndarray:
        """Return a mask of `size` samples that is True in the runs."""
        out = np.zeros(size, dtype=bool)
        for run in self:
            out[run] = True
        return out


def runs_of(mask: np.ndarray) -> Runs:
    """Return the runs of True in a mask of shape (n,)."""
    if not mask.any():
        return Runs(np.empty(0, dtype=int), np.empty(0, dtype=int))
    edges = np.flatnonzero(np.diff(mask.view(np.int8), prepend=0, append=0))
    return Runs(edges[::2], edges[1::2] - edges[::2])
