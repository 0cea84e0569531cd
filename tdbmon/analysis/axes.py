"""Transformation of probe readings to machine axes (x right, y up) and along the rigid rotor to the bearing planes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from tdbsim.errors import InputError
from tdbsim.machine import Machine

from tdbmon.record.timebase import usual_rate

AXES = ("x", "y")
_ROUNDING = 1e-9  # of the greatest weight: smaller weights are rounding errors


def to_planes(record: xr.Dataset, machine: Machine, use: Sequence[str] | None = None) -> xr.Dataset:
    """Return the displacement of the shaft centre at the touchdown bearings.

    Each probe reads ``x cos(angle) + y sin(angle)`` in its own plane; with two probes at each of two planes the four
    readings give the rigid line of the rotor, which is evaluated at the bearing planes (the rigid-body case of modal
    expansion, r = Phi (Q Phi)^+ r_m).  If they do not, an end with two usable probes is evaluated at its probe plane.

    Parameters
    ----------
    record : Dataset
        A record assigned to the machine (`tdbmon.record.assign`), probes in m.
    machine : Machine
    use : sequence of str, optional
        Names of the usable probes; by default all that the record holds.

    Returns
    -------
    Dataset
        ``displacement(end, axis, time)`` in m at the bearing planes and ``weights(end, axis, probe)``, the linear map
        from readings to it (noise propagates through it too).  ``plane(end)`` is "bearing", "probe" or "none".  An end that
        cannot be resolved is NaN.  Attribute ``sampling_hz`` is the sampling rate between gaps in the time axis.

    Raises
    ------
    InputError
        If no end has two usable probes in different directions, or the probes have different time bases.
    """
    names = [p.name for p in machine.probes if p.name in record and (use is None or p.name in use)]
    if not names:
        raise InputError("the record holds no usable displacement probe of this machine")
    dims = {record[name].dims[0] for name in names}
    if len(dims) > 1:
        raise InputError(f"the probes {', '.join(names)} are on different time bases; record them at one rate")
    dim = str(dims.pop())
    weights, planes = _weights(machine, names)
    if all(plane == "none" for plane in planes):
        raise InputError("no end has two usable probes in different directions; the orbit cannot be seen")
    readings = np.stack([record[name].to_numpy() for name in names])
    displacement = np.einsum("eap,pt->eat", weights, np.nan_to_num(readings), optimize=True)
    broken = np.isnan(readings)
    if broken.any():
        for i in range(len(machine.ends)):
            # a probe in the plane of one bearing has zero weight at the other but for rounding, and must not void it
            share = np.abs(weights[i])
            needed = (share > _ROUNDING * share.max(axis=1, keepdims=True)).any(axis=0)
            displacement[i][:, broken[needed].any(axis=0)] = np.nan
    for i, plane in enumerate(planes):
        if plane == "none":
            displacement[i] = np.nan
    time = record[dim].to_numpy()
    return xr.Dataset(
        {
            "displacement": (("end", "axis", "time"), displacement, {"units": "m", "long_name": "shaft displacement"}),
            "weights": (("end", "axis", "probe"), weights),
            "plane": (("end",), planes),
        },
        coords={"end": list(machine.ends), "axis": list(AXES), "time": ("time", time, {"units": "s"}), "probe": names},
        attrs={"sampling_hz": usual_rate(time)},
    )


def seen_ends(planes: xr.Dataset) -> list[str]:
    """Return the names of the ends whose orbit is visible, from a result of `to_planes`."""
    return [str(end) for end, plane in zip(planes.end.values, planes.plane.values, strict=True) if plane != "none"]


def at_own_probes(
    planes: xr.Dataset, record: xr.Dataset, machine: Machine, use: Sequence[str], ends: Sequence[str]
) -> xr.Dataset:
    """Evaluate ends at the plane of their own probes, since the rigid line propagates the errors of another end's probes.

    Parameters
    ----------
    planes : Dataset
        Result of `to_planes` of the same record.
    record, machine, use
        As `to_planes` takes them.
    ends : sequence of str
        Each with two usable probes in different directions.

    Returns
    -------
    Dataset
        The planes given, with these ends at the plane "probe".
    """
    displacement, weights = planes.displacement.copy(deep=True), planes.weights.copy(deep=True)
    plane = planes.plane.copy(deep=True)
    for end in ends:
        own = to_planes(record, machine, [probe.name for probe in machine.probes_at(end) if probe.name in use])
        displacement.loc[{"end": end}] = own.displacement.sel(end=end)
        weights.loc[{"end": end}] = own.weights.sel(end=end).reindex(probe=weights.probe, fill_value=0.0)
        plane.loc[{"end": end}] = "probe"
    return planes.assign(displacement=displacement, weights=weights, plane=plane)


def differ(angles: Sequence[float]) -> bool:
    """Return whether at least two of some probes (angles in rad) measure in different directions."""
    directions = np.column_stack([np.cos(angles), np.sin(angles)])
    return len(angles) >= 2 and int(np.linalg.matrix_rank(directions, tol=0.1)) == 2


def _weights(machine: Machine, names: Sequence[str]) -> tuple[np.ndarray, list[str]]:
    """Return the linear map (end, axis, probe) from readings to displacement, and the plane for which it holds at each end."""
    probes = [p for p in machine.probes if p.name in names]
    cos, sin = np.cos([p.angle for p in probes]), np.sin([p.angle for p in probes])
    position = np.array([p.position for p in probes])
    middle = position.mean()
    line = np.column_stack([cos, sin, cos * (position - middle), sin * (position - middle)])
    weights = np.zeros((len(machine.ends), 2, len(probes)))
    planes = []
    apart = max(np.ptp(position), 1e-3)
    resolved = np.linalg.matrix_rank(line / [1, 1, apart, apart], tol=0.05) == 4
    inverse = np.linalg.pinv(line) if resolved else None
    for i, end in enumerate(machine.ends):
        if inverse is not None:
            lever = machine.bearing(end).position - middle
            weights[i] = inverse[:2] + lever * inverse[2:]
            planes.append("bearing")
            continue
        own = np.array([p.end == end for p in probes])
        if differ([p.angle for p in probes if p.end == end]):
            weights[i][:, own] = np.linalg.pinv(np.column_stack([cos[own], sin[own]]))
            planes.append("probe")
        else:
            planes.append("none")
    return weights, planes
