"""Parameters of the calibration, their bounds and priors, and models at their values.

A value of the machine file is fitted where it has a tolerance, and within it.  The tolerance is taken as two prior standard
deviations either way.  The unbalance of a plane is fitted as a vector, along and across its nominal phase.

Other parameters are in no machine file: the bearings' centres as seen by the probes, and the per-drop parameters
(`drop_parameters`), above all the state at the release.  Still others are stated without tolerance although they are not known
exactly: stiffnesses and masses from catalogues, the law of the contact (`stated_parameters`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tdbsim.columns import (
    BALL_DAMPING,
    BALL_STIFFNESS,
    CONTACT_DAMPING,
    CONTACT_POWER,
    CONTACT_STIFFNESS,
    DECAY_RATE,
    FRICTION,
    FRICTION_POWER,
    GAP,
    HALF_CLEARANCE,
    MAGNET_DAMPING,
    MAGNET_STIFFNESS,
    RING_DRAG,
    RING_MASS,
    SUPPORT_DAMPING,
    SUPPORT_MASS,
    SUPPORT_XX,
    SUPPORT_YY,
)
from tdbsim.drop_model import DropModel
from tdbsim.machine import Machine, Tolerant, TouchdownBearing, Unbalance
from tdbsim.modes import Modes
from tdbsim.power_law import scaled_stiffness

from tdbmon.estimate import OUTSIDE

Array = NDArray[np.float64]

_CENTRE_SIGMA = 10e-6  # m; distance of the bearing's centre from the probes' zero
ZERO_SIGMA = 1e-6  # m; drift of a probe's zero from drop to drop
# m, each component of the 1X and 2X runout of a good surface; API 670 (5th ed., 6.1.2) allows a probe track 6 um pk-pk, and
# more is not calibrated but an effect of its own
_RUNOUT_SIGMA = (1.5e-6, 0.75e-6)
_RUNOUT_LIMIT = 3e-6
_VELOCITY_SIGMA = 0.5e-3  # m/s, of the release velocity in excess of the levitated whirl
_RELEASE_SIGMA = 2e-3  # s, of the first guess of the instant

# field of a touchdown bearing: its columns in the model, factor to these, unit of output
_END = {
    "radial_gap": ((GAP,), 1.0, "um"),
    "support_stiffness": ((SUPPORT_XX, SUPPORT_YY), 1.0, "N/m"),
    "support_damping": ((SUPPORT_DAMPING,), 1.0, "N s/m"),
    "ball_damping": ((BALL_DAMPING,), 1.0, "N s/m"),
    "diametral_clearance": ((HALF_CLEARANCE,), 0.5, "um"),
    "inner_ring_drag": ((RING_DRAG,), 1.0, "N m"),
    "friction": ((FRICTION,), 1.0, "1"),
    "contact_damping": ((CONTACT_DAMPING,), 1.0, "s/m"),
}
# fields stated without tolerance: column, unit of output, relative standard deviation
_STATED = {
    "contact_stiffness": (CONTACT_STIFFNESS, "N/m^(10/9)", 0.08),
    "ball_stiffness": (BALL_STIFFNESS, "N/m^1.5", 0.03),
    "inner_ring_mass": (RING_MASS, "kg", 0.02),
    "support_mass": (SUPPORT_MASS, "kg", 0.02),
}
_AS_STATED = (*_STATED, "contact_exponent", "friction_load_exponent")
_EXPONENT_SIGMA = 0.04  # line contact has 10/9; edges and misalignment raise it
_LOAD_SIGMA = 0.04  # of the exponent by which friction falls with load: 0 to 0.1 for most metal pairs
_MODULUS_SHARE = 0.004
_WIDTH = 3.0  # bounds of stated values, in standard deviations
_RESTATED = 0.5  # relative tolerance of a restated value: wide enough that the prior hardly matters
EDGE = 1e-6  # of a parameter's scale: a value this near a bound is at it
_MAGNET = {"stiffness": (MAGNET_STIFFNESS, "N/m"), "damping": (MAGNET_DAMPING, "N s/m")}


@dataclass(frozen=True)
class Parameter:
    """A free parameter of the calibration (SI).

    Attributes
    ----------
    name : str
        ``"NDE.friction"``, ``"impeller.along"``, ``"NDE.centre_x"``, ``"set_point_x_0"`` ...
    unit : str
        Of output, a key of `tdbmon.estimate.OUTSIDE`.
    nominal : float
        Starting value.
    low, high : float
        Bounds.
    sigma : float
        Prior standard deviation; infinite without a prior.
    moves : bool
        Whether it affects the motion; sensor parameters affect the readings only.
    nudge : float
        Step of the difference quotients, in units of `scale`: it should move the shaft by some hundredths of a micrometre.
        Paths are nonlinear after contacts, so larger steps give derivatives that lead into wrong minima; the fixed time step
        makes a trajectory rough by some nanometres, which would dominate the differences of much smaller ones.
    span : float
        Scale where sigma is infinite; 0 for a quarter of the range.
    """

    name: str
    unit: str
    _: KW_ONLY
    nominal: float
    low: float
    high: float
    sigma: float
    moves: bool = True
    nudge: float = 0.0015
    span: float = 0.0

    @property
    def scale(self) -> float:
        """Unit of its coordinate: sigma, or else span."""
        return self.sigma if math.isfinite(self.sigma) else self.span or (self.high - self.low) / 4

    @property
    def least(self) -> float:
        """Lower end of its interval: zero for a value whose bounds exclude negative ones."""
        return 0.0 if self.low >= 0 else -math.inf

    def at_bound(self, value: float) -> bool:
        """Return whether a value (SI) is at a bound."""
        return min(value - self.low, self.high - value) < EDGE * self.scale

    def instead(self, value: float, *stated: float) -> str:
        """Return a value in words, with what the machine file states instead: a number or a range."""
        told, *allowed = (f"{OUTSIDE[self.unit] * each:.4g}" for each in (value, *stated))
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"{self.name} {told} instead of {' to '.join(allowed)}{unit}"


def machine_parameters(machine: Machine) -> tuple[Parameter, ...]:
    """Return the parameters of a machine that have a tolerance."""
    found = []
    for bearing in machine.touchdown_bearings:
        for field, (_, _, unit) in _END.items():
            found += _tolerated(f"{bearing.name}.{field}", unit, _end_value(bearing, field))
    for magnet in machine.magnetic_bearings:
        for field, (_, unit) in _MAGNET.items():
            found += _tolerated(f"magnet {magnet.name}.{field}", unit, getattr(magnet, field))
    for plane in machine.rotor.unbalance:
        found += _unbalance(plane)
    if machine.rotor.speed_decay_time is not None:
        found += _tolerated("rotor.speed_decay_time", "s", machine.rotor.speed_decay_time)
    return tuple(found)


def stated_parameters(machine: Machine) -> tuple[Parameter, ...]:
    """Return the parameters that a machine file states without tolerance although they are not known exactly."""
    found = []
    for bearing in machine.touchdown_bearings:
        for field, (_, unit, share) in _STATED.items():
            found.append(_about(f"{bearing.name}.{field}", unit, _stated_value(bearing, field), share))
        exponent, reach = bearing.contact_exponent, _WIDTH * _EXPONENT_SIGMA
        low, high = min(max(1.0, exponent - reach), exponent), exponent + reach
        name = f"{bearing.name}.contact_exponent"
        found.append(Parameter(name, "1", nominal=exponent, low=low, high=high, sigma=_EXPONENT_SIGMA))
        falls, reach = bearing.friction_load_exponent, _WIDTH * _LOAD_SIGMA
        name = f"{bearing.name}.friction_load_exponent"
        found.append(Parameter(name, "1", nominal=falls, low=falls - reach, high=falls + reach, sigma=_LOAD_SIGMA))
    found.append(_about("rotor.elastic_modulus", "GPa", machine.rotor.elastic_modulus, _MODULUS_SHARE))
    return tuple(found)


def file_values(machine: Machine) -> dict[str, Tolerant]:
    """Return the values in a machine file (SI) by their names in a calibration; without sensor parameters, which no file has."""
    found = {p.name: Tolerant(nominal=p.nominal, low=p.low, high=p.high) for p in machine_parameters(machine)}
    found |= {p.name: Tolerant(nominal=p.nominal, low=p.nominal, high=p.nominal) for p in stated_parameters(machine)}
    for plane in machine.rotor.unbalance:
        found |= {f"{plane.name}.amount": plane.amount, f"{plane.name}.phase": plane.phase}
    return found


def entries(machine: Machine) -> tuple[Parameter, ...]:
    """Return a machine file's entries for bearings, magnets and rotor, with a tolerance or without.

    Without those that the catalogue of effects covers (a ring's drag, unbalance), that are poorly known anyway (ball damping),
    or that are not wrong by a factor (exponents).
    """
    found = []
    for bearing in machine.touchdown_bearings:
        for field, (_, _, unit) in _END.items():
            if field not in ("inner_ring_drag", "ball_damping"):
                found.append(_within(f"{bearing.name}.{field}", unit, _end_value(bearing, field)))
        for field, (_, unit, _) in _STATED.items():
            found.append(_about(f"{bearing.name}.{field}", unit, _stated_value(bearing, field), 0.0))
    for magnet in machine.magnetic_bearings:
        for field, (_, unit) in _MAGNET.items():
            found.append(_within(f"magnet {magnet.name}.{field}", unit, getattr(magnet, field)))
    found.append(_about("rotor.elastic_modulus", "GPa", machine.rotor.elastic_modulus, 0.0))
    if machine.rotor.speed_decay_time is not None:
        found.append(_within("rotor.speed_decay_time", "s", machine.rotor.speed_decay_time))
    return tuple(found)


def sensor_parameters(machine: Machine) -> tuple[Parameter, ...]:
    """Return the shared sensor parameters: the bearings' centres as seen by the probes."""
    return tuple(
        _about_zero(f"{end}.centre_{axis}", "um", 5 * _CENTRE_SIGMA, _CENTRE_SIGMA, moves=False)
        for end in machine.ends
        for axis in "xy"
    )


def drop_parameters(machine: Machine, set_point: Array, angle: float, angle_sigma: float) -> tuple[Parameter, ...]:
    """Return the per-drop parameters.

    Parameters
    ----------
    machine : Machine
    set_point : (2, 2) array
        First guess of each end's levitated mean position (x, y), m.
    angle, angle_sigma : float
        First guess of the shaft's angle at the release and its standard deviation, rad; infinite where unknown.
    """
    found = []
    for end, bearing in enumerate(machine.touchdown_bearings):
        reach = bearing.radial_gap.nominal
        for axis, start in zip("xy", set_point[end], strict=True):
            name, first = f"set_point_{axis}_{end}", float(start)
            found.append(Parameter(name, "um", nominal=first, low=-reach, high=reach, sigma=math.inf, nudge=0.00025))
    found += [
        _about_zero(f"velocity_{axis}_{end}", "mm/s", 10 * _VELOCITY_SIGMA, _VELOCITY_SIGMA, nudge=0.008)
        for end in range(2)
        for axis in "xy"
    ]
    found.append(_about_zero("release", "s", 3 * _RELEASE_SIGMA, _RELEASE_SIGMA, nudge=0.0002))
    width = min(5 * angle_sigma, math.pi)
    found.append(
        Parameter("shaft_angle", "deg", nominal=angle, low=angle - width, high=angle + width, sigma=angle_sigma)
    )
    for end, bearing in enumerate(machine.touchdown_bearings):
        # periodic in the ball spacing, which is two scales
        found.append(_about_zero(f"cage_{end}", "deg", math.inf, math.inf, span=math.pi / bearing.balls.count))
    # the rotor's axial position may differ from drop to drop, and with it the track under the probes
    found += [
        _about_zero(f"{end}.runout_{part}_{k}", "um", _RUNOUT_LIMIT, sigma, moves=False)
        for end in machine.ends
        for k, sigma in enumerate(_RUNOUT_SIGMA, start=1)
        for part in ("cosine", "sine")
    ]
    zeros = (
        _about_zero(f"zero_{each.name}", "um", 10 * ZERO_SIGMA, ZERO_SIGMA, moves=False) for each in machine.probes
    )
    return (*found, *zeros)


def restated_machine(machine: Machine, values: Mapping[str, float]) -> Machine:
    """Return the machine with values (SI) of `entries` instead of those in its file, with wide tolerances.

    Entries that a file states without tolerance, such as the stiffness of a contact, get none.
    """
    return calibrated_machine(machine, values, _restated)


def calibrated_machine(
    machine: Machine, values: Mapping[str, float], moved: Callable[[Tolerant, float], Tolerant] | None = None
) -> Machine:
    """Return the machine with values (SI) of `machine_parameters` as its nominal ones; the tolerances stay.

    Values of sensors and drops are ignored.  To change tolerances too, `moved` returns the new from the old toleranced value and
    the new nominal.
    """
    moved = moved or _with_nominal
    bearings = []
    for bearing in machine.touchdown_bearings:
        new = {f: values[f"{bearing.name}.{f}"] for f in _END if f"{bearing.name}.{f}" in values}
        clearance = new.pop("diametral_clearance", None)
        update: dict[str, Any] = {f: moved(getattr(bearing, f), value) for f, value in new.items()}
        if clearance is not None:
            wider = moved(bearing.balls.diametral_clearance, clearance)
            update["balls"] = bearing.balls.model_copy(update={"diametral_clearance": wider})
        stated = {f: values[f"{bearing.name}.{f}"] for f in _AS_STATED if f"{bearing.name}.{f}" in values}
        if (stiffness := stated.pop("ball_stiffness", None)) is not None:
            balls = update.get("balls", bearing.balls)
            update["balls"] = balls.model_copy(update={"stated_stiffness": stiffness})
        bearings.append(bearing.model_copy(update=update | stated))
    magnets = []
    for magnet in machine.magnetic_bearings:
        held = {f: values[f"magnet {magnet.name}.{f}"] for f in _MAGNET if f"magnet {magnet.name}.{f}" in values}
        magnets.append(magnet.model_copy(update={f: moved(getattr(magnet, f), v) for f, v in held.items()}))
    rotor: dict[str, Any] = {"unbalance": tuple(_with_vector(plane, values) for plane in machine.rotor.unbalance)}
    if machine.rotor.speed_decay_time is not None and "rotor.speed_decay_time" in values:
        rotor["speed_decay_time"] = moved(machine.rotor.speed_decay_time, values["rotor.speed_decay_time"])
    if "rotor.elastic_modulus" in values:
        rotor["elastic_modulus"] = values["rotor.elastic_modulus"]
    return machine.model_copy(
        update={
            "touchdown_bearings": tuple(bearings),
            "magnetic_bearings": tuple(magnets),
            "rotor": machine.rotor.model_copy(update=rotor),
        }
    )


def with_values(model: DropModel, values: Mapping[str, float]) -> DropModel:
    """Return a copy of a model without effects at values of `machine_parameters`; the rotor's modes stay.

    Equal to `build_model` of `calibrated_machine`, but without rebuilding the rotor.
    """
    machine = model.machine
    changed = model.copy()
    arrays = changed.arrays
    for row, bearing in zip(arrays.end, machine.touchdown_bearings, strict=True):
        for field, (columns, factor, _) in _END.items():
            value = values.get(f"{bearing.name}.{field}")
            if value is not None:
                for column in columns:
                    row[column] = factor * value
        for field, (column, *_) in _STATED.items():
            row[column] = values.get(f"{bearing.name}.{field}", row[column])
        row[FRICTION_POWER] = values.get(f"{bearing.name}.friction_load_exponent", row[FRICTION_POWER])
        exponent = values.get(f"{bearing.name}.contact_exponent", bearing.contact_exponent)
        stiffness = values.get(f"{bearing.name}.contact_stiffness", bearing.contact_stiffness)
        row[CONTACT_STIFFNESS], row[CONTACT_POWER] = scaled_stiffness(stiffness, exponent), exponent - 1
    for row, held in zip(arrays.magnet, machine.magnetic_bearings, strict=True):
        for field, (column, _) in _MAGNET.items():
            row[column] = values.get(f"magnet {held.name}.{field}", row[column])
    if "rotor.elastic_modulus" in values:  # the shear modulus scales with it, hence the whole stiffness of the shaft
        stiffer = values["rotor.elastic_modulus"] / machine.rotor.elastic_modulus
        arrays.square[:] *= stiffer
        arrays.damping[:] *= math.sqrt(stiffer)
    if "rotor.speed_decay_time" in values:
        arrays.spin[DECAY_RATE] = 1 / values["rotor.speed_decay_time"]
    for plane in machine.rotor.unbalance:
        if f"{plane.name}.along" in values or f"{plane.name}.across" in values:
            change = _vector(plane, values) - plane.amount.nominal * np.exp(1j * plane.phase.nominal)
            shape = _shape(model.modes, plane.position)
            arrays.unbalance[0] += change.real * shape
            arrays.unbalance[1] += change.imag * shape
    return changed


def polar(plane: Unbalance, along: float, across: float) -> tuple[float, float]:
    """Return amount, kg m, and phase, rad, of an unbalance from its components along and across the nominal phase."""
    return math.hypot(along, across), plane.phase.nominal + math.atan2(across, along)


def _with_nominal(value: Tolerant, nominal: float) -> Tolerant:
    """Return a toleranced value with another nominal, the tolerance extended to include it."""
    return Tolerant(nominal=nominal, low=min(value.low, nominal), high=max(value.high, nominal))


def _restated(_: Tolerant, nominal: float) -> Tolerant:
    return Tolerant(nominal=nominal, low=(1 - _RESTATED) * nominal, high=(1 + _RESTATED) * nominal)


def _end_value(bearing: TouchdownBearing, field: str) -> Tolerant:
    value: Tolerant = getattr(bearing.balls if field == "diametral_clearance" else bearing, field)
    return value


def _stated_value(bearing: TouchdownBearing, field: str) -> float:
    return float(getattr(bearing, field))


def _about_zero(name: str, unit: str, reach: float, sigma: float, **further: Any) -> Parameter:
    """Return a parameter that starts at zero, with symmetric bounds."""
    return Parameter(name, unit, nominal=0.0, low=-reach, high=reach, sigma=sigma, **further)


def _about(name: str, unit: str, value: float, share: float) -> Parameter:
    low, high = value * (1 - _WIDTH * share), value * (1 + _WIDTH * share)
    return Parameter(name, unit, nominal=value, low=low, high=high, sigma=value * share)


def _tolerated(name: str, unit: str, value: Tolerant) -> list[Parameter]:
    if value.is_exact:
        return []
    return [_within(name, unit, value)]


def _within(name: str, unit: str, value: Tolerant) -> Parameter:
    sigma = (value.high - value.low) / 4
    return Parameter(name, unit, nominal=value.nominal, low=value.low, high=value.high, sigma=sigma)


def _unbalance(plane: Unbalance) -> list[Parameter]:
    amount, turn = plane.amount, (plane.phase.high - plane.phase.low) / 2
    if amount.high == 0 or (amount.is_exact and turn == 0):
        return []
    if turn > math.pi / 2:
        return _unbalance_of_wide_phase(plane, min(turn, math.pi))
    width = turn
    lowest = min(amount.low * math.cos(width), amount.low)
    across = max(amount.high * math.sin(width), 1e-3 * amount.high)
    spread = max((amount.high - amount.low) / 4, amount.nominal * (1 - math.cos(width / 2)), 1e-6 * amount.high)
    return [
        Parameter(f"{plane.name}.along", "g mm", nominal=amount.nominal, low=lowest, high=amount.high, sigma=spread),
        Parameter(f"{plane.name}.across", "g mm", nominal=0.0, low=-across, high=across, sigma=across / 2),
    ]


def _unbalance_of_wide_phase(plane: Unbalance, turn: float) -> list[Parameter]:
    """Return the components of an unbalance whose phase is unknown or has a tolerance of more than a right angle either way.

    Their prior means and standard deviations are those of a phase uniformly distributed over the tolerance.
    """
    amount = plane.amount
    along, double = math.sin(turn) / turn, math.sin(2 * turn) / (4 * turn)
    size = math.hypot(amount.nominal, (amount.high - amount.low) / 4)
    most, sigma = amount.high, (size * math.sqrt(0.5 + double - along**2), size * math.sqrt(0.5 - double))
    name, mean = plane.name, amount.nominal * along
    return [
        Parameter(f"{name}.along", "g mm", nominal=mean, low=most * math.cos(turn), high=most, sigma=sigma[0]),
        Parameter(f"{name}.across", "g mm", nominal=0.0, low=-most, high=most, sigma=sigma[1]),
    ]


def _vector(plane: Unbalance, values: Mapping[str, float]) -> complex:
    along = values.get(f"{plane.name}.along", plane.amount.nominal)
    return complex(along, values.get(f"{plane.name}.across", 0.0)) * complex(np.exp(1j * plane.phase.nominal))


@lru_cache(maxsize=16)
def _shape(modes: Modes, position: float) -> Array:
    return modes.at(position)


def _with_vector(plane: Unbalance, values: Mapping[str, float]) -> Unbalance:
    if f"{plane.name}.along" not in values and f"{plane.name}.across" not in values:
        return plane
    along = values.get(f"{plane.name}.along", plane.amount.nominal)
    amount, phase = polar(plane, along, values.get(f"{plane.name}.across", 0.0))
    return plane.model_copy(
        update={"amount": _with_nominal(plane.amount, amount), "phase": _with_nominal(plane.phase, phase)}
    )
