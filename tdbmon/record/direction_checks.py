"""Checks of the probe orientation: a released rotor must fall downwards, and unbalance must cause forward whirl."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import xarray as xr
from tdbsim.machine import Machine

from tdbmon.record.finding import Check, um
from tdbmon.record.held_end import DOWN_DEG, Path, aside, held_ends, middle
from tdbmon.record.samples import times_of

_LEVITATED_S = 5e-3  # levitation needed at the start; with less, the release cannot be detected either
STANDS = 0.3  # of the radial gap: a levitated shaft moves less (zone A of ISO 14839-2)
_LIES = 0.7  # of the gap, from the probes' zero: a levitated shaft is closer to the centre
_ACROSS = 0.17  # smallest sine of the angle between two probes that resolve the plane: 10 degrees
_LEAST_SAMPLES = 200
_MOVED = (0.3, 10.0)  # radial gaps between levitation and rest: less is not a fall, more is impossible


def motions_of(ds: xr.Dataset, machine: Machine) -> dict[str, Path]:
    """Return time, s, and x + i y at the probe plane, m, of each end with two probes that resolve both directions."""
    return {end: motion for end in machine.ends if (motion := _motion_at(ds, machine, end)) is not None}


def _motion_at(ds: xr.Dataset, machine: Machine, end: str) -> Path | None:
    there = [probe for probe in machine.probes_at(end) if probe.name in ds]
    for one, other in combinations(there, 2):
        if ds[one.name].dims != ds[other.name].dims or abs(np.sin(one.angle - other.angle)) < _ACROSS:
            continue
        axes = np.array([[np.cos(p.angle), np.sin(p.angle)] for p in (one, other)])
        readings = np.stack((ds[one.name].values, ds[other.name].values))
        x, y = np.linalg.solve(axes, np.where(np.isfinite(readings), readings, np.nan))
        return times_of(ds[one.name]), x + 1j * y
    return None


def fall_directions(ds: xr.Dataset, machine: Machine) -> list[Check]:
    """Check at each end that the settled position lies below the initial one, since a released rotor falls.

    Not checked is an end that does not initially stand still within the clearance (the record begins after the release), one
    that stays levitated while the other falls, and one whose final whirl orbit is larger than the displacement of its mean
    position: a shaft that whirls around the full clearance does not settle.
    """
    found = []
    motions = motions_of(ds, machine)
    held = held_ends(motions, machine)
    for end, (time, z) in motions.items():
        if end in held:
            continue
        gap = machine.bearing(end).radial_gap.nominal
        start = z[(time < time[0] + _LEVITATED_S) & np.isfinite(z)]
        if start.size and (np.abs(start - start[0]).max() > STANDS * gap or np.abs(start.mean()) > _LIES * gap):
            continue
        z = z[np.isfinite(z)]
        if z.size < _LEAST_SAMPLES:
            continue
        few = max(min(z.size // 50, 200), 10)
        last = z[-z.size // 4 :]
        moved = middle(last) - z[:few].mean()
        if np.std(last) > abs(moved):
            continue
        if not _MOVED[0] * gap < abs(moved) < _MOVED[1] * gap:
            continue
        off = aside(moved)
        detail = f"settles {um(abs(moved))} from its initial position, {off:.0f} deg from straight down"
        names = ", ".join(probe.name for probe in machine.probes_at(end))
        cure = f": check sign of the sensitivity and angle of {names}, and whether two are swapped"
        down = off < DOWN_DEG
        found.append(Check("fall", end, down, detail + ("" if down else cure)))
    return found


def whirl_directions(ds: xr.Dataset, machine: Machine, hz: float | None) -> list[Check]:
    """Check that the 1X orbit of the levitated rotor whirls forward; a backward orbit indicates swapped probes."""
    found: list[Check] = []
    if hz is None or hz <= 0:
        return found
    for end, (time, z) in motions_of(ds, machine).items():
        first = (time < time[0] + 4 / hz) & np.isfinite(z)
        t, z = time[first] - time[0], z[first]
        if t.size < 40 or t[-1] < 3 / hz:
            continue
        turn = np.exp(2j * np.pi * hz * t)
        basis = np.column_stack((turn, turn.conj(), np.ones_like(t), t, t**2))
        fit, *_ = np.linalg.lstsq(basis, z, rcond=None)
        forward, backward = abs(fit[0]), abs(fit[1])
        if machine.sense < 0:
            forward, backward = backward, forward
        left = float(np.sqrt(np.mean(np.abs(z - basis @ fit) ** 2)))
        if max(forward, backward) < left:
            continue  # 1X does not exceed the residual
        swapped = backward > 3 * forward
        sense = "backward" if swapped else "forward"
        detail = f"1X whirls {sense} at the start ({um(forward)} forward, {um(backward)} backward)"
        cure = ": two probes may be swapped, or 'rotation' in the machine file is wrong" if swapped else ""
        if swapped or forward > 3 * backward:
            found.append(Check("whirl", end, not swapped, detail + cure))
    return found
