"""The result of fitting a machine's model to its drops."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import compress

import numpy as np
from numpy.typing import NDArray
from tdbsim.machine import Machine

from tdbmon.estimate import Estimate
from tdbmon.identify.drop import MeasuredDrop
from tdbmon.identify.problem import Problem
from tdbmon.quantity import percent
from tdbmon.record.finding import um

Array = NDArray[np.float64]

LACKS = 4.0  # rms residual over noise, from which on the model does not explain the drops
# of the gap, rms distance: paths farther apart have diverged.  On synthetic drops with an effect that the model lacked, six fits
# within 8 % of the gap had peak forces wrong by 8 % at most; of eight beyond 10 %, six were wrong by 35 to 88 %, with the true
# force outside the interval
PARTED = 0.1


@dataclass(frozen=True)
class Residual:
    """Difference between a drop and its simulation, up to one horizon.

    Attributes
    ----------
    horizon : float
        s after the release.
    rms : dict
        Rms of measured less simulated reading, by probe, m; without probes that have no sample up to the horizon.
    noise : dict
        Standard deviation of each probe's noise, m.
    """

    horizon: float
    rms: dict[str, float]
    noise: dict[str, float]

    @classmethod
    def of(cls, left: Array, since: Array, drop: MeasuredDrop, horizon: float) -> Residual:
        """Return the residual of a drop from measured less simulated readings (probes, k), m, NaN where a sample is missing.

        `since` is the time after the release (k,), s.
        """
        names = [probe.name for probe in drop.probes]
        here = left[:, (since >= 0) & (since <= horizon)]
        seen = np.asarray(np.isfinite(here).any(axis=1))
        rms = np.sqrt(np.nanmean((here if seen.all() else here[seen]) ** 2, axis=1))
        return cls(
            horizon,
            dict(zip(compress(names, seen.tolist()), rms.tolist(), strict=True)),
            dict(zip(names, (noise.sigma for noise in drop.noise), strict=True)),
        )

    @property
    def whole(self) -> float:
        """Rms of all probes together, m."""
        return float(np.sqrt(np.mean([rms**2 for rms in self.rms.values()])))

    @property
    def ratio(self) -> float:
        """Rms over noise, all probes together: 1 where the residual is noise alone."""
        return float(np.sqrt(np.mean([(self.rms[p] / self.noise[p]) ** 2 for p in self.rms])))


@dataclass(frozen=True)
class DropFit:
    """The fit of one drop.

    Attributes
    ----------
    name : str
        The record's file.
    speed : float
        At the release, Hz.
    release : Estimate
        Instant, s from the record's first sample.
    residuals : tuple of Residual
        To increasing horizons.
    """

    name: str
    speed: float
    release: Estimate
    residuals: tuple[Residual, ...]

    def residual_to(self, horizon: float) -> Residual:
        """Return the residual to the first horizon that is not shorter than this one, s."""
        return next(r for r in self.residuals if r.horizon >= horizon - 1e-9)


@dataclass(frozen=True)
class Undetermined:
    """A value that the drops hardly determine: it stays near the machine file's.

    Attributes
    ----------
    name : str
        As among the calibration's `values`.
    share : float
        Its standard deviation over that of the machine file's tolerance.
    partners : tuple of (str, float)
        Values that can compensate for it, with their correlation.
    """

    name: str
    share: float
    partners: tuple[tuple[str, float], ...]


@dataclass(frozen=True, eq=False)
class Calibration:
    """A machine fitted to its drops (SI).

    Attributes
    ----------
    machine, calibrated : Machine
        As in the machine file; with the fitted values as nominal ones.
    values : dict
        Every fitted value of machine and sensors, by name (``"NDE.friction"``).
    at_bound : tuple of str
        Names of values that ran to a bound: the true value may lie beyond, or the model lacks something.
    undetermined : tuple of Undetermined
    drops : tuple of DropFit
    horizon : float
        To which the drops were fitted, s after the release.
    trusted : float
        Horizon up to which the fit is fully trusted, s after the release (60 ms, or less where the record is shorter).
    misfit : float
        Rms over noise of all drops to that horizon.
    remarks : tuple of str
        On what was left out and what does not fit.
    seconds : float
        Time that the fit took.
    problem : Problem
    point : (n,) array
        The fitted vector in the coordinates of `problem`.
    covariance : (n, n) array
        Of the point; source of the intervals of single values and of the draws for ensembles.
    mistaken : str
        The error of the machine file that the drops show; empty where they show none.
    """

    machine: Machine
    calibrated: Machine
    values: dict[str, Estimate]
    at_bound: tuple[str, ...]
    undetermined: tuple[Undetermined, ...]
    drops: tuple[DropFit, ...]
    horizon: float
    trusted: float
    misfit: float
    remarks: tuple[str, ...]
    seconds: float
    problem: Problem
    point: Array
    covariance: Array
    mistaken: str = ""

    def no_forces(self, drop: int) -> str:
        """Return the reason why the forces of a drop are withheld; empty where they are not."""
        if self.mistaken:
            return "the drops contradict the machine file (see the fit's remarks): forces would be those of another machine"
        left = self.drops[drop].residual_to(self.trusted)
        gap = min(each.radial_gap.nominal for each in self.machine.touchdown_bearings)
        if left.whole <= PARTED * gap:
            return ""
        return (
            f"in the first {left.horizon * 1e3:.3g} ms the fitted model is off by {um(left.whole)} rms,"
            f" {percent(left.whole / gap)} of the gap: beyond {percent(PARTED)} its path is not that of the shaft and has other"
            " impacts"
        )

    @property
    def explains(self) -> bool:
        """False where the misfit is so large that values and forces may be wrong by more than their intervals."""
        return self.misfit <= LACKS

    def value(self, name: str, stated: float, unit: str) -> Estimate:
        """Return a fitted value, or what the machine file states without tolerance (SI) where it was not fitted."""
        unfitted = Estimate(stated, unit=unit, method="machine file", why="the machine file states no tolerance")
        return self.values.get(name, unfitted)
