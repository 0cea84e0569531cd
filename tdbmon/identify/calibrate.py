"""Fit a machine's model to its drops, all at once, from the first contacts onwards.

Least squares of what the probes read against what a simulation would have them read, in units of the noise, with what
the machine file knows beforehand.  A long stretch fitted at once sticks in wrong minima, so the horizon grows: just past
the first contact, then further.  Trajectories with impacts part exponentially, and so the model's error grows: later
samples count less; and where fits to shorter and longer horizons differ, the intervals say so.  The cages' angles, on
which a contact depends in a wavy way, are searched over all of a ball's spacing, everything else adapting linearly.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import product

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tdbsim.drop_model import build_model
from tdbsim.errors import InputError
from tdbsim.machine import Machine

from tdbmon.estimate import Estimate
from tdbmon.identify.calibration import AtBound, Calibration, DropFit, Residual, Undetermined
from tdbmon.identify.drop import MeasuredDrop, measured_drop
from tdbmon.identify.levenberg import Minimum, minimise
from tdbmon.identify.parameters import (
    calibrated_machine,
    drop_parameters,
    machine_parameters,
    polar,
    sensor_parameters,
    with_values,
)
from tdbmon.identify.prediction import predict, readings, window
from tdbmon.identify.problem import Problem, huber, spread

Array = NDArray[np.float64]
Progress = Callable[[str], None]

HORIZONS = (0.012, 0.025, 0.04, 0.06, 0.1)  # s after the release
TRUSTED = 0.06  # s: further on trajectories part
_BENDING = 12  # modes a plane: with eight the reduction alone is 1.6 um off after 60 ms, with twelve 0.13 um
_STEPS = 12  # linearisations at most
_ENOUGH = 4e-4  # relative gain that ends it
_START_STEPS = 6  # of each of several starts
_CLEARANCE_START = 1.0  # standard deviations from the nominal clearance, at which other starts begin
_CAGE_GRID = 8  # angles tried over a ball's spacing, an end
_BLOCK_S = 0.01  # s; what is left follows itself in time about as long as a bounce lasts
_THREADS = 2
_UNDETERMINED = 0.7  # of the standard deviation known beforehand
_PARTNER = 0.4  # correlation from which on a value is named as partner
_ODD_DROP = 4.0  # misfit of a drop, against the median of the others, that is remarked


def _silent(_: str) -> None:
    return None


def fit_drops(
    machine: Machine,
    records: Sequence[xr.Dataset],
    horizons: Sequence[float] = HORIZONS,
    progress: Progress = _silent,
) -> Calibration:
    """Calibrate a machine's model to one or more of its drops.

    Parameters
    ----------
    machine : Machine
        Its tolerances say which values may move and how far.
    records : sequence of Dataset
        As `tdbmon.record.read.read` gives them, of this machine in one condition.
    horizons : sequence of float
        s after the release, growing; those beyond the shortest record are left out.
    progress : callable, optional
        Is told the name of each step as it begins.

    Returns
    -------
    Calibration

    Raises
    ------
    InputError
        If there is no record, a record cannot be used (`tdbmon.identify.drop.measured_drop`), or the machine leaves no
        way to start: the levitated shaft touches at its nominal values.
    """
    began = time.monotonic()
    if not records:
        raise InputError("no record given; give the records of one or more drops of the machine")
    progress("reading levitation and noise")
    drops = tuple(measured_drop(record, machine) for record in records)
    usable = [h for h in horizons if h <= min(drop.seconds for drop in drops)]
    if not usable:
        raise InputError(
            f"the records end {min(drop.seconds for drop in drops) * 1e3:.3g} ms after the release, before the shortest"
            f" horizon of {min(horizons) * 1e3:g} ms"
        )
    with ThreadPoolExecutor(_THREADS) as pool:
        problem = _problem(machine, drops, pool)
        point = problem.start
        passed: list[Array] = []
        _check_start(problem, usable[0])
        for k, horizon in enumerate(usable):
            progress(f"fitting the first {horizon * 1e3:g} ms")
            point = _fit(problem, point, horizon)
            if k < 2:
                point = _fit(problem, _turn_cages(problem, point, horizon), horizon)
            if k == min(1, len(usable) - 1):
                progress(f"trying other starts to {horizon * 1e3:g} ms")
                point = _fit(problem, _best_start(problem, point, horizon), horizon)
            if k >= 1:
                passed.append(point)
        covariance = _covariance(problem, point, usable[-1]) + _drift(passed[:-1], point)
        fits = tuple(_drop_fit(problem, point, covariance, i, usable) for i in range(len(drops)))
    shared, _ = problem.values(point, 0)
    trusted = max((h for h in usable if h <= TRUSTED), default=usable[0])
    remarks = [remark for drop in drops for remark in drop.remarks] + _odd_drops(fits, min(usable[-1], 0.025))
    return Calibration(
        machine=machine,
        calibrated=calibrated_machine(machine, shared),
        values=_estimates(problem, point, covariance),
        at_bound=_at_bound(problem, point),
        undetermined=_undetermined(problem, covariance),
        drops=fits,
        horizon=usable[-1],
        misfit=float(np.sqrt(np.mean([_at(fit.residuals, trusted).ratio ** 2 for fit in fits]))),
        remarks=tuple(remarks),
        seconds=time.monotonic() - began,
        problem=problem,
        point=point,
        covariance=covariance,
    )


def _problem(machine: Machine, drops: tuple[MeasuredDrop, ...], pool: ThreadPoolExecutor) -> Problem:
    own = tuple(drop_parameters(machine, _set_point(machine, drop), drop.angle, drop.angle_sigma) for drop in drops)
    shared = (*machine_parameters(machine), *sensor_parameters(machine))
    return Problem(build_model(machine, bending=_BENDING), drops, shared, own, pool)


def _set_point(machine: Machine, drop: MeasuredDrop) -> Array:
    """Return the levitated mean (x, y) an end that the probes' means come nearest to, (2, 2), m."""
    first, second = machine.touchdown_bearings
    rows = []
    for probe in drop.probes:
        share = (probe.position - first.position) / (second.position - first.position)
        direction = np.array([math.cos(probe.angle), math.sin(probe.angle)])
        rows.append(np.concatenate([(1 - share) * direction, share * direction]))
    solution, *_ = np.linalg.lstsq(np.array(rows), np.array([n.mean for n in drop.noise]), rcond=None)
    return np.asarray(solution, dtype=float).reshape(2, 2)


