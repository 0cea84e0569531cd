"""Simulate a drop: levitated, released, caught by the touchdown bearings."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from tdbsim import state_layout
from tdbsim.channel_names import check_channel_names
from tdbsim.drop_model import BENDING, Array, DropModel, build_model, check_count
from tdbsim.effect import Effect
from tdbsim.errors import InputError
from tdbsim.integration import Integration
from tdbsim.levitation import Whirl, fill_levitated
from tdbsim.machine import Machine
from tdbsim.release import alone, begin, check_speed
from tdbsim.sensors import SensorChain, check_pulses

if TYPE_CHECKING:
    import xarray as xr

    from tdbsim.heat_coupling import WarmIntegration, Warmth

Pair = tuple[float, float]

_RECORD = 1.6  # least memory of a record over that of its states, with all unmeasured quantities
_FORMS = {(): "a number", (2,): "a number for each end", (2, 2): "(x, y) for each end"}


@dataclass(frozen=True)
class DropPlan:
    """Conditions and numerical options of a drop; SI, speeds in Hz, angles in rad.

    Attributes
    ----------
    speed : float
        Speed at the release, Hz, 0 for a shaft at standstill; its sense is the machine's ``rotation``.
    seconds : float
        Time simulated after the release.
    levitated : float
        Time recorded before the release.
    sampling : float
        Sampling rate of the result, Hz.
    set_point : pair of pairs
        Mean position (x, y), m, of the levitated shaft at each touchdown bearing's plane.
    velocity : pair of pairs
        Velocity of each end (x, y), m/s, in excess of the levitated whirl at the release.
    shaft_angle : float
        Of the shaft at the release, from +x towards +y.
    ring_angle, cage_angle : pair of float
        Of each end's inner ring and cage at the release; ball 1 is at the cage's angle.
    sensors : SensorChain
        Noise, hum, quantisation of the sensors; by default none.
    seed : int
        Seed of the sensors' noise.
    method : str
        "splitting" (fast, fixed steps) or "dormand_prince" (adaptive, for reference).
    step : float, optional
        Greatest step of the splitting while an end touches, s, by default the machine's `usual_step`; steps in free flight
        are twice as long, up to 50e-6, those in which a contact begins or ends a quarter as long.
    tolerance : float
        Relative error per step of the adaptive method.
    heat_interval : float
        Time between exchanges of drop and temperatures, s, where a touchdown bearing has `heat`; at least one sample, since the
        torque depends on the loads at the samples.
    """

    speed: float
    seconds: float = 0.2
    levitated: float = 0.0
    sampling: float = 20e3
    set_point: tuple[Pair, Pair] = ((0.0, 0.0), (0.0, 0.0))
    velocity: tuple[Pair, Pair] = ((0.0, 0.0), (0.0, 0.0))
    shaft_angle: float = 0.0
    ring_angle: Pair = (0.0, 0.0)
    cage_angle: Pair = (0.0, 0.0)
    sensors: SensorChain = field(default_factory=SensorChain)
    seed: int = 0
    method: Literal["splitting", "dormand_prince"] = "splitting"
    step: float | None = None
    tolerance: float = 1e-7
    heat_interval: float = 1e-3

    def __post_init__(self) -> None:
        for name, unit, wanted in (
            ("speed", "Hz", "not negative"), ("seconds", "s", "positive"), ("levitated", "s", "not negative"),
            ("sampling", "Hz", "positive"), ("step", "s", "positive"), ("tolerance", "", "positive"),
            ("heat_interval", "s", "positive"),
        ):  # fmt: skip
            value = getattr(self, name)
            if name == "step" and value is None:
                continue
            _check_numbers(name, value, unit, ())
            if value < 0 or (value == 0 and wanted == "positive"):
                sense = "; the sense of rotation is the machine's 'rotation'" if name == "speed" else ""
                raise InputError(f"{name} {value:g} {unit}".rstrip() + f" must be {wanted}{sense}")
        for name, unit, shape in (
            ("set_point", "m", (2, 2)), ("velocity", "m/s", (2, 2)),
            ("ring_angle", "rad", (2,)), ("cage_angle", "rad", (2,)), ("shaft_angle", "rad", ()),
        ):  # fmt: skip
            _check_numbers(name, getattr(self, name), unit, shape)
        if self.method not in ("splitting", "dormand_prince"):
            raise InputError(f"method '{self.method}' is neither 'splitting' nor 'dormand_prince'")
        check_count("seed", self.seed, "as a seed")
        if round(self.seconds * self.sampling) < 1:
            raise InputError(
                f"{self.seconds:g} s at {self.sampling:g} Hz holds no sample; simulate longer or sample faster"
            )


def _check_numbers(name: str, value: object, unit: str, shape: tuple[int, ...]) -> None:
    """Raise InputError where a value is not finite or has a wrong shape."""
    if type(value) is float and not shape and math.isfinite(value):
        return  # the usual case, made fast since fits create plans by the thousand
    wanted = f"give {_FORMS[shape]}" + (f" in {unit}" if unit else "")
    try:
        numbers = np.asarray(value)
    except ValueError:  # rows of different lengths
        raise InputError(f"{name} {value!r} has another form; {wanted}") from None
    if numbers.dtype.kind not in "iuf":
        raise InputError(f"{name} {value!r} is not {'a number' if shape == () else 'of numbers'}; {wanted}")
    if numbers.shape != shape:
        raise InputError(f"{name} {value!r} has another form; {wanted}")
    if not np.isfinite(numbers).all():
        raise InputError(f"{name} {value!r} is not finite; {wanted}")


@dataclass(frozen=True, eq=False)
class Trajectory:
    """States of a drop at the sampling instants (see `tdbsim.state_layout` for their order).

    Attributes
    ----------
    model : DropModel
    plan : DropPlan
    time : (k,) array
        s, from the first sample; the release is at ``plan.levitated``.
    state : (k, size) array
    peak_normal : (2,) array
        Greatest normal force at each end over all steps of the splitting, N; zero with the adaptive method, which has none.
    whirl : (n,) complex array
        Of the levitated rotor, in modal coordinates: x + i y = whirl exp(i angle), m.
    warmth : Warmth, optional
        Thermal results, where a touchdown bearing has `heat`.
    """

    model: DropModel
    plan: DropPlan
    time: Array
    state: Array
    peak_normal: Array
    whirl: Whirl
    warmth: Warmth | None = None

    @property
    def place(self) -> NDArray[np.complex128]:
        """Shaft centre at both ends relative to the bearings' centres, x + i y (2, k), m."""
        at_end, n = self.model.arrays.at_end, self.model.n
        x, y = self.state[:, state_layout.modes_x(n)].T, self.state[:, state_layout.modes_y(n)].T
        return np.asarray(at_end @ x + 1j * (at_end @ y))


