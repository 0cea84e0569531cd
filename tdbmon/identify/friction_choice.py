"""The friction coefficient chosen by sensitivity: which of many brings the simulated orbit nearest to the measured one.

The way of the source, before least squares: one coefficient for both ends is varied, everything else stays, and the one is
chosen whose orbit is most like the measured (N. Neisi, dissertation, LUT University, sec. 3.1 and 4.3.2).  What is called
alike there is stated here as the rms distance of the two orbits, and the deepest excursions stand beside it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tdbsim.errors import InputError

from tdbmon.estimate import Estimate
from tdbmon.identify.agreement import at_planes
from tdbmon.identify.calibration import Calibration
from tdbmon.identify.prediction import predict, readings

Array = NDArray[np.float64]

GRID = np.round(np.arange(0.02, 0.3001, 0.01), 3)  # coefficients tried
_FINE = 0.001  # step about the best of them
_SECONDS = 0.06  # s after the release: the first contacts, before trajectories part


@dataclass(frozen=True, eq=False)
class FrictionChoice:
    """Orbits at tried coefficients against the measured ones (SI).

    Attributes
    ----------
    seconds : float
        After the release, over which orbits are compared.
    tried : (m,) array
        Coefficients of both ends, rising.
    distance : dict
        By the end's name, rms distance of simulated and measured orbit (m,), m.
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


def choose_friction(calibration: Calibration, drop: int = 0, seconds: float = _SECONDS) -> FrictionChoice:
    """Vary the friction of both ends of a calibrated drop, all else as fitted.

    Raises
    ------
    InputError
        If no tried coefficient can be simulated, or the probes show the orbit of no end.
    """
    problem, machine = calibration.problem, calibration.calibrated
    measured = problem.drops[drop]
    seconds = min(seconds, measured.seconds)
    shared, own = problem.values(calibration.point, drop)
    names = [f"{end}.friction" for end in machine.ends]
    orbits: dict[float, Array] = {}
    seen = np.empty(0)

    def follow(coefficient: float) -> None:
        nonlocal seen
        values = {**shared, **dict.fromkeys(names, coefficient)}
        try:
            model, effects = problem.setting(values, own, drop)
            prediction = predict(measured, model, own, seconds)
        except InputError:
            return
        simulated = readings(prediction, measured, machine, problem.sensors(effects, values, own, drop))
        span = slice(prediction.first, prediction.first + simulated.shape[1])
        time = measured.time[span] - measured.release - own["release"]
        after = time >= 0
        orbits[coefficient] = at_planes(simulated[:, after], time[after], measured, machine).displacement.to_numpy()
        if not seen.size:
            seen = at_planes(
                measured.reading[:, span][:, after], time[after], measured, machine
            ).displacement.to_numpy()

    for coefficient in GRID:
        follow(float(coefficient))
    if not orbits:
        raise InputError(f"{measured.name}: cannot be simulated at any coefficient of friction from {GRID[0]:g} on")
    shown = [i for i in range(len(machine.ends)) if np.isfinite(seen[i]).all()]
    if not shown:
        raise InputError(f"{measured.name}: no end has two usable probes in different directions")

    def apart(coefficient: float) -> float:
        return float(np.mean((orbits[coefficient] - seen)[shown] ** 2))

    best = min(orbits, key=apart)
    near = np.arange(best - GRID[1] + GRID[0], best + GRID[1] - GRID[0], _FINE)
    for coefficient in near[near > 0]:
        follow(round(float(coefficient), 6))
    tried = sorted(orbits)
    left = np.array([orbits[each] - seen for each in tried])
    centres = {end: [shared[f"{end}.centre_{axis}"] for axis in "xy"] for end in machine.ends}
    names_shown = {i: machine.ends[i] for i in shown}
    return FrictionChoice(
        seconds=seconds,
        tried=np.array(tried),
        distance={end: np.sqrt(np.mean(np.sum(left[:, i] ** 2, axis=1), axis=1)) for i, end in names_shown.items()},
        deepest={
            end: np.array([_deepest(orbits[each][i], centres[end]) for each in tried]) for i, end in names_shown.items()
        },
        measured_deepest={end: _deepest(seen[i], centres[end]) for i, end in names_shown.items()},
        chosen=min(tried, key=apart),
        fitted={
            end: calibration.values.get(f"{end}.friction")
            or Estimate(
                machine.bearing(end).friction.nominal,
                unit="1",
                method="machine file",
                why="the machine file states no tolerance",
            )
            for end in machine.ends
        },
    )


def _deepest(path: Array, centre: list[float]) -> float:
    return float(np.hypot(path[0] - centre[0], path[1] - centre[1]).max())
