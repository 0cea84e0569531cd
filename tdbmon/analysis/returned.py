"""Detection of a shaft that returns to its levitated position after the drop instead of resting at the bottom.

Behind a high-pass filter (AC coupling, usual for accelerometers) the static position is lost: the mean reading returns to
zero while the shaft lies on its bearings.  Relevitation by the magnetic bearings looks the same at the end of a record, and
the probes cannot tell the two apart; a shaft that hovers there for only part of the time after the drop was relevitated.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from tdbsim.machine import Machine

from tdbmon.record.finding import um
from tdbmon.runs import runs_of

BOUNCING_S = 0.25  # after the release, during which the shaft still bounces
_TAIL_S = 0.07  # at least two swing periods, whose mean is the rest position
_BACK = 0.1  # of the gap: distance within which the shaft has returned
_WENT = 0.5  # of the gap: least excursion before that
_WHIRLS = 0.85  # of the gap, rms: above, the shaft whirls, and only its mean is central


def at_rest(time: np.ndarray, xy: np.ndarray, release_s: float) -> np.ndarray:
    """Return the last samples (2, k) of a record, a tenth of the time since the release or 70 ms, whichever is more.

    There the shaft rests, or swings about its rest position.
    """
    return xy[:, time >= min(time[-1] - _TAIL_S, time[-1] - 0.1 * (time[-1] - release_s))]


def returned(planes: xr.Dataset, end: str, machine: Machine, release_s: float | None) -> str:
    """Return a message if an end is, or was in between, back at its levitated position; "" if not, or if that is unknown.

    Parameters
    ----------
    planes : Dataset
        Result of `tdbmon.analysis.axes.to_planes`.
    end : str
    machine : Machine
    release_s : float or None
        The release, s; None if unknown.
    """
    time, xy = planes.time.to_numpy(), planes.displacement.sel(end=end).to_numpy()
    if release_s is None or not machine.gravity or time[-1] - release_s < BOUNCING_S:
        return ""
    before, after, tail = xy[:, time < release_s], xy[:, time >= release_s], at_rest(time, xy, release_s)
    if not all(np.isfinite(part).all(axis=0).any() for part in (before, after, tail)):
        return ""
    start, rest = np.nanmean(before, axis=1), np.nanmean(tail, axis=1)
    reach = float(np.nanmax(np.hypot(*(after - start[:, None]))))
    apart = float(np.hypot(*(rest - start)))
    gap = machine.bearing(end).radial_gap.nominal
    moves = float(np.sqrt(np.nanmean(np.sum((tail - rest[:, None]) ** 2, axis=0))))
    if reach < _WENT * gap:
        return ""
    if apart <= _BACK * gap and moves <= _WHIRLS * gap:
        return (
            f"at the end the shaft is within {um(apart)} of its levitated position, though it moved {um(reach)} away: either"
            " the channels are AC coupled or high-pass filtered (set the data acquisition to DC coupling), or the magnetic"
            " bearings lifted the rotor again (cut the record before that)"
        )
    near = _BACK * gap + float(np.nanmax(np.hypot(*(before - start[:, None]))))
    return _held(time[time >= release_s], np.hypot(*(after - start[:, None])) < near) if apart > near else ""


def _held(time: np.ndarray, near: np.ndarray) -> str:
    """Return a message with the first time span in which the shaft is `near` its levitated position for 70 ms; "" if none.

    No bounce lasts so long.
    """
    hovers = next(iter(runs_of(near).lasting(time, _TAIL_S)), None)
    if hovers is None:
        return ""
    begin, end = float(time[hovers.start]), float(time[hovers.stop - 1])
    return (
        f"from {begin:.4g} s to {end:.4g} s the shaft is back at its levitated position: the magnetic bearings lifted the rotor"
        " again (cut the record before that)"
    )
