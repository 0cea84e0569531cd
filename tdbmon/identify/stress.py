"""Hertz stress of the most loaded ball, and its box statistics over a drop."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tdbsim.machine import TouchdownBearing

from tdbmon.estimate import Estimate
from tdbmon.identify.model_share import STRESS, of_members
from tdbmon.runs import runs_of

Array = NDArray[np.float64]

_SIGMAS = 3.0  # standard deviations from the mean: outliers as in N. Neisi's dissertation
_TUKEY = 1.5  # interquartile ranges beyond the quartiles: J. W. Tukey, Exploratory Data Analysis


@dataclass(frozen=True)
class Stress:
    """Box statistics over time of the greatest stress among the balls, while any ball is loaded (Pa).

    Attributes
    ----------
    greatest : Estimate
        Over the whole time.
    mean, median, q1, q3 : float
        Of the fitted drop; these and all that follow are meaningless where `greatest` is missing.
    least : float
        Least stress within Tukey's lower fence.
    outliers, tukey : tuple of float
        Peaks of the stretches beyond three standard deviations from the mean, and beyond Tukey's upper fence.
    outlier_level, tukey_level : float
        Those two limits.
    assumption : str
        Assumptions of the stress beyond the machine file; empty where there are none.
    """

    greatest: Estimate
    mean: float
    median: float
    q1: float
    q3: float
    least: float
    outliers: tuple[float, ...]
    tukey: tuple[float, ...]
    outlier_level: float
    tukey_level: float
    assumption: str

    @classmethod
    def missing(cls, bearing: TouchdownBearing, why: str) -> Stress:
        """Return the box of a missing stress, with the reason."""
        return cls(Estimate.missing("MPa", why), 0.0, 0.0, 0.0, 0.0, 0.0, (), (), 0.0, 0.0, assumed(bearing))


def ball_stress(bearing: TouchdownBearing, load: Array) -> Array:
    """Return the greater of the inner and the outer race's peak pressure, Pa, for ball loads in N."""
    geometry = bearing.geometry
    return np.maximum(geometry.inner.peak_pressure(load), geometry.outer.peak_pressure(load))


def assumed(bearing: TouchdownBearing) -> str:
    """Return in words the assumptions on the balls where the machine file is silent; empty where there are none."""
    balls = bearing.balls
    told = balls.model_fields_set
    found = [
        f"{race} groove conformity {getattr(balls, f'{race}_conformity'):g}"
        for race in ("inner", "outer")
        if f"{race}_conformity" not in told
    ]
    if "material" not in told and bearing.heat is None:
        found.append(f"{balls.material} balls")
    return f"assumes {', '.join(found)}, not stated in the machine file" if found else ""


def first(seconds: float) -> str:
    """Return in words the time after the release, s, that forces and stresses cover."""
    return f"the first {seconds:g} s after the release"


def stress_box(members: list[Array], bearing: TouchdownBearing, seconds: float) -> Stress:
    """Return the box over `seconds` from the stress histories (k,) of an ensemble's members, the fitted one first, Pa."""
    fitted = members[0]
    loaded = fitted[fitted > 0]
    greatest = np.array([member.max() for member in members])
    assumption = assumed(bearing)
    rule = f"Hertz, most loaded ball, greatest of {first(seconds)}" + (f"; {assumption}" if assumption else "")
    if not loaded.size:
        return Stress.missing(bearing, f"no ball of bearing '{bearing.name}' is loaded in the fitted drop")
    mean, spread = float(loaded.mean()), float(loaded.std())
    q1, median, q3 = (float(q) for q in np.quantile(loaded, (0.25, 0.5, 0.75)))
    levels = mean + _SIGMAS * spread, q3 + _TUKEY * (q3 - q1)
    return Stress(
        greatest=of_members(greatest, STRESS, "MPa", rule),
        mean=mean,
        median=median,
        q1=q1,
        q3=q3,
        least=float(loaded[loaded >= q1 - _TUKEY * (q3 - q1)].min()),
        outliers=_peaks(fitted, levels[0]),
        tukey=_peaks(fitted, levels[1]),
        outlier_level=levels[0],
        tukey_level=levels[1],
        assumption=assumption,
    )


def _peaks(values: Array, level: float) -> tuple[float, ...]:
    """Return the greatest value of each stretch beyond a level."""
    return tuple(float(values[run].max()) for run in runs_of(values > level))
