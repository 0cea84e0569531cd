"""Re-levitation: the shaft is lifted again after resting on its touchdown bearings, and what follows is not part of the drop.

A high-pass filtered channel also returns to zero while the shaft is at rest, but starts to do so at the fall.  If the reading
stays low for most of the time in between, the shaft was at rest and was lifted by the magnetic bearings.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tdbsim.machine import Machine

from tdbmon.record.direction_checks import STANDS, motions_of
from tdbmon.record.finding import Check
from tdbmon.record.held_end import HEAD_S, Path, falls_at, middle
from tdbmon.record.timebase import usual_interval
from tdbmon.runs import runs_of

_HOVERS_S = 0.07  # longer than any bounce or oscillation reaches this height
_FEWEST = 20  # samples required in that time: times in ms misread as s would have two
_NEAR = 0.1  # of the gap, added to the levitated orbit: within, the shaft is levitated again
_LAY = 0.7  # of the gap: least median depth between fall and lift; a third with a high-pass filter
_LEAVES = 0.25  # of the gap above that depth: the shaft is being lifted
_BEFORE_S = (0.3, 0.07)  # interval before this: the shaft is at rest, and the smallest depth there marks the start of the lift


def until_taken_up(ds: xr.Dataset, machine: Machine) -> tuple[xr.Dataset, list[Check]]:
    """Return the record up to the instant at which the shaft is lifted again, and a failed check if its end was removed.

    The attributes ``lifted_s`` and ``hovers_s`` then give the start of the lift and the end of the renewed levitation, s.
    """
    lifted = _lifted(ds, machine)
    if lifted is None:
        return ds, []
    since, until = lifted
    detail = (
        f"after the drop the shaft is lifted off its touchdown bearings from about {since:.4g} s on: the magnetic bearings"
        f" levitate the rotor again. Later samples are left out; cut the record at {since:.4g} s"
    )
    kept = {dim: slice(None, int(np.searchsorted(ds[dim].to_numpy(), since))) for dim in ds.dims}
    return ds.isel(kept).assign_attrs(lifted_s=since, hovers_s=until), [Check("lifted again", "", False, detail)]


def _lifted(ds: xr.Dataset, machine: Machine) -> tuple[float, float] | None:
    """Return when the first of the ends that fell is lifted, and until when it then stays levitated, s; None if none is."""
    if machine.gravity <= 0:
        return None
    motions = motions_of(ds, machine)
    swift = [end for end, (time, _) in motions.items() if len(time) > 1 and _FEWEST * usual_interval(time) < _HOVERS_S]
    found = [each for end in swift if (each := _of_end(motions, end, machine)) is not None]
    return min(found, default=None)


def _of_end(motions: Mapping[str, Path], end: str, machine: Machine) -> tuple[float, float] | None:
    time, z = motions[end]
    seen = np.isfinite(z)
    time, z = time[seen], z[seen]
    fell = falls_at({end: (time, z)}, machine) if len(time) else None
    if fell is None:
        return None
    gap = machine.bearing(end).radial_gap.nominal
    head = z[time < time[0] + HEAD_S]
    start = middle(head)
    away, orbit = np.abs(z - start), float(np.abs(head - start).max())
    if orbit > STANDS * gap:  # the record begins in the fall or a bounce: the levitated position is unknown
        return None
    hovers = next(iter(runs_of((away < _NEAR * gap + orbit) & (time > fell)).lasting(time, _HOVERS_S)), None)
    if hovers is None:
        return None
    back, until = hovers.start, float(time[hovers.stop - 1])
    between = (time > fell) & (time < time[back])
    depth = float(np.median(away[between])) if between.any() else 0.0
    if depth < _LAY * gap:
        return None
    high = _last(away > depth - _LEAVES * gap, back)
    before = (time > max(fell, time[high] - _BEFORE_S[0])) & (time < time[high] - _BEFORE_S[1])
    seen_up = _last(away >= np.quantile(away[before], 0.05), high) if before.any() else high
    # the slow lift exceeds the oscillation only later: extrapolate back by as much as from there to `high`
    return max(2 * float(time[seen_up]) - float(time[high]), fell), until


def _last(true: NDArray[np.bool_], before: int) -> int:
    """Return the index of the last true element up to and including index `before`."""
    return int(np.flatnonzero(true[: before + 1])[-1])
