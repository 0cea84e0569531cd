"""How far out the recorded shaft goes, against what forces are told of: the time that is simulated, and the simulations."""

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

_FARTHER = 0.15  # of the gap: a shaft that goes so much farther out presses harder
# of the greatest outward speed before: a blow may be as hard.  Of synthetic drops from 5 to 700 Hz the true force after 0.2 s
# came to 0.72 to 1.4 of that before where this tells of them, else to 0.63 at most
_AS_HARD = 0.65
_FLIGHT = 3e-4  # s


def later_remarks(measured: MeasuredDrop, machine: Machine) -> tuple[str, ...]:
    """Say at which ends the shaft goes farther out, or strikes as hard, after the time that forces are told of.

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
                f"{measured.name}: {end}: {at:.3g} s after the release the shaft is {um(farthest)} from the probes' zero,"
                f" within the {SECONDS:g} s that are simulated {um(before)} at most: forces and stresses are those of these"
                f" {SECONDS:g} s, and may be far greater later (see whirl)"
            )
            continue
        speed = _outward(since, out)
        within, later = speed[(since > 0) & (since <= SECONDS)], speed[since > SECONDS]
        if np.nanmax(later, initial=0.0) > _AS_HARD * np.nanmax(within, initial=0.0):
            at, fastest = float(since[since > SECONDS][np.nanargmax(later)]), float(np.nanmax(later))
            remarks.append(
                f"{measured.name}: {end}: the shaft has not settled {SECONDS:g} s after the release: after {at:.3g} s it still"
                f" flies outwards with {fastest * 1e3:.0f} mm/s, within the {SECONDS:g} s that are simulated with"
                f" {float(np.nanmax(within)) * 1e3:.0f} mm/s at most: forces and stresses are those of these {SECONDS:g} s, and"
                " later blows may be harder"
            )
    return tuple(remarks)


def _outward(since: Array, out: Array) -> Array:
    """Return the speed (k,) with which a distance grows, m/s: over a time that is short beside a flight and quiets noise."""
    step = max(1, round(_FLIGHT / (since[1] - since[0])))
    speed = np.full(len(out), np.nan)
    speed[step:] = (out[step:] - out[:-step]) / (since[step:] - since[:-step])
    return speed


def astray_remarks(calibration: Calibration, drop: int, told: DropForces) -> tuple[str, ...]:
    """Say at which ends the shaft goes otherwise than in most of the simulations that forces are told by.

    Where paths have parted some whirl and others do not: the middle of all may be that of no whirl, and the record whirl.

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
        seen = span.stop < len(since) and np.isfinite(out).all()  # or it may go farther where nobody looked
        if reached - usual < near and (usual - reached < near or not seen):
            continue
        like = found.peaks[np.abs(found.farthest - reached) < near] / 1e3
        press = (
            f"the {len(like)} of {len(found.peaks)} that go as far press with {like.min():.2g} to {like.max():.2g} kN at most"
            if like.size
            else "none goes as far: the forces may be other than any of theirs"
        )
        remarks.append(
            f"{measured.name}: {bearing.name}: within {told.seconds:g} s of the release the shaft goes out to {um(reached)}"
            f" ({float(since[span][np.nanargmax(out)]):.3g} s), in most of the simulations drawn to {um(usual)}: the likeliest"
            f" force, stress and speed of the ring that are told are not those of this drop; {press}"
        )
    return tuple(remarks)
