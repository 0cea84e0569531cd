"""A shaft that lay on its touchdown bearings and was levitated again: what follows its lift is not the drop's.

A channel behind a high-pass goes back to zero too while the shaft lies, but does so from the fall on: where it stays down for
most of the time in between, the shaft lay there, and the magnetic bearings took it up.
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

_HOVERS_S = 0.07  # longer than any bounce lasts or swing goes so high
_FEWEST = 20  # samples in that time, without which it is not that long: times in ms read as s have two
_NEAR = 0.1  # of the gap, beyond the levitated orbit, within which it hovers where it levitated
_LAY = 0.7  # of the gap, as deep as it was for half of the time between fall and lift: behind a high-pass it is a third
_LEAVES = 0.25  # of the gap above that: then it is on its way up
_BEFORE_S = (0.3, 0.07)  # before it is: there it lies, and the least of its depth is where it leaves from


def until_taken_up(ds: xr.Dataset, machine: Machine) -> tuple[xr.Dataset, list[Check]]:
    """Return a record laid over its machine up to where the shaft is lifted again, and a failed check if something was left out.

    The attributes ``lifted_s`` and ``hovers_s`` then tell from when to when it was levitated again.
    """
    lifted = _lifted(ds, machine)
    if lifted is None:
        return ds, []
    since, until = lifted
    detail = (
        f"the shaft lay on its touchdown bearings and is lifted from about {since:.4g} s on: the magnetic bearings took the rotor"
        f" up again. What follows is left out; cut the record at {since:.4g} s"
    )
    kept = {dim: slice(None, int(np.searchsorted(ds[dim].to_numpy(), since))) for dim in ds.dims}
    return ds.isel(kept).assign_attrs(lifted_s=since, hovers_s=until), [Check("lifted again", "", False, detail)]


def _lifted(ds: xr.Dataset, machine: Machine) -> tuple[float, float] | None:
    """Return when the first of the ends that fell is lifted, and until when it then hovers, s; None where none is."""
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
    if orbit > STANDS * gap:  # the record begins in the fall or a bounce: nothing tells where the shaft levitates
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
    # it leaves slowly, and is seen above its swing only later: about as much later as from there to `high`
    return max(2 * float(time[seen_up]) - float(time[high]), fell), until


def _last(true: NDArray[np.bool_], before: int) -> int:
    """Return the last sample up to another one at which something is true."""
    return int(np.flatnonzero(true[: before + 1])[-1])
