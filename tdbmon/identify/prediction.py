"""Probe readings predicted by a simulation of a drop at given values, and their residuals."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tdbsim import state_layout
from tdbsim.drop_model import DropModel
from tdbsim.machine import Machine
from tdbsim.modes import Modes
from tdbsim.rhs import windage_acceleration
from tdbsim.sensors import SensorChain, clean_readings
from tdbsim.simulate import DropPlan, Trajectory, run

from tdbmon.analysis.autoregression import whitened
from tdbmon.identify.drop import LEAD_S, MeasuredDrop
from tdbmon.identify.runout import ORDERS, runout_at, runout_phasors

Array = NDArray[np.float64]
Values = Mapping[str, float]

DECELERATION = -1  # index in a drop's `residuals`: deceleration before the release
_MODEL_ERROR = 1e-7  # m, error of the model at the first contact; it grows with the divergence
_DRIVEN = 0.5  # of the predicted deceleration: a rotor that slows down less before the release is driven
_COASTING_FLOOR = 3e-3  # relative, least standard deviation of the deceleration from a record of a tenth of a second
_LEVITATED_ROWS = 5  # residuals per probe: mean, real and imaginary part of 1X and 2X
_COASTING_ROWS = 1  # the deceleration
_LEVITATED_FLOOR = 5e-8  # m; least standard deviation of a levitated mean or phasor


@dataclass(frozen=True, eq=False)
class Path:
    """Motion of the shaft in a simulated drop, at the record's samples (SI); or in several, along a first axis.

    Attributes
    ----------
    first : int
        Sample of the record at which it begins.
    x, y : (..., probes, k) arrays
        Shaft centre in the probes' planes, relative to the line of bearing centres, m.
    angle : (..., k) array
        Shaft angle, rad.
    omega : float
        Speed at the middle of the levitated stretch, rad/s.
    coasting : (...) array
        Angular acceleration at that speed without a drive, rad/s^2.
    mean : (..., probes) complex array
        Levitated mean x + i y, m.
    whirl : (..., probes) complex array
        Amplitude of the levitated whirl: x + i y = whirl exp(i angle), m.
    """

    first: int
    x: Array
    y: Array
    angle: Array
    omega: float
    coasting: Array
    mean: NDArray[np.complex128]
    whirl: NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Prediction:
    """A simulated drop.

    Attributes
    ----------
    motion : Trajectory
    path : Path
    """

    motion: Trajectory
    path: Path


@dataclass(frozen=True, eq=False)
class Sensors:
    """The sensors of a drop.

    Attributes
    ----------
    chain : SensorChain
        The channels with the sensor effects.
    shared, own : mapping
        Shared values and those of this drop (SI) by name, the usual runout among the latter; for several paths, (paths,) arrays.
    """

    chain: SensorChain
    shared: Mapping[str, float | Array]
    own: Mapping[str, float | Array]


@dataclass(frozen=True, eq=False)
class Levitated:
    """Readings before the release: means (probes,), m, and phasors of 1X and 2X (probes, 2), m."""

    mean: Array
    orders: NDArray[np.complex128]


def window(drop: MeasuredDrop, horizon: float) -> tuple[int, int]:
    """Return the first sample of the record that is simulated for a horizon, and the number of samples."""
    lead = min(LEAD_S, drop.release - float(drop.time[0]))
    first = int(np.searchsorted(drop.time, drop.release - lead))
    return first, min(round((lead + horizon) / drop.interval), drop.unbroken - first)


def drop_plan(drop: MeasuredDrop, own: Values, first: int, count: int) -> DropPlan:
    """Return the plan of a drop over `count` samples of the record from the sample `first` on."""
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
    motion = run(model, planned(drop, own, horizon))
    return Prediction(motion, path_of(drop, motion, horizon))


def planned(drop: MeasuredDrop, own: Values, horizon: float) -> DropPlan:
    """Return the plan of a prediction to a horizon."""
    return drop_plan(drop, own, *window(drop, horizon))


def path_of(drop: MeasuredDrop, motion: Trajectory, horizon: float) -> Path:
    """Return the path of the shaft in a simulation."""
    model, n = motion.model, motion.model.n
    shapes = shapes_at(model.modes, tuple(probe.position for probe in drop.probes))
    middle = drop.omega + drop.acceleration * (max(drop.time[0], drop.even_from) - drop.release) / 2
    along_x, along_y = motion.state[:, state_layout.modes_x(n)], motion.state[:, state_layout.modes_y(n)]
    angle = motion.state[:, state_layout.shaft_angle(n)]
    whirl = motion.whirl  # the speed hardly changes before the release
    at_first = whirl * np.exp(1j * angle[0])
    mean = along_x[0] + 1j * along_y[0] - at_first
    return Path(
        first=window(drop, horizon)[0],
        x=shapes @ along_x.T,
        y=shapes @ along_y.T,
        angle=angle.copy(),  # a view would keep the large state array alive
        omega=middle,
        coasting=np.asarray(coasting(model, middle)),
        mean=shapes @ mean,
        whirl=shapes @ whirl,
    )


def side_by_side(paths: Sequence[Path], sensors: Sequence[Sensors]) -> tuple[Path, Sensors]:
    """Return several paths of a drop to one horizon stacked into one, and their sensors (of equal chains) likewise."""

    def stacked(name: str) -> NDArray[Any]:
        return np.stack([getattr(each, name) for each in paths])

    together = Path(
        first=paths[0].first,
        omega=paths[0].omega,
        **{name: stacked(name) for name in ("x", "y", "angle", "coasting", "mean", "whirl")},
    )
    shared = {name: np.array([each.shared[name] for each in sensors]) for name in sensors[0].shared}
    own = {name: np.array([each.own[name] for each in sensors]) for name in sensors[0].own}
    return together, Sensors(sensors[0].chain, shared, own)


def coasting(model: DropModel, omega: float) -> float:
    """Return the angular acceleration of the free rotor without a drive, rad/s^2."""
    return float(windage_acceleration.py_func(model.arrays.spin, model.arrays.effect, omega))


@lru_cache(maxsize=64)
def shapes_at(modes: Modes, positions: tuple[float, ...]) -> Array:
    """Return the mode shapes (k, n) at positions; cached, as every simulation needs them."""
    return modes.at(positions)


def readings(path: Path, drop: MeasuredDrop, machine: Machine, sensors: Sensors) -> Array:
    """Return the probe readings of a path (..., probes, k), m."""
    before = math.ceil(max(sensors.chain.of(probe.name).lag for probe in drop.probes))
    x, y, angle = _with_levitated(path, before) if before > 0 else (path.x, path.y, path.angle)
    offset = centre(machine, sensors.shared, [probe.position for probe in drop.probes])[..., None]
    usual = runout_at(runout_phasors(drop.probes, machine, sensors.chain, sensors.own), angle)
    seen = clean_readings(x + offset.real, y + offset.imag, angle, drop.probes, sensors.chain, usual)
    return seen[..., max(before, 0) :] + _zeros(drop, sensors)[..., None]


def _with_levitated(path: Path, count: int) -> tuple[Array, Array, Array]:
    """Return x, y and angle of a path preceded by `count` levitated samples, which a lagging channel still shows."""
    step = path.angle[..., 1:2] - path.angle[..., :1]
    angle = path.angle[..., :1] + step * np.arange(-count, 0)
    place = path.mean[..., None] + path.whirl[..., None] * np.exp(1j * angle)[..., None, :]
    return (
        np.concatenate([place.real, path.x], axis=-1),
        np.concatenate([place.imag, path.y], axis=-1),
        np.concatenate([angle, path.angle], axis=-1),
    )


def _zeros(drop: MeasuredDrop, sensors: Sensors) -> Array:
    """Return the probes' zeros, their readings of a centred shaft (..., probes), m."""
    return np.stack([np.asarray(sensors.own[f"zero_{probe.name}"]) for probe in drop.probes], axis=-1)


