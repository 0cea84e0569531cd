"""The machine as arrays for the kernels: one flat set, built once per run, cheap to change.

Axes: x right, y up; the two planes share the rotor's modes.  Deflections count from the bearing's centre before the drop, so the
static deflection of the supports by their own weight is included; the weight of rotor and inner rings acts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tdbsim import hooks
from tdbsim.ball_motion import ball_motion
from tdbsim.columns import (
    BALL_COUNT,
    BALL_DAMPING,
    BALL_STIFFNESS,
    CAGE_RATIO,
    CONTACT_DAMPING,
    CONTACT_POWER,
    CONTACT_STIFFNESS,
    DECAY_RATE,
    END_COLUMNS,
    FRICTION,
    FRICTION_LOAD,
    FRICTION_POWER,
    GAP,
    GRAVITY,
    HALF_CLEARANCE,
    HAS_HOLDING,
    HAS_SLIP_LAW,
    HAS_SPRING,
    HAS_WINDAGE,
    INERTIA,
    JOURNAL_RADIUS,
    MAGNET_COLUMNS,
    MAGNET_DAMPING,
    MAGNET_STIFFNESS,
    RING_DRAG,
    RING_INERTIA,
    RING_MASS,
    ROTOR_ROW,
    SHAPE_REACH,
    SPIN_COLUMNS,
    SUPPORT_DAMPING,
    SUPPORT_MASS,
    SUPPORT_XX,
    SUPPORT_XY,
    SUPPORT_YY,
    WAVES_REACH,
)
from tdbsim.effect import Effect, declaration
from tdbsim.errors import InputError
from tdbsim.machine import STANDARD_GRAVITY, Machine, TouchdownBearing
from tdbsim.modes import Modes, free_free
from tdbsim.power_law import scaled_stiffness
from tdbsim.rotor import build_rotor, end_mass
from tdbsim.stated_effects import all_effects

Array = NDArray[np.float64]

# modes per plane: with four the error of the first peak force is an eighth on rotors of 4 and 24 kg, 2 % on one of 1500 kg
BENDING = 16
_REACHES = {"gap": SHAPE_REACH, "bore": SHAPE_REACH, "ball": WAVES_REACH}
_FLAGS = {"support": HAS_SPRING, "friction": HAS_SLIP_LAW}
_SPIN_FLAGS = {"windage": HAS_WINDAGE, "holding": HAS_HOLDING}


class Arrays(NamedTuple):
    """All arrays of a run; n modes per plane, m magnetic bearings, b balls at most.

    ``square`` (n,) angular frequencies squared; ``damping`` (n,) 1/s; ``gyro`` (n, n); ``at_end`` (2, n) shapes at the
    touchdown bearings; ``weight`` (n,) modal weight along y; ``unbalance`` (2, n) modal unbalance, cosine and sine
    part; ``bow`` (2, n) modal bow, likewise; ``circulatory`` (n, n) cross-coupling, F_x = -C b, F_y = C a;
    ``at_magnet`` (m, n); ``magnet``, ``spin``, ``end`` columns as in `tdbsim.columns`; ``ball_cosine``, ``ball_sine``,
    ``ball_oversize`` (2, b); ``effect`` (3, k) coefficients of the effects' hooks for the ends and the rotor.
    """

    square: Array
    damping: Array
    gyro: Array
    at_end: Array
    weight: Array
    unbalance: Array
    bow: Array
    circulatory: Array
    at_magnet: Array
    magnet: Array
    spin: Array
    end: Array
    ball_cosine: Array
    ball_sine: Array
    ball_oversize: Array
    effect: Array


@dataclass(frozen=True, eq=False)
class Draft:
    """A model under construction, whose arrays effects change in place."""

    machine: Machine
    modes: Modes
    arrays: Arrays


@dataclass(frozen=True, eq=False)
class DropModel:
    """A machine with its effects, ready for simulation.

    Attributes
    ----------
    machine : Machine
    modes : Modes
        Of one plane, with attachment modes at the touchdown bearings.
    arrays : Arrays
        Input of the kernels.
    effects : tuple of Effect
        Those of the machine and added ones.
    """

    machine: Machine
    modes: Modes
    arrays: Arrays
    effects: tuple[Effect, ...]

    @property
    def n(self) -> int:
        """Number of modes per plane."""
        return self.modes.n

    def copy(self) -> DropModel:
        """Return a model with copied arrays, which may be changed independently."""
        return DropModel(self.machine, self.modes, Arrays(*(array.copy() for array in self.arrays)), self.effects)


def build_model(
    machine: Machine, effects: Sequence[Effect] = (), bending: int = BENDING, attachment: bool = True
) -> DropModel:
    """Turn a machine and effects into the arrays of a run.

    Parameters
    ----------
    machine : Machine
        At its nominal values, with its own effects.
    effects : sequence of Effect
        Additional effects.
    bending : int
        Free-free bending modes kept in each plane.
    attachment : bool
        Whether attachment modes add the local compliance at the touchdown bearings.

    Raises
    ------
    InputError
        If an effect does not fit the machine, the values of the machine are impossible, its centre of mass lies beyond the
        touchdown bearings, or the rotor has fewer modes than requested.
    """
    check_count("bending", bending, "bending modes")
    applied = all_effects(machine, effects)
    modes = _modes(machine, bending, attachment)
    end_mass(machine, modes.model)  # refuses a centre of mass beyond the touchdown bearings
    return _with(machine, modes, _arrays(machine, modes), applied)


def check_count(name: str, value: object, what: str) -> None:
    """Raise InputError where an argument is not a non-negative integer."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 0:
        raise InputError(f"{value!r} {what}: impossible; give {name} as a whole number, 0 or more")


