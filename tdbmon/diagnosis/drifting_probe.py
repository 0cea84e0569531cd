"""A probe whose zero drifts from the release on: of no catalogue, and in its readings as good as a ball, lobes or waves.

The drift is a parabola in time that begins with the release, the same in all drops.  What it would explain beside the fitted
values follows from their slopes; of the probe with most, the readings are put right by it and the plain model is fitted anew.
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

_SPAN_S = 0.04  # s after the release, of which the shape is counted
_TRIAL = 1e-6  # m
_WORTH = 0.25  # of what the plain model leaves beyond noise, that a drift must promise to take away to be tried
_PASSES = 2  # of putting readings right: the first is by slopes of a fit that made up for the drift


@dataclass(frozen=True, eq=False)
class Drift:
    """A probe's drift.

    Attributes
    ----------
    probe : str
    shape : (2,) array
        What it reads too much after 40 ms by a line, and by a parabola, m.
    gain : float
        Sum of squares that it would take away.
    """

    probe: str
    shape: Array
    gain: float

    def by(self, since: Array) -> Array:
        """Return what it reads too much (n,), m, at times (n,) after the release, s."""
        return np.asarray(self.shape @ _shapes(since))


def drifting_probe(plain: Contender, best: Contender, horizons: Sequence[float]) -> str | None:
    """Say which probe drifts and how far, if that leaves no more of the drops than the best model with causes; None otherwise.

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
    # a drift has two values; a ball, lobes or waves, which fit as much, have one more of each drop at least
    if found.fails and (not best.causes or found.ratio > EXPLAINED or found.excess > best.excess):
        return None
    # of other causes that leave noise alone too, who leaves less is likelier
    if best.causes and not best.fails and not best.fits_much and _criterion(found, drift) > best.bic:
        return None
    moved = drift.by(np.array([found.horizon]))
    return (
        f"probe '{drift.probe}' drifts: it reads {float(moved[0]) * 1e6:+.2g} um more {found.horizon * 1e3:g} ms after the"
        f" release than at it, in all drops; without that the plain model leaves {found.times_noise} times what noise would, and"
        " no effect of the catalogue does that"
    )


def _criterion(found: Contender, drift: Drift) -> float:
    """Return the Bayesian information criterion of a model fitted to readings that are put right by a drift."""
    return found.bic + drift.shape.size * math.log(found.fit.count)


def _drifts(fitted: Contender, probes: Sequence[str]) -> list[Drift]:
    """Return of each probe the drift that takes most from what a model leaves beside what its values can do.

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
                raise InputError("the model cannot be simulated where it was fitted")
            changes = [row - before for row, before in zip(rows, known.residuals, strict=True)]
            columns.append(beside.of(changes))
        design = np.column_stack(columns)
        amounts, *_ = np.linalg.lstsq(design, -beside.left, rcond=None)
        gain = float(beside.left @ beside.left - np.sum((beside.left + design @ amounts) ** 2))
        found.append(Drift(probe, np.asarray(_TRIAL * amounts), gain))
    return found


def _refitted(plain: Contender, drift: Drift, horizons: Sequence[float]) -> Contender:
    """Return the plain model fitted from the fall on to readings that are put right."""
    problem = _without(plain.problem, drift)
    found = Contender((), problem, linearised(problem, problem.start, horizons[0]), horizons[0], plain.floor)
    for horizon in (each for each in horizons if each <= plain.horizon):
        found = settled(found, horizon, SLOPES)
    return found


def _without(problem: Problem, drift: Drift) -> Problem:
    """Return a problem whose readings of a probe are put right."""
    drops = []
    for drop in problem.drops:
        its = np.array([probe.name == drift.probe for probe in drop.probes], dtype=float)
        drops.append(replace(drop, reading=drop.reading - its[:, None] * drift.by(drop.time - drop.release)))
    return replace(problem, drops=tuple(drops))


def _shapes(since: Array) -> Array:
    """Return a line and a parabola (2, n) that begin with the release and reach 1 after 40 ms."""
    part = np.maximum(since, 0.0) / _SPAN_S
    return np.array([part, part**2])
