"""A shaft that is back where it levitated: then nothing lies at the bottom of the clearance.

Channels behind a high-pass (AC coupling, usual for accelerometers) forget where the shaft is: their mean goes back to zero
while it lies on its bearings.  Magnetic bearings that take the rotor up again do the same, and no probe tells which it was;
but what hovers there in between, or only as the record ends, is held.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from tdbsim.machine import Machine

from tdbmon.record.finding import um
from tdbmon.runs import runs_of

BOUNCING_S = 0.25  # after the release: before, the shaft still bounces
_TAIL_S = 0.07  # at least two swings, whose mean is where it rests
_BACK = 0.1  # of the gap, within which it is back
_WENT = 0.5  # of the gap, as far as it must have gone
_WHIRLS = 0.85  # of the gap, rms: a shaft that whirls round the ring is in the middle on the average


def at_rest(time: np.ndarray, xy: np.ndarray, release_s: float) -> np.ndarray:
    """Return the samples (2, k) of a record's end, the last tenth after the release: the shaft rests or swings about rest."""
    return xy[:, time >= min(time[-1] - _TAIL_S, time[-1] - 0.1 * (time[-1] - release_s))]


def returned(planes: xr.Dataset, end: str, machine: Machine, release_s: float | None) -> str:
    """Say that an end is, or was in between, back where it levitated; "" where not, or where the record cannot tell.

    Parameters
    ----------
    planes : Dataset
        Result of `tdbmon.analysis.axes.to_planes`.
    end : str
    machine : Machine
    release_s : float or None
        The release; None where it is not known.
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
            f"at the end the shaft is within {um(apart)} of where it levitated, though it went {um(reach)} from there: either"
            " the channels are AC coupled or behind a high-pass (set the data acquisition to DC coupling), or the magnetic"
            " bearings took the rotor up again (cut the record before that)"
        )
    near = _BACK * gap + float(np.nanmax(np.hypot(*(before - start[:, None]))))
    return _held(time[time >= release_s], np.hypot(*(after - start[:, None])) < near) if apart > near else ""


def _held(time: np.ndarray, near: np.ndarray) -> str:
    """Say from when to when a shaft hovers `near` where it levitated, for longer than any bounce lasts; "" where it does not."""
    hovers = next(iter(runs_of(near).lasting(time, _TAIL_S)), None)
    if hovers is None:
        return ""
    begin, end = float(time[hovers.start]), float(time[hovers.stop - 1])
    return (
        f"from {begin:.4g} s to {end:.4g} s the shaft is back where it levitated: the magnetic bearings took the rotor up again"
        " (cut the record before that)"
    )
