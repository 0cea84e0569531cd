"""Fit a machine's model to all of its drops at once, from the first contacts onwards.

Least squares of measured less simulated probe readings in units of the noise, with the machine file's tolerances as prior.
A long stretch fitted at once ends in wrong minima, so the horizon grows: from just past the first contact outwards
(`tdbmon.identify.follow`).  Trajectories with impacts diverge exponentially and the model's error with them, so later
samples have less weight.  The misfit beyond noise, and the differences between fits to shorter and longer horizons, widen
the intervals (`tdbmon.identify.certainty`).
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tdbsim.errors import InputError
from tdbsim.machine import Machine

from tdbmon.estimate import Estimate
from tdbmon.identify.calibration import LACKS, Calibration, DropFit, Residual, Undetermined
from tdbmon.identify.certainty import reach
from tdbmon.identify.crew import Crew
from tdbmon.identify.divergence import followable, parting_remarks, with_divergence
from tdbmon.identify.drop import MeasuredDrop
from tdbmon.identify.follow import followed
from tdbmon.identify.free_effect import effect_in_words
from tdbmon.identify.machine_doubt import machine_doubt
from tdbmon.identify.measured_drops import measured_drops
from tdbmon.identify.parameters import calibrated_machine, polar, stated_parameters
from tdbmon.identify.problem import Problem, build_problem, check_start
from tdbmon.identify.stages import stages_of
from tdbmon.identify.stated_values import stated_remarks
from tdbmon.identify.unlike_drops import unlike_drops
from tdbmon.progress import Progress, silent

Array = NDArray[np.float64]

_EARLY = 0.025  # s in a usual gap; later the simulated path of a single drop may diverge from the measured one
TRUSTED = 0.06  # s in a usual gap; later trajectories diverge
# rms residual over noise up to which a model explains the drops fully; scales wrong by a tenth give several times that
_NOISE_ALONE = 1.3
_UNDETERMINED = 0.7  # of the prior standard deviation
_PARTNER = 0.4  # least correlation of a value that is named as partner


def fit_drops(
    machine: Machine,
    records: Sequence[xr.Dataset],
    horizons: Sequence[float] | None = None,
    progress: Progress = silent,
    workers: int = 1,
) -> Calibration:
    """Calibrate a machine's model on one or more of its drops.

    Parameters
    ----------
    machine : Machine
        Its tolerances state which values are fitted and within what bounds.
    records : sequence of Dataset
        As `tdbmon.record.read.read` gives them, of this machine in one condition.
    horizons : sequence of float, optional
        s after the release, increasing; by default those of `tdbmon.identify.stages`.  None beyond the shortest record is used.
    progress : callable, optional
        Called with the name of each step as it begins.
    workers : int
        Number of worker processes (see `tdbmon.identify.crew.Crew`).

    Returns
    -------
    Calibration

    Raises
    ------
    InputError
        If there is no record, one is given twice or cannot be used (`tdbmon.identify.drop.measured_drop`), or the fit cannot
        start: the levitated shaft touches at the machine's nominal values.
    """
    began = time.monotonic()
    progress("reading levitation and noise")
    drops = measured_drops(records, machine)
    stages = stages_of(machine)
    horizons = stages.calibration if horizons is None else horizons
    usable = [h for h in horizons if h <= min(drop.seconds for drop in drops)]
    if not usable:
        raise InputError(
            f"the records end {min(drop.seconds for drop in drops) * 1e3:.3g} ms after the release, before the shortest"
            f" horizon of {min(horizons) * 1e3:g} ms"
        )
    with Crew(workers) as crew:
        problem = build_problem(machine, drops, crew)
        check_start(problem, usable[0])
        problem = with_divergence(problem)
        progress("looking for errors in the machine file")
        mistaken = machine_doubt(problem)
        problem = replace(problem, to_the_bottom=True)
        asked, usable = usable, followable(problem, usable)
        remarks = [remark for drop in drops for remark in drop.remarks]
        remarks += [*standing_remarks(problem), *parting_remarks(problem, asked, usable)]
        if mistaken is not None:
            usable = stages.until_touched(usable)
        problem, passed = followed(problem, usable, progress)
        usable = [h for h in usable if h <= passed[-1].horizon]
        point = passed[-1].fit.point
        covariance = reach(problem, passed)
        fits = tuple(_drop_fit(problem, point, covariance, i, usable) for i in range(len(drops)))
        trusted = max((h for h in usable if h <= stages.at(TRUSTED)), default=usable[0])
        misfit = float(np.sqrt(np.mean([fit.residual_to(trusted).ratio ** 2 for fit in fits])))
    shared, _ = problem.values(point, 0)
    early = [each.fit for each in passed if each.horizon <= stages.at(_EARLY)][-1:] or [passed[0].fit]
    if mistaken is None and misfit < _NOISE_ALONE:
        remarks = _scales_right(drops, remarks, misfit)
    remarks += [*unlike_drops(problem, early[0]), *stated_remarks(problem, point)]
    if mistaken is not None:
        remarks.append(f"values, forces and stresses are not to be trusted: {mistaken.why}")
    elif misfit > LACKS:
        checks = "first correct what the records' checks found; " if any(drop.faults for drop in drops) else ""
        remarks.append(
            f"the residual of the first contacts is {misfit:.2f} times the noise: the model lacks something, and its values,"
            f" forces and stresses may be wrong by more than their intervals; {checks}`tdbmon diagnose` looks for what is"
            " missing, best with several drops"
        )
    return Calibration(
        machine=machine,
        calibrated=calibrated_machine(machine, shared),
        values=estimates(problem, point, covariance),
        at_bound=_at_bound(problem, point),
        undetermined=_undetermined(problem, point, covariance),
        drops=fits,
        horizon=usable[-1],
        trusted=trusted,
        misfit=misfit,
        remarks=tuple(remarks),
        seconds=time.monotonic() - began,
        problem=problem,
        point=point,
        covariance=covariance,
        mistaken=mistaken.why if mistaken is not None else "",
    )


def standing_remarks(problem: Problem) -> tuple[str, ...]:
    """Say which effects of the machine file act in the model; nothing where there is none."""
    if not problem.standing:
        return ()
    acting = "; ".join(map(effect_in_words, problem.standing))
    return (f"the model includes the effects of the machine file: {acting}; values, forces and stresses are valid with them",)


def _scales_right(drops: Sequence[MeasuredDrop], remarks: Sequence[str], misfit: float) -> list[str]:
    """Return the remarks; where the model follows the drops to within noise, doubts about scales give way to a confirmation."""
    doubts = {doubt for drop in drops for doubt in drop.scale_doubts}
    return [remark for remark in remarks if remark not in doubts] + [
        f"{drop.name}: the doubts of the free fall about the scales of times and probes (see free fall, probe scales) do not"
        f" hold: with the scales as they are the residual of fall and first contacts is {misfit:.2f} times the noise; 1X motion"
        " and bending explain how the fall looks"
        for drop in drops
        if drop.scale_doubts
    ]


def _drop_fit(problem: Problem, point: Array, covariance: Array, drop: int, horizons: Sequence[float]) -> DropFit:
    measured, (_, own) = problem.drops[drop], problem.values(point, drop)
    at = [p.name for p in problem.own[drop]].index("release")
    column = problem.columns(drop)[len(problem.shared) + at]
    sigma = problem.own[drop][at].scale * math.sqrt(covariance[column, column])
    found = problem.simulated(point, drop, horizons[-1])
    return DropFit(
        name=measured.name,
        speed=measured.speed,
        release=Estimate.from_sigma(measured.release + own["release"], sigma, "s", "simulation fitted to the drop"),
        residuals=tuple(Residual.of(found.left, found.since, measured, horizon) for horizon in horizons),
    )


def estimates(problem: Problem, point: Array, covariance: Array) -> dict[str, Estimate]:
    """Return the shared values at a point, with intervals from a covariance (n, n); an unbalance as amount and phase."""
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
            radial = np.array([along, across]) / max(amount, 1e-12)
            around = np.array([-radial[1], radial[0]])
            sigmas = math.sqrt(float(radial @ block @ radial)), math.sqrt(float(around @ block @ around))
            out[f"{owner}.amount"] = Estimate.from_sigma(amount, sigmas[0], "g mm", rule, least=0.0)
            phase_sigma = min(sigmas[1] / max(amount, 1e-12), math.pi)
            out[f"{owner}.phase"] = Estimate.from_sigma(phase, phase_sigma, "deg", rule)
        elif field != "across":
            sigma = p.scale * math.sqrt(covariance[i, i])
            out[p.name] = Estimate.from_sigma(values[p.name], sigma, p.unit, rule, least=p.least)
    return out


def _told_as(problem: Problem, point: Array) -> dict[str, str]:
    """Return the name of each shared parameter in `estimates`.

    An unbalance is fitted along and across its nominal phase but reported as amount and phase: each component takes the name of
    the one that it changes most.
    """
    values, _ = problem.values(point, 0)
    names = {}
    for p in problem.shared:
        owner, _, field = p.name.rpartition(".")
        names[p.name] = p.name
        if field in ("along", "across"):
            outward = abs(values[f"{owner}.along"]) >= abs(values[f"{owner}.across"])
            names[p.name] = f"{owner}.{'amount' if (field == 'along') == outward else 'phase'}"
    return names


def _at_bound(problem: Problem, point: Array) -> tuple[str, ...]:
    told = _told_as(problem, point)
    return tuple(told[p.name] for p, at in zip(problem.shared, problem.at_bound(point), strict=False) if at)


def _undetermined(problem: Problem, point: Array, covariance: Array) -> tuple[Undetermined, ...]:
    told = _told_as(problem, point)
    sigmas = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(sigmas, sigmas)
    count, found = len(problem.shared), []
    # values stated without tolerance are free only so that they do not bias the others
    stated = {p.name for p in stated_parameters(problem.model.machine)}
    for i, p in enumerate(problem.shared):
        if sigmas[i] < _UNDETERMINED or p.name in stated:
            continue
        order = [k for k in np.argsort(-np.abs(correlation[i, :count])) if k != i][:3]
        partners = [
            (told[problem.shared[k].name], float(correlation[i, k])) for k in order if abs(correlation[i, k]) > _PARTNER
        ]
        found.append(Undetermined(told[p.name], float(sigmas[i]), tuple(partners)))
    return tuple(found)
