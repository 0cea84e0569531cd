"""Forces and stresses of calibrated drops, which no sensor measured, with their uncertainty.

An ensemble of simulations is drawn from the calibration's covariance.  As long as its members stay together, a history is a
curve with a band.  Trajectories with impacts diverge exponentially: once the members have diverged, a curve would be
meaningless, and the history ends.  A peak force is the greatest over a member's whole simulation, so its interval covers later
impacts within that time too; `tdbmon.identify.excursions` remarks on a shaft that goes farther out still later.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from tdbsim import state_layout
from tdbsim.columns import GAP, JOURNAL_RADIUS
from tdbsim.errors import InputError
from tdbsim.fatigue import DropFatigue, drop_fatigue
from tdbsim.machine import Machine, TouchdownBearing
from tdbsim.observe import FORCES, observed
from tdbsim.simulate import DropPlan, Trajectory, run
from tdbsim.usual_step import usual_step

from tdbmon.analysis.contact_events import NOISE_S
from tdbmon.estimate import Estimate
from tdbmon.identify.calibration import PARTED, Calibration
from tdbmon.identify.crew import Crew
from tdbmon.identify.draws import draws
from tdbmon.identify.drop import MeasuredDrop
from tdbmon.identify.model_share import FORCE, MEMBERS, band, of_members
from tdbmon.identify.prediction import Values, drop_plan, window
from tdbmon.identify.problem import Problem
from tdbmon.identify.stress import Stress, ball_stress, first, stress_box
from tdbmon.quantity import percent
from tdbmon.ring_speed import SLIPS, turns_along
from tdbmon.runs import runs_of

Array = NDArray[np.float64]

SECONDS = 0.2  # simulated after the release
_FINER = 0.5  # times the usual step, with which a sharp peak is up to 1.6 % too low; 0.4 % with half of it
_SAMPLING = 40e3  # Hz, at least: at a record's own rate the first peak may be missed by a tenth


@dataclass(frozen=True, eq=False)
class ForceHistory:
    """Normal force of rotor on inner ring.

    Attributes
    ----------
    time : (k,) array
        s after the release, until the ensemble's members have diverged.
    force, low, high : (k,) arrays
        Median and 95 % band, N.
    parted : float
        Time at which the members have diverged, s after the release; the end of the history where they never do.
    """

    time: Array
    force: Array
    low: Array
    high: Array
    parted: float


@dataclass(frozen=True)
class ContactForce:
    """One contact, before the members have diverged.

    Attributes
    ----------
    start, seconds : float
        Start, s after the release, and duration, s, in the fitted drop.
    peak : Estimate
        N.
    impulse, impulse_low, impulse_high : float
        Of the normal force, N s, with its 95 % interval.
    """

    start: float
    seconds: float
    peak: Estimate
    impulse: float
    impulse_low: float
    impulse_high: float


@dataclass(frozen=True)
class EndForces:
    """Forces and stresses of one touchdown bearing in one drop.

    Attributes
    ----------
    end : str
    history : ForceHistory
    peak : Estimate
        Greatest normal force, N.
    contacts : tuple of ContactForce
    impulse, impulse_low, impulse_high : float
        Over the whole simulated time, N s, with its 95 % interval; NaN where the forces are withheld.
    stress : Stress
    ring_at_speed : Estimate
        Time at which the inner ring reaches the journal's speed, s after the release.
    fatigue : tuple of DropFatigue
        Of the balls, one per member.
    peaks, farthest : (members,) arrays
        Each member's greatest normal force, N, and greatest distance of the shaft from the bearing's centre, m.
    """

    end: str
    history: ForceHistory
    peak: Estimate
    contacts: tuple[ContactForce, ...]
    impulse: float
    impulse_low: float
    impulse_high: float
    stress: Stress
    ring_at_speed: Estimate
    fatigue: tuple[DropFatigue, ...]
    peaks: Array
    farthest: Array


@dataclass(frozen=True)
class DropForces:
    """Forces of one drop.

    Attributes
    ----------
    name : str
        The record's file.
    seconds : float
        Simulated time after the release.
    members : int
        Number of simulations in the ensemble, the fitted one included.
    ends : dict
        By the end's name.
    withheld : str
        Reason why the forces are withheld (`Calibration.no_forces`); empty where they are not.
    """

    name: str
    seconds: float
    members: int
    ends: dict[str, EndForces]
    withheld: str = ""


@dataclass(frozen=True, eq=False)
class _Member:
    """One simulation of the ensemble.

    Time after the release (k,); position (2 ends, k) complex; normal force, stress, whether the ring turns with the journal (2,
    k); peak forces (2,); fatigue of both ends.
    """

    time: Array
    place: NDArray[np.complex128]
    normal: Array
    stress: Array
    rolls: NDArray[np.bool_]
    peak: Array
    fatigue: tuple[DropFatigue, ...]


def forces_of(calibration: Calibration, seconds: float = SECONDS, members: int = MEMBERS) -> tuple[DropForces, ...]:
    """Simulate the calibrated drops from their fitted states and return the forces on the bearings.

    Forces that the calibration withholds (`Calibration.no_forces`) are missing, with the reason.

    Parameters
    ----------
    calibration : Calibration
    seconds : float
        Simulated time after the release.
    members : int
        Simulations per drop, at least 8.

    Returns
    -------
    tuple of DropForces
        In the order of the calibration's drops.

    Raises
    ------
    InputError
        If `members` is below 8, `seconds` is not positive and finite, or too few draws can be simulated.
    """
    if members < 8:
        raise InputError(f"{members} members are too few for an interval; give at least 8")
    if not 0 < seconds < math.inf:
        raise InputError(f"seconds {seconds:g} s is not positive and finite")
    problem = calibration.problem
    points = draws(problem, calibration.point, calibration.covariance, members, np.random.default_rng(0))
    found = []
    with Crew() as crew:
        for drop, measured in enumerate(problem.drops):
            if why := calibration.no_forces(drop):
                ends = {each.name: _withheld(each, why) for each in problem.model.machine.touchdown_bearings}
                found.append(DropForces(measured.name, seconds, 0, ends, why))
                continue
            tried = crew.together(partial(_member, problem, drop=drop, seconds=seconds), points)
            kept = [member for member in tried if member is not None]
            if tried[0] is None or len(kept) < members // 2:
                raise InputError(
                    f"{measured.name}: only {len(kept)} of {members} draws from the calibration can be simulated;"
                    " the calibration is too uncertain for forces: use more drops"
                )
            ends = {
                name: _end_forces(kept, end, name, calibration.calibrated, seconds)
                for end, name in enumerate(calibration.machine.ends)
            }
            found.append(DropForces(measured.name, seconds, len(kept), ends))
    return tuple(found)


def _simulated(problem: Problem, point: Array, drop: int, seconds: float) -> Trajectory | None:
    """Simulate a drop at given values to `seconds` after the release, with the step that forces and stresses need.

    Returns
    -------
    Trajectory or None
        None where the values cannot be simulated.
    """
    shared, own = problem.values(point, drop)
    try:
        model, _ = problem.setting(shared, own, drop)
        plan = _plan_until(problem.drops[drop], own, seconds)
        step = _FINER * usual_step(model)
        return run(model, replace(plan, sampling=max(plan.sampling, _SAMPLING), step=step))
    except InputError:
        return None


def _plan_until(measured: MeasuredDrop, own: Values, seconds: float) -> DropPlan:
    """Return the plan of a drop with its own values, from its window's first sample to `seconds` after the release."""
    first, _ = window(measured, 0.0)
    count = math.ceil((measured.release + own["release"] + seconds - measured.time[first]) / measured.interval) + 1
    return drop_plan(measured, own, first, count)