def _check_start(problem: Problem, horizon: float) -> None:
    """Raise what keeps the nominal values from being simulated, with the record's name."""
    for drop, measured in enumerate(problem.drops):
        try:
            problem.residual(problem.start, drop, horizon)
        except InputError as error:
            raise InputError(
                f"{measured.name}: cannot be simulated with the machine's nominal values: {error}"
            ) from None


def _fit(problem: Problem, point: Array, horizon: float) -> Array:
    """Return the minimum to a horizon; weights are set anew once on the way, when the residuals have shrunk."""
    for _ in range(2):
        point = _minimum(problem, point, horizon, _STEPS).point
    return point


def _minimum(problem: Problem, point: Array, horizon: float, steps: int) -> Minimum:
    base = problem.all_residuals(point, horizon)
    if base is None:
        raise InputError("the fit left what can be simulated; check gap and probes of the machine file")
    weights = [huber(r, spread(r)) for r in base]

    def cost(at: Array) -> float:
        residuals = problem.all_residuals(at, horizon)
        if residuals is None:
            return math.inf
        data = sum(float(w @ r**2) for w, r in zip(weights, residuals, strict=True))
        return 0.5 * (data + float(problem.prior @ at**2))

    def linearise(at: Array) -> tuple[Array, Array]:
        curvature, slope = np.diag(problem.prior), problem.prior * at
        for drop, (r, jacobian) in enumerate(problem.linearised(at, horizon)):
            where = problem.columns(drop)
            weighted = jacobian * weights[drop][:, None]
            curvature[np.ix_(where, where)] += jacobian.T @ weighted
            slope[where] += weighted.T @ r
        return curvature, slope

    return minimise(cost, linearise, point, problem.low, problem.high, steps, _ENOUGH)


