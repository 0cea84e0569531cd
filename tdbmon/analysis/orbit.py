"""Orbits of the shaft centre (raw, 1X-filtered, averaged over revolutions) and the shaft centreline."""

from __future__ import annotations

from typing import Literal

import numpy as np
import xarray as xr
from tdbsim.errors import InputError

from tdbmon.analysis.order import turned_through
from tdbmon.analysis.unbroken import pieces

OrbitKind = Literal["raw", "1X", "averaged"]

_KINDS = ("raw", "1X", "averaged")
_STEPS = 128  # angle steps per averaged revolution


def orbit(
    planes: xr.Dataset,
    angle: np.ndarray,
    start_s: float,
    revolutions: int,
    kind: OrbitKind = "raw",
    sense: int = 1,
    mark: float = 0.0,
) -> xr.Dataset:
    """Return the orbit over whole revolutions, from one passage of the keyphasor mark to another.

    Parameters
    ----------
    planes : Dataset
        ``displacement(end, axis, time)``, m.
    angle : ndarray, shape (time,)
        Shaft angle from +x towards +y, rad, continuous; NaN where unknown.
    start_s : float
        The orbit begins at the first passage after this time, s.
    revolutions : int
    kind : {"raw", "1X", "averaged"}
        The samples; mean position and 1X component fitted to them over these revolutions; or the synchronous
        average over the revolutions.
    sense : int
        +1 where the rotor turns from +x towards +y, -1 otherwise.
    mark : float
        Shaft angle at the keyphasor's pulse, rad.

    Returns
    -------
    Dataset
        ``displacement(end, axis, sample)``, m; ``keyphasor(pulse)``, index of the first sample of each revolution (for
        the keyphasor dots).  Coordinates ``time`` (s; not for the average) and ``turned`` (rad since the first pulse).
        An average of two or more revolutions has ``deviation(end, axis, sample)``, the standard deviation of a single
        revolution about it.  Attributes ``kind``, ``speed_hz``, ``start_s``, ``end_s``.

    Raises
    ------
    InputError
        If `kind` is unknown, `revolutions` is below 1, or the angle is not known over that many revolutions after `start_s`.
    """
    if kind not in _KINDS:
        raise InputError(f"unknown kind of orbit '{kind}'; give one of {', '.join(_KINDS)}")
    time = planes.time.to_numpy()
    turns = (turned_through(angle, time, sense) - sense * mark) / (2 * np.pi)
    first, last, zero = _whole(time, turns, start_s, revolutions)
    signals = planes.displacement.transpose("end", "axis", "time").to_numpy()
    if kind == "averaged":
        return _averaged(planes, signals, time, turns, zero, revolutions)
    some = slice(first, last + 1)
    turned, xy = 2 * np.pi * (turns[some] - zero), signals[..., some]
    if kind == "1X":
        xy = _first_order(xy, turned)
    # the tolerance keeps rounding errors from deciding on which side of a pulse a sample lies
    passed = np.searchsorted(turned, 2 * np.pi * (np.arange(revolutions) - 1e-6))
    return xr.Dataset(
        {"displacement": (("end", "axis", "sample"), xy, {"units": "m"}), "keyphasor": ("pulse", passed)},
        coords={
            "end": planes.end,
            "axis": planes.axis,
            "time": ("sample", time[some], {"units": "s"}),
            "turned": ("sample", turned, {"units": "rad"}),
        },
        attrs=_attributes(kind, time, turns, zero, revolutions),
    )


