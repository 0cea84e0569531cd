"""Angular-contact ball bearings: rows whose contact angle varies with load and tilt, alone or in pairs.

Deflections are those of the inner ring relative to the outer one.  At ball j at azimuth beta, the groove centres are a distance A
apart when the ball is just free.  Under load their distance is s_r = A cos(alpha0) - c_d/2 + e_r radially and s_a = A sin(alpha0)
+ e_t axially; the ball is compressed by hypot(s_r, s_a) - A and carries its load at the contact angle atan2(s_a, s_r) (T. A.
Harris, Rolling Bearing Analysis, chapter on loads at slow speed).  A deep-groove bearing is a row with alpha0 = 0 and
clearance c_d.  Centrifugal force and gyroscopic moment of the balls are neglected, and the stiffness is that at the free contact
angle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdbsim.errors import InputError
from tdbsim.hertz import BearingGeometry
from tdbsim.static_equilibrium import static_equilibrium

Array = NDArray[np.float64]
Arrangement = Literal["X", "O", "tandem"]


@dataclass(frozen=True)
class Row:
    """One row of balls.

    Attributes
    ----------
    geometry : BearingGeometry
        Its ``contact_angle`` is the free one.
    count : int
    position : float
        Axial position of the ball centres from the bearing's middle, m.
    sense : int
        +1 where a push of the inner ring towards +z loads the row, -1 where one towards -z does.
    clearance : float
        Diametral, in addition to that of the free contact angle, m.
    preload : float
        Axial interference of the row with the rings centred, m; negative for play.
    """

    geometry: BearingGeometry
    count: int
    position: float = 0.0
    sense: int = 1
    clearance: float = 0.0
    preload: float = 0.0

    def __post_init__(self) -> None:
        if self.count < 3:
            raise InputError(f"{self.count} balls cannot hold a ring; give 3 or more")
        if self.sense not in (1, -1):
            raise InputError(f"sense {self.sense} of a row is neither 1 nor -1")

    @property
    def centre_distance(self) -> float:
        """Distance A of the groove centres with the ball just free, m."""
        conformities = self.geometry.inner_conformity + self.geometry.outer_conformity
        return (conformities - 1) * self.geometry.ball_diameter

    @property
    def locus_radius(self) -> float:
        """Radius of the circle of inner groove centres, m."""
        ball, angle = self.geometry.ball_diameter, self.geometry.contact_angle
        return self.geometry.pitch_diameter / 2 + (self.geometry.inner_conformity - 0.5) * ball * math.cos(angle)


@dataclass(frozen=True)
class RowLoads:
    """Compression, m, load, N, and contact angle, rad, of each ball of a row; each (..., n).

    The angle is positive in the row's own direction of axial load, whatever its sense.
    """

    press: Array
    load: Array
    contact_angle: Array


@dataclass(frozen=True)
class AngularContactBearing:
    """Rows on one inner and one outer ring.

    Displacements and loads have five components: x, y, z in m or N, and psi_x, psi_y in rad or N m, about the middle.
    """

    rows: tuple[Row, ...]

    def __post_init__(self) -> None:
        if not self.rows:
            raise InputError("a bearing needs at least one row of balls")

    @cached_property
    def _stiffness(self) -> tuple[float, ...]:
        return tuple(row.geometry.stiffness for row in self.rows)

    @cached_property
    def _radius(self) -> float:
        return self.rows[0].geometry.pitch_diameter / 2

    def displaced(self, displacement: ArrayLike, cage_angle: ArrayLike = 0.0) -> tuple[RowLoads, ...]:
        """Return the ball loads of each row for displacements (..., 5), at the cage's angle (...), rad."""
        where = np.asarray(displacement, dtype=float)
        return tuple(self._row(i, where, np.asarray(cage_angle, dtype=float))[0] for i in range(len(self.rows)))

    def force(self, displacement: ArrayLike, cage_angle: ArrayLike = 0.0) -> Array:
        """Return the load (..., 5) on the inner ring that balances a displacement: the gradient of the elastic energy."""
        where, cage = np.asarray(displacement, dtype=float), np.asarray(cage_angle, dtype=float)
        total = np.zeros(np.broadcast_shapes(where.shape, (*cage.shape, 5)))
        for i in range(len(self.rows)):
            loads, radial, axial, _ = self._row(i, where, cage)
            normal = np.cos(loads.contact_angle)[..., None] * radial + np.sin(loads.contact_angle)[..., None] * axial
            total = total + np.sum(loads.load[..., None] * normal, axis=-2)
        return total

    def _row(self, index: int, where: Array, cage: Array) -> tuple[RowLoads, Array, Array, Array]:
        """Return the loads of a row, derivatives of radial and axial approach by the displacement (..., n, 5), length."""
        row, stiffness = self.rows[index], self._stiffness[index]
        beta = cage[..., None] + 2 * math.pi * np.arange(row.count) / row.count
        c, s, none = np.cos(beta), np.sin(beta), np.zeros_like(beta)
        radial = np.stack([c, s, none, -row.position * s, row.position * c], axis=-1)
        axial = row.sense * np.stack([none, none, none + 1, row.locus_radius * s, -row.locus_radius * c], axis=-1)
        apart, angle = row.centre_distance, row.geometry.contact_angle
        s_r = apart * math.cos(angle) - row.clearance / 2 + np.sum(radial * where[..., None, :], axis=-1)
        s_a = apart * math.sin(angle) + row.preload + np.sum(axial * where[..., None, :], axis=-1)
        length = np.hypot(s_r, s_a)
        press = length - apart
        positive = np.maximum(press, 0.0)
        loads = RowLoads(press, stiffness * positive * np.sqrt(positive), np.arctan2(s_a, s_r))
        return loads, radial, axial, length

    def loaded(self, load: ArrayLike, cage_angle: ArrayLike = 0.0) -> Array:
        """Return the displacement (..., 5) at which the balls balance a load (..., 5) on the inner ring.

        Raises
        ------
        InputError
            If the rows cannot carry a load, such as an axial one that separates a single row: the balls would then run on
            the low shoulder (which `displaced` treats as a full groove).
        """
        load = np.asarray(load, dtype=float)
        if load.shape[-1:] != (5,) or not np.all(np.isfinite(load)):
            raise InputError("a load has five finite components: F_x, F_y, F_z in N, M_x, M_y in N m")
        shape = np.broadcast_shapes(load.shape[:-1], np.shape(cage_angle))
        cage = np.broadcast_to(np.asarray(cage_angle, dtype=float), shape).ravel()
        # angles as arcs on the pitch circle, so that all coordinates are lengths
        unit = np.array([1.0, 1.0, 1.0, 1 / self._radius, 1 / self._radius])
        flat = np.broadcast_to(load, (*shape, 5)).reshape(-1, 5) * unit

        def potential(scaled: Array, at: NDArray[np.intp]) -> tuple[Array, Array, Array, Array]:
            value, carried = np.zeros(len(at)), np.zeros(len(at))
            gradient, curvature = np.zeros((len(at), 5)), np.zeros((len(at), 5, 5))
            for i, stiffness in enumerate(self._stiffness):
                loads, radial, axial, length = self._row(i, scaled * unit, cage[at])
                cosine, sine = np.cos(loads.contact_angle)[..., None], np.sin(loads.contact_angle)[..., None]
                along, across = (cosine * radial + sine * axial) * unit, (cosine * axial - sine * radial) * unit
                positive = np.maximum(loads.press, 0.0)
                value += 0.4 * np.sum(loads.load * positive, axis=-1)
                carried += loads.load.sum(axis=-1)
                gradient += np.einsum("kn,knd->kd", loads.load, along)
                steep, turned = 1.5 * stiffness * np.sqrt(positive), loads.load / length
                curvature += np.einsum("kn,knd,kne->kde", steep, along, along)
                curvature += np.einsum("kn,knd,kne->kde", turned, across, across)
            return value, gradient, curvature, carried

        reach = 0.5 * min(row.centre_distance for row in self.rows)
        found = static_equilibrium(potential, np.zeros_like(flat), flat, reach, "angular-contact bearing")
        self._check_shoulders(found * unit, cage, flat / unit)
        return np.asarray((found * unit).reshape(*shape, 5))

    def _check_shoulders(self, where: Array, cage: Array, load: Array) -> None:
        for number, (row, loads) in enumerate(zip(self.rows, self.displaced(where, cage), strict=True), 1):
            over = (loads.load > 0) & (loads.contact_angle < 0)
            if row.geometry.contact_angle > 0 and over.any():
                bad = load[int(np.argmax(over.any(axis=-1)))]
                raise InputError(
                    f"row {number} cannot carry the load {np.array2string(bad, precision=4)} (N, N m): it would press balls"
                    " against the shoulder that an angular-contact ring lacks; give the row a partner or turn the load"
                )


