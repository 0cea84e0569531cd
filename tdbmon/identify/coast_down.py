"""The whole coast-down at the calibrated values: simulated to the record's end, recorded by the same sensors, analysed alike.

Only the first contacts were fitted.  Later the measured and the simulated path diverge, so that only features can be compared:
speed, swing, lines, resonances passed, decay of the motion.  Both records go through the same analysis, so that its errors are
common to both.
"""

from __future__ import annotations

import math
import time as clock
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tdbsim import state_layout
from tdbsim.drop_model import DropModel
from tdbsim.sensors import Motion, ProbeChain, SensorChain, measure
from tdbsim.simulate import DropPlan, pieces
from tdbsim.usual_step import usual_step

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.result import Analysis
from tdbmon.identify.calibration import Calibration
from tdbmon.identify.prediction import centre, drop_plan
from tdbmon.identify.runout import with_runout

Array = NDArray[np.float64]

_LEAST_S = 2.0  # of record after the release: a shorter one holds no coast-down to compare
_LONGER = 2.0  # times the usual step: paths have diverged long before its error shows
_CHUNK = 10_000  # samples whose states are kept in memory at a time


@dataclass(frozen=True, eq=False)
class CoastDown:
    """A simulated coast-down beside the record.

    Attributes
    ----------
    measured, simulated : Analysis
        Of the measured and of the simulated record.
    took : float
        Processor time of the simulation, s.
    """

    measured: Analysis
    simulated: Analysis
    took: float


def coast_down(calibration: Calibration, measured: Analysis, drop: int = 0) -> CoastDown | None:
    """Simulate a calibrated drop to the end of its record and analyse what the sensors would have recorded.

    The simulated record lacks the channels that the measured one lacks or that were unfit for use.

    Parameters
    ----------
    calibration : Calibration
    measured : Analysis
        Of the record of that drop.
    drop : int
        Which of the calibration's drops.

    Returns
    -------
    CoastDown or None
        None where the record ends too soon after the release to hold a coast-down, or has no orbit.

    Raises
    ------
    InputError
        If the simulation does not converge.
    """
    fitted = calibration.problem.drops[drop]
    if fitted.time[-1] - fitted.release < _LEAST_S or measured.planes is None:
        return None
    machine = calibration.machine
    record, took = simulated_record(calibration, drop, _speed_noise(measured))
    used = {probe.name for probe in fitted.probes}
    lost = [probe.name for probe in machine.probes if probe.name not in used]
    lost += [name for name in ("speed", "keyphasor") if name not in measured.record]
    record = record.drop_vars([machine.channel_in_file(name) for name in lost], errors="ignore")
    return CoastDown(measured, analyse(record, machine), took)


def _speed_noise(measured: Analysis) -> float:
    """Return the sample-to-sample scatter of the speed signal, Hz."""
    return float(np.std(np.diff(measured.speed_hz))) / math.sqrt(2) if len(measured.speed_hz) > 3 else 0.0


def simulated_record(calibration: Calibration, drop: int = 0, speed_noise_hz: float = 0.0) -> tuple[xr.Dataset, float]:
    """Return the record that the sensors would have made of a calibrated drop, and the processor time of its simulation, s.

    It is evenly sampled from the record's first sample to its last, regardless of the record's time stamps, with the fitted
    zeros and runout and the probes' measured noise level; the noise is white, and there is no hum.

    Raises
    ------
    InputError
        If the simulation does not converge.
    """
    problem, machine = calibration.problem, calibration.machine
    measured = problem.drops[drop]
    shared, own = problem.values(calibration.point, drop)
    model, effects = problem.setting(shared, own, drop)
    since = measured.interval * np.arange(round((measured.time[-1] - measured.time[0]) / measured.interval) + 1)
    plan = replace(drop_plan(measured, own, 0, len(since)), step=_LONGER * usual_step(model))
    began = clock.thread_time()
    places, angle, omega = _simulate(model, plan, since)
    took = clock.thread_time() - began
    offset = centre(machine, shared, [probe.position for probe in machine.probes])
    noise = {probe.name: each.sigma for probe, each in zip(measured.probes, measured.noise, strict=True)}
    usual = float(np.median(list(noise.values())))
    chain = SensorChain(
        probes={p.name: ProbeChain(noise=noise.get(p.name, usual)) for p in machine.probes},
        speed_noise_hz=speed_noise_hz,
    )
    for effect in effects:
        chain = effect.sense(chain, machine, 1 / measured.interval)
    chain = _with_zeros(with_runout(chain, machine, own), {p.name: own[f"zero_{p.name}"] for p in machine.probes})
    motion = Motion(
        time=since,
        x=places[0] + offset.real[:, None],
        y=places[1] + offset.imag[:, None],
        angle=angle,
        speed_hz=np.abs(omega) / (2 * np.pi),
    )
    if not measured.compensated:  # slow roll stayed in the readings and is part of the fitted runout
        probes = tuple(probe.model_copy(update={"slow_roll": None}) for probe in machine.probes)
        machine = machine.model_copy(update={"probes": probes})
    record = measure(motion, chain, machine, np.random.default_rng(0), f"simulation of {measured.name}")
    record.attrs["source_file"] = f"simulation of {measured.name}"
    return record, took


def _with_zeros(chain: SensorChain, zeros: Mapping[str, float]) -> SensorChain:
    """Return a chain whose probes read their fitted zeros, m, with the shaft centred, crosstalk included."""
    leaking = {name: part * zeros[source] for name, (source, part) in chain.leaks.items()}
    links = {name: replace(chain.of(name), offset=zero - leaking.get(name, 0.0)) for name, zero in zeros.items()}
    return replace(chain, probes=links)


def _simulate(model: DropModel, plan: DropPlan, time: Array) -> tuple[Array, Array, Array]:
    """Return position in the probes' planes (2 axes, probes, k), shaft angle and speed (k,), levitation included."""
    n, shapes = model.n, model.modes.at([probe.position for probe in model.machine.probes])
    places, angle, omega = np.empty((2, len(shapes), len(time))), np.empty(len(time)), np.empty(len(time))
    done = 0
    for piece in pieces(model, plan, time, _CHUNK):
        here = slice(done, done + len(piece.time))
        places[0, :, here] = shapes @ piece.state[:, state_layout.modes_x(n)].T
        places[1, :, here] = shapes @ piece.state[:, state_layout.modes_y(n)].T
        angle[here] = piece.state[:, state_layout.shaft_angle(n)]
        omega[here] = piece.state[:, state_layout.omega(n)]
        done = here.stop
    return places, angle, omega
