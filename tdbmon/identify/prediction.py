"""What the probes would read of a drop at given values, and how far that is from what they read."""

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

DECELERATION = -1  # of a drop's `residuals`: the one that the deceleration before the release leaves
_MODEL_ERROR = 1e-7  # m, of the model at the first contact; it grows with the divergence
_DRIVEN = 0.5  # of the predicted deceleration: who slows down less before the release is driven
_COASTING_FLOOR = 3e-3  # of the deceleration; no record of a tenth of a second tells it better
_LEVITATED_ROWS = 5  # residuals a probe: mean, and both parts of 1X and 2X
_COASTING_ROWS = 1  # the deceleration
_LEVITATED_FLOOR = 5e-8  # m; no levitated mean or phasor is trusted beyond this


@dataclass(frozen=True, eq=False)
class Path:
    """Where a simulated drop leads the shaft, at the record's samples (SI); or several at other values, along a first axis.

    Attributes
    ----------
    first : int
        Sample of the record at which it begins.
    x, y : (..., probes, k) arrays
        Shaft centre in the probes' planes as the bearings' centres have it, m.
    angle : (..., k) array
        Shaft angle, rad.
    omega : float
        Speed at the middle of the levitated stretch, rad/s.
    coasting : (...) array
        Angular acceleration there if nothing drives, rad/s^2.
    mean : (..., probes) complex array
        x + i y of the levitated mean, m.
    whirl : (..., probes) complex array
        Of the levitated whirl: x + i y = whirl exp(i angle), m.
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
    """How the probes of a drop see it.

    Attributes
    ----------
    chain : SensorChain
        What effects do to the channels.
    shared, own : mapping
        Values (SI) by name, of all drops and of this one, what a usual surface runs out among these; with several paths,
        (paths,) arrays of them.
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
    """Return the first sample of the record that is simulated to a horizon, and how many there are."""
    lead = min(LEAD_S, drop.release - float(drop.time[0]))
    first = int(np.searchsorted(drop.time, drop.release - lead))
    return first, min(round((lead + horizon) / drop.interval), drop.unbroken - first)


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
    motion = run(model, planned(drop, own, horizon))
    return Prediction(motion, path_of(drop, motion, horizon))


def planned(drop: MeasuredDrop, own: Values, horizon: float) -> DropPlan:
    """Return the plan of what is simulated for a prediction."""
    return drop_plan(drop, own, *window(drop, horizon))


def path_of(drop: MeasuredDrop, motion: Trajectory, horizon: float) -> Path:
    """Return where a simulation leads the shaft."""
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
        angle=angle.copy(),  # all that is seen of the states, which take much room
        omega=middle,
        coasting=np.asarray(coasting(model, middle)),
        mean=shapes @ mean,
        whirl=shapes @ whirl,
    )


def side_by_side(paths: Sequence[Path], sensors: Sequence[Sensors]) -> tuple[Path, Sensors]:
    """Return several paths of a drop to one horizon as one, with the sensors that see them, whose chains are equal."""

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
    """Return the angular acceleration of the rotor that nothing drives, nothing touches, rad/s^2."""
    return float(windage_acceleration.py_func(model.arrays.spin, model.arrays.effect, omega))


@lru_cache(maxsize=64)
def shapes_at(modes: Modes, positions: tuple[float, ...]) -> Array:
    """Return the modes' deflections (k, n) at positions, kept: they are asked for in every simulation."""
    return modes.at(positions)


def readings(path: Path, drop: MeasuredDrop, machine: Machine, sensors: Sensors) -> Array:
    """Return what the probes read of a path, (..., probes, k), m."""
    before = math.ceil(max(sensors.chain.of(probe.name).lag for probe in drop.probes))
    x, y, angle = _with_levitated(path, before) if before > 0 else (path.x, path.y, path.angle)
    offset = centre(machine, sensors.shared, [probe.position for probe in drop.probes])[..., None]
    usual = runout_at(runout_phasors(drop.probes, machine, sensors.chain, sensors.own), angle)
    seen = clean_readings(x + offset.real, y + offset.imag, angle, drop.probes, sensors.chain, usual)
    return seen[..., max(before, 0) :] + _zeros(drop, sensors)[..., None]


