"""What the probes would read of a drop at given values, and how far that is from what they read."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from tdbsim import hooks
from tdbsim.columns import DECAY_RATE, HAS_WINDAGE, ROTOR_ROW
from tdbsim.drop_model import DropModel
from tdbsim.machine import Machine
from tdbsim.modes import Modes
from tdbsim.sensors import Runout, SensorChain, clean_readings
from tdbsim.simulate import DropPlan, Trajectory, run

from tdbmon.identify.drop import FLIGHT_S, MeasuredDrop
from tdbmon.identify.noise import coloured

Array = NDArray[np.float64]
Values = Mapping[str, float]

LEAD_S = 0.008  # simulated before the first guess of the release, which is not better known
_MODEL_ERROR = 1e-7  # m, of the model at the first contact; it grows with the divergence
_DRIVEN = 0.5  # of the predicted deceleration: who slows down less before the release is driven
_COASTING_FLOOR = 3e-3  # of the deceleration; no record of a tenth of a second tells it better
_LEVITATED_ROWS = 5  # residuals a probe: mean, and both parts of 1X and 2X
_LEVITATED_FLOOR = 5e-8  # m; no levitated mean or phasor is trusted beyond this


@dataclass(frozen=True, eq=False)
class Prediction:
    """Readings of a simulated drop at the record's samples (SI).

    Attributes
    ----------
    first : int
        Sample of the record at which it begins.
    motion : Trajectory
    x, y : (probes, k) arrays
        Shaft centre in the probes' planes as the bearings' centres have it, m.
    angle : (k,) array
        Shaft angle, rad.
    omega, coasting : float
        Speed at the middle of the levitated stretch, rad/s, and angular acceleration there, rad/s^2, if nothing drives.
    mean : (probes,) complex array
        x + i y of the levitated mean, m.
    whirl : (probes,) complex array
        Of the levitated whirl: x + i y = whirl exp(i angle), m.
    """

    first: int
    motion: Trajectory
    x: Array
    y: Array
    angle: Array
    omega: float
    coasting: float
    mean: NDArray[np.complex128]
    whirl: NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Sensors:
    """How the probes of a drop see it.

    Attributes
    ----------
    chain : SensorChain
        What effects do to the channels, and how the surface at each end runs out (`with_surface`).
    shared, own : mapping
        Values (SI) by name, of all drops and of this one.
    """

    chain: SensorChain
    shared: Values
    own: Values


def with_surface(chain: SensorChain, machine: Machine, own: Values) -> SensorChain:
    """Return a chain whose probes also see what a usual surface at their end runs out once and twice a revolution."""
    probes = dict(chain.probes)
    for end in machine.ends:
        parts = [complex(own[f"{end}.runout_cosine_{k}"], own[f"{end}.runout_sine_{k}"]) for k in (1, 2)]
        surface = tuple(Runout(k, abs(part), cmath.phase(part) / k) for k, part in enumerate(parts, start=1))
        for probe in machine.probes_at(end):
            link = chain.of(probe.name)
            probes[probe.name] = replace(link, runout=(*link.runout, *surface))
    return replace(chain, probes=probes)


@dataclass(frozen=True, eq=False)
class Levitated:
    """Readings before the release: means (probes,), m, and phasors of 1X and 2X (probes, 2), m."""

    mean: Array
    orders: NDArray[np.complex128]


def window(drop: MeasuredDrop, horizon: float) -> tuple[int, int]:
    """Return the first sample of the record that is simulated to a horizon, and how many there are."""
    first = max(int(np.searchsorted(drop.time, drop.release - LEAD_S)), 0)
    return first, min(round((LEAD_S + horizon) / drop.interval), len(drop.time) - first)


def drop_plan(drop: MeasuredDrop, own: Values, first: int, count: int) -> DropPlan:
    """Return the plan of a drop that begins at a sample of the record and has `count` of them."""
    offset = own["release"]
    levitated = drop.release + offset - float(drop.time[first])
    speed = abs(drop.omega + drop.acceleration * min(offset, 0.0)) / (2 * np.pi)
    return DropPlan(
        speed=speed,
        seconds=(count - 1) * drop.interval - levitated,
        levitated=levitated,
        sampling=1 / drop.interval,
        set_point=((own["set_point_x_0"], own["set_point_y_0"]), (own["set_point_x_1"], own["set_point_y_1"])),
        velocity=((own["velocity_x_0"], own["velocity_y_0"]), (own["velocity_x_1"], own["velocity_y_1"])),
        shaft_angle=own["shaft_angle"] + drop.omega * offset,
        cage_angle=(own["cage_0"], own["cage_1"]),
    )


def predict(drop: MeasuredDrop, model: DropModel, own: Values, horizon: float) -> Prediction:
    """Simulate a drop to `horizon` s after the first guess of its release.

    Raises
    ------
    InputError
        If the values are impossible: the levitated shaft reaches the ring, or the simulation does not converge.
    """
    return predicted(drop, run(*simulation(drop, model, own, horizon)), horizon)


def simulation(drop: MeasuredDrop, model: DropModel, own: Values, horizon: float) -> tuple[DropModel, DropPlan]:
    """Return what is simulated for a prediction."""
    return model, drop_plan(drop, own, *window(drop, horizon))


def predicted(drop: MeasuredDrop, motion: Trajectory, horizon: float) -> Prediction:
    """Return the prediction of a simulation."""
    model, n = motion.model, motion.model.n
    shapes = shapes_at(model.modes, tuple(probe.position for probe in drop.probes))
    middle = drop.omega + drop.acceleration * (drop.time[0] - drop.release) / 2
    angle = motion.state[:, 2 * n + 12]
    whirl = motion.whirl  # the speed hardly changes before the release
    at_first = whirl * np.exp(1j * angle[0])
    mean = motion.state[0, :n] + 1j * motion.state[0, n : 2 * n] - at_first
    return Prediction(
        first=window(drop, horizon)[0],
        motion=motion,
        x=shapes @ motion.state[:, :n].T,
        y=shapes @ motion.state[:, n : 2 * n].T,
        angle=angle,
        omega=middle,
        coasting=coasting(model, middle),
        mean=shapes @ mean,
        whirl=shapes @ whirl,
    )


def coasting(model: DropModel, omega: float) -> float:
    """Return the angular acceleration of the rotor that nothing drives, nothing touches, rad/s^2."""
    spin = model.arrays.spin
    rate = -float(spin[DECAY_RATE]) * omega
    if spin[HAS_WINDAGE]:
        rate += float(hooks.windage(omega, model.arrays.effect[ROTOR_ROW]))
    return rate


@lru_cache(maxsize=64)
def shapes_at(modes: Modes, positions: tuple[float, ...]) -> Array:
    """Return the modes' deflections (k, n) at positions, kept: they are asked for in every simulation."""
    return modes.at(positions)


