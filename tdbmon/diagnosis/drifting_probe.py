"""A probe whose zero drifts from the release on: not in the catalogue, but waves, lobes or a ball fit it.

The drift is a line plus a parabola in time from the release on, the same in all drops.  Its gain beside the fitted values follows
from their Jacobian.  The readings of the probe with the greatest gain are corrected, and the plain model is fitted to them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from tdbsim.errors import InputError

from tdbmon.diagnosis.beside_values import beside_values
from tdbmon.diagnosis.contender import EXPLAINED, SLOPES, Contender, settled
from tdbmon.identify.least_squares import linearised
from tdbmon.identify.problem import Problem

Array = NDArray[np.float64]

_SPAN_S = 0.04  # s after the release at which line and parabola reach 1
_TRIAL = 1e-6  # m
_WORTH = 0.25  # share of the plain model's excess that a drift must promise to take away
_PASSES = 2  # corrections of the readings: the first rests on a fit whose values compensate for the drift


@dataclass(frozen=True, eq=False)
class Drift:
    """A probe's drift.

    Attributes
    ----------
    probe : str
    shape : (2,) array
        Excess reading 40 ms after the release: part of the line, and of the parabola, m.
    gain : float
        Reduction of the sum of squares.
    """

    probe: str
    shape: Array
    gain: float

    def by(self, since: Array) -> Array:
        """Return the excess reading (n,), m, at times (n,) after the release, s."""
        return np.asarray(self.shape @ _shapes(since))


def drifting_probe(plain: Contender, best: Contender, horizons: Sequence[float]) -> str | None:
    """Say which probe drifts and how far, if the corrected plain model explains the drops as well as the best; else None.

    Parameters
    ----------
    plain, best : Contender
    horizons : sequence of float
        s after the release.
    """
    if not plain.fails:
        return None
    probes = dict.fromkeys(probe.name for drop in plain.problem.drops for probe in drop.probes)
    try:
        drift, found = max(_drifts(plain, list(probes)), key=lambda each: each.gain), plain
        if drift.gain < _WORTH * plain.excess:
            return None
        for _ in range(_PASSES):
            found = _refitted(plain, drift, horizons)
            (more,) = _drifts(found, [drift.probe])
            drift = replace(drift, shape=drift.shape + more.shape)
    except InputError:
        return None
    # a drift has two parameters; a ball, lobes or waves, which fit as much, have at least one more per drop
    if found.fails and (not best.causes or found.ratio > EXPLAINED or found.excess > best.excess):
        return None
    # against any other cause that holds too, BIC decides
    if best.causes and not best.fails and not best.fits_much and _criterion(found, drift) > best.bic:
        return None
    moved = drift.by(np.array([found.horizon]))
    return (
        f"probe '{drift.probe}' drifts: {found.horizon * 1e3:g} ms after the release it reads {float(moved[0]) * 1e6:+.2g} um"
        f" more than at the release, in all drops; with the drift removed the misfit of the plain model is {found.times_noise}"
        " times that of noise alone, and no effect of the catalogue achieves that"
    )


def _criterion(found: Contender, drift: Drift) -> float:
    """Return the BIC of a model fitted to corrected readings, the drift's parameters included."""
    return found.bic + drift.shape.size * math.log(found.fit.count)


def _drifts(fitted: Contender, probes: Sequence[str]) -> list[Drift]:
    """Return, for each probe, the drift with the greatest gain beside the fitted values of a model.

    Raises
    ------
    InputError
        If the model cannot be simulated.
    """
    problem, horizon = fitted.problem, fitted.horizon
    known = linearised(problem, fitted.fit.point, horizon)
    beside = beside_values(problem, known)
    found = []
    for probe in probes:
        columns = []
        for each in np.eye(2):
            rows = _without(problem, Drift(probe, _TRIAL * each, 0.0)).all_residuals(known.point, horizon)
            if rows is None:
                raise InputError("the model cannot be simulated at its fitted values")
            changes = [row - before for row, before in zip(rows, known.residuals, strict=True)]
            columns.append(beside.of(changes))
        design = np.column_stack(columns)
        amounts, *_ = np.linalg.lstsq(design, -beside.left, rcond=None)
        gain = float(beside.left @ beside.left - np.sum((beside.left + design @ amounts) ** 2))
        found.append(Drift(probe, np.asarray(_TRIAL * amounts), gain))
    return found


def _refitted(plain: Contender, drift: Drift, horizons: Sequence[float]) -> Contender:
    """Return the plain model fitted from the fall on to corrected readings."""
    problem = _without(plain.problem, drift)
    found = Contender((), problem, linearised(problem, problem.start, horizons[0]), horizons[0], plain.floor)
    for horizon in (each for each in horizons if each <= plain.horizon):
        found = settled(found, horizon, SLOPES)
    return found


def _without(problem: Problem, drift: Drift) -> Problem:
    """Return a problem with the readings of a probe corrected."""
    drops = []
    for drop in problem.drops:
        its = np.array([probe.name == drift.probe for probe in drop.probes], dtype=float)
        drops.append(replace(drop, reading=drop.reading - its[:, None] * drift.by(drop.time - drop.release)))
    return replace(problem, drops=tuple(drops))


def _shapes(since: Array) -> Array:
    """Return a line and a parabola (2, n) that start at the release and reach 1 after 40 ms."""
    part = np.maximum(since, 0.0) / _SPAN_S
    return np.array([part, part**2])
