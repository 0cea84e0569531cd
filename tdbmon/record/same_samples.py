"""Two records of one measurement: the same samples in two files, but for the rounding of formats and what was cut off.

Tools that export again may also set the zeros of probes anew, or sample at another rate.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence

import numpy as np
import xarray as xr

from tdbmon.record.samples import known_samples

_ROUNDING = 1e-3  # of a probe's standard deviation: so little are two exports of its samples apart
_RESAMPLED = 0.01  # the same of two exports at two rates
_CUT = 0.9  # of the samples, that the shorter of two exports must hold to be compared from their first samples on
_LEAST_SAMPLES = 100  # that tell where a cut record lies in another
_CHANGE = 0.3  # of the change from sample to sample: noise of two drops at rest is apart by all of it


def same_samples(one: xr.Dataset, other: xr.Dataset) -> bool:
    """Return whether the displacements of two records are the same but for rounding and what was cut off at start and end.

    Whole records are the same also where their zeros or their sampling rates differ.
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
    """Return whether all probes show one motion from the first samples on, at the times of the slower record, zeros aside.

    A filter before the lower rate takes some of the contacts' shocks away; of two drops even the noise differs by more.
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
    """Return times since the first sample, s, and values of a channel where it has any."""
    time, values = known_samples(channel)
    return time - time[:1], values


def _share_a_stretch(pairs: list[tuple[np.ndarray, np.ndarray]]) -> bool:
    """Return whether half of the shorter record at least lies in the other, in all channels."""
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
    return tells  # a stretch in which no probe moves could be of any drop


def _change_in_common(longer: np.ndarray, shorter: np.ndarray, start: int) -> float | None:
    """Return the change from sample to sample where two records overlap, m (rms); None where they differ there.

    They are laid so that the half of the shorter one from `start` on fits best.
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
    """Return the sample of a channel from which on a part differs least from it, by the sum of squares."""
    from scipy.signal import correlate

    middle = float(np.nanmean(longer))
    x, y = np.nan_to_num(longer - middle), np.nan_to_num(part - middle)
    squares = np.concatenate([[0.0], np.cumsum(x**2)])
    return int(np.argmin(squares[y.size :] - squares[: -y.size] - 2 * correlate(x, y, mode="valid", method="fft")))
