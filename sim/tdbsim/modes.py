"""Modes of the rotor: the free-free basis of simulation and the whirl modes on springs.

A drop is simulated in few coordinates: rigid modes, the first free-free bending modes and, on request, attachment modes, which
restore the local compliance at a point load that a truncated set of bending modes lacks (residual flexibility, R. H. MacNeal,
Computers & Structures 1 (1971) 581; S. Rubin, AIAA Journal 13 (1975) 995).

Reduced equations, per plane, with mass-normalised shapes and omega in rad/s:
    a'' + damping a' + omega gyro b' + (2 pi frequencies)^2 a = at(position) F_x
    b'' + damping b' - omega gyro a' + (2 pi frequencies)^2 b = at(position) F_y
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eig, eigh

from tdbsim.errors import InputError
from tdbsim.machine import Machine
from tdbsim.rotor import Array, RotorModel, spring_positions

_RIGID = 2  # translation and rotation, in each plane


@dataclass(frozen=True, eq=False)
class Modes:
    """Mass-normalised modes of one plane; both planes share them.

    Attributes
    ----------
    model : RotorModel
        The rotor of the modes.
    frequencies : (n,) array
        Hz; 0 for the two rigid modes (translation, rotation about the centre of mass), then the bending modes, then
        the attachment modes.
    vectors : (2m, n) array
        Modes in the model's coordinates (v, psi) of one plane.
    bending : int
        Number of bending modes among them.
    """

    model: RotorModel
    frequencies: Array
    vectors: Array
    bending: int

    @property
    def n(self) -> int:
        """Number of modes per plane."""
        return len(self.frequencies)

    @property
    def names(self) -> tuple[str, ...]:
        """Names in the order of the modes."""
        attached = self.n - _RIGID - self.bending
        return (
            "translation",
            "rotation",
            *(f"bending {k + 1}" for k in range(self.bending)),
            *(f"attachment {k + 1}" for k in range(attached)),
        )

    @cached_property
    def gyro(self) -> Array:
        """Symmetric gyroscopic matrix (n, n), which times omega in rad/s couples the planes' velocities."""
        return self.vectors.T @ self.model.plane_polar @ self.vectors

    @cached_property
    def damping(self) -> Array:
        """Modal damping (n,), 1/s: twice the damping ratio times the angular frequency, stationary, 0 where rigid."""
        return 4 * math.pi * self.model.modal_damping_ratio * self.frequencies

    def at(self, position: ArrayLike) -> Array:
        """Return the deflections of the modes at a position: (n,), or (k, n) for k positions; 1/sqrt(kg)."""
        values = self.model.plane_rows(position) @ self.vectors
        return values if np.ndim(position) else values[0]


def free_free(model: RotorModel, bending_per_plane: int, attach: Sequence[float] = ()) -> Modes:
    """Return the rigid and the first bending modes of the free rotor, with attachment modes on request.

    Parameters
    ----------
    model : RotorModel
        The rotor.
    bending_per_plane : int
        Number of bending modes kept in each plane.
    attach : sequence of float
        Axial positions of loads, m: each adds one mode, so that the static compliance there is exact.  Attachment modes are the
        static deflections of the discarded modes under these loads, diagonalised among themselves; their frequencies are natural
        frequencies of the reduced model only.

    Raises
    ------
    InputError
        If the model has fewer modes than requested, or two positions of `attach` coincide.
    """
    elastic = len(model.plane_mass) - _RIGID
    if not 0 <= bending_per_plane <= elastic - len(attach):
        raise InputError(
            f"{bending_per_plane} bending modes with {len(attach)} attachment modes requested; this rotor has"
            f" {elastic} elastic modes per plane: request fewer or give a smaller max_element"
        )
    squares, shapes = eigh(model.plane_stiffness, model.plane_mass)
    squares, shapes = squares[_RIGID:], shapes[:, _RIGID:]
    shapes = shapes * np.where(shapes[0] < 0, -1.0, 1.0)  # a fixed sign: up at the non-drive end
    kept, kept_shapes = squares[:bending_per_plane], shapes[:, :bending_per_plane]
    if len(attach):
        rest, rest_shapes = squares[bending_per_plane:], shapes[:, bending_per_plane:]
        load = model.plane_rows(attach) @ rest_shapes
        added, added_shapes = _attachment_modes(rest, load)
        kept, kept_shapes = np.append(kept, added), np.hstack([kept_shapes, rest_shapes @ added_shapes])

    translation = np.tile([1.0, 0.0], len(model.nodes)) / math.sqrt(model.total_mass)
    rotation = model.rigid_rotation(model.centre_of_mass) / math.sqrt(model.diametral_inertia)
    return Modes(
        model,
        np.concatenate([[0.0, 0.0], np.sqrt(kept) / (2 * math.pi)]),
        np.column_stack([translation, rotation, kept_shapes]),
        bending_per_plane,
    )


