"""Lift-off: the record begins with the shaft at rest on its touchdown bearings, which is levitated before it drops.

The initial rest position is neither the levitated position nor a drop; from lift-off on, the record is that of a normal drop.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from tdbsim.machine import Machine

from tdbmon.record.finding import Check
from tdbmon.runs import runs_of

_UPRIGHT = 0.5  # least sine of the angle of a probe that measures the shaft's height
_SWINGS_S = 0.07  # at the start and at the end: at least two oscillations, whose median is the rest position
_SAME = 0.25  # of the gap: largest difference between the rest positions at start and end
_UP = 0.5  # of the gap above the rest position: the shaft is lifted
_HELD_S = 0.07  # longer than any bounce or oscillation reaches this height
_FALL_S = 0.02  # end of the lifted stretch, in which the drop may already have begun
_ORBIT_S = 0.1  # before that: certainly on the levitated orbit
_WIDER = 2.0  # times the size of that orbit: not yet levitated


def from_lift_off(ds: xr.Dataset, machine: Machine) -> tuple[xr.Dataset, list[Check]]:
    """Return the record from the instant at which the shaft is levitated, and a failed check if its start was removed."""
    since = _levitates_from(ds, machine)
    if since is None:
        return ds, []
    detail = (
        f"the record begins with the shaft on its touchdown bearings; it levitates from {since:.4g} s on. Earlier samples"
        f" are left out; cut the record at {since:.4g} s"
    )
    kept = {dim: slice(int(np.searchsorted(ds[dim].to_numpy(), since)), None) for dim in ds.dims}
    return ds.isel(kept), [Check("lift-off", "", False, detail)]


def _levitates_from(ds: xr.Dataset, machine: Machine) -> float | None:
    """Return when a shaft initially at rest becomes levitated, s; None if it was not at rest or the record cannot tell."""
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
    seen = np.isfinite(height).any(axis=0)  # missing samples are removed, so that a gap does not count as lifted
    time, height = time[seen], height[:, seen]
    up = next(iter(runs_of(~np.any(height - first[:, None] <= _UP, axis=0)).lasting(time, _HELD_S)), None)
    if up is None:
        return None
    return _from_orbit(time[up], height[:, up])


def _from_orbit(time: np.ndarray, height: np.ndarray) -> float:
    """Return the time from which a lifted shaft stays on the orbit that it has just before the drop, s."""
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