def _member(problem: Problem, point: Array, drop: int, seconds: float) -> _Member | None:
    motion = _simulated(problem, point, drop, seconds)
    if motion is None:
        return None
    n, state = motion.model.n, motion.state
    seen = observed(motion)
    bearings = enumerate(problem.model.machine.touchdown_bearings)
    stress = [ball_stress(bearing, seen.loads[e, : bearing.balls.count]) for e, bearing in bearings]
    omega, rings = state[:, state_layout.omega(n)], state[:, state_layout.ring_speeds(n)].T
    radii = [(row[JOURNAL_RADIUS], row[JOURNAL_RADIUS] + row[GAP]) for row in motion.model.arrays.end]
    return _Member(
        time=motion.time - motion.plan.levitated,
        place=motion.place,
        normal=seen.forces[:, FORCES.index("normal_force")],
        stress=np.stack([each.max(axis=0) for each in stress]),
        rolls=np.stack([turns_along(ring, omega, *each) for ring, each in zip(rings, radii, strict=True)]),
        peak=motion.peak_normal,
        fatigue=tuple(drop_fatigue(each) for each in stress),
    )


def _end_forces(members: list[_Member], end: int, name: str, machine: Machine, seconds: float) -> EndForces:
    fitted = members[0]
    # a member's release may be earlier or later than the fitted drop's: all are interpolated to its samples
    time = fitted.time[fitted.time >= 0]
    normal = np.stack([np.interp(time, m.time, m.normal[end]) for m in members])
    for force, member in zip(normal, members, strict=True):  # the peak lies between samples
        at = int(force.argmax())
        force[at] = max(force[at], member.peak[end]) if force[at] > 0 else 0.0
    place = np.stack(
        [np.interp(time, m.time, m.place[end].real) + 1j * np.interp(time, m.time, m.place[end].imag) for m in members]
    )
    apart = np.sqrt(np.mean(np.abs(place - place.mean(axis=0)) ** 2, axis=0))
    beyond = np.flatnonzero(apart > PARTED * machine.bearing(name).radial_gap.nominal)
    parted = float(time[beyond[0]]) if beyond.size else float(time[-1])
    together = time < parted if beyond.size else np.ones(len(time), dtype=bool)
    low, middle, high = band(normal[:, together], axis=0)
    history = ForceHistory(time=time[together], force=middle, low=low, high=high, parted=parted)
    impulse, impulse_low, impulse_high = _impulse(normal, time)
    peaks = np.array([m.peak[end] for m in members])
    return EndForces(
        end=name,
        history=history,
        peak=_peak(peaks, seconds),
        contacts=_contacts(time, normal, parted, seconds),
        impulse=impulse,
        impulse_low=impulse_low,
        impulse_high=impulse_high,
        stress=stress_box([m.stress[end][m.time >= 0] for m in members], machine.bearing(name), seconds),
        ring_at_speed=_at_speed(members, end),
        fatigue=tuple(m.fatigue[end] for m in members),
        peaks=peaks,
        farthest=np.abs(place).max(axis=1),
    )


