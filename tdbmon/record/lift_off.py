"""A lift-off: the record begins while the shaft lies on its touchdown bearings, and is levitated before it drops.

What lies at the start is neither where the shaft levitates nor a fall; from the lift-off on the record is one of a drop.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from tdbsim.machine import Machine

from tdbmon.record.finding import Check
from tdbmon.runs import runs_of

_UPRIGHT = 0.5  # sine of a probe's angle, from which on it sees how high the shaft is
_SWINGS_S = 0.07  # at the start and at the end: at least two swings, whose middle is where it lies
_SAME = 0.25  # of the gap, within which it lies in one place
_UP = 0.5  # of the gap, above which it does not lie
_HELD_S = 0.07  # longer than it bounces or swings so high
_FALL_S = 0.02  # at the end of the time that it is up: it may fall already
_ORBIT_S = 0.1  # before that: surely on the levitated orbit
_WIDER = 2.0  # times that orbit: not levitated yet


def from_lift_off(ds: xr.Dataset, machine: Machine) -> tuple[xr.Dataset, list[Check]]:
    """Return a record laid over its machine from where the shaft levitates, and a failed check if something was left out."""
    since = _levitates_from(ds, machine)
    if since is None:
        return ds, []
    detail = (
        f"the record begins with the shaft on its touchdown bearings, and it levitates from {since:.4g} s on: what lies before"
        f" is left out; cut the record at {since:.4g} s"
    )
    kept = {dim: slice(int(np.searchsorted(ds[dim].to_numpy(), since)), None) for dim in ds.dims}
    return ds.isel(kept), [Check("lift-off", "", False, detail)]


def _levitates_from(ds: xr.Dataset, machine: Machine) -> float | None:
    """Return from when a shaft that lay at first levitates, s; None where it did not lie, or where the record cannot tell."""
    upright = [probe for probe in machine.probes if probe.name in ds and abs(np.sin(probe.angle)) > _UPRIGHT]
    if not upright:
        return None
    dimension = ds[upright[0].name].dims[0]
    time = ds[dimension].to_numpy()
    pulls = {
        probe.name: float(np.sin(probe.angle)) * machine.bearing(probe.end).radial_gap.nominal for probe in upright
    }
    height = np.array([ds[name] / pull for name, pull in pulls.items() if ds[name].dims[0] == dimension])
    head, tail = height[:, time < time[0] + _SWINGS_S], height[:, time > time[-1] - _SWINGS_S]
    if not all(np.isfinite(part).any(axis=1).all() for part in (head, tail)):
        return None
    first, last = np.nanmedian(head, axis=1), np.nanmedian(tail, axis=1)
    if np.any(np.abs(last - first) > _SAME):
        return None
    seen = np.isfinite(height).any(axis=0)  # a stretch without values is not up: it is as what lies around it
    time, height = time[seen], height[:, seen]
    up = next(iter(runs_of(~np.any(height - first[:, None] <= _UP, axis=0)).lasting(time, _HELD_S)), None)
    if up is None:
        return None
    return _from_orbit(time[up], height[:, up])


def _from_orbit(time: np.ndarray, height: np.ndarray) -> float:
    """Return from when a shaft that is up stays on the orbit that it has before it falls, s."""
    fallen = time[-1] - _FALL_S
    orbit = height[:, (time > fallen - min(_ORBIT_S, (fallen - time[0]) / 2)) & (time < fallen)]
    told = np.isfinite(orbit).any(axis=1)
    if not told.any():
        return float(time[0])
    orbit, height = orbit[told], height[told]
    place = np.nanmedian(orbit, axis=1)[:, None]
    reach = np.nanmax(np.abs(orbit - place), axis=1)[:, None]
    beyond = np.flatnonzero(np.any(np.abs(height - place) > _WIDER * reach, axis=0) & (time < fallen))
    return float(time[beyond[-1] + 1]) if beyond.size else float(time[0])
