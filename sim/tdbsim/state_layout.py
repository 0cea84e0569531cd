"""Layout of the state vector of a drop with n modes per plane.

The state is one vector: positions q, velocities v, work w.

    q   n modal displacements in x, n in y; for each end inner ring x, y, outer ring x, y, foundation x, y; then the
        angles of the shaft and of the two inner rings
    v   their rates
    w   energy dissipated, stored or supplied (`LEDGER`), J: the energy balance of a run

Indices of single components are available in compiled kernels too, slices in Python only.
"""

from __future__ import annotations

from tdbsim.cache import shared

LEDGER = (
    "friction_0", "friction_1", "heat_0", "heat_1", "contact_0", "contact_1", "balls_0", "balls_1",
    "support_0", "support_1", "modal", "windage", "ring_drag", "external",
)  # fmt: skip
RUBBED, HEAT, STRUCK, ROLLED, YIELDED, MODAL, WINDAGE, DRAGGED, EXTERNAL = 0, 2, 4, 6, 8, 10, 11, 12, 13
_BODIES = 6  # coordinates of an end: x and y of three bodies
_TURNING = 3  # shaft and inner rings


@shared
def positions(n: int) -> int:
    """Return the number of positions, which is also the offset from a position to its rate."""
    return 2 * n + 2 * _BODIES + _TURNING


@shared
def bodies(n: int, end: int) -> int:
    """Return the index of an end's first position: inner ring x, y, outer ring x, y, foundation x, y."""
    return 2 * n + _BODIES * end


@shared
def shaft_angle(n: int) -> int:
    """Return the index of the shaft's angle."""
    return 2 * n + 2 * _BODIES


@shared
def ring_angle(n: int, end: int) -> int:
    """Return the index of the angle of an end's inner ring."""
    return 2 * n + 2 * _BODIES + 1 + end


@shared
def omega(n: int) -> int:
    """Return the index of the shaft's speed, rad/s."""
    return positions(n) + shaft_angle(n)


@shared
def ring_speed(n: int, end: int) -> int:
    """Return the index of the speed of an end's inner ring, rad/s."""
    return positions(n) + ring_angle(n, end)


@shared
def work(n: int) -> int:
    """Return the index of the first entry of work, in the order of `LEDGER`."""
    return 2 * positions(n)


@shared
def size(n: int) -> int:
    """Return the length of the state vector."""
    return work(n) + len(LEDGER)


def modes_x(n: int) -> slice:
    """Return the slice of the modal displacements along x."""
    return slice(0, n)


def modes_y(n: int) -> slice:
    """Return the slice of the modal displacements along y."""
    return slice(n, 2 * n)


def mode_rates_x(n: int) -> slice:
    """Return the slice of the modal velocities along x."""
    return slice(positions(n), positions(n) + n)


def mode_rates_y(n: int) -> slice:
    """Return the slice of the modal velocities along y."""
    return slice(positions(n) + n, positions(n) + 2 * n)


def ring_angles(n: int) -> slice:
    """Return the slice of the angles of both inner rings."""
    return slice(ring_angle(n, 0), ring_angle(n, 1) + 1)


def ring_speeds(n: int) -> slice:
    """Return the slice of the speeds of both inner rings."""
    return slice(ring_speed(n, 0), ring_speed(n, 1) + 1)