def _best_start(problem: Problem, point: Array, horizon: float) -> Array:
    """Return the best of several starts, each fitted: narrow and wide ball clearances, cages turned to suit.

    A wider clearance with a narrower gap lets the rotor fall as far; the first contact alone hardly tells them apart.
    """
    index = {p.name: k for k, p in enumerate(problem.shared)}
    starts = [point]
    pairs = []
    for bearing in problem.model.machine.touchdown_bearings:
        clearance, gap = (index.get(f"{bearing.name}.{f}") for f in ("diametral_clearance", "radial_gap"))
        if clearance is not None and gap is not None:
            pairs.append((clearance, gap, 0.5 * problem.shared[clearance].scale / problem.shared[gap].scale))
    for signs in product((-_CLEARANCE_START, _CLEARANCE_START), repeat=len(pairs)) if pairs else ():
        other = point.copy()
        for (clearance, gap, ratio), sign in zip(pairs, signs, strict=True):
            other[gap] -= ratio * (sign - point[clearance])
            other[clearance] = sign
        starts.append(np.clip(other, problem.low, problem.high))
    fitted = []
    for start in starts:
        try:
            found = _minimum(problem, start, horizon, _START_STEPS).point
            fitted.append(_minimum(problem, _turn_cages(problem, found, horizon), horizon, _START_STEPS).point)
        except InputError:
            continue
    if not fitted:
        raise InputError("no start of the fit can be simulated; check gap and clearance of the machine file")
    return min(fitted, key=lambda each: _misfit(problem, each, horizon))


def _misfit(problem: Problem, point: Array, horizon: float) -> float:
    """Return the robust misfit of a point in fixed units, so that points compare."""
    residuals = problem.all_residuals(point, horizon)
    if residuals is None:
        return math.inf
    return sum(float(huber(r, 1.0) @ r**2) for r in residuals) + float(problem.prior @ point**2)


def _turn_cages(problem: Problem, point: Array, horizon: float) -> Array:
    """Return the point with each drop's cages at the angles that fit best once all else has adapted linearly.

    Each end by itself: the ends' first contacts hardly know of each other.
    """
    point = point.copy()
    own = [p.name for p in problem.own[0]]
    cages = [len(problem.shared) + own.index(f"cage_{end}") for end in range(2)]
    turned = problem.each(lambda drop: _turned(problem, point, drop, horizon, cages))
    for drop, angles in enumerate(turned):
        point[problem.columns(drop)[cages]] = angles
    return point


def _turned(problem: Problem, point: Array, drop: int, horizon: float, cages: list[int]) -> Array:
    """Return the best angles of a drop's cages, in the coordinates of the point."""
    where = problem.columns(drop)
    base, jacobian = problem.slopes(point, drop, horizon)
    others = ~np.isin(np.arange(len(where)), cages)
    weights, prior = np.sqrt(huber(base, spread(base))), problem.prior[where][others]
    basis, _ = np.linalg.qr(np.vstack([jacobian[:, others] * weights[:, None], np.diag(prior)]))
    near = point.copy()
    for cage in cages:
        start, least, best = near[where[cage]], math.inf, near[where[cage]]
        for angle in start + np.arange(_CAGE_GRID) * 2 / _CAGE_GRID:  # two of its scales are a ball's spacing
            near[where[cage]] = angle
            try:
                left = problem.residual(near, drop, horizon) * weights
            except InputError:
                continue
            left = np.concatenate([left, near[where][others] * prior])
            left = left - basis @ (basis.T @ left)
            if float(left @ left) < least:
                least, best = float(left @ left), angle
        # a cage turned by whole balls is the same one
        near[where[cage]] = (best + 1) % 2 - 1
    return near[where[cages]]