def _attachment_modes(squares: Array, load: Array) -> tuple[Array, Array]:
    """Diagonalise the static deflections of modes (squared frequencies `squares`) under unit loads (a, modes)."""
    deflections = (load / squares).T
    deflections = deflections / np.linalg.norm(deflections, axis=0)  # only the span matters
    mass = deflections.T @ deflections
    if np.linalg.eigvalsh(mass)[0] < 1e-10:
        raise InputError("two attachment positions are the same or too near to each other; give each once")
    values, mix = eigh((deflections.T * squares) @ deflections, mass)
    return values, deflections @ mix


@dataclass(frozen=True)
class Spring:
    """A support of the shaft at an axial position, m: stiffness in x and y, N/m, and damping, N s/m."""

    position: float
    stiffness_x: float
    stiffness_y: float
    damping: float = 0.0


@dataclass(frozen=True, eq=False)
class SupportedModes:
    """Whirl modes of the rotating rotor on springs, by ascending frequency.

    Attributes
    ----------
    speed_hz : float
        Speed.
    frequencies : (n,) array
        Damped natural frequencies, Hz, as seen in a record.
    damping_ratio : (n,) array
        Negative where unstable.
    whirl : (n,) array
        Sense of the orbits, weighted by mass: +1 circular forward, -1 circular backward, 0 straight lines.
    modes : Modes
        The basis of the amplitudes.
    amplitude_x, amplitude_y : (n_basis, n) complex arrays
        Shapes: x = Re(amplitude_x exp(2 pi i f t)), y likewise, of unit modal mass.
    """

    speed_hz: float
    frequencies: Array
    damping_ratio: Array
    whirl: Array
    modes: Modes
    amplitude_x: NDArray[np.complex128]
    amplitude_y: NDArray[np.complex128]

    @property
    def forward(self) -> NDArray[np.bool_]:
        """True where the mode whirls with the rotation."""
        return self.whirl > 0

    def at(self, position: ArrayLike) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """Return the complex deflections (x, y) of the modes at a position (or positions)."""
        shapes = self.modes.at(position)
        return shapes @ self.amplitude_x, shapes @ self.amplitude_y


def supported(
    machine: Machine,
    model: RotorModel,
    stiffness: Mapping[str, float | tuple[float, float]],
    speed_hz: float = 0.0,
    n: int = 6,
    damping: Mapping[str, float] | None = None,
) -> SupportedModes:
    """Return the first whirl modes of the rotor on springs at its touchdown bearings.

    Parameters
    ----------
    machine, model : Machine, RotorModel
        The rotor.
    stiffness : mapping
        End to N/m, or to (x, y) in N/m.
    speed_hz : float
        Speed, Hz; its sense is the machine's `rotation`.
    n : int
        Number of modes (a forward and a backward one count as two).
    damping : mapping, optional
        End to N s/m of the supports; the rotor's modal damping always acts.

    Raises
    ------
    InputError
        If an end is missing or unknown, or a stiffness is not positive.
    """
    return whirl_modes(model, _springs(machine, stiffness, damping), machine.sense * speed_hz, n)