def _withheld(bearing: TouchdownBearing, why: str) -> EndForces:
    """Return the missing forces of an end, with the reason."""
    nothing = np.empty(0)
    return EndForces(
        end=bearing.name,
        history=ForceHistory(nothing, nothing, nothing, nothing, parted=0.0),
        peak=Estimate.missing("N", why),
        contacts=(),
        impulse=math.nan,
        impulse_low=math.nan,
        impulse_high=math.nan,
        stress=Stress.missing(bearing, why),
        ring_at_speed=Estimate.missing("s", why),
        fatigue=(),
        peaks=nothing,
        farthest=nothing,
    )


def _peak(peaks: Array, seconds: float, sampled: bool = False) -> Estimate:
    """Return the greatest force from those of the members (n,), N; `sampled` where some are sampled, not refined peaks."""
    of = "of the contact" if sampled else f"of {first(seconds)}"
    rule = f"greatest {of}, median of {len(peaks)} simulations drawn from the calibration"
    beside = f"; except the greatest of each, taken at its samples, at most {1e6 / _SAMPLING:g} us apart" if sampled else ""
    return of_members(peaks, FORCE, "N", rule + beside)


def _impulse(normal: Array, time: Array) -> tuple[float, float, float]:
    """Return the impulse of the fitted drop, the first of the members (n, k), and its 95 % interval, N s.

    The fitted drop may be an outlier among the members: the interval is extended to include it.
    """
    impulses = np.asarray(np.trapezoid(normal, time, axis=1))
    fitted = float(impulses[0])
    low, _, high = band(impulses).tolist()
    return fitted, min(low, fitted), max(high, fitted)


def _contacts(time: Array, normal: Array, parted: float, seconds: float) -> tuple[ContactForce, ...]:
    """Return the fitted drop's contacts, each with the members' forces up to halfway to the neighbouring contacts."""
    spans: list[list[int]] = []
    for pressed in runs_of(normal[0] > 0):
        if spans and time[pressed.start] - time[spans[-1][1] - 1] < NOISE_S:
            spans[-1][1] = pressed.stop
        else:
            spans.append([pressed.start, pressed.stop])
    found = []
    for k, (begin, stop) in enumerate(spans):
        if stop >= len(time) or time[stop - 1] >= parted:
            break
        if stop - begin < 2:  # a grazing contact of one sample
            continue
        left = (spans[k - 1][1] + begin) // 2 if k else 0
        right = (stop + spans[k + 1][0]) // 2 if k + 1 < len(spans) else len(time)
        part = normal[:, left:right]
        peaks = part.max(axis=1)
        if np.median(peaks) == 0.0:  # a grazing contact that most members miss
            continue
        impulse, impulse_low, impulse_high = _impulse(part, time[left:right])
        found.append(
            ContactForce(
                start=float(time[begin]),
                seconds=float(time[stop - 1] - time[begin]),
                peak=_peak(peaks, seconds, sampled=bool(np.any(peaks < normal.max(axis=1)))),
                impulse=impulse,
                impulse_low=impulse_low,
                impulse_high=impulse_high,
            )
        )
    return tuple(found)


def _at_speed(members: list[_Member], end: int) -> Estimate:
    """Return when the ring reaches the journal's speed; members in which it does not count as later than any time."""
    times = np.full(len(members), np.inf)
    for i, member in enumerate(members):
        there = np.flatnonzero(member.rolls[end] & (member.time > 0))
        if there.size:
            times[i] = member.time[there[0]]
    times.sort()
    last, late = float(members[0].time[-1]), int(np.sum(np.isinf(times)))
    if math.isinf(times[len(times) // 2]):
        return Estimate.missing("s", f"the inner ring does not reach the journal's speed within {last:.3g} s")
    rule = f"slip below {percent(SLIPS)} in simulations drawn from the calibration"
    if late:
        why = f"in {late} of {len(times)} simulations the ring does not reach the journal's speed within {last:.3g} s"
        return Estimate(
            float(np.median(times)), unit="s", method=rule, why=f"{why}: the time has no upper limit"
        )
    low, middle, high = band(times).tolist()
    return Estimate(middle, low, high, "s", rule)