def levitated(path: Path, drop: MeasuredDrop, machine: Machine, sensors: Sensors) -> Levitated:
    """Return the readings of the levitated rotor: means, and c of Re(c exp(i k angle)) for k = 1, 2."""
    links = [sensors.chain.of(probe.name) for probe in drop.probes]
    pairs = list(zip(drop.probes, links, strict=True))
    axes = np.exp(-1j * np.array([probe.angle + link.angle_error for probe, link in pairs]))
    gain = np.array([link.gain for link in links])
    place = path.mean + centre(machine, sensors.shared, [probe.position for probe in drop.probes])
    means = gain * (place * axes).real + np.array([link.offset for link in links])
    phasors = runout_phasors(drop.probes, machine, sensors.chain, sensors.own)
    for probe, (axis, link) in enumerate(zip(axes.tolist(), links, strict=True)):
        for surface in link.runout:
            if surface.order in ORDERS:
                crest = surface.amplitude * (axis * cmath.exp(1j * surface.phase)) ** surface.order
                phasors[..., probe, surface.order - 1] += crest
    phasors[..., 0] += path.whirl * axes
    phasors *= gain[:, None]
    rows = {probe.name: i for i, probe in enumerate(drop.probes)}
    alone = means.copy(), phasors.copy()
    for name, (source, part) in sensors.chain.leaks.items():
        if name in rows and source in rows:
            means[..., rows[name]] += part * alone[0][..., rows[source]]
            phasors[..., rows[name], :] += part * alone[1][..., rows[source], :]
    late = np.exp(-1j * path.omega * drop.interval * np.array([link.lag for link in links]))
    return Levitated(means + _zeros(drop, sensors), phasors * np.column_stack([late, late**2]))