def readings(prediction: Prediction, drop: MeasuredDrop, machine: Machine, sensors: Sensors) -> Array:
    """Return what the probes read of a prediction, (probes, k), m."""
    offset = centre(machine, sensors.shared, [probe.position for probe in drop.probes])
    x, y = prediction.x + offset.real[:, None], prediction.y + offset.imag[:, None]
    out = clean_readings(x, y, prediction.angle, drop.probes, sensors.chain)
    for row, probe in zip(out, drop.probes, strict=True):
        row += sensors.own[f"zero_{probe.name}"]
    return out


def levitated(prediction: Prediction, drop: MeasuredDrop, machine: Machine, sensors: Sensors) -> Levitated:
    """Return what the probes read of the levitated rotor: means, and c of Re(c exp(i k angle)) for k = 1, 2."""
    links = [sensors.chain.of(probe.name) for probe in drop.probes]
    pairs = list(zip(drop.probes, links, strict=True))
    axes = np.exp(-1j * np.array([probe.angle + link.angle_error for probe, link in pairs]))
    gain = np.array([link.gain for link in links])
    place = prediction.mean + centre(machine, sensors.shared, [probe.position for probe in drop.probes])
    means = gain * (place * axes).real + np.array([link.offset for link in links])
    phasors = np.zeros((len(links), 2), dtype=complex)
    phasors[:, 0] = prediction.whirl * axes
    for seen, axis, link in zip(phasors, axes.tolist(), links, strict=True):
        for surface in link.runout:
            if surface.order <= len(seen):
                seen[surface.order - 1] += surface.amplitude * (axis * cmath.exp(1j * surface.phase)) ** surface.order
    phasors *= gain[:, None]
    rows = {probe.name: i for i, probe in enumerate(drop.probes)}
    alone = means.copy(), phasors.copy()
    for name, (source, part) in sensors.chain.leaks.items():
        if name in rows and source in rows:
            means[rows[name]] += part * alone[0][rows[source]]
            phasors[rows[name]] += part * alone[1][rows[source]]
    late = np.exp(-1j * prediction.omega * drop.interval * np.array([link.lag for link in links]))
    phasors *= np.column_stack([late, late**2])
    means += np.array([sensors.own[f"zero_{probe.name}"] for probe in drop.probes])
    return Levitated(means, phasors)


def centre(machine: Machine, shared: Values, position: ArrayLike) -> NDArray[np.complex128]:
    """Return where the line of the bearings' centres passes a plane, or several, in the probes' zero, x + i y, m."""
    a, b = machine.touchdown_bearings
    at = [complex(shared[f"{end.name}.centre_x"], shared[f"{end.name}.centre_y"]) for end in (a, b)]
    return np.asarray(at[0] + (at[1] - at[0]) * (np.asarray(position) - a.position) / (b.position - a.position))


def residuals(prediction: Prediction, drop: MeasuredDrop, machine: Machine, sensors: Sensors) -> Array:
    """Return measured less predicted as multiples of what is expected of it: noise, and how the model's error grows.

    In this order: readings (a probe after the other, without missing samples), pulses of the keyphasor, levitated means and
    whirl, coasting.
    """
    k = prediction.x.shape[1]
    span = slice(prediction.first, prediction.first + k)
    left = drop.reading[:, span] - readings(prediction, drop, machine, sensors)
    scale = _scale(drop, prediction.first, k)
    held = levitated(prediction, drop, machine, sensors)
    turn = np.exp(1j * np.array([1, 2]) * sensors.own["shaft_angle"])
    apart = (scale.orders - held.orders * turn) / scale.order_sigma
    still = (scale.mean - held.mean) / scale.mean_sigma
    return np.concatenate(
        [
            (coloured(left, scale.colour) / scale.reading_sigma)[scale.there],
            _pulse_residuals(prediction, drop),
            np.column_stack([still, apart.real, apart.imag]).ravel(),
            _coasting_residual(prediction, drop),
        ]
    )