def simulate(
    machine: Machine, plan: DropPlan, effects: Sequence[Effect] = (), bending: int = BENDING, attachment: bool = True
) -> xr.Dataset:
    """Simulate a drop and its record by the machine's sensors.

    Parameters
    ----------
    machine : Machine
        At its nominal values, with its own effects.
    plan : DropPlan
        Speed, time, initial state, method.
    effects : sequence of Effect
        Additional effects, from `tdbsim.stated_effects.parse` or the effects' classes.
    bending, attachment : int, bool
        The modes of the rotor, as in `build_model`.

    Returns
    -------
    xarray.Dataset
        The channels of a record (see `tdbmon.record`): one variable per probe in m, ``speed`` in Hz, ``keyphasor``; and
        unmeasured quantities along ``end`` and ``time``: see `tdbsim.drop_record`.

    Raises
    ------
    InputError
        If a value is impossible, the set-point is outside the gap, the integration does not converge, a channel's name is
        taken, or the record would not fit into memory.
    """
    from tdbsim.drop_record import drop_record

    check_speed(machine, plan)
    check_channel_names(machine)
    check_pulses(machine, plan.sensors, plan.speed, plan.sampling)
    model = build_model(machine, effects, bending, attachment)
    check_memory(model, plan, _RECORD)
    return drop_record(run(model, plan))


