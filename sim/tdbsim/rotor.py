"""Finite element model of the rotor: Timoshenko beams with gyroscopic effects, wheels as point inertias.

Coordinates
    Axes of the machine: x right, y up, z along the shaft from the non-drive end; right-handed, so that a positive speed
    turns from +x towards +y.  Each node has (x, y, theta_x, theta_y); the angles are right-handed rotations of the
    cross-section about +x and +y.  Without shear dx/dz = theta_y and dy/dz = -theta_x.

One plane
    The rotor is axisymmetric, so both planes have the same matrices.  They are stored for one plane, with (v, psi) per node: the
    deflection and the rotation of the cross-section in the sense of dv/dz.  v = x, psi = theta_y in the x-z plane and
    v = y, psi = -theta_x in the y-z plane.

Equation of motion of both planes, with omega in rad/s:  M q'' + omega G q' + (K + omega' G_c) q = F.  The rate of the spin's
angular momentum omega I_p (theta_y, -theta_x, 1) includes omega' I_p (theta_y, -theta_x), so G_c = G where the torque that
changes the speed acts about the fixed z axis.  A torque that follows the tilted shaft, such as windage, has that moment as a
component itself, and then G_c = 0.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdbsim.errors import InputError
from tdbsim.machine import Machine
from tdbsim.timoshenko import element_matrices, shape_functions, shear_coefficient

Array = NDArray[np.float64]

# Greatest element length for the first four bending modes within 0.1 %.  In a slender shaft the error falls with the fourth
# power of the element length.  In a stubby one the shear force varies along the element, which the element neglects: there the
# error falls with the square, in proportion to length^2 diameter^2 / shaft^4.
_SLENDER = 1 / 30  # of the shaft's length
_STUBBY = 0.0022  # of the shaft's length squared over the diameter
_FINEST = 1 / 80  # of the shaft's length
_SAME_NODE = 1e-4  # of the shaft's length; a named position nearer to a node gets none of its own and is interpolated


@dataclass(frozen=True, eq=False)
class RotorModel:
    """Matrices of a free rotor with m nodes.

    Attributes
    ----------
    nodes : (m,) array
        Axial positions, m.
    shear : (m - 1,) array
        Shear parameter 12 E I / (kappa G A l^2) of each element.
    plane_mass, plane_stiffness : (2m, 2m) arrays
        Of one plane, in (v, psi) per node.
    plane_polar : (2m, 2m) array
        Polar inertia matrix; omega times it is the gyroscopic coupling of the planes.
    modal_damping_ratio : float
        Of every bending mode.
    """

    nodes: Array
    shear: Array
    plane_mass: Array
    plane_stiffness: Array
    plane_polar: Array
    modal_damping_ratio: float = 0.0

    @property
    def length(self) -> float:
        """Length of the shaft, m."""
        return float(self.nodes[-1])

    @cached_property
    def _translation(self) -> Array:
        return np.tile([1.0, 0.0], len(self.nodes))

    def rigid_rotation(self, about: float) -> Array:
        """Return the unit rotation (2m,) of one plane about an axial position."""
        return np.column_stack([self.nodes - about, np.ones(len(self.nodes))]).ravel()

    @cached_property
    def total_mass(self) -> float:
        """Mass, kg."""
        return float(self._translation @ self.plane_mass @ self._translation)

    @cached_property
    def centre_of_mass(self) -> float:
        """Axial position of the centre of mass, m."""
        return float(self._translation @ self.plane_mass @ self.rigid_rotation(0.0)) / self.total_mass

    @cached_property
    def polar_inertia(self) -> float:
        """Moment of inertia about the shaft's axis, kg m^2."""
        rotation = self.rigid_rotation(0.0)
        return float(rotation @ self.plane_polar @ rotation)

    @cached_property
    def diametral_inertia(self) -> float:
        """Moment of inertia about a diameter through the centre of mass, kg m^2."""
        rotation = self.rigid_rotation(self.centre_of_mass)
        return float(rotation @ self.plane_mass @ rotation)

    def shares(self, first: float, second: float) -> tuple[float, float]:
        """Return the shares of the weight on two supports at axial positions by the lever rule; negative where held down."""
        share = (self.centre_of_mass - first) / (second - first)
        return 1 - share, share

    def plane_rows(self, positions: ArrayLike) -> Array:
        """Return rows (k, 2m) that give the deflection of one plane at k positions.

        Raises
        ------
        InputError
            If a position lies outside the shaft.
        """
        deflection, _ = _rows(self.nodes, self.shear, np.atleast_1d(np.asarray(positions, dtype=float)))
        return deflection