def centre(machine: Machine, shared: Mapping[str, float | Array], position: Sequence[float]) -> NDArray[np.complex128]:
    """Return the line of bearing centres in given planes, relative to the probes' zero, x + i y (..., planes), m."""
    a, b = machine.touchdown_bearings
    at = [np.asarray(shared[f"{end.name}.centre_x"] + 1j * shared[f"{end.name}.centre_y"])[..., None] for end in (a, b)]
    along = (np.asarray(position) - a.position) / (b.position - a.position)
    return np.asarray(at[0] + (at[1] - at[0]) * along)


def residuals(path: Path, drop: MeasuredDrop, machine: Machine, sensors: Sensors) -> Array:
    """Return measured less predicted values, whitened and in units of noise and the growing error of the model.

    In this order, along the last axis: readings (probe by probe, without missing samples), keyphasor pulses, levitated means and
    phasors, and last the single residual of the deceleration before the release (`DECELERATION`).
    """
    k = path.x.shape[-1]
    span = slice(path.first, path.first + k)
    left = drop.reading[:, span] - readings(path, drop, machine, sensors)
    scale = _scale(drop, path.first, k)
    held = levitated(path, drop, machine, sensors)
    turn = np.exp(1j * np.multiply.outer(sensors.own["shaft_angle"], [1, 2]))[..., None, :]
    apart = (scale.orders - held.orders * turn) / scale.order_sigma
    still = (scale.mean - held.mean) / scale.mean_sigma
    before = np.concatenate([still[..., None], apart.real, apart.imag], axis=-1)
    return np.concatenate(
        [
            (whitened(left, scale.colour) / scale.reading_sigma)[..., scale.there],
            _pulse_residuals(path, drop, scale),
            before.reshape(*before.shape[:-2], -1),
            _coasting_residual(path, drop)[..., None],
        ],
        axis=-1,
    )


@dataclass(frozen=True, eq=False)
class _Scale:
    """Measured values and standard deviations of a drop's residuals, which do not depend on the parameters.

    Attributes
    ----------
    colour : (order, probes, 1) array
        Autoregressive coefficients of the noise, padded with zeros for lower orders.
    reading_sigma : (probes, k) array
        Standard deviation of innovation and model error together, m.
    there : (probes, k) array of bool
        Where a sample and the earlier ones that whiten it are present.
    mean, orders : (probes,) and (probes, 2) arrays
        Levitated means and phasors, measured, m.
    mean_sigma, order_sigma : (probes,) and (probes, 1) arrays
        Their standard deviations, m.
    pulses : array of bool
        Which keyphasor pulses come between the release and the end.
    before_pulse, after_pulse : (pulses,) arrays of int
        Samples before and after each of these.
    on_the_way : (pulses,) array
        Position between the two, 0 to 1.
    """

    colour: Array
    reading_sigma: Array
    there: NDArray[np.bool_]
    mean: Array
    orders: NDArray[np.complex128]
    mean_sigma: Array
    order_sigma: Array
    pulses: NDArray[np.bool_]
    before_pulse: NDArray[np.intp]
    after_pulse: NDArray[np.intp]
    on_the_way: Array