def single(geometry: BearingGeometry, count: int, clearance: float = 0.0) -> AngularContactBearing:
    """Return a bearing of one row that carries axial load towards +z; a deep-groove one at contact angle 0."""
    return AngularContactBearing((Row(geometry, count, clearance=clearance),))


def pair(
    geometry: BearingGeometry, count: int, spacing: float, arrangement: Arrangement, preload: float = 0.0
) -> AngularContactBearing:
    """Return two equal rows.

    Parameters
    ----------
    geometry, count
        Of each row.
    spacing : float
        Between the rows' ball centres, m; for two bearings side by side the width of one.
    arrangement : str
        "X" (face to face: the lines of contact meet the axis between the rows or near them), "O" (back to back: far
        apart, stiff against tilt), "tandem" (both rows carry towards +z).
    preload : float
        Axial interference of the pair, m, half of it at each row; negative for axial play.

    Raises
    ------
    InputError
        If the spacing is not positive, or a preload is given for rows in tandem.
    """
    if not spacing > 0:
        raise InputError(f"spacing {spacing * 1e3:g} mm of the rows is not positive")
    if arrangement not in ("X", "O", "tandem"):
        raise InputError(f"arrangement '{arrangement}' is unknown; give X, O or tandem")
    if arrangement == "tandem" and preload:
        raise InputError(f"preload {preload * 1e6:g} um: rows in tandem do not press on each other; give 0")
    senses = {"X": (-1, 1), "O": (1, -1), "tandem": (1, 1)}[arrangement]
    rows = (
        Row(geometry, count, position, sense, preload=preload / 2)
        for position, sense in zip((-spacing / 2, spacing / 2), senses, strict=True)
    )
    return AngularContactBearing(tuple(rows))