def _with_levitated(path: Path, count: int) -> tuple[Array, Array, Array]:
    """Return x, y and angle of a path with so many samples of its levitation before: a channel that lags still shows them."""
    step = path.angle[..., 1:2] - path.angle[..., :1]
    angle = path.angle[..., :1] + step * np.arange(-count, 0)
    place = path.mean[..., None] + path.whirl[..., None] * np.exp(1j * angle)[..., None, :]
    return (
        np.concatenate([place.real, path.x], axis=-1),
        np.concatenate([place.imag, path.y], axis=-1),
        np.concatenate([angle, path.angle], axis=-1),
    )


def _zeros(drop: MeasuredDrop, sensors: Sensors) -> Array:
    """Return what the probes read with the shaft in the middle, (..., probes), m."""
    return np.stack([np.asarray(sensors.own[f"zero_{probe.name}"]) for probe in drop.probes], axis=-1)


def levitated(path: Path, drop: MeasuredDrop, machine: Machine, sensors: Sensors) -> Levitated:
    """Return what the probes read of the levitated rotor: means, and c of Re(c exp(i k angle)) for k = 1, 2."""
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
    """Return where the line of the bearings' centres passes some planes in the probes' zero, x + i y, (..., planes), m."""
    a, b = machine.touchdown_bearings
    at = [np.asarray(shared[f"{end.name}.centre_x"] + 1j * shared[f"{end.name}.centre_y"])[..., None] for end in (a, b)]
    along = (np.asarray(position) - a.position) / (b.position - a.position)
    return np.asarray(at[0] + (at[1] - at[0]) * along)


def residuals(path: Path, drop: MeasuredDrop, machine: Machine, sensors: Sensors) -> Array:
    """Return measured less predicted as multiples of what is expected of it: noise, and how the model's error grows.

    In this order, along the last axis: readings (a probe after the other, without missing samples), pulses of the
    keyphasor, levitated means and whirl, and as the only one of its kind the deceleration before the release
    (`DECELERATION`).
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
    pulses : array of bool
        Which pulses of the keyphasor come between the release and the end.
    before_pulse, after_pulse : (pulses,) arrays of int
        The samples between which each of these comes.
    on_the_way : (pulses,) array
        How far it is from one to the other, 0 to 1.
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


@lru_cache(maxsize=16)  # of some drops at a horizon or two
def _scale(drop: MeasuredDrop, first: int, count: int) -> _Scale:
    model = model_error(drop, drop.time[first : first + count] - drop.release)
    colour = np.zeros((max(len(noise.colour) for noise in drop.noise), len(drop.noise), 1))
    for row, noise in enumerate(drop.noise):
        colour[: len(noise.colour), row, 0] = noise.colour
    time = drop.time[first : first + count]
    there = np.isfinite(whitened(drop.reading[:, first : first + count], colour))
    for row, noise in enumerate(drop.noise):  # what the first samples' noise follows was not looked at
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
    before = _LEVITATED_ROWS * len(drop.probes) + _COASTING_ROWS
    return np.concatenate([late, np.ones(rows - len(late) - before, dtype=bool), np.zeros(before, dtype=bool)])


def model_error(drop: MeasuredDrop, since: Array) -> Array:
    """Return the standard deviation of the model's error, m, at times since the first guess of the release, s."""
    return _MODEL_ERROR * np.exp(drop.divergence * np.maximum(since - drop.flight, 0.0))


def _pulse_residuals(path: Path, drop: MeasuredDrop, scale: _Scale) -> Array:
    """Return measured less predicted shaft angle at the pulses within the path, over their standard deviation."""
    before, after = path.angle[..., scale.before_pulse], path.angle[..., scale.after_pulse]
    seen = before + scale.on_the_way * (after - before)
    return np.asarray((drop.pulse_angles[scale.pulses] - seen) / drop.pulse_sigma)


def _coasting_residual(path: Path, drop: MeasuredDrop) -> Array:
    """Return measured less predicted deceleration before the release; nothing where a drive held the speed."""
    sigma = math.hypot(drop.acceleration_sigma, _COASTING_FLOOR * drop.acceleration)
    return np.where(is_driven(drop, path.coasting), 0.0, (drop.acceleration - path.coasting) / sigma)


def is_driven(drop: MeasuredDrop, predicted: float | Array) -> bool | Array:
    """Return whether a drive held the speed before the release, by predicted accelerations (...), rad/s^2, of one without."""
    slows = np.asarray(predicted) != 0.0
    return ~slows | (drop.acceleration / np.where(slows, predicted, 1.0) < _DRIVEN)