def with_effects(model: DropModel, effects: Sequence[Effect]) -> DropModel:
    """Return a model without effects, with effects added: equal to `build_model`, but without rebuilding the rotor.

    Raises
    ------
    InputError
        As `build_model`; or if the model already has effects, which may have changed its values.
    """
    if model.effects:
        raise InputError("the model already has effects; build it again with all of them")
    return _with(model.machine, model.modes, model.copy().arrays, all_effects(model.machine, effects))


def _with(machine: Machine, modes: Modes, arrays: Arrays, effects: tuple[Effect, ...]) -> DropModel:
    draft = Draft(machine, modes, arrays)
    for effect in effects:
        effect.modify(draft)
    start = hooks.offsets() if effects else {}
    for effect in effects:  # coefficients depend on the values after all modifications, whatever the order
        if effect.slots and not effect.is_off:
            _fill_slots(draft, effect, start[effect.identifier()])
    for row, bearing in zip(arrays.end, machine.touchdown_bearings, strict=True):
        _check_end(row, bearing)
    return DropModel(machine, modes, arrays, effects)


def _fill_slots(draft: Draft, effect: Effect, start: int) -> None:
    module = declaration(effect.identifier()).module
    for end in effect.ends(draft.machine) or (ROTOR_ROW,):
        row, at = draft.arrays.effect[end], start
        if effect.most > 1:
            at += int(row[start - 1]) * effect.slots
            row[start - 1] += 1.0
        row[at : at + effect.slots] = effect.coefficients(draft, end)
        for kind in hooks.HOOKS:
            if hasattr(module, kind):
                if kind in _REACHES:
                    draft.arrays.end[end, _REACHES[kind]] += effect.reach(draft, end)
                elif kind in _FLAGS:
                    draft.arrays.end[end, _FLAGS[kind]] = 1.0
                else:
                    draft.arrays.spin[_SPIN_FLAGS[kind]] = 1.0


def _check_end(row: Array, bearing: TouchdownBearing) -> None:
    name = f"touchdown_bearing '{bearing.name}'"
    if not row[GAP] > 0:
        raise InputError(f"{name}: the radial gap is {row[GAP] * 1e6:g} um; it must be positive for the rotor to turn")
    if math.isfinite(row[SHAPE_REACH]) and row[SHAPE_REACH] >= row[GAP]:
        raise InputError(
            f"{name}: the shape given by effects reaches {row[SHAPE_REACH] * 1e6:g} um inwards and closes the radial gap of"
            f" {row[GAP] * 1e6:g} um; make the effects smaller"
        )
    if not row[SUPPORT_XX] * row[SUPPORT_YY] > row[SUPPORT_XY] ** 2:
        raise InputError(f"{name}: the support's stiffness is not positive in every direction")


def _modes(machine: Machine, bending_per_plane: int, attachment: bool) -> Modes:
    # only what the modes depend on, so that they are found again when calibration changes anything else
    rotor = machine.rotor
    stripped = (
        rotor.sections, rotor.disks, rotor.elastic_modulus, rotor.density, rotor.poisson_ratio, rotor.modal_damping_ratio,
        tuple(plane.position for plane in rotor.unbalance),
        tuple(magnet.position for magnet in machine.magnetic_bearings),
        tuple(bearing.position for bearing in machine.touchdown_bearings),
        tuple(probe.position for probe in machine.probes),
    )  # fmt: skip
    return _cached_modes(_Shaft(machine, stripped), bending_per_plane, attachment)


@dataclass(frozen=True)
class _Shaft:
    """A machine that compares equal to any with the same shaft, as key of the cached modes."""

    machine: Machine
    key: tuple[object, ...]

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Shaft) and self.key == other.key


