"""Plausibility checks of a machine file: impossible values are mostly units wrong by a power of ten."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tdbsim.errors import InputError
from tdbsim.power_law import static_depth

if TYPE_CHECKING:
    from tdbsim.machine import Machine, MagneticBearing, Rotor, Tolerant, TouchdownBearing

_STRONGEST_GRAVITY = 25.0  # m/s^2; a centrifuge holds no magnetic bearing
# m/s^2 across the shaft: one within some 6 deg of vertical does not fall onto its touchdown bearings
_LEAST_GRAVITY = 1.0
_MAINS = 16.0, 400.0  # Hz: railways to aircraft
_SMALLEST_JOURNAL = 0.2  # of the pitch radius: no sleeve in the inner ring is thicker
_LEAST_FILLED = 0.2  # of the pitch circle, filled with balls
# factor by which the ring's radius of gyration may be below the journal's radius or above the pitch radius
_RING_WIDTH = 2.0
_THINNEST, _THICKEST = 1e-3, 5.0  # m: from a dental spindle to the largest generators
_LONGEST = 30.0  # m, of one section
_FASTEST_STOP = 1e-3  # s
_FLAT = 0.99  # allows for rounding in drawings: the polar inertia is at most twice the diametral one, as of a thin disc
_LOWEST_BALL = 4.37  # load of the lowest ball over the mean load per ball, without clearance (R. Stribeck)


def check_plausible(machine: Machine) -> None:
    """Check the values of a machine against each other and against the ranges of real materials and bearings.

    Raises
    ------
    InputError
        With the value that cannot be right, and its unit.
    """
    if machine.gravity > _STRONGEST_GRAVITY:
        raise InputError(f"gravity {machine.gravity:g} m/s^2 is impossible on earth (9.81 m/s^2); check its unit")
    if machine.gravity < 0:
        raise InputError(f"gravity {machine.gravity:g} m/s^2: it already points down (-y); give it without the minus")
    if machine.gravity < _LEAST_GRAVITY:
        raise InputError(
            f"gravity {machine.gravity:g} m/s^2: an upright shaft does not fall onto its touchdown bearings, but the analysis of"
            " a drop needs that fall; only horizontal shafts are covered (inclined ones by 9.81 m/s^2 times the cosine of the"
            " inclination). For the run-down alone, which needs no fall, leave out gravity and all [[probe]] tables"
        )
    lowest, highest = _MAINS
    if not lowest <= machine.mains <= highest:
        raise InputError(
            f"mains {machine.mains:g} Hz is no mains frequency ({lowest:g} to {highest:g} Hz); give 50 Hz or 60 Hz"
        )
    _check_rotor(machine.rotor)
    _check_disks(machine.rotor)
    for magnet in machine.magnetic_bearings:
        _check_magnet(magnet)
    for bearing in machine.touchdown_bearings:
        where = f"touchdown_bearing '{bearing.name}'"
        _check_gap(bearing, where)
        _check_ring(bearing, where)
        _check_signs(bearing, where)
        _check_travel(machine, bearing, where)
        if bearing.heat is not None:
            try:
                bearing.heat.body(bearing)
                bearing.heat.geometry(bearing)
            except InputError as error:
                raise InputError(f"{where}: heat: {error}") from None


def _check_rotor(rotor: Rotor) -> None:
    """Refuse impossible shaft materials: the extremes are carbon fibre, 1600 kg/m^3, and tungsten, 19 300 kg/m^3 and 410 GPa."""
    for name, value, unit, low, high in (
        ("elastic_modulus", rotor.elastic_modulus, "Pa", 1e9, 1e12),
        ("density", rotor.density, "kg/m^3", 1e3, 2.5e4),
    ):
        if not low <= value <= high:
            raise InputError(
                f"[rotor]: {name} {value:g} {unit} is not between {low:g} and {high:g} {unit}; is the unit right?"
            )
    for number, section in enumerate(rotor.sections, start=1):
        diameter, length = section.outer_diameter, section.length
        if not _THINNEST <= diameter <= _THICKEST or length > _LONGEST:
            raise InputError(
                f"[rotor]: section {number} of {diameter:g} m diameter and {length:g} m length is impossible for a shaft; are"
                " the units right? A number without a unit is in m"
            )
    decay = rotor.speed_decay_time
    if decay is not None and decay.low <= 0:
        raise InputError(f"[rotor]: speed_decay_time reaches down to {decay.low:g} s; it must stay positive")
    if decay is not None and decay.nominal < _FASTEST_STOP:
        raise InputError(
            f"[rotor]: speed_decay_time {decay.nominal:g} s: drag in air stops no shaft in less than {_FASTEST_STOP * 1e3:g} ms;"
            " is the unit right?"
        )


def _check_disks(rotor: Rotor) -> None:
    """Refuse inertias impossible for a body of that mass on that shaft."""
    for disk in rotor.disks:
        polar, diametral = disk.polar_inertia, disk.diametral_inertia
        if polar * _FLAT > 2 * diametral:
            raise InputError(
                f"disks '{disk.name}': polar_inertia {polar:g} kg m^2 is more than twice the diametral_inertia"
                f" {diametral:g} kg m^2, which is impossible; a thin disc has twice the diametral one: check both"
            )
        gyration = math.sqrt(max(polar, diametral) / disk.mass)
        if gyration > rotor.length:
            raise InputError(
                f"disks '{disk.name}': inertias of {polar:g} and {diametral:g} kg m^2 give its mass of {disk.mass:g} kg"
                f" a radius of gyration of {gyration:.3g} m, more than the shaft's length ({rotor.length:g} m); are the units"
                " right? A number without a unit is in kg m^2"
            )


def _check_magnet(magnet: MagneticBearing) -> None:
    where = f"magnetic_bearing '{magnet.name}'"
    if magnet.stiffness.low <= 0:
        raise InputError(
            f"{where}: stiffness reaches down to {magnet.stiffness.low:g} N/m; it must stay positive to hold the rotor: give"
            " that of the closed loop"
        )
    if magnet.damping.low < 0:
        raise InputError(f"{where}: damping reaches down to {magnet.damping.low:g} N s/m; it must not be negative")


def _check_gap(bearing: TouchdownBearing, where: str) -> None:
    gap, clearance = bearing.radial_gap, bearing.balls.diametral_clearance
    if gap.low <= 0:
        raise InputError(f"{where}: radial_gap {_um(gap)} is not positive")
    if gap.nominal > 0.1 * bearing.journal_radius:
        raise InputError(
            f"{where}: radial_gap {gap.nominal * 1e6:g} um is more than a tenth of the journal radius"
            f" ({bearing.journal_radius * 1e3:g} mm); check its unit"
        )
    if abs(clearance.nominal) > 2 * gap.nominal:
        raise InputError(
            f"{where}: balls: diametral_clearance {clearance.nominal * 1e6:g} um is more than the diametral air gap"
            f" ({2 * gap.nominal * 1e6:g} um); check its unit"
        )


def _check_ring(bearing: TouchdownBearing, where: str) -> None:
    """Refuse an inner ring that is not between journal and balls, or whose inertia does not fit there."""
    balls, radius = bearing.balls, bearing.journal_radius
    pitch_radius = balls.pitch_diameter / 2
    if not _SMALLEST_JOURNAL * pitch_radius < radius < pitch_radius:
        raise InputError(
            f"{where}: journal_radius {radius * 1e3:g} mm does not go into a bearing whose balls run on a radius of"
            f" {pitch_radius * 1e3:g} mm (half of pitch_diameter); check both units"
        )
    filled = balls.count * balls.diameter / (2 * math.pi * pitch_radius)
    if filled < _LEAST_FILLED:
        raise InputError(
            f"{where}: balls: {balls.count} of {balls.diameter * 1e3:g} mm fill {filled:.2g} of their pitch circle; half or more"
            f" is usual: check diameter and pitch_diameter ({balls.pitch_diameter * 1e3:g} mm)"
        )
    gyration = math.sqrt(bearing.inner_ring_inertia / bearing.inner_ring_mass)
    if not radius / _RING_WIDTH < gyration < pitch_radius * _RING_WIDTH:
        raise InputError(
            f"{where}: inner_ring_inertia {bearing.inner_ring_inertia:g} kg m^2 and inner_ring_mass"
            f" {bearing.inner_ring_mass:g} kg give a radius of gyration of {gyration * 1e3:.3g} mm, but it lies between journal"
            f" ({radius * 1e3:g} mm) and balls ({pitch_radius * 1e3:g} mm); check both units"
        )


def _check_signs(bearing: TouchdownBearing, where: str) -> None:
    for name in (
        "support_stiffness",
        "support_damping",
        "ball_damping",
        "friction",
        "contact_damping",
        "inner_ring_drag",
    ):
        value: Tolerant = getattr(bearing, name)
        if value.low < 0 or (name == "support_stiffness" and value.low <= 0):
            raise InputError(f"{where}: {name} reaches down to {value.low:g}; it must stay positive")
    friction = bearing.friction
    if friction.high > 2:
        raise InputError(
            f"{where}: friction {friction.nominal:g} (up to {friction.high:g}) is no friction coefficient; 0.05 to 0.5 is usual"
        )


def _check_travel(machine: Machine, bearing: TouchdownBearing, where: str) -> None:
    """Refuse stiffnesses that yield by more than the air gap under half of the weight: the rotor would rest on its seals."""
    load, gap, balls = 0.5 * machine.gravity * _mass(machine.rotor), bearing.radial_gap.nominal, bearing.balls
    support, contact, stated = bearing.support_stiffness.nominal, bearing.contact_stiffness, balls.stated_stiffness
    yielding = [
        (f"support_stiffness {support:g} N/m", load / support),
        (f"contact_stiffness {contact:g} N/m^(10/9)", static_depth(load, contact, bearing.contact_exponent)),
    ]
    if stated is not None:
        lowest = load * min(1.0, _LOWEST_BALL / balls.count)
        yielding.append((f"balls: stiffness {stated:g} N/m^1.5", (lowest / stated) ** (2 / 3)))
    for name, travel in yielding:
        if travel > gap:
            raise InputError(
                f"{where}: {name} yields by {travel * 1e6:.3g} um under half of the rotor's weight, more than the radial_gap"
                f" ({gap * 1e6:g} um); check its unit"
            )


def _mass(rotor: Rotor) -> float:
    """Return the mass of shaft and discs, kg."""
    areas = ((math.pi / 4 * (s.outer_diameter**2 - s.inner_diameter**2), s.length) for s in rotor.sections)
    return rotor.density * math.fsum(area * length for area, length in areas) + math.fsum(
        disk.mass for disk in rotor.disks
    )


def _um(value: Tolerant) -> str:
    least = "" if value.is_exact else f" (down to {value.low * 1e6:g} um)"
    return f"{value.nominal * 1e6:g} um{least}"
