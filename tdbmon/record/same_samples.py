"""Two records of one measurement: the same samples in two files, but for the rounding of formats and what was cut off."""

from __future__ import annotations

import numpy as np
import xarray as xr

_ROUNDING = 1e-3  # of a probe's standard deviation: so little are two exports of its samples apart
_CUT = 0.9  # of the samples, that the shorter of two exports must hold to be compared from their first samples on
_LEAST_SAMPLES = 100  # that tell where a cut record lies in another
_CHANGE = 0.3  # of the change from sample to sample: noise of two drops at rest is apart by all of it


def same_samples(one: xr.Dataset, other: xr.Dataset) -> bool:
    """Return whether the displacements of two records are the same but for rounding and what was cut off at start and end."""
    names = [name for name in one.data_vars if name in other and one[name].attrs.get("units") == "m"]
    pairs = [(one[name].to_numpy(), other[name].to_numpy()) for name in names]
    return bool(pairs) and (all(_same(a, b) for a, b in pairs) or _share_a_stretch(pairs))


def _same(a: np.ndarray, b: np.ndarray) -> bool:
    size = min(a.size, b.size)
    if size < _CUT * max(a.size, b.size):
        return False
    apart, spread = a[:size] - b[:size], float(np.nanstd(a)) if np.isfinite(a).any() else 0.0
    seen = np.isfinite(apart)
    return not seen.any() or float(np.sqrt(np.mean(apart[seen] ** 2))) <= _ROUNDING * spread


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
