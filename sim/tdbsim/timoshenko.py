"""The Timoshenko beam element between two nodes of one plane, with (v, psi) at each.

H. D. Nelson, A finite rotating shaft element using Timoshenko beam theory, J. Mech. Design 102 (1980) 793-803.  The
shape functions are exact for loads at the ends; the shear force is constant along the element.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def shear_coefficient(bore_ratio: ArrayLike, poisson_ratio: float) -> Array:
    """Return the shear coefficient of a hollow circular section (Cowper, J. Appl. Mech. 33, 1966).

    Parameters
    ----------
    bore_ratio : array
        Inner over outer diameter, 0 where solid.
    poisson_ratio : float
        Of the shaft's material.
    """
    m2 = np.square(bore_ratio)
    square = (1 + m2) ** 2
    return np.asarray(
        6 * (1 + poisson_ratio) * square / ((7 + 6 * poisson_ratio) * square + (20 + 12 * poisson_ratio) * m2)
    )


def shape_functions(xi: Array, length: Array, shear: Array) -> tuple[Array, Array]:
    """Return the shape functions (..., 4) of deflection and of the cross-section's rotation.

    Parameters
    ----------
    xi : array
        Position in the element, z/length, 0 to 1.
    length : array
        Of the element, m.
    shear : array
        Shear parameter 12 E I/(kappa G A length^2); 0 for the Euler-Bernoulli beam.
    """
    over = 1 / (1 + shear)
    deflection = [
        over * (1 - 3 * xi**2 + 2 * xi**3 + shear * (1 - xi)),
        over * length * (xi - 2 * xi**2 + xi**3 + shear / 2 * (xi - xi**2)),
        over * (3 * xi**2 - 2 * xi**3 + shear * xi),
        over * length * (-(xi**2) + xi**3 - shear / 2 * (xi - xi**2)),
    ]
    rotation = [
        over * 6 / length * (xi**2 - xi),
        over * (1 - 4 * xi + 3 * xi**2 + shear * (1 - xi)),
        over * 6 / length * (xi - xi**2),
        over * (-2 * xi + 3 * xi**2 + shear * xi),
    ]
    return np.stack(deflection, axis=-1), np.stack(rotation, axis=-1)


def element_matrices(
    length: Array, shear: Array, bending: Array, line_mass: Array, line_inertia: Array
) -> tuple[Array, Array, Array]:
    """Return consistent mass, stiffness and polar matrices (elements, 4, 4) of one plane.

    Parameters
    ----------
    length, shear : (elements,) arrays
        As in `shape_functions`.
    bending : (elements,) array
        Bending stiffness E I, N m^2.
    line_mass, line_inertia : (elements,) arrays
        Density times area, kg/m, and times second moment of area, kg m.
    """
    points, weights = np.polynomial.legendre.leggauss(4)  # exact for the products of cubics
    xi = (points[:, None] + 1) / 2
    deflection, rotation = shape_functions(xi, length, shear)
    by_length = weights[:, None] / 2 * length
    translatory = np.einsum("pe,pei,pej->eij", by_length * line_mass, deflection, deflection)
    rotary = np.einsum("pe,pei,pej->eij", by_length * line_inertia, rotation, rotation)

    zero, one = np.zeros_like(length), np.ones_like(length)
    shearing = np.stack([2 / length, one, -2 / length, one], axis=-1)  # constant along the element
    curving = np.stack([zero, one, zero, -one], axis=-1)
    # exact for end loads: curvature is a constant and an antisymmetric part, the latter in series with the shear
    stiffness = (bending / length)[:, None, None] * (
        np.einsum("ei,ej->eij", curving, curving)
        + (3 / (1 + shear))[:, None, None] * np.einsum("ei,ej->eij", shearing, shearing)
    )
    return (
        translatory + rotary,
        stiffness,
        2 * rotary,
    )  # the polar inertia of a circular section is twice the diametral one
