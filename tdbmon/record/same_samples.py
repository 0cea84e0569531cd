"""Detection of duplicate records: the same samples in two files, apart from rounding and truncation.

Repeated exports may also change the zeros of probes or the sampling rate.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence

import numpy as np
import xarray as xr

from tdbmon.record.samples import known_samples

_ROUNDING = 1e-3  # of a probe's standard deviation: largest rms difference between two exports
_RESAMPLED = 0.01  # the same for two exports at different sampling rates
_CUT = 0.9  # of the samples: least length of the shorter export for comparison from the first sample on
_LEAST_SAMPLES = 100  # needed to locate a truncated record in another
_CHANGE = 0.3  # of the rms sample-to-sample change: at rest, the noise of two different drops differs by all of it


def same_samples(one: xr.Dataset, other: xr.Dataset) -> bool:
    """Return whether the displacements of two records are equal apart from rounding and truncation at start or end.

    Untruncated records also count as equal if only their zeros or sampling rates differ.
    """
    names = [name for name in one.data_vars if name in other and one[name].attrs.get("units") == "m"]
    pairs = [(one[name].to_numpy(), other[name].to_numpy()) for name in names]
    if not pairs:
        return False
    return all(_same(a, b) for a, b in pairs) or _share_a_stretch(pairs) or _same_motion(one, other, names)


def _same(a: np.ndarray, b: np.ndarray) -> bool:
    size = min(a.size, b.size)
    if size < _CUT * max(a.size, b.size):
        return False
    apart, spread = a[:size] - b[:size], float(np.nanstd(a)) if np.isfinite(a).any() else 0.0
    seen = np.isfinite(apart)
    return not seen.any() or float(np.sqrt(np.mean(apart[seen] ** 2))) <= _ROUNDING * spread


def _same_motion(one: xr.Dataset, other: xr.Dataset, names: Sequence[Hashable]) -> bool:
    """Return whether all probes show the same motion from their first samples on, apart from constant offsets.

    They are compared at the times of the slower record, whose anti-alias filter smooths the contacts; between two different
    drops even the noise differs by more.
    """
    tells = False
    for name in names:
        slow, fast = sorted((each[name] for each in (one, other)), key=lambda each: each.sizes[each.dims[0]])
        (t, y), (time, x) = (_from_start(each) for each in (slow, fast))
        if min(t.size, time.size) < _LEAST_SAMPLES or min(t[-1], time[-1]) < _CUT * max(t[-1], time[-1]):
            return False
        t, y = t[t <= time[-1]], y[t <= time[-1]]
        apart = np.interp(t, time, x) - y
        change = float(np.sqrt(np.mean(np.diff(y) ** 2)))
        if float(np.std(apart)) > min(_RESAMPLED * float(np.std(y)), _CHANGE * change):
            return False
        tells |= change > 0
    return tells


def _from_start(channel: xr.DataArray) -> tuple[np.ndarray, np.ndarray]:
    """Return the finite samples of a channel, with their times since the first one, s."""
    time, values = known_samples(channel)
    return time - time[:1], values


def _share_a_stretch(pairs: list[tuple[np.ndarray, np.ndarray]]) -> bool:
    """Return whether at least half of the shorter record is contained in the other one, in all channels."""
    tells = False
    for a, b in pairs:
        longer, shorter = (a, b) if a.size >= b.size else (b, a)
        if shorter.size < 2 * _LEAST_SAMPLES or not (np.isfinite(a).any() and np.isfinite(b).any()):
            return False
        changes = [_change_in_common(longer, shorter, start) for start in (0, shorter.size // 2)]
        known = [change for change in changes if change is not None]
        if not known:
            return False
        tells |= any(known)
    return tells  # a stretch without motion could belong to any drop


def _change_in_common(longer: np.ndarray, shorter: np.ndarray, start: int) -> float | None:
    """Return the rms sample-to-sample change in the overlap of two channels, m; None if they differ there.

    They are aligned so that the half of the shorter one that begins at `start` fits best.
    """
    place = _best_place(longer, shorter[start : start + shorter.size // 2]) - start
    first, last = max(place, 0), min(place + shorter.size, longer.size)
    common = longer[first:last]
    apart = common - shorter[first - place : last - place]
    seen = np.isfinite(apart)
    if not seen.any():
        return None
    change = float(np.sqrt(np.nanmean(np.diff(common[seen]) ** 2))) if seen.sum() > 1 else 0.0
    limit = min(_ROUNDING * float(np.nanstd(longer)), _CHANGE * change)
    return change if float(np.sqrt(np.mean(apart[seen] ** 2))) <= limit else None


def _best_place(longer: np.ndarray, part: np.ndarray) -> int:
    """Return the offset in samples at which a part fits a longer channel best in the least-squares sense."""
    from scipy.signal import correlate

    middle = float(np.nanmean(longer))
    x, y = np.nan_to_num(longer - middle), np.nan_to_num(part - middle)
    squares = np.concatenate([[0.0], np.cumsum(x**2)])
    return int(np.argmin(squares[y.size :] - squares[: -y.size] - 2 * correlate(x, y, mode="valid", method="fft")))