def run(model: DropModel, plan: DropPlan) -> Trajectory:
    """Integrate a drop; the part of `simulate` between model and record (raises as `simulate`).

    The given model is unchanged; that of the trajectory contains the plan's angles and magnetic forces.
    """
    check_memory(model, plan)
    time = instants(plan)
    return next(pieces(model, plan, time, len(time)))


def pieces(model: DropModel, plan: DropPlan, time: Array, longest: int) -> Iterator[Trajectory]:
    """Integrate a drop piece by piece, where all its states would need too much memory (raises as `run`).

    Parameters
    ----------
    model, plan : DropModel, DropPlan
        As in `run`.
    time : (k,) array
        Instants of the record, s, from the first sample, ascending.
    longest : int
        Greatest number of samples per piece, with separate pieces before the release; where it is enough for all, there is one
        piece.  Exchanges with the temperatures of bearings count from the start of each piece.

    Yields
    ------
    Trajectory
        At the next instants; greatest forces are those so far, and the last piece has the thermal results of the whole drop.
    """
    arrays = model.arrays  # a run changes only their angles and magnetic forces
    model = replace(model, arrays=arrays._replace(end=arrays.end.copy(), magnet=arrays.magnet.copy()))
    start, whirl = _begin(model, plan)
    levitated, since = before_release(plan, time), time - plan.levitated
    peak = np.zeros(2)
    drop: Integration | WarmIntegration
    if model.machine.has_heat:
        from tdbsim.heat_coupling import WarmIntegration

        drop = WarmIntegration(model, plan, start, peak)
    else:
        drop = Integration(model, plan, start, peak)
    for first, last in _cuts(levitated, len(time), longest):
        state, held = np.empty((last - first, len(start))), min(max(levitated - first, 0), last - first)
        fill_levitated(whirl[None], since[first : first + held], start[None], state[None])
        drop.through(since[first + held : last], state[held:])
        warmth = None if isinstance(drop, Integration) or last < len(time) else drop.warmth(levitated)
        yield Trajectory(model, plan, time[first:last], state, peak.copy(), whirl, warmth)


def _cuts(levitated: int, count: int, longest: int) -> Iterator[tuple[int, int]]:
    """Yield start and end of pieces of at most `longest` samples; only a single piece for all extends over the release."""
    if count <= longest:
        return iter([(0, count)])
    return pairwise([*range(0, levitated, longest), *range(levitated, count, longest), count])


def check_memory(model: DropModel, plan: DropPlan, times: float = 1.0) -> None:
    """Raise InputError where `times` the size of a drop's states exceeds the computer's memory."""
    needed = 8.0 * times * _samples(plan) * state_layout.size(model.n)
    memory = _memory()
    if needed > memory:
        raise InputError(
            f"{plan.levitated + plan.seconds:g} s at {plan.sampling:g} Hz are {_samples(plan):.3g} samples, which need"
            f" {needed / 1e9:.3g} GB; this computer has {memory / 1e9:.3g} GB: simulate shorter, or sample more slowly"
        )


def _memory() -> float:
    """Return the computer's memory, bytes; infinite where unknown."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        return math.inf


def _samples(plan: DropPlan) -> int:
    return 1 + math.floor((plan.levitated + plan.seconds) * plan.sampling + 1e-9)


def instants(plan: DropPlan) -> Array:
    """Return the instants of a drop's record, s, from the first sample."""
    return np.arange(_samples(plan)) / plan.sampling


def before_release(plan: DropPlan, time: Array) -> int:
    """Return the number of instants of a drop's record before the release."""
    return int(np.searchsorted(time, plan.levitated - 1e-12))


def initial_state(model: DropModel, plan: DropPlan) -> Array:
    """Return the state at the release; the model's angles, set-point and magnetic forces are set according to the plan."""
    return _begin(model, plan)[0]


def _begin(model: DropModel, plan: DropPlan) -> tuple[Array, Whirl]:
    """Return the state at the release, and the whirl before it at shaft angle zero."""
    start, whirl, (fault,) = begin(alone(model), [model], [plan])
    if fault is not None:
        raise fault
    return start[0], whirl[0]
