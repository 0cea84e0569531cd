"""The residual force at the touchdown bearings: with it, the model's rotor would follow the record.

Between contacts the rotor is linear: rigid and bending modes with the gyroscopic coupling at the drop's speed.  So the readings
that a force at the two ends would add are linear in its values at instants `STEP_S` apart, interpolated linearly.  These are
fitted to the whitened residuals together with the error of the state at the release.  Prior of the force: a random walk
(W. Gersch, G. Kitagawa, J. Business Econ. Statist. 2 (1984) 253) with the step of maximum evidence (D. J. C. MacKay, Neural
Computation 4 (1992) 415).

The force is relative to that of the simulation on its own path.  Before the first contact only a missing effect (or noise) makes
one; after it, so does a simulation that bounces elsewhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, expm
from tdbsim.drop_model import DropModel

from tdbmon.analysis.autoregression import whitened
from tdbmon.diagnosis.left_over import LeftOver
from tdbmon.estimate import Z95
from tdbmon.identify.prediction import shapes_at

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

STEP_S = 4e-4  # interval of the force's values: a contact lasts several
_STEPS = np.geomspace(1.0, 3e4, 19)  # N, steps of the walk that are tried; the least bounds the band from below
_START = 10.0  # prior standard deviation of the force at the release, in steps
_STATE_SIGMA = (2e-5, 5e-3)  # m and m/s, prior standard deviations of the error of the rigid state at the release


@dataclass(frozen=True)
class Summary:
    """The residual force at one end over some time.

    Attributes
    ----------
    rms, band : float
        rms of its magnitude, and of the half-width of its 95 % interval, N.
    mean : complex
        x + i y, N.
    axis : float
        Its principal direction, rad from +x towards +y, -pi/2 to pi/2.
    straight : float
        1 if it acts along that direction only, 0 if along none (it rotates, or comes from all sides).
    """

    rms: float
    band: float
    mean: complex
    axis: float
    straight: float


@dataclass(frozen=True, eq=False)
class ResidualForce:
    """The residual force of one drop.

    Attributes
    ----------
    drop : str
        The record's file.
    time : (k,) array
        s after the release.
    force : (2, k) complex array
        F_x + i F_y on the rotor at the two ends, N.
    band : (2, 2, k) array
        Half-width of the 95 % interval of x and y due to the probes' noise, N.
    place : (2, k) complex array
        Shaft centre relative to the bearing's, m: simulated, plus the residual where all probes were read.
    simulated : (2, k) complex array
        Force of the ring on the rotor in the simulation, N.
    step : float
        Step of the random walk of maximum evidence, N, which limits how fast the force may change.
    """

    drop: str
    time: Array
    force: Complex
    band: Array
    place: Complex
    simulated: Complex
    step: float

    @property
    def fall(self) -> NDArray[np.bool_]:
        """True up to one step before the simulation's first contact at either end, (k,)."""
        pressed = np.flatnonzero((np.abs(self.simulated) > 0).any(axis=0))
        return np.arange(len(self.time)) < (pressed[0] - 1 if pressed.size else len(self.time))

    def summary(self, end: int, within: NDArray[np.bool_]) -> Summary | None:
        """Return the summary of the force at an end over some instants; None without any."""
        if not within.any():
            return None
        force, band = self.force[end, within], self.band[end][:, within]
        square, turned = float(np.mean(np.abs(force) ** 2)), complex(np.mean(force**2))
        return Summary(
            rms=math.sqrt(square),
            band=math.sqrt(float(np.mean(np.sum(band**2, axis=0)))),
            mean=complex(force.mean()),
            axis=float(np.angle(turned) / 2),
            straight=abs(turned) / square if square > 0 else 0.0,
        )

    @property
    def stands_out(self) -> Array:
        """Share of time in which the force exceeds its band, at each end, (2,)."""
        parts = np.stack([self.force.real, self.force.imag], axis=1)
        return np.asarray(np.mean((np.abs(parts) > self.band).any(axis=1), axis=1))


def residual_force(drop: LeftOver) -> ResidualForce:
    """Return the force at both ends that explains the residual of a drop after the release.

    Parameters
    ----------
    drop : LeftOver
    """
    first = int(np.searchsorted(drop.time, 0.0))
    time = drop.time[first:]
    interval = float(drop.time[-1] - drop.time[0]) / (len(drop.time) - 1)
    stride = max(1, round(STEP_S / interval))
    ramps = max(1, math.ceil((len(time) - 1) / stride))
    positions = tuple(probe.position for probe in drop.probes)
    ramp, jump, state = responses(drop.motion.model, drop.omega, positions, interval, stride, len(time))
    columns = np.zeros((len(drop.probes), len(time), 2, 2, ramps + 1))
    columns[..., 0] = _START * _seen(jump, drop)
    for k in range(ramps):
        columns[:, k * stride :, :, :, k + 1] = _seen(ramp[:, : len(time) - k * stride], drop)
    rigid = _seen(state, drop) * np.array([*_STATE_SIGMA, *_STATE_SIGMA])[:, None]
    target = _white(drop.filled[:, first:, None], drop)[:, 0]
    walk = _white(columns.reshape(len(drop.probes), len(time), -1), drop)
    step, values, covariance = _likeliest(walk, _white(rigid.reshape(len(drop.probes), len(time), -1), drop), target)
    # cumulative sum of the walk: from (end, direction, step) to (end, direction, instant)
    total = np.tril(np.ones((ramps + 1, ramps + 1)))
    total[:, 0] = _START
    force = values.reshape(2, 2, ramps + 1) @ total.T
    blocks = covariance.reshape(4, ramps + 1, 4, ramps + 1)
    variance = np.stack([np.einsum("ij,jk,ik->i", total, blocks[part, :, part], total) for part in range(4)])
    kept = np.arange(ramps + 1) * stride < len(time)
    instants = (np.arange(ramps + 1) * stride)[kept]
    return ResidualForce(
        drop=drop.name,
        time=time[instants],
        force=(force[:, 0] + 1j * force[:, 1])[:, kept],
        band=Z95 * np.sqrt(np.maximum(variance, 0.0)).reshape(2, 2, -1)[..., kept],
        place=(drop.place + np.nan_to_num(drop.at_ends))[:, first:][:, instants],
        simulated=drop.force[:, first:][:, instants],
        step=step,
    )


