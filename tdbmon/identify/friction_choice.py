"""The friction coefficient chosen by sensitivity: the one whose simulated orbit is nearest to the measured one.

The published method that preceded least squares: one coefficient for both ends is varied with everything else fixed, and the
one whose orbit is most similar to the measured one is chosen (N. Neisi, dissertation, LUT University, sec. 3.1 and 4.3.2).
Similarity is measured here by the rms distance of the two orbits; the deepest excursions are stated beside it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tdbsim.errors import InputError

from tdbmon.estimate import Estimate
from tdbmon.identify.agreement import at_planes
from tdbmon.identify.calibration import Calibration
from tdbmon.identify.prediction import predict, readings, window

Array = NDArray[np.float64]

GRID = np.round(np.arange(0.02, 0.3001, 0.01), 3)  # coefficients tried, continued where a fitted one is greater
_BEYOND = 1.25  # times the greatest fitted coefficient: end of the grid at least
_FINE = 0.001  # step about the best coefficient
_SECONDS = 0.06  # s after the release: the first contacts, before trajectories diverge


@dataclass(frozen=True, eq=False)
class FrictionChoice:
    """Orbits at tried coefficients against the measured ones (SI).

    Attributes
    ----------
    seconds : float
        Time after the release over which orbits are compared.
    tried : (m,) array
        Coefficients of both ends, ascending.
    distance : dict
        By the end's name, rms distance between simulated and measured orbit (m,), m.
    deepest : dict
        Greatest simulated distance from the bearing's centre (m,), m.
    measured_deepest : dict
        The same of the measured orbit, m.
    chosen : float
        The coefficient with the least distance, both ends together.
    fitted : dict
        The least-squares value of each end.
    """

    seconds: float
    tried: Array
    distance: dict[str, Array]
    deepest: dict[str, Array]
    measured_deepest: dict[str, float]
    chosen: float
    fitted: dict[str, Estimate]

    @property
    def at_edge(self) -> bool:
        """True where the chosen coefficient is the least or the greatest tried: the optimum may lie beyond."""
        return self.chosen in (self.tried[0], self.tried[-1])


def choose_friction(calibration: Calibration, drop: int = 0, seconds: float = _SECONDS) -> FrictionChoice:
    """Vary the friction of both ends of a calibrated drop, all else as fitted, up to the horizon of the fit at most.

    Raises
    ------
    InputError
        If no tried coefficient can be simulated, or the probes determine the orbit of no end.
    """
    machine, measured = calibration.calibrated, calibration.problem.drops[drop]
    seconds = min(seconds, calibration.horizon)  # beyond it another path may be the nearer one
    fitted = {
        end: calibration.value(f"{end}.friction", machine.bearing(end).friction.nominal, "1") for end in machine.ends
    }
    shared, own = calibration.problem.values(calibration.point, drop)
    first, count = window(measured, seconds)
    span = slice(first + int(np.searchsorted(measured.time[first:], measured.release + own["release"])), first + count)
    seen = at_planes(measured.reading[:, span], measured.time[span], measured, machine).displacement.to_numpy()
    there = np.isfinite(seen)  # samples may be missing or cut off
    shown = [i for i in range(len(machine.ends)) if there[i].any()]
    if not shown:
        raise InputError(f"{measured.name}: no end has two usable probes in different directions")

    def follow(coefficients: Array) -> dict[float, Array]:
        paths = ((float(each), _orbit(calibration, drop, float(each), seconds, span)) for each in coefficients)
        return {each: np.where(there, path, np.nan) for each, path in paths if path is not None}

    def apart(coefficient: float) -> float:
        return float(np.nanmean((orbits[coefficient] - seen)[shown] ** 2))

    grid = _grid(max(each.value or 0.0 for each in fitted.values()))
    orbits = follow(grid)
    if not orbits:
        raise InputError(f"{measured.name}: cannot be simulated with any coefficient of friction from {GRID[0]:g} up")
    best, step = min(orbits, key=apart), float(GRID[1] - GRID[0])
    near = np.round(np.arange(best - step, best + step, _FINE), 6)
    orbits |= follow(near[near > 0])
    tried = sorted(orbits)
    left = np.array([orbits[each] - seen for each in tried])
    centres = {end: [shared[f"{end}.centre_{axis}"] for axis in "xy"] for end in machine.ends}
    names_shown = {i: machine.ends[i] for i in shown}
    return FrictionChoice(
        seconds=seconds,
        tried=np.array(tried),
        distance={end: np.sqrt(np.nanmean(np.sum(left[:, i] ** 2, axis=1), axis=1)) for i, end in names_shown.items()},
        deepest={
            end: np.array([_deepest(orbits[each][i], centres[end]) for each in tried]) for i, end in names_shown.items()
        },
        measured_deepest={end: _deepest(seen[i], centres[end]) for i, end in names_shown.items()},
        chosen=min(tried, key=apart),
        fitted=fitted,
    )


def _grid(fitted: float) -> Array:
    """Return the coefficients to try for the greatest fitted one."""
    step, last = float(GRID[1] - GRID[0]), float(GRID[-1])
    more = max(math.ceil((_BEYOND * fitted - last) / step - 1e-9), 0)
    return np.concatenate([GRID, np.round(last + step * np.arange(1, more + 1), 3)])


def _orbit(calibration: Calibration, drop: int, coefficient: float, seconds: float, span: slice) -> Array | None:
    """Return the simulated position (ends, 2, k) at the record's samples `span`; None where it cannot be simulated."""
    problem, measured = calibration.problem, calibration.problem.drops[drop]
    shared, own = problem.values(calibration.point, drop)
    values = {**shared, **{f"{end}.friction": coefficient for end in calibration.machine.ends}}
    try:
        model, effects = problem.setting(values, own, drop)
        prediction = predict(measured, model, own, seconds)
    except InputError:
        return None
    sensors = problem.sensors(effects, values, own, drop)
    simulated = readings(prediction.path, measured, calibration.machine, sensors)
    here = simulated[:, span.start - prediction.path.first : span.stop - prediction.path.first]
    return np.asarray(at_planes(here, measured.time[span], measured, calibration.machine).displacement.to_numpy())


def _deepest(path: Array, centre: list[float]) -> float:
    return float(np.nanmax(np.hypot(path[0] - centre[0], path[1] - centre[1])))
