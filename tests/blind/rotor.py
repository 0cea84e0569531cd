"""A shaft as quadratic Timoshenko elements with selective integration, and its free-free modes.

Another element than the simulator's: three nodes with deflection and rotation of their own, shear freed of locking by
two Gauss points (T. J. R. Hughes, The Finite Element Method, 1987, section 5.4).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Disk:
    """A wheel: point inertia, SI."""

    name: str
    position: float
    mass: float
    polar_inertia: float
    diametral_inertia: float


@dataclass(frozen=True)
class Modes:
    """Free-free modes of one plane, mass-normalised; the first two are rigid.

    `deflection` and `rotation` hold the modes' values at `nodes` (nodes x modes).
    """

    nodes: Array
    frequency: Array  # rad/s
    deflection: Array
    rotation: Array
    gyroscopic: Array  # modes x modes
    weight: Array  # modal mass of a unit acceleration
    mass: float
    polar_inertia: float
    projection: Array  # modes x 2 nodes: modal amplitudes of given nodal deflections and slopes

    def amplitudes(self, deflection: Array, slope: Array) -> Array:
        """Return the modal amplitudes of a shape given at the nodes."""
        amplitudes: Array = self.projection @ np.concatenate((deflection, slope))
        return amplitudes

    def at(self, position: float) -> Array:
        """Return the modes' deflections at a position, interpolated within its element (quadratic)."""
        element = min(int(np.searchsorted(self.nodes[2::2], position)), (len(self.nodes) - 3) // 2)
        first = 2 * element
        left, right = self.nodes[first], self.nodes[first + 2]
        return _shapes(2 * (position - left) / (right - left) - 1) @ self.deflection[first : first + 3]


def _shapes(xi: float) -> Array:
    return np.array([xi * (xi - 1) / 2, 1 - xi * xi, xi * (xi + 1) / 2])


def _slopes(xi: float) -> Array:
    return np.array([xi - 0.5, -2 * xi, xi + 0.5])


def modes(
    sections: list[tuple[float, float]],
    disks: list[Disk],
    *,
    elastic_modulus: float,
    density: float,
    poisson_ratio: float,
    count: int,
    element: float = 0.012,
) -> Modes:
    """Return the first `count` free-free modes of a plane of a shaft of `sections` (length, diameter; m)."""
    steps = np.concatenate(([0.0], np.cumsum([length for length, _ in sections])))
    breaks = np.unique(np.round([*steps, *(disk.position for disk in disks)], 9))
    lengths, diameters = [], []
    for left, right in pairwise(breaks):
        pieces = max(1, int(np.ceil((right - left) / element)))
        lengths += [(right - left) / pieces] * pieces
        diameters += [sections[int(np.searchsorted(steps, (left + right) / 2)) - 1][1]] * pieces
    ends = np.concatenate(([0.0], np.cumsum(lengths)))
    nodes = np.empty(2 * len(lengths) + 1)
    nodes[::2], nodes[1::2] = ends, (ends[:-1] + ends[1:]) / 2
    n = len(nodes)
    stiffness, inertia = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 2 * n))
    polar = np.zeros((n, n))
    shear_modulus = elastic_modulus / (2 * (1 + poisson_ratio))
    shear_factor = 6 * (1 + poisson_ratio) / (7 + 6 * poisson_ratio)  # solid circle, Cowper 1966
    two, three = np.polynomial.legendre.leggauss(2), np.polynomial.legendre.leggauss(3)
    for k, (length, diameter) in enumerate(zip(lengths, diameters, strict=True)):
        area, second = np.pi * diameter**2 / 4, np.pi * diameter**4 / 64
        w = np.arange(2 * k, 2 * k + 3)
        psi = n + w
        both = np.concatenate((w, psi))
        for xi, weight in zip(*two, strict=True):
            shear = np.concatenate((_slopes(xi) * 2 / length, -_shapes(xi)))
            curvature = _slopes(xi) * 2 / length
            stiffness[np.ix_(both, both)] += (
                shear_modulus * shear_factor * area * weight * length / 2 * np.outer(shear, shear)
            )
            stiffness[np.ix_(psi, psi)] += (
                elastic_modulus * second * weight * length / 2 * np.outer(curvature, curvature)
            )
        for xi, weight in zip(*three, strict=True):
            product = weight * length / 2 * np.outer(_shapes(xi), _shapes(xi))
            inertia[np.ix_(w, w)] += density * area * product
            inertia[np.ix_(psi, psi)] += density * second * product
            polar[np.ix_(w, w)] += 2 * density * second * product
    for disk in disks:
        node = int(np.argmin(np.abs(nodes - disk.position)))
        inertia[node, node] += disk.mass
        inertia[n + node, n + node] += disk.diametral_inertia
        polar[node, node] += disk.polar_inertia
    squares, vectors = eigh(stiffness, inertia, subset_by_index=[0, count - 1])
    squares[:2] = 0.0
    deflection, rotation = vectors[:n], vectors[n:]
    ones = np.concatenate((np.ones(n), np.zeros(n)))
    return Modes(
        nodes=nodes,
        frequency=np.sqrt(squares),
        deflection=deflection,
        rotation=rotation,
        gyroscopic=rotation.T @ polar @ rotation,
        weight=vectors.T @ inertia @ ones,
        mass=float(ones @ inertia @ ones),
        polar_inertia=float(np.ones(n) @ polar @ np.ones(n)),
        projection=vectors.T @ inertia,
    )