def responses(
    model: DropModel, omega: float, positions: tuple[float, ...], interval: float, stride: int, count: int
) -> tuple[Complex, Complex, Complex]:
    """Return responses of the free rotor at some positions, x + i y, m.

    In x + i y both planes have one equation: q'' + (D - i omega G) q' + K q = S^T F.

    Parameters
    ----------
    model : DropModel
    omega : float
        rad/s.
    positions : (r,) tuple
        m.
    interval : float
        s between samples.
    stride, count : int
        Samples during which the force rises, and samples returned.

    Returns
    -------
    ramp, jump : (r, count, 2) complex arrays
        To a force along x at each end that rises from 0 to 1 N within `stride` samples and stays, and to a step of 1 N.
    state : (r, count, 4) complex array
        To an initial 1 m along x at the first end, 1 m/s there, and the same at the second end, of the rotor as a straight body.
    """
    arrays, n = model.arrays, model.n
    system = np.zeros((2 * n, 2 * n), dtype=complex)
    system[:n, n:] = np.eye(n)
    system[n:, :n] = -np.diag(arrays.square)
    system[n:, n:] = -np.diag(arrays.damping) + 1j * omega * arrays.gyro
    # a force that is linear between samples, exactly: the block's exponential holds the integrals
    # (C. F. Van Loan, IEEE Trans. Automatic Control 23 (1978) 395)
    block = np.zeros((2 * n + 4, 2 * n + 4), dtype=complex)
    block[: 2 * n, : 2 * n] = system * interval
    block[n : 2 * n, 2 * n : 2 * n + 2] = arrays.at_end.T * interval
    block[2 * n : 2 * n + 2, 2 * n + 2 :] = np.eye(2)
    whole = expm(block)
    advance, held, rising = np.split(whole[: 2 * n], [2 * n, 2 * n + 2], axis=1)
    straight = np.linalg.inv(arrays.at_end[:, :2])
    now = np.zeros((2 * n, 8), dtype=complex)
    now[:2, 4::2] = straight
    now[n : n + 2, 5::2] = straight
    shapes = shapes_at(model.modes, positions)
    out = np.empty((len(positions), count, 8), dtype=complex)
    for k in range(count):
        out[:, k] = shapes @ now[:n]
        now = advance @ now
        now[:, :2] += held * min(k / stride, 1.0) + (rising / stride if k < stride else 0.0)
        now[:, 2:4] += held
    return out[..., :2], out[..., 2:4], out[..., 4:]


def _seen(motion: Complex, drop: LeftOver) -> Array:
    """Return the readings of motions x + i y (p, count, c), and of the same turned from x to y, (p, count, c, 2)."""
    seen = np.tensordot(drop.axes, motion, axes=1)
    return np.stack([seen.real, -seen.imag], axis=-1)


def _white(columns: Array, drop: LeftOver) -> Array:
    """Return columns (p, count, c) of readings from the release on, whitened, in units of the noise, (rows, c).

    Left out are each probe's first samples, and those that are missing or follow a missing one within the filter.
    """
    rows = []
    there = np.isfinite(drop.whitened[:, -columns.shape[1] :])
    for block, noise, kept in zip(columns, drop.noise, there, strict=True):
        first = len(noise.colour)
        rows.append(whitened(block.T, noise.colour).T[first:][kept[first:]] / noise.innovation)
    return np.concatenate(rows)


def _likeliest(walk: Array, state: Array, target: Array) -> tuple[float, Array, Array]:
    """Return the step of maximum evidence, and means and covariance of the walk's increments, for readings in units of noise.

    Gaussian priors: the same width for all increments, 1 for the state, which is integrated out.
    """
    factor = cho_factor(np.eye(state.shape[1]) + state.T @ state)
    taken = cho_solve(factor, state.T @ np.column_stack([walk, target]))
    square = walk.T @ walk - walk.T @ state @ taken[:, :-1]
    product = walk.T @ target - walk.T @ state @ taken[:, -1]
    values, vectors = np.linalg.eigh((square + square.T) / 2)
    values, along = np.maximum(values, 0.0), vectors.T @ product
    # log of the evidence, up to terms common to all widths
    evidence = [np.sum(along**2 / (values + w**-2)) - np.sum(np.log1p(values * w**2)) for w in _STEPS]
    width = float(_STEPS[int(np.argmax(evidence))])
    covariance = (vectors / (values + width**-2)) @ vectors.T
    return width, covariance @ product, covariance
