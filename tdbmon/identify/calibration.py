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

LACKS = 4.0  # times the noise, from which on the model does not explain the drops
# of the gap, rms: paths so far apart are two.  Of synthetic drops of which the model lacked something, six fits within 8 % of
# the gap had peak forces off by 8 % at most; of eight beyond 10 %, six were off by 35 to 88 %, with the truth outside
PARTED = 0.1


@dataclass(frozen=True)
class Residual:
    """How far a drop is from its simulation, to one horizon.

    Attributes
    ----------
    horizon : float
        s after the release.
    rms : dict
        Measured less simulated, by probe, m; a probe of which all samples are missing so far is not among them.
    noise : dict
        Standard deviation of each probe's noise, m.
    """

    horizon: float
    rms: dict[str, float]
    noise: dict[str, float]

    @classmethod
    def of(cls, left: Array, since: Array, drop: MeasuredDrop, horizon: float) -> Residual:
        """Return the residual of a drop from what is left of it, (probes, k), m, NaN where a sample is missing.

        `since` is s after the release, (k,).
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
        """rms of all probes together, m."""
        return float(np.sqrt(np.mean([rms**2 for rms in self.rms.values()])))

    @property
    def ratio(self) -> float:
        """rms over noise, all probes together: 1 where nothing but noise is left."""
        return float(np.sqrt(np.mean([(self.rms[p] / self.noise[p]) ** 2 for p in self.rms])))


@dataclass(frozen=True)
class DropFit:
    """What was fitted to one drop.

    Attributes
    ----------
    name : str
        The record's file.
    speed : float
        At the release, Hz.
    release : Estimate
        Instant, s from the record's first sample.
    residuals : tuple of Residual
        To growing horizons.
    """

    name: str
    speed: float
    release: Estimate
    residuals: tuple[Residual, ...]

    def residual_to(self, horizon: float) -> Residual:
        """Return the residual to the first horizon that is no shorter than this one, s."""
        return next(r for r in self.residuals if r.horizon >= horizon - 1e-9)


@dataclass(frozen=True)
class Undetermined:
    """A value that the drops say little about: it stays about where the machine file puts it.

    Attributes
    ----------
    name : str
        As among the calibration's `values`.
    share : float
        Its standard deviation over the one of the machine file's tolerance.
    partners : tuple of (str, float)
        Values that can make up for it, with their correlation.
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
        As its owner wrote it; with the fitted values as nominal ones.
    values : dict
        Every fitted value of machine and sensors, by name (``"NDE.friction"``).
    at_bound : tuple of str
        Names of values that ran to the edge of their tolerance: the truth may lie beyond, or the model lacks something.
    undetermined : tuple of Undetermined
    drops : tuple of DropFit
    horizon : float
        s after the release, to which the drops were fitted.
    trusted : float
        s after the release: the horizon that the fit trusts fully (60 ms, or less where the record is shorter).
    misfit : float
        rms over noise of all drops to that horizon.
    remarks : tuple of str
        What was left out, and what does not fit.
    seconds : float
        That it took.
    problem : Problem
    point : (n,) array
        The fitted vector in the coordinates of `problem`.
    covariance : (n, n) array
        Of it: what the intervals of single values come from, and whole drops are drawn from.
    mistaken : str
        What the machine file has wrong, as the drops tell it; empty where they tell of nothing.
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
        """Return why the forces of a drop cannot be told; empty where they can."""
        if self.mistaken:
            return "the drops contradict the machine file, as the fit's remarks say: forces would be those of another machine"
        left = self.drops[drop].residual_to(self.trusted)
        gap = min(each.radial_gap.nominal for each in self.machine.touchdown_bearings)
        if left.whole <= PARTED * gap:
            return ""
        return (
            f"in the first {left.horizon * 1e3:.3g} ms the fitted model is off by {um(left.whole)} rms,"
            f" {percent(left.whole / gap)} of the gap: beyond {percent(PARTED)} it is another path than the shaft's, with other"
            " blows"
        )

    @property
    def explains(self) -> bool:
        """False where the model leaves so much that its values and forces may be off by more than their intervals."""
        return self.misfit <= LACKS

    def value(self, name: str, stated: float, unit: str) -> Estimate:
        """Return a fitted value, or what the machine file states without tolerance (SI) where it was not fitted."""
        unfitted = Estimate(stated, unit=unit, method="machine file", why="the machine file states no tolerance")
        return self.values.get(name, unfitted)