@dataclass(frozen=True, eq=False)
class _Scale:
    """What a drop's residuals are counted from and in, which is the same at all values.

    Attributes
    ----------
    colour : (order, probes, 1) array
        Of the noise; a probe of a lower order has zeros.
    reading_sigma : (probes, k) array
        What is expected of noise and model, m.
    there : (probes, k) array of bool
        Where a sample and those that its noise follows are there.
    mean, orders : (probes,) and (probes, 2) arrays
        Measured before the release, m.
    mean_sigma, order_sigma : (probes,) and (probes, 1) arrays
        Their standard deviations, m.
    """

    colour: Array
    reading_sigma: Array
    there: NDArray[np.bool_]
    mean: Array
    orders: NDArray[np.complex128]
    mean_sigma: Array
    order_sigma: Array


@lru_cache(maxsize=16)  # of some drops at a horizon or two
def _scale(drop: MeasuredDrop, first: int, count: int) -> _Scale:
    model = model_error(drop, drop.time[first : first + count] - drop.release)
    colour = np.zeros((max(len(noise.colour) for noise in drop.noise), len(drop.noise), 1))
    for row, noise in enumerate(drop.noise):
        colour[: len(noise.colour), row, 0] = noise.colour
    return _Scale(
        colour=colour,
        reading_sigma=np.array([np.hypot(noise.innovation, model) for noise in drop.noise]),
        there=np.isfinite(coloured(drop.reading[:, first : first + count], colour)),
        mean=np.array([noise.mean for noise in drop.noise]),
        orders=np.array([noise.orders[:2] for noise in drop.noise]),
        mean_sigma=np.array([np.hypot(noise.mean_sigma, _LEVITATED_FLOOR) for noise in drop.noise]),
        order_sigma=np.array([[np.hypot(noise.order_sigma, _LEVITATED_FLOOR)] for noise in drop.noise]),
    )


def noise_alone(drop: MeasuredDrop, horizon: float) -> float:
    """Return the sum of squares that noise alone leaves of a drop's `residuals`, which allow for a model's error too."""
    first, count = window(drop, horizon)
    model = model_error(drop, drop.time[first : first + count] - drop.release)
    there = _scale(drop, first, count).there
    return sum(
        float(np.sum(1 / (1 + (model[seen] / noise.innovation) ** 2)))
        for seen, noise in zip(there, drop.noise, strict=True)
    )


def on_reading_rows(drop: MeasuredDrop, horizon: float, values: NDArray[Any]) -> NDArray[Any]:
    """Return values of the simulated samples (k,) as the readings' rows of `residuals` have them, (rows,)."""
    there = _scale(drop, *window(drop, horizon)).there
    return np.broadcast_to(values, there.shape)[there]


def touched_rows(drop: MeasuredDrop, horizon: float, touch: float, rows: int) -> NDArray[np.bool_]:
    """Return which of a drop's `residuals`, so many rows, contacts take part in: readings after a touch, and pulses."""
    first, count = window(drop, horizon)
    late = on_reading_rows(drop, horizon, drop.time[first : first + count] > touch)
    before = _LEVITATED_ROWS * len(drop.probes) + 1  # with the deceleration
    return np.concatenate([late, np.ones(rows - len(late) - before, dtype=bool), np.zeros(before, dtype=bool)])


def model_error(drop: MeasuredDrop, since: Array) -> Array:
    """Return the standard deviation of the model's error, m, at times since the first guess of the release, s."""
    return _MODEL_ERROR * np.exp(drop.divergence * np.maximum(since - FLIGHT_S, 0.0))


def _pulse_residuals(prediction: Prediction, drop: MeasuredDrop) -> Array:
    """Return measured less predicted shaft angle at the pulses within the prediction, over their standard deviation."""
    time = drop.time[prediction.first : prediction.first + len(prediction.angle)]
    inside = (drop.pulse_times > drop.release) & (drop.pulse_times < time[-1])
    if not inside.any():
        return np.empty(0)
    seen = np.interp(drop.pulse_times[inside], time, prediction.angle)
    return (drop.pulse_angles[inside] - seen) / drop.pulse_sigma


def _coasting_residual(prediction: Prediction, drop: MeasuredDrop) -> Array:
    """Return measured less predicted deceleration before the release; nothing where a drive held the speed."""
    if prediction.coasting == 0.0 or drop.acceleration / prediction.coasting < _DRIVEN:
        return np.zeros(1)
    sigma = math.hypot(drop.acceleration_sigma, _COASTING_FLOOR * drop.acceleration)
    return np.array([(drop.acceleration - prediction.coasting) / sigma])