def centreline(planes: xr.Dataset, window_s: float = 0.2) -> xr.Dataset:
    """Return the shaft centreline: the mean position over consecutive windows.

    Parameters
    ----------
    planes : Dataset
        ``displacement(end, axis, time)``, m; attribute ``sampling_hz``.
    window_s : float
        Window length, s; use several periods of the pendulum swing.

    Returns
    -------
    Dataset
        ``position`` and ``deviation`` (standard deviation of the samples) ``(end, axis, time)``, m; ``time`` is the
        centre of each window, s.  A window that contains NaN gives NaN; no window spans a gap in the time axis.

    Raises
    ------
    InputError
        If the record is shorter than a window, or a window is shorter than two samples.
    """
    rate, samples = float(planes.attrs["sampling_hz"]), planes.sizes["time"]
    length = round(window_s * rate)
    if not 2 <= length <= samples:
        raise InputError(
            f"a window of {window_s:g} s holds {length} of the record's {samples} samples at {rate:g} Hz; give one of 2 samples"
            " to the whole record"
        )
    time = planes.time.to_numpy()
    whole = [slice(p.start, p.start + (p.stop - p.start) // length * length) for p in pieces(time)]
    signals = planes.displacement.transpose("end", "axis", "time").to_numpy()
    blocks = np.concatenate([signals[..., p] for p in whole], axis=-1).reshape(*signals.shape[:2], -1, length)
    middle = np.concatenate([time[p] for p in whole]).reshape(-1, length).mean(axis=1)
    dims = ("end", "axis", "time")
    return xr.Dataset(
        {
            "position": (dims, blocks.mean(axis=-1), {"units": "m"}),
            "deviation": (dims, blocks.std(axis=-1), {"units": "m"}),
        },
        coords={"end": planes.end, "axis": planes.axis, "time": ("time", middle, {"units": "s"})},
        attrs={"window_s": length / rate},
    )


def _whole(time: np.ndarray, turns: np.ndarray, start_s: float, revolutions: int) -> tuple[int, int, int]:
    """Return first and last sample of the revolutions after `start_s`, and the number of the first revolution."""
    if revolutions < 1:
        raise InputError(f"an orbit of {revolutions} revolutions cannot be extracted; give 1 or more")
    after = np.flatnonzero((time >= start_s) & np.isfinite(turns))
    if after.size:
        zero = int(np.ceil(turns[after[0]] - 1e-6))
        inside = after[(turns[after] >= zero - 1e-6) & (turns[after] <= zero + revolutions + 1e-6)]
        complete = turns[after[-1]] >= zero + revolutions - 1e-6
        if complete and inside.size > 1 and inside[-1] - inside[0] == inside.size - 1:
            return int(inside[0]), int(inside[-1]), zero
    known = turns[after][-1] - turns[after][0] if after.size else 0.0
    raise InputError(
        f"{revolutions} whole revolutions after {start_s:g} s are not available; the shaft angle covers {known:.1f} there"
    )


def _first_order(xy: np.ndarray, turned: np.ndarray) -> np.ndarray:
    base = np.column_stack([np.ones_like(turned), np.cos(turned), np.sin(turned)])
    return np.asarray((xy @ np.linalg.pinv(base).T) @ base.T)


def _averaged(
    planes: xr.Dataset, signals: np.ndarray, time: np.ndarray, turns: np.ndarray, zero: int, revolutions: int
) -> xr.Dataset:
    known = np.isfinite(turns)
    turned = np.arange(_STEPS) / _STEPS
    at = np.interp(zero + np.arange(revolutions)[:, None] + turned, turns[known], time[known])
    whole = np.array([[np.interp(at, time, signal) for signal in end] for end in signals])
    dims = ("end", "axis", "sample")
    variables: dict[str, tuple] = {
        "displacement": (dims, whole.mean(axis=2), {"units": "m"}),
        "keyphasor": ("pulse", np.zeros(1, dtype=int)),
    }
    if revolutions > 1:
        variables["deviation"] = (dims, whole.std(axis=2, ddof=1), {"units": "m"})
    return xr.Dataset(
        variables,
        coords={"end": planes.end, "axis": planes.axis, "turned": ("sample", 2 * np.pi * turned, {"units": "rad"})},
        attrs=_attributes("averaged", time, turns, zero, revolutions),
    )


def _attributes(kind: str, time: np.ndarray, turns: np.ndarray, zero: int, revolutions: int) -> dict[str, str | float]:
    known = np.isfinite(turns)
    start, end = np.interp([zero, zero + revolutions], turns[known], time[known])
    return {"kind": kind, "start_s": float(start), "end_s": float(end), "speed_hz": float(revolutions / (end - start))}