def build_rotor(machine: Machine, max_element: float | None = None) -> RotorModel:
    """Build the model of a machine's rotor.

    Nodes stand at the ends of all sections and at all named positions (wheels, unbalance planes, bearings, probes).

    Parameters
    ----------
    machine : Machine
        Its `rotor` and the positions on it.
    max_element : float, optional
        Greatest element length, m.  By default short enough for the first four bending modes to be within 0.1 % of the
        continuous shaft's (up to a diameter of a fifth of the length).

    Raises
    ------
    InputError
        If `max_element` is not positive.

    References
    ----------
    H. D. Nelson, A finite rotating shaft element using Timoshenko beam theory, J. Mech. Design 102 (1980) 793-803.
    """
    rotor = machine.rotor
    if max_element is not None and not max_element > 0:
        raise InputError(f"max_element {max_element:g} m is not positive; give the greatest element length")
    ends = np.concatenate([[0.0], np.cumsum([section.length for section in rotor.sections])])
    diameters = np.array([section.outer_diameter for section in rotor.sections])
    limits = np.clip(_STUBBY * rotor.length**2 / diameters, _FINEST * rotor.length, _SLENDER * rotor.length)
    if max_element is not None:
        limits = np.full(len(diameters), max_element)
    nodes = _mesh(ends, limits, _named_positions(machine))

    section_of = np.searchsorted(ends[1:-1], (nodes[:-1] + nodes[1:]) / 2)
    outer = diameters[section_of]
    inner = np.array([section.inner_diameter for section in rotor.sections])[section_of]
    area = math.pi / 4 * (outer**2 - inner**2)
    second_moment = math.pi / 64 * (outer**4 - inner**4)
    length = np.diff(nodes)
    shear_modulus = rotor.elastic_modulus / (2 * (1 + rotor.poisson_ratio))
    kappa = shear_coefficient(inner / outer, rotor.poisson_ratio)
    bending = rotor.elastic_modulus * second_moment
    shear = 12 * bending / (kappa * shear_modulus * area * length**2)

    mass, stiffness, polar = element_matrices(
        length, shear, bending, rotor.density * area, rotor.density * second_moment
    )
    size = 2 * len(nodes)
    plane_mass, plane_stiffness, plane_polar = (_assembled(each, size) for each in (mass, stiffness, polar))
    for disk in rotor.disks:
        deflection, rotation = _rows(nodes, shear, np.array([disk.position]))
        plane_mass += disk.mass * deflection.T @ deflection + disk.diametral_inertia * rotation.T @ rotation
        plane_polar += disk.polar_inertia * rotation.T @ rotation
    return RotorModel(nodes, shear, plane_mass, plane_stiffness, plane_polar, rotor.modal_damping_ratio)


def static_loads(machine: Machine, model: RotorModel) -> dict[str, float]:
    """Return the weight that each touchdown bearing carries with the rotor at rest, N.

    Raises
    ------
    InputError
        If the centre of mass is not between the touchdown bearings: one end would rest at the top of its clearance.
    """
    return {end: mass * machine.gravity for end, mass in end_mass(machine, model).items()}


def end_mass(machine: Machine, model: RotorModel) -> dict[str, float]:
    """Return each end's share of the rotor's mass, kg (raises as `static_loads`)."""
    first, second = machine.touchdown_bearings
    shares = model.shares(first.position, second.position)
    if not min(shares) > 0:
        raise InputError(
            f"the rotor's centre of mass, at {model.centre_of_mass * 1e3:.1f} mm, does not lie between the touchdown"
            f" bearings at {first.position * 1e3:g} and {second.position * 1e3:g} mm; check sections, disks, positions"
        )
    return {end: model.total_mass * share for end, share in zip(machine.ends, shares, strict=True)}


def spring_positions(machine: Machine, stiffness: Mapping[str, Any]) -> list[tuple[float, Any]]:
    """Return (position, value) of each touchdown bearing, checking that every end has a value.

    Raises
    ------
    InputError
        If an end is missing or unknown, or a value is not positive.
    """
    for end in stiffness:
        machine.bearing(end)
    missing = [end for end in machine.ends if end not in stiffness]
    if missing:
        raise InputError(f"no stiffness given for end '{missing[0]}'; give one in N/m for each of {machine.ends}")
    for end, value in stiffness.items():
        if not np.all(np.asarray(value, dtype=float) > 0):
            raise InputError(f"stiffness {value} N/m of end '{end}' is not positive")
    return [(machine.bearing(end).position, stiffness[end]) for end in machine.ends]


def _named_positions(machine: Machine) -> list[float]:
    positions = {disk.position for disk in machine.rotor.disks}
    positions |= {plane.position for plane in machine.rotor.unbalance}
    positions |= {bearing.position for bearing in machine.magnetic_bearings}
    positions |= {bearing.position for bearing in machine.touchdown_bearings}
    positions |= {probe.position for probe in machine.probes}
    return sorted(positions)


def _mesh(ends: Array, limits: Array, named: list[float]) -> Array:
    """Return nodes at all section ends and named positions, and between them as the limits of element length require."""
    fixed = list(ends)
    for position in named:
        if min(abs(position - node) for node in fixed) > _SAME_NODE * ends[-1]:
            fixed.append(position)
    parts = []
    for left, right in pairwise(sorted(fixed)):
        limit = limits[np.searchsorted(ends[1:-1], (left + right) / 2)]
        elements = max(1, math.ceil((right - left) / limit - 1e-9))
        parts.append(np.linspace(left, right, elements, endpoint=False))
    return np.concatenate([*parts, ends[-1:]])


def _assembled(elements: Array, size: int) -> Array:
    matrix = np.zeros((size, size))
    start = 2 * np.arange(len(elements))[:, None, None]
    np.add.at(matrix, (start + np.arange(4)[:, None], start + np.arange(4)[None, :]), elements)
    return matrix


def _rows(nodes: Array, shear: Array, positions: Array) -> tuple[Array, Array]:
    outside = ~((positions >= nodes[0] - 1e-9) & (positions <= nodes[-1] + 1e-9))
    if outside.any():
        raise InputError(
            f"position {positions[outside][0] * 1e3:g} mm lies outside the shaft (0 to {nodes[-1] * 1e3:g} mm)"
        )
    element = np.clip(np.searchsorted(nodes, positions, side="right") - 1, 0, len(nodes) - 2)
    length = np.diff(nodes)[element]
    values = shape_functions((positions - nodes[element]) / length, length, shear[element])
    columns = 2 * element[:, None] + np.arange(4)
    deflection, rotation = np.zeros((2, len(positions), 2 * len(nodes)))
    for rows, value in zip((deflection, rotation), values, strict=True):
        np.put_along_axis(rows, columns, value, axis=1)
    return deflection, rotation
