"""Detection of probe cables exchanged between the ends: neither end then moves on a circle, but both do once exchanged back."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import xarray as xr
from tdbsim.machine import Machine

from tdbmon.analysis.axes import to_planes
from tdbmon.record.finding import Check, um

# s: end of the bounces after the release; length of the part of the record that is used, and its latest end after the release
_SETTLED_S, _LONG_S, _WITHIN_S = 0.2, 0.25, 2.0
_SAMPLES = 4000  # samples used, enough for a circle
# times nearer to circles at both ends by exchanging; sound records stay below 0.9, exchanged ones lie above 3
_CLEARLY = 2.0
_FITS = 0.04  # of the gap: greatest median distance of a settled shaft from its circle
_ROUND = (0.5, 2.0)  # of the gap: radii possible for the clearance circle
_ROUNDS = 8  # iterations of the reweighting


@dataclass(frozen=True)
class ExchangedProbes:
    """Pairs of probes, one of each end, of which one pair is exchanged, and the failed check that reports it.

    The circles cannot show which of two pairs it is: exchanging the other one mirrors the motion end for end.
    """

    pairs: tuple[tuple[str, str], ...]
    check: Check


def exchanged_probes(
    planes: xr.Dataset, record: xr.Dataset, machine: Machine, release_s: float | None
) -> ExchangedProbes | None:
    """Find two probes whose cables are exchanged between the ends.

    Parameters
    ----------
    planes : Dataset
        Result of `to_planes`.
    record : Dataset
        Probes in m, from which `planes` were made.
    machine : Machine
    release_s : float or None
        Instant of the release, s; None if unknown, to use the start of the record.

    Returns
    -------
    ExchangedProbes or None
        None unless exchanging two of them puts both ends on circles of the size of the clearance.
    """
    used = {str(name) for name in planes.probe.values}
    ends = [[probe.name for probe in machine.probes_at(end) if probe.name in used] for end in machine.ends]
    if len(ends) != 2 or not all(ends) or any(str(plane) != "bearing" for plane in planes.plane.values):
        return None
    dimension = record[ends[0][0]].dims[0]
    time = record[dimension].to_numpy()
    start = float(time[0] if release_s is None else release_s)
    last = min(float(time[-1]), start + _WITHIN_S)
    tail = (time >= max(start + _SETTLED_S, last - _LONG_S)) & (time <= last)
    if tail.sum() < 100:
        return None
    some = record[sorted(used)].isel({dimension: np.flatnonzero(tail)[:: max(int(tail.sum()) // _SAMPLES, 1)]})
    gap = max(machine.bearing(end).radial_gap.nominal for end in machine.ends)
    as_is, _ = _off_circles(to_planes(some, machine, sorted(used)))
    if min(as_is) < _FITS * gap:
        return None
    mended = {}
    for one, other in product(*ends):
        exchanged = some.assign({one: some[other].variable, other: some[one].variable})
        mended[one, other] = _off_circles(to_planes(exchanged, machine, sorted(used)))
    (one, other), (off, radii) = min(mended.items(), key=lambda each: max(each[1][0]))
    near = max(off) < min(_FITS * gap, min(as_is) / _CLEARLY)
    if not near or not all(_ROUND[0] * gap < radius < _ROUND[1] * gap for radius in radii):
        return None
    others = [name for name in ends[0] + ends[1] if name not in (one, other)]
    detail = (
        f"the settled shaft follows a circle at neither end (median distance {um(as_is[0])} and {um(as_is[1])}), but at both ends"
        f" with {one} and {other} exchanged ({um(off[0])} and {um(off[1])}): are their cables exchanged between the ends, or"
        f" those of {' and '.join(others)}, which looks the same?"
    )
    pairs = [(one, other)] + ([(others[0], others[1])] if len(others) == 2 else [])
    return ExchangedProbes(tuple(pairs), Check("cabling", f"{one}, {other}", False, detail))


def _off_circles(planes: xr.Dataset) -> tuple[list[float], list[float]]:
    """Return the median distance of each end from its fitted circle, and the radius of that, m; infinite without samples."""
    found = [_off_circle(planes.displacement.sel(end=end).to_numpy()) for end in planes.end.values]
    off, radii = zip(*found, strict=True)
    return list(off), list(radii)


def _off_circle(xy: np.ndarray) -> tuple[float, float]:
    """Return the median distance from a circle fitted algebraically, and its radius, m; lift-offs are weighted down.

    Source: I. Kasa, IEEE Trans. Instrum. Meas. 25 (1976) 8.
    """
    x, y = xy[:, np.isfinite(xy).all(axis=0)] * 1e6
    if x.size < 50:
        return np.inf, np.inf
    design = np.column_stack([x, y, np.ones_like(x)])
    weight, off, radius = np.ones_like(x), np.full_like(x, np.inf), np.inf
    for _ in range(_ROUNDS):
        a, b, c = np.linalg.lstsq(design * weight[:, None], (x**2 + y**2) * weight, rcond=None)[0]
        radius = float(np.sqrt(max(c + (a**2 + b**2) / 4, 0.0)))
        off = np.abs(np.hypot(x - a / 2, y - b / 2) - radius)
        weight = 1 / np.hypot(1, off / (1.5 * float(np.median(off)) + 0.1))
    return float(np.median(off)) * 1e-6, radius * 1e-6