def _springs(
    machine: Machine,
    stiffness: Mapping[str, float | tuple[float, float]],
    damping: Mapping[str, float] | None,
) -> list[Spring]:
    damping = damping or {}
    for end in damping:
        machine.bearing(end)
    springs = []
    for end, (position, value) in zip(machine.ends, spring_positions(machine, stiffness), strict=True):
        x, y = np.broadcast_to(np.asarray(value, dtype=float), (2,))
        springs.append(Spring(position, float(x), float(y), damping.get(end, 0.0)))
    return springs


def whirl_modes(model: RotorModel, springs: Sequence[Spring], speed_hz: float = 0.0, n: int = 6) -> SupportedModes:
    """Return the first n whirl modes on springs at any positions; a negative speed is clockwise.

    The eigenproblem is solved in n + 10 free-free modes plus the attachment modes of the springs (relative error of the
    frequencies 1e-6 to 2e-5, up to pinned ends).
    """
    if n < 1:
        raise InputError(f"{n} modes requested; request at least one")
    attach = sorted({spring.position for spring in springs})
    elastic = len(model.plane_mass) - _RIGID - len(attach)
    basis = free_free(model, min(elastic, n + 10), attach)
    omega = 2 * math.pi * speed_hz
    stiffness_x = np.diag((2 * math.pi * basis.frequencies) ** 2)
    stiffness_y = stiffness_x.copy()
    damping = np.diag(basis.damping)
    for spring in springs:
        shape = basis.at(spring.position)
        stiffness_x += spring.stiffness_x * np.outer(shape, shape)
        stiffness_y += spring.stiffness_y * np.outer(shape, shape)
        damping += spring.damping * np.outer(shape, shape)
    size = basis.n
    if all(spring.stiffness_x == spring.stiffness_y for spring in springs):
        # isotropic supports: with p = x + i y the planes combine into p'' + (D - i omega P) p' + K p = 0
        values, vectors = _state_modes(stiffness_x, damping - 1j * omega * basis.gyro)
        backward = values.imag < 0
        first = np.where(backward, vectors.conj(), vectors)
        x, y = first, np.where(backward, 1j, -1j) * first
        values = np.where(backward, values.conj(), values)
    else:
        zero = np.zeros((size, size))
        coupled = np.block([[damping, omega * basis.gyro], [-omega * basis.gyro, damping]])
        values, vectors = _state_modes(np.block([[stiffness_x, zero], [zero, stiffness_y]]), coupled)
        vectors, values = vectors[:, values.imag > 0], values[values.imag > 0]
        x, y = vectors[:size], vectors[size:]
    chosen = np.argsort(values.imag, kind="stable")[:n]
    values, x, y = values[chosen], x[:, chosen], y[:, chosen]
    scale = np.sqrt(np.sum(np.abs(x) ** 2 + np.abs(y) ** 2, axis=0))
    x, y = x / scale, y / scale
    turning = -2 * np.sum(np.imag(x.conj() * y), axis=0)
    return SupportedModes(
        speed_hz,
        values.imag / (2 * math.pi),
        -values.real / np.abs(values),
        turning * (-1 if speed_hz < 0 else 1),
        basis,
        x,
        y,
    )


def _state_modes(stiffness: NDArray, damping: NDArray) -> tuple[NDArray, NDArray]:
    """Return oscillating eigenvalues and displacement vectors of q'' + D q' + K q = 0."""
    size = len(stiffness)
    # in units of the lowest stiffness' frequency both halves of the state are of one size
    unit = math.sqrt(float(np.trace(stiffness).real) / size)
    state = np.block([[np.zeros((size, size)), np.eye(size)], [-stiffness / unit**2, -damping / unit]])
    values, vectors = eig(state)
    values = values * unit
    swinging = np.abs(values.imag) > 1e-6 * np.abs(values)  # the overdamped ones have no frequency
    return values[swinging], vectors[:size, swinging]