def _covariance(problem: Problem, point: Array, horizon: float) -> Array:
    """Return the covariance of the point with what the model does not explain: H^-1 (H + sum g g^T) H^-1.

    H is the curvature, whose inverse holds for residuals that are noise alone; g is the slope of each 10 ms of a drop:
    what is left there follows itself in time and counts as one (P. J. Huber, Proc. 5th Berkeley Symposium 1 (1967) 221;
    K.-Y. Liang, S. L. Zeger, Biometrika 73 (1986) 13).  A few such stretches know little of many values, so H stays in.
    """
    curvature = np.diag(np.where(problem.prior > 0, problem.prior, 1e-6))
    scatter = np.zeros_like(curvature)
    for drop, (r, jacobian) in enumerate(problem.linearised(point, horizon)):
        where = problem.columns(drop)
        weights = huber(r, spread(r))
        curvature[np.ix_(where, where)] += jacobian.T @ (jacobian * weights[:, None])
        measured = problem.drops[drop]
        count = window(measured, horizon)[1]
        block = np.full(len(r), -1)  # pulses and levitated stretch are a block of their own
        times = np.arange(count) * measured.interval // _BLOCK_S
        block[: len(measured.probes) * count] = np.tile(times, len(measured.probes))
        for each in np.unique(block):
            slope = jacobian[block == each].T @ (weights * r)[block == each]
            scatter[np.ix_(where, where)] += np.outer(slope, slope)
    inverse = np.linalg.inv(curvature)
    return inverse + inverse @ scatter @ inverse


def _drift(passed: Sequence[Array], point: Array) -> Array:
    """Return the mean square of how far the fits to shorter horizons lie from the point, as a covariance.

    Were the model right, they would differ by their noise; what the model lacks pulls them apart.
    """
    total = np.zeros((len(point), len(point)))
    for each in passed:
        total += np.outer(each - point, each - point) / len(passed)
    return total


def _drop_fit(problem: Problem, point: Array, covariance: Array, drop: int, horizons: Sequence[float]) -> DropFit:
    measured, machine = problem.drops[drop], problem.model.machine
    shared, own = problem.values(point, drop)
    where = dict(zip((p.name for p in problem.own[drop]), problem.columns(drop)[len(problem.shared) :], strict=True))
    scale = {p.name: p.scale for p in problem.own[drop]}

    def sigma(name: str) -> float:
        return scale[name] * math.sqrt(covariance[where[name], where[name]])

    prediction = predict(measured, with_values(problem.model, shared), own, horizons[-1])
    left = measured.reading[:, prediction.first : prediction.first + prediction.x.shape[1]]
    left = left - readings(prediction, measured, machine, shared, own)
    since = measured.time[prediction.first : prediction.first + left.shape[1]] - measured.release
    residuals = []
    for horizon in horizons:
        rms = np.sqrt(np.mean(left[:, (since >= 0) & (since <= horizon)] ** 2, axis=1))
        by_probe = zip(measured.probes, rms, measured.noise, strict=True)
        names = [(probe.name, float(value), noise.sigma) for probe, value, noise in by_probe]
        residuals.append(Residual(horizon, {n: v for n, v, _ in names}, {n: s for n, _, s in names}))
    n = problem.model.n
    at = int(np.searchsorted(prediction.motion.time, prediction.motion.plan.levitated - 1e-12))
    state, rule = prediction.motion.state[at], "simulation fitted to the drop"
    late = float(prediction.motion.time[at] - prediction.motion.plan.levitated)
    position, velocity = {}, {}
    for end, name in enumerate(machine.ends):
        shape = prediction.motion.model.arrays.at_end[end]
        rate = [float(shape @ state[2 * n + 15 + axis * n : 2 * n + 15 + (axis + 1) * n]) for axis in range(2)]
        place = [float(shape @ state[axis * n : (axis + 1) * n]) - late * rate[axis] for axis in range(2)]
        rate[1] += late * machine.gravity
        position[name] = tuple(
            Estimate.from_sigma(place[k], sigma(f"set_point_{'xy'[k]}_{end}"), "um", rule) for k in range(2)
        )
        velocity[name] = tuple(
            Estimate.from_sigma(rate[k], sigma(f"velocity_{'xy'[k]}_{end}"), "mm/s", rule) for k in range(2)
        )
    return DropFit(
        name=measured.name,
        speed=abs(measured.omega) / (2 * math.pi),
        release=Estimate.from_sigma(measured.release + own["release"], sigma("release"), "s", rule),
        shaft_angle=Estimate.from_sigma(own["shaft_angle"], sigma("shaft_angle"), "deg", rule),
        position={name: (p[0], p[1]) for name, p in position.items()},
        velocity={name: (v[0], v[1]) for name, v in velocity.items()},
        residuals=tuple(residuals),
    )