@lru_cache(maxsize=16)
def _cached_modes(shaft: _Shaft, bending_per_plane: int, attachment: bool) -> Modes:
    positions = [bearing.position for bearing in shaft.machine.touchdown_bearings] if attachment else []
    return free_free(build_rotor(shaft.machine), bending_per_plane, positions)


def _arrays(machine: Machine, modes: Modes) -> Arrays:
    n = modes.n
    rotor = modes.model
    at_end = np.atleast_2d(modes.at(np.array([bearing.position for bearing in machine.touchdown_bearings])))
    unbalance = np.zeros((2, n))
    for plane in machine.rotor.unbalance:
        shape, amount, phase = modes.at(plane.position), plane.amount.nominal, plane.phase.nominal
        unbalance[0] += shape * amount * math.cos(phase)
        unbalance[1] += shape * amount * math.sin(phase)
    translation = np.tile([1.0, 0.0], len(rotor.nodes))
    weight = -machine.gravity * (modes.vectors.T @ (rotor.plane_mass @ translation))
    rotor_weight = STANDARD_GRAVITY * rotor.total_mass
    magnets = machine.magnetic_bearings
    at_magnet = np.array([modes.at(magnet.position) for magnet in magnets]).reshape(len(magnets), n)
    magnet = np.zeros((len(magnets), MAGNET_COLUMNS))
    for row, each in zip(magnet, magnets, strict=True):
        row[MAGNET_STIFFNESS], row[MAGNET_DAMPING] = each.stiffness.nominal, each.damping.nominal
    spin = np.zeros(SPIN_COLUMNS)
    decay = machine.rotor.speed_decay_time
    spin[INERTIA], spin[GRAVITY] = rotor.polar_inertia, machine.gravity
    spin[DECAY_RATE] = 0.0 if decay is None else 1 / _positive(decay.nominal, "speed_decay_time", "s")
    most = max(bearing.balls.count for bearing in machine.touchdown_bearings)
    cosine, sine = np.zeros((2, 2, most))
    for end, bearing in enumerate(machine.touchdown_bearings):
        azimuth = 2 * math.pi * np.arange(bearing.balls.count) / bearing.balls.count
        cosine[end, : bearing.balls.count], sine[end, : bearing.balls.count] = np.cos(azimuth), np.sin(azimuth)
    return Arrays(
        square=(2 * math.pi * modes.frequencies) ** 2,
        damping=np.array(modes.damping),
        gyro=np.ascontiguousarray((modes.gyro + modes.gyro.T) / 2),
        at_end=np.ascontiguousarray(at_end),
        weight=weight,
        unbalance=unbalance,
        bow=np.zeros((2, n)),
        circulatory=np.zeros((n, n)),
        at_magnet=at_magnet,
        magnet=magnet,
        spin=spin,
        end=np.array([_end_row(bearing, rotor_weight) for bearing in machine.touchdown_bearings]),
        ball_cosine=cosine,
        ball_sine=sine,
        ball_oversize=np.zeros((2, most)),
        effect=np.zeros((3, hooks.row_length())),
    )


def _end_row(bearing: TouchdownBearing, rotor_weight: float) -> Array:
    row = np.zeros(END_COLUMNS)
    row[GAP] = bearing.radial_gap.nominal
    row[JOURNAL_RADIUS] = bearing.journal_radius
    row[CONTACT_STIFFNESS] = scaled_stiffness(bearing.contact_stiffness, bearing.contact_exponent)
    row[CONTACT_POWER] = bearing.contact_exponent - 1
    row[CONTACT_DAMPING] = bearing.contact_damping.nominal
    row[FRICTION] = bearing.friction.nominal
    row[FRICTION_POWER], row[FRICTION_LOAD] = bearing.friction_load_exponent, rotor_weight
    row[RING_MASS] = bearing.inner_ring_mass
    row[RING_INERTIA] = bearing.inner_ring_inertia
    row[RING_DRAG] = bearing.inner_ring_drag.nominal
    row[BALL_COUNT] = bearing.balls.count
    row[BALL_STIFFNESS] = bearing.ball_stiffness
    row[HALF_CLEARANCE] = bearing.balls.diametral_clearance.nominal / 2
    row[BALL_DAMPING] = bearing.ball_damping.nominal
    row[CAGE_RATIO] = ball_motion(bearing.geometry).cage
    row[SUPPORT_MASS] = bearing.support_mass
    row[SUPPORT_XX] = row[SUPPORT_YY] = bearing.support_stiffness.nominal
    row[SUPPORT_DAMPING] = bearing.support_damping.nominal
    return row


def _positive(value: float, name: str, unit: str) -> float:
    if not value > 0:
        raise InputError(f"{name} {value:g} {unit} is not positive")
    return value
