"""Insertion of samples skipped in the time axis, so that lost samples are treated like other missing ones."""

from __future__ import annotations

import numpy as np
import xarray as xr

from tdbmon.record.probe_checks import SHORT_GAP
from tdbmon.record.timebase import LONG, usual_interval


def with_skipped_samples(record: xr.Dataset) -> xr.Dataset:
    """Return a record with NaN inserted where its time axes skip up to five samples; longer gaps are kept.

    Analyses that count samples instead of using times would otherwise date everything that follows too early.
    """
    whole = {}
    for dim in record.dims:
        time = record[dim].to_numpy()
        if len(time) > 2 and len(skipped := _skipped(time)):
            whole[dim] = np.sort(np.append(time, skipped))
    return record.reindex(whole) if whole else record


def _skipped(time: np.ndarray) -> np.ndarray:
    """Return the times of the skipped samples, equally spaced between their neighbours, s."""
    steps = np.diff(time)
    count = np.round(steps / usual_interval(time)).astype(int) - 1
    at = np.flatnonzero((steps > LONG * np.median(steps)) & (count > 0) & (count <= SHORT_GAP))
    return np.concatenate([time[i] + steps[i] * np.arange(1, count[i] + 1) / (count[i] + 1) for i in at] or [time[:0]])