@lru_cache(maxsize=16)  # a few drops at one or two horizons
def _scale(drop: MeasuredDrop, first: int, count: int) -> _Scale:
    model = model_error(drop, drop.time[first : first + count] - drop.release)
    colour = np.zeros((max(len(noise.colour) for noise in drop.noise), len(drop.noise), 1))
    for row, noise in enumerate(drop.noise):
        colour[: len(noise.colour), row, 0] = noise.colour
    time = drop.time[first : first + count]
    there = np.isfinite(whitened(drop.reading[:, first : first + count], colour))
    for row, noise in enumerate(drop.noise):  # the first samples lack the earlier ones that whiten them
        there[row, : len(noise.colour)] = False
    pulses = (drop.pulse_times > drop.release) & (drop.pulse_times < time[-1])
    after = np.searchsorted(time, drop.pulse_times[pulses])
    before = np.maximum(after - 1, 0)
    between = time[after] - time[before]
    return _Scale(
        colour=colour,
        reading_sigma=np.array([np.hypot(noise.innovation, model) for noise in drop.noise]),
        there=there,
        mean=np.array([noise.mean for noise in drop.noise]),
        orders=np.array([noise.orders[:2] for noise in drop.noise]),
        mean_sigma=np.array([np.hypot(noise.mean_sigma, _LEVITATED_FLOOR) for noise in drop.noise]),
        order_sigma=np.array([[np.hypot(noise.order_sigma, _LEVITATED_FLOOR)] for noise in drop.noise]),
        pulses=pulses,
        before_pulse=before,
        after_pulse=after,
        on_the_way=(drop.pulse_times[pulses] - time[before]) / np.where(between > 0, between, 1.0),
    )


def noise_alone(drop: MeasuredDrop, horizon: float) -> float:
    """Return the expected sum of squares of a drop's `residuals` for noise alone, as they are scaled by the model error too."""
    first, count = window(drop, horizon)
    model = model_error(drop, drop.time[first : first + count] - drop.release)
    there = _scale(drop, first, count).there
    return sum(
        float(np.sum(1 / (1 + (model[seen] / noise.innovation) ** 2)))
        for seen, noise in zip(there, drop.noise, strict=True)
    )


def on_reading_rows(drop: MeasuredDrop, horizon: float, values: NDArray[Any]) -> NDArray[Any]:
    """Return values at the simulated samples (k,), arranged like the readings in `residuals` (rows,)."""
    there = _scale(drop, *window(drop, horizon)).there
    return np.broadcast_to(values, there.shape)[there]


def touched_rows(drop: MeasuredDrop, horizon: float, touch: float, rows: int) -> NDArray[np.bool_]:
    """Return which of a drop's `residuals` (rows,) contacts affect: readings after the touch, and pulses."""
    first, count = window(drop, horizon)
    late = on_reading_rows(drop, horizon, drop.time[first : first + count] > touch)
    before = _LEVITATED_ROWS * len(drop.probes) + _COASTING_ROWS
    return np.concatenate([late, np.ones(rows - len(late) - before, dtype=bool), np.zeros(before, dtype=bool)])


def model_error(drop: MeasuredDrop, since: Array) -> Array:
    """Return the standard deviation of the model's error, m, at times since the first guess of the release, s."""
    return _MODEL_ERROR * np.exp(drop.divergence * np.maximum(since - drop.flight, 0.0))


def _pulse_residuals(path: Path, drop: MeasuredDrop, scale: _Scale) -> Array:
    """Return measured less predicted shaft angle at the pulses within the path, over its standard deviation."""
    before, after = path.angle[..., scale.before_pulse], path.angle[..., scale.after_pulse]
    seen = before + scale.on_the_way * (after - before)
    return np.asarray((drop.pulse_angles[scale.pulses] - seen) / drop.pulse_sigma)


def _coasting_residual(path: Path, drop: MeasuredDrop) -> Array:
    """Return the residual of the deceleration before the release; zero where a drive held the speed."""
    sigma = math.hypot(drop.acceleration_sigma, _COASTING_FLOOR * drop.acceleration)
    return np.where(is_driven(drop, path.coasting), 0.0, (drop.acceleration - path.coasting) / sigma)


def is_driven(drop: MeasuredDrop, predicted: float | Array) -> bool | Array:
    """Return whether a drive held the speed before the release, from the predicted acceleration without one (...), rad/s^2."""
    slows = np.asarray(predicted) != 0.0
    return ~slows | (drop.acceleration / np.where(slows, predicted, 1.0) < _DRIVEN)
