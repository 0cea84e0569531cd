"""Excursions of the recorded shaft that the stated forces do not cover: later than simulated, or unlike the simulations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from tdbsim.machine import Machine

from tdbmon.identify.agreement import at_planes
from tdbmon.identify.calibration import Calibration
from tdbmon.identify.drop import MeasuredDrop
from tdbmon.identify.forces import SECONDS, DropForces
from tdbmon.identify.prediction import centre
from tdbmon.record.finding import um

Array = NDArray[np.float64]

_FARTHER = 0.15  # of the gap: an excursion larger by this means a larger force
# of the greatest outward speed before: a later blow may be as hard.  In synthetic drops from 5 to 700 Hz the greatest force after
# 0.2 s was 0.72 to 1.4 times that before where this limit was passed, and 0.63 times at most elsewhere
_AS_HARD = 0.65
_FLIGHT = 3e-4  # s, span of the speed's difference quotient


def later_remarks(measured: MeasuredDrop, machine: Machine) -> tuple[str, ...]:
    """Return remarks on ends where the shaft goes farther out, or strikes as hard, after the simulated time.

    Whirl may set in late, and a fast rotor may bounce for seconds.

    Parameters
    ----------
    measured : MeasuredDrop
    machine : Machine
    """
    since = measured.time - measured.release
    remarks = []
    for end in machine.ends:
        rows = [row for row, probe in enumerate(measured.probes) if probe.end == end]
        axes = np.array([measured.probes[row].angle for row in rows])
        if len(rows) < 2:
            continue
        x, y = np.linalg.lstsq(np.column_stack([np.cos(axes), np.sin(axes)]), measured.reading[rows], rcond=None)[0]
        out = np.hypot(x, y)
        within, later = out[(since > 0) & (since <= SECONDS)], out[since > SECONDS]
        if not np.isfinite(within).any() or not np.isfinite(later).any():
            continue
        farthest, before = float(np.nanmax(later)), float(np.nanmax(within))
        if farthest > before + _FARTHER * machine.bearing(end).radial_gap.nominal:
            at = float(since[since > SECONDS][np.nanargmax(later)])
            remarks.append(
                f"{measured.name}: {end}: {at:.3g} s after the release the shaft is {um(farthest)} from the probes' zero, but"
                f" at most {um(before)} within the {SECONDS:g} s that are simulated: forces and stresses are those of these"
                f" {SECONDS:g} s, and may be far greater later (see whirl)"
            )
            continue
        speed = _outward_speed(since, out)
        within, later = speed[(since > 0) & (since <= SECONDS)], speed[since > SECONDS]
        if np.nanmax(later, initial=0.0) > _AS_HARD * np.nanmax(within, initial=0.0):
            at, fastest = float(since[since > SECONDS][np.nanargmax(later)]), float(np.nanmax(later))
            remarks.append(
                f"{measured.name}: {end}: the shaft has not settled {SECONDS:g} s after the release: after {at:.3g} s it still"
                f" moves outwards at {fastest * 1e3:.0f} mm/s, but at most at {float(np.nanmax(within)) * 1e3:.0f} mm/s within"
                f" the {SECONDS:g} s that are simulated: forces and stresses are those of these {SECONDS:g} s, and"
                " later impacts may be harder"
            )
    return tuple(remarks)


def _outward_speed(since: Array, out: Array) -> Array:
    """Return the rate of change (k,) of a distance, m/s, over a span that averages noise and is short against a flight."""
    step = max(1, round(_FLIGHT / (since[1] - since[0])))
    speed = np.full(len(out), np.nan)
    speed[step:] = (out[step:] - out[:-step]) / (since[step:] - since[:-step])
    return speed


def astray_remarks(calibration: Calibration, drop: int, told: DropForces) -> tuple[str, ...]:
    """Return remarks on ends where the shaft moves unlike most of the simulations that the forces come from.

    Once paths have diverged, some whirl and others do not; the median may be without whirl while the record shows it.

    Parameters
    ----------
    calibration : Calibration
    drop : int
        Which of its drops.
    told : DropForces
        Its forces.
    """
    problem, machine = calibration.problem, calibration.calibrated
    measured = problem.drops[drop]
    since = measured.time - measured.release
    span = slice(*np.searchsorted(since, [0.0, told.seconds]))
    planes = at_planes(measured.reading[:, span], measured.time[span], measured, machine)
    shared, _ = problem.values(calibration.point, drop)
    remarks = []
    for i, bearing in enumerate(machine.touchdown_bearings):
        found = told.ends[bearing.name]
        xy, origin = planes.displacement[i].to_numpy(), complex(centre(machine, shared, [bearing.position])[0])
        out = np.hypot(xy[0] - origin.real, xy[1] - origin.imag)
        if str(planes.plane[i].item()) != "bearing" or not found.farthest.size or not np.isfinite(out).any():
            continue
        reached, usual = float(np.nanmax(out)), float(np.median(found.farthest))
        near = _FARTHER * bearing.radial_gap.nominal
        seen = span.stop < len(since) and np.isfinite(out).all()  # missing samples may lie farther out
        if reached - usual < near and (usual - reached < near or not seen):
            continue
        like = found.peaks[np.abs(found.farthest - reached) < near] / 1e3
        press = (
            f"the {len(like)} of {len(found.peaks)} that move as far have peak forces of {like.min():.2g} to {like.max():.2g} kN"
            if like.size
            else "none moves as far: the forces may differ from all of theirs"
        )
        remarks.append(
            f"{measured.name}: {bearing.name}: within {told.seconds:g} s of the release the shaft moves out to {um(reached)}"
            f" (at {float(since[span][np.nanargmax(out)]):.3g} s), in most of the simulations drawn to {um(usual)}: the medians"
            f" given for force, stress and speed of the ring are not those of this drop; {press}"
        )
    return tuple(remarks)
