"""Quasi-static ball loads of a deep-groove bearing with imperfect balls and raceways.

Ball j at azimuth beta_j is compressed by delta_j = e_x cos beta_j + e_y sin beta_j - c_d/2 + its oversize + waviness, and
carries Q_j = K_j delta_j^(3/2) where delta_j > 0 (T. A. Harris, Rolling Bearing Analysis).  `tdbsim.ball_bearing` computes the
same inside a run; here each ball has the stiffness of its own size, and the inverse, displacement from load, is solved too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdbsim.errors import InputError
from tdbsim.hertz import BearingGeometry
from tdbsim.static_equilibrium import static_equilibrium

Array = NDArray[np.float64]
Race = Literal["inner", "outer"]


@dataclass(frozen=True)
class Wave:
    """Waviness of a raceway: interference amplitude cos(order (azimuth - angle of the race) - phase), m and rad."""

    amplitude: float
    order: int
    phase: float = 0.0
    race: Race = "inner"

    def __post_init__(self) -> None:
        if self.race not in ("inner", "outer"):
            raise InputError(f"race '{self.race}' is neither 'inner' nor 'outer'")
        if self.order < 1:
            raise InputError(f"waviness of order {self.order} is impossible; give 1 or more waves around the race")


def off_sized(geometry: BearingGeometry, deviation: float) -> BearingGeometry:
    """Return the geometry for a ball with a deviation of the diameter, m: the grooves stay, so the conformity changes."""
    if deviation == 0:
        return geometry
    diameter = geometry.ball_diameter + deviation
    share = geometry.ball_diameter / diameter
    return replace(
        geometry,
        ball_diameter=diameter,
        inner_conformity=geometry.inner_conformity * share,
        outer_conformity=geometry.outer_conformity * share,
    )


@dataclass(frozen=True)
class BallLoads:
    """Loads of a row of balls; arrays may have any number of leading dimensions (time first).

    Attributes
    ----------
    displacement : (..., 2) array
        Of the inner relative to the outer ring (x, y), m.
    azimuth : (..., n) array
        Of the balls, rad.
    press : (..., n) array
        Compression of each ball, m; negative where it is loose.
    load : (..., n) array
        N.
    """

    displacement: Array
    azimuth: Array
    press: Array
    load: Array

    @property
    def force(self) -> Array:
        """Force (..., 2) of the inner ring on the balls, N: the load in equilibrium with the displacement."""
        return np.stack(
            [np.sum(self.load * np.cos(self.azimuth), axis=-1), np.sum(self.load * np.sin(self.azimuth), axis=-1)],
            axis=-1,
        )


@dataclass(frozen=True)
class BallRow:
    """The balls of a deep-groove bearing.

    Attributes
    ----------
    geometry : BearingGeometry
        Of a ball of nominal size.
    count : int
    diametral_clearance : float
        m; negative for preloaded balls.
    oversize : tuple of float
        Deviation of each ball's diameter from the nominal one, m, ball 1 first; empty where all are nominal.
    waves : tuple of Wave
        Of the raceways.

    Raises
    ------
    InputError
        If there are fewer than three balls, or the number of sizes is not that of the balls.
    """

    geometry: BearingGeometry
    count: int
    diametral_clearance: float = 0.0
    oversize: tuple[float, ...] = ()
    waves: tuple[Wave, ...] = ()

    def __post_init__(self) -> None:
        if self.count < 3:
            raise InputError(f"{self.count} balls cannot hold a ring; give 3 or more")
        if self.oversize and len(self.oversize) != self.count:
            raise InputError(f"{len(self.oversize)} ball sizes given for {self.count} balls; give one a ball, or none")

    def with_oversize(self, deviation: float, *balls: int) -> BallRow:
        """Return the row with a deviation of the diameter, m, at some balls (1 to count)."""
        sizes = list(self.oversize or (0.0,) * self.count)
        for ball in balls:
            if not 1 <= ball <= self.count:
                raise InputError(f"ball {ball} given; the row has balls 1 to {self.count}")
            sizes[ball - 1] += deviation
        return replace(self, oversize=tuple(sizes))

    @cached_property
    def geometries(self) -> tuple[BearingGeometry, ...]:
        """Bearing geometry for each ball's size."""
        return tuple(off_sized(self.geometry, size) for size in self.oversize or (0.0,) * self.count)

    @cached_property
    def stiffness(self) -> Array:
        """Stiffness of each ball between both races (n,), N/m^1.5."""
        return np.array([each.stiffness for each in self.geometries])

    def azimuth(self, cage_angle: ArrayLike = 0.0) -> Array:
        """Return the balls' azimuths (..., n), rad; ball 1 is at the cage's angle (...)."""
        return np.asarray(cage_angle, dtype=float)[..., None] + 2 * math.pi * np.arange(self.count) / self.count

    def interference(self, azimuth: Array, ring_angle: ArrayLike = 0.0) -> Array:
        """Return the compression (..., n) of each ball with the rings centred, m, at the angle (...) of the inner ring."""
        ring = np.asarray(ring_angle, dtype=float)[..., None]
        sizes = np.array(self.oversize or (0.0,) * self.count)
        total = np.broadcast_to(sizes - self.diametral_clearance / 2, np.broadcast_shapes(azimuth.shape, ring.shape))
        for wave in self.waves:
            turned = azimuth - (ring if wave.race == "inner" else 0.0)
            total = total + wave.amplitude * np.cos(wave.order * turned - wave.phase)
        return total

    def displaced(self, displacement: ArrayLike, cage_angle: ArrayLike = 0.0, ring_angle: ArrayLike = 0.0) -> BallLoads:
        """Return the loads of the balls for displacements (..., 2) of the inner relative to the outer ring, m."""
        displacement = np.asarray(displacement, dtype=float)
        azimuth = self.azimuth(cage_angle)
        press = self.interference(azimuth, ring_angle) + (
            displacement[..., :1] * np.cos(azimuth) + displacement[..., 1:] * np.sin(azimuth)
        )
        positive = np.maximum(press, 0.0)
        return BallLoads(
            displacement, np.broadcast_to(azimuth, press.shape), press, self.stiffness * positive * np.sqrt(positive)
        )

    def loaded(self, force: ArrayLike, cage_angle: ArrayLike = 0.0, ring_angle: ArrayLike = 0.0) -> BallLoads:
        """Return the loads of the balls in equilibrium with a force on the inner ring.

        Parameters
        ----------
        force : (..., 2) array
            Along x and y, N.
        cage_angle, ring_angle : (...) array
            rad.

        Raises
        ------
        InputError
            If a force is not finite.
        """
        force = np.asarray(force, dtype=float)
        if not np.all(np.isfinite(force)):
            raise InputError("the force on the inner ring must be finite, N")
        shape = np.broadcast_shapes(force.shape[:-1], np.shape(cage_angle), np.shape(ring_angle))
        cage, ring = (np.broadcast_to(np.asarray(angle, dtype=float), shape) for angle in (cage_angle, ring_angle))
        azimuth = self.azimuth(cage.ravel())
        free = self.interference(azimuth, ring.ravel())
        flat = np.broadcast_to(force, (*shape, 2)).reshape(-1, 2)
        cosine, sine = np.cos(azimuth), np.sin(azimuth)

        def potential(where: Array, at: NDArray[np.intp]) -> tuple[Array, Array, Array, Array]:
            c, s = cosine[at], sine[at]
            press = np.maximum(free[at] + where[:, :1] * c + where[:, 1:] * s, 0.0)
            root = self.stiffness * np.sqrt(press)
            load = root * press
            slope = 1.5 * root
            xy = np.sum(slope * c * s, axis=1)
            curvature = np.array([[np.sum(slope * c * c, axis=1), xy], [xy, np.sum(slope * s * s, axis=1)]])
            gradient = np.stack([np.sum(load * c, axis=1), np.sum(load * s, axis=1)], axis=1)
            return 0.4 * np.sum(load * press, axis=1), gradient, np.moveaxis(curvature, 2, 0), load.sum(axis=1)

        # start from a displacement with which a single ball in line with the force would carry it alone
        size = np.linalg.norm(flat, axis=1)
        alone = (size / self.stiffness.min()) ** (2 / 3)
        far = np.where(size > 0, np.maximum(alone - free.min(axis=1), 0.0) / math.cos(math.pi / self.count), 0.0)
        start = flat * (far / np.where(size > 0, size, 1.0))[:, None]
        reach = float(np.max(2 * far + np.abs(free).max(axis=1)))
        where = static_equilibrium(potential, start, flat, reach or 1e-6, "ball row")
        return self.displaced(where.reshape(*shape, 2), cage, ring)

    def peak_pressure(self, load: ArrayLike, race: Race = "inner") -> Array:
        """Return the greatest Hertz pressure (..., n) of each ball on a race, Pa, for the balls' loads (..., n), N."""
        load = np.asarray(load, dtype=float)
        contacts = [each.inner if race == "inner" else each.outer for each in self.geometries]
        return np.stack([contact.peak_pressure(load[..., j]) for j, contact in enumerate(contacts)], axis=-1)