def _at(residuals: Sequence[Residual], horizon: float) -> Residual:
    return next(r for r in residuals if r.horizon >= horizon - 1e-9)


def _estimates(problem: Problem, point: Array, covariance: Array) -> dict[str, Estimate]:
    """Return the shared values with their intervals, an unbalance as amount and phase."""
    machine, out = problem.model.machine, {}
    rule = "least squares of simulated against measured drops"
    values, _ = problem.values(point, 0)
    index = {p.name: i for i, p in enumerate(problem.shared)}
    planes = {plane.name: plane for plane in machine.rotor.unbalance}
    for i, p in enumerate(problem.shared):
        owner, _, field = p.name.rpartition(".")
        if field == "along":
            along, across = values[p.name], values[f"{owner}.across"]
            amount, phase = polar(planes[owner], along, across)
            pair = [i, index[f"{owner}.across"]]
            size = np.array([problem.shared[k].scale for k in pair])
            block = covariance[np.ix_(pair, pair)] * np.outer(size, size)
            out_ = np.array([along, across]) / max(amount, 1e-12)
            turned = np.array([-out_[1], out_[0]])
            spread_ = math.sqrt(float(out_ @ block @ out_)), math.sqrt(float(turned @ block @ turned))
            out[f"{owner}.amount"] = Estimate.from_sigma(amount, spread_[0], "g mm", rule)
            phase_sigma = min(spread_[1] / max(amount, 1e-12), math.pi)
            out[f"{owner}.phase"] = Estimate.from_sigma(phase, phase_sigma, "deg", rule)
        elif field != "across":
            out[p.name] = Estimate.from_sigma(values[p.name], p.scale * math.sqrt(covariance[i, i]), p.unit, rule)
    return out


def _at_bound(problem: Problem, point: Array) -> tuple[AtBound, ...]:
    edge = 1e-6
    values, _ = problem.values(point, 0)
    return tuple(
        AtBound(p.name, values[p.name])
        for p, z, low, high in zip(problem.shared, point, problem.low, problem.high, strict=False)
        if z <= low + edge or z >= high - edge
    )


def _undetermined(problem: Problem, covariance: Array) -> tuple[Undetermined, ...]:
    spread_ = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(spread_, spread_)
    count, found = len(problem.shared), []
    for i, p in enumerate(problem.shared):
        if spread_[i] < _UNDETERMINED:
            continue
        order = [k for k in np.argsort(-np.abs(correlation[i, :count])) if k != i][:3]
        partners = [
            (problem.shared[k].name, float(correlation[i, k])) for k in order if abs(correlation[i, k]) > _PARTNER
        ]
        found.append(Undetermined(p.name, float(spread_[i]), tuple(partners)))
    return tuple(found)


def _odd_drops(fits: Sequence[DropFit], horizon: float) -> list[str]:
    """Name drops that fit far worse than the others: of another machine, or of the same one changed."""
    ratios = np.array([_at(fit.residuals, horizon).ratio for fit in fits])
    out = []
    for i, fit in enumerate(fits):
        others = np.delete(ratios, i)
        if others.size >= 2 and ratios[i] > _ODD_DROP * max(float(np.median(others)), 1.0):
            out.append(
                f"{fit.name}: fits {ratios[i] / np.median(others):.1f} times worse than the other drops: of another"
                " machine, or the machine has changed between the drops; calibrate it alone"
            )
    return out
