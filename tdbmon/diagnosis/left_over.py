"""Residuals of a fitted model: where and when they exceed the noise, and at which frequencies."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tdbsim.machine import Machine, Probe
from tdbsim.observe import FORCES, observed
from tdbsim.sensors import SensorChain
from tdbsim.simulate import Trajectory

from tdbmon.analysis.contact_events import NOISE_S
from tdbmon.diagnosis.contender import Contender
from tdbmon.identify.drop import straight_shaft
from tdbmon.identify.noise import Noise

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_SHORTEST = 50  # least number of samples of a spectrum: with fewer a line is as broad as the spectrum
PHASES = ("levitated", "fall", "first contact", "after")
DIRECTIONS = ("x", "y", "radial", "tangential")


@dataclass(frozen=True, eq=False)
class LeftOver:
    """One drop, measured less simulated (SI); p probes, k samples.

    Attributes
    ----------
    name : str
        The record's file.
    time : (k,) array
        s after the release of the fitted model.
    probes : tuple of Probe
    noise : tuple of Noise
        One per probe.
    measured, simulated : (p, k) arrays
        Readings, m; NaN where a measured one is missing.
    axes : (p, p) complex array
        Matrix from motions x + i y in the probes' planes to readings (see `seen_along`).
    to_ends : (2, p) complex array
        Matrix from readings to x + i y at the two ends; zeros if `sees_ends` is False.
    place : (2, k) complex array
        Simulated shaft centre at the ends, relative to the bearings' centres, m.
    force : (2, k) complex array
        Simulated force of the ring on the rotor, N.
    touch : tuple of pair or None
        Begin and end of the first simulated contact of each end, s; None without one.
    omega : float
        rad/s, negative clockwise.
    motion : Trajectory
    """

    name: str
    time: Array
    probes: tuple[Probe, ...]
    noise: tuple[Noise, ...]
    measured: Array
    simulated: Array
    axes: Complex
    to_ends: Complex
    place: Complex
    force: Complex
    touch: tuple[tuple[float, float] | None, ...]
    omega: float
    motion: Trajectory

    @property
    def speed(self) -> float:
        """Speed, Hz."""
        return abs(self.omega) / (2 * math.pi)

    @property
    def residual(self) -> Array:
        """Measured less simulated, m; NaN where nothing was measured."""
        return self.measured - self.simulated

    @property
    def filled(self) -> Array:
        """The residual with 0 where nothing was measured."""
        return np.nan_to_num(self.residual, nan=0.0)

    @property
    def whitened(self) -> Array:
        """The residual whitened, in units of the noise; NaN where a sample, or one before it that the filter uses, is missing."""
        rows = zip(self.residual, self.noise, strict=True)
        return np.array([noise.whiten(row) for row, noise in rows])

    @property
    def sees_ends(self) -> bool:
        """True if the probes determine both directions at both ends."""
        return bool(self.to_ends.any())

    @property
    def complete(self) -> NDArray[np.bool_]:
        """True from the release on where all probes were read; all are needed to determine the directions."""
        return (self.time >= 0) & np.isfinite(self.measured).all(axis=0)

    @property
    def at_ends(self) -> Complex:
        """The residual at the ends, x + i y, m; NaN where a probe was not read."""
        return np.where(np.isfinite(self.measured).all(axis=0), self.to_ends @ self.filled, np.nan)

    @property
    def noise_at_ends(self) -> Array:
        """Standard deviation of the noise of x and y at the ends (2, 2), m."""
        sigma = np.array([each.sigma for each in self.noise])
        return np.sqrt(np.stack([self.to_ends.real**2, self.to_ends.imag**2], axis=1) @ sigma**2)

    def phase(self, end: int) -> NDArray[np.intp]:
        """Return the index in `PHASES` of every sample, (k,)."""
        out = np.where(self.time < 0, 0, 1)
        touch = self.touch[end]
        if touch is not None:
            out[self.time >= touch[0]] = 2
            out[self.time > touch[1]] = 3
        return out


def left_over(contender: Contender, horizon: float) -> tuple[LeftOver, ...]:
    """Return the residuals of a fitted model in each drop.

    Parameters
    ----------
    contender : Contender
    horizon : float
        s after the first guess of the release.

    Raises
    ------
    InputError
        If the model cannot be simulated to the horizon.
    """
    return tuple(_of_drop(contender, drop, horizon) for drop in range(len(contender.problem.drops)))


def _of_drop(contender: Contender, drop: int, horizon: float) -> LeftOver:
    problem = contender.problem
    measured, machine = problem.drops[drop], problem.model.machine
    _, own = problem.values(contender.fit.point, drop)
    axes = seen_along(measured.probes, problem.variant(contender.fit.point, drop, horizon).sensors.chain)
    found = problem.simulated(contender.fit.point, drop, horizon)
    motion, time = found.prediction.motion, found.since - own["release"]
    force = _forces(motion)
    return LeftOver(
        name=measured.name,
        time=time,
        probes=measured.probes,
        noise=measured.noise,
        measured=measured.reading[:, found.span],
        simulated=found.readings,
        axes=axes,
        to_ends=to_ends(machine, measured.probes, axes),
        place=motion.place,
        force=force,
        touch=tuple(_first(time, np.abs(row) > 0) for row in force),
        omega=measured.omega,
        motion=motion,
    )


def seen_along(probes: Sequence[Probe], chain: SensorChain) -> Complex:
    """Return the complex matrix (probes, probes); readings are the real part of its product with x + i y in the probes' planes.

    It contains a model's probe angles, gains and crosstalk, but no delays of channels.
    """
    links = [chain.of(probe.name) for probe in probes]
    alone = [
        link.gain * cmath.exp(-1j * (probe.angle + link.angle_error)) for probe, link in zip(probes, links, strict=True)
    ]
    axes = np.diag(np.array(alone, dtype=complex))
    rows = {probe.name: row for row, probe in enumerate(probes)}
    for name, (source, part) in chain.leaks.items():
        if name in rows and source in rows:
            axes[rows[name], rows[source]] += part * alone[rows[source]]
    return axes


def to_ends(machine: Machine, probes: Sequence[Probe], axes: Complex) -> Complex:
    """Return the matrix (2, probes) from readings to x + i y at the ends of a straight shaft; zeros if undetermined.

    Parameters
    ----------
    machine : Machine
    probes : sequence of Probe
    axes : (probes, probes) complex array
        From `seen_along`.
    """
    design = straight_shaft(machine, probes, axes)
    if np.linalg.matrix_rank(design, tol=1e-3) < 4:
        return np.zeros((2, len(probes)), dtype=complex)
    inverse = np.linalg.pinv(design)
    return np.asarray(inverse[0::2] + 1j * inverse[1::2], dtype=complex)


def _forces(motion: Trajectory) -> Complex:
    """Return the force of the ring on the rotor at both ends, (2, k), N."""
    forces = observed(motion).forces
    out: Complex = forces[:, FORCES.index("force_x")] + 1j * forces[:, FORCES.index("force_y")]
    return out


def _first(time: Array, pressed: NDArray[np.bool_]) -> tuple[float, float] | None:
    """Return begin and end of the first contact; breaks shorter than `NOISE_S` do not end it."""
    at = time[pressed & (time > 0)]
    if not at.size:
        return None
    breaks = np.flatnonzero(np.diff(at) > NOISE_S)
    return float(at[0]), float(at[breaks[0]] if breaks.size else at[-1])


def by_phase(drops: Sequence[LeftOver], machine: Machine) -> dict[str, Array]:
    """Return the whitened rms of each probe in each of the `PHASES` of its end, (4,); NaN without samples."""
    out = {}
    for name in dict.fromkeys(probe.name for drop in drops for probe in drop.probes):
        squares: list[list[float]] = [[] for _ in PHASES]
        for drop in drops:
            for probe, row in zip(drop.probes, drop.whitened, strict=True):
                if probe.name != name:
                    continue
                phase = drop.phase(machine.ends.index(probe.end))
                for k, square in enumerate(squares):
                    square.extend((row[(phase == k) & np.isfinite(row)] ** 2).tolist())
        out[name] = np.array([math.sqrt(np.mean(square)) if square else math.nan for square in squares])
    return out


def by_direction(drops: Sequence[LeftOver]) -> Array:
    """Return the rms of the residual at each end in `DIRECTIONS`, over that of the noise, from the release on, (2, 4).

    Radial points from the bearing's centre to the simulated shaft, tangential a quarter turn counter-clockwise from there.  Drops
    whose probes do not determine the directions are left out, and samples that one probe lacks; NaN if none is left.
    """
    squares: list[Array] = []
    for drop in drops:
        if not drop.sees_ends:
            continue
        after = drop.complete
        if not after.any():
            continue
        left = drop.at_ends[:, after]
        turned = left * np.exp(-1j * np.angle(drop.place[:, after]))
        noise = drop.noise_at_ends
        mean = np.sqrt(np.mean(noise**2, axis=1))[:, None]
        parts = [left.real / noise[:, :1], left.imag / noise[:, 1:], turned.real / mean, turned.imag / mean]
        squares.append(np.array([np.mean(part**2, axis=1) for part in parts]).T)
    if not squares:
        return np.full((2, len(DIRECTIONS)), math.nan)
    return np.asarray(np.sqrt(np.mean(squares, axis=0)))


@dataclass(frozen=True, eq=False)
class Line:
    """A peak of the residual's spectrum.

    Attributes
    ----------
    drop, end : str
    frequency : float
        Hz; negative where the residual whirls backward.
    order : float or None
        The same in multiples of the rotation; None at standstill.
    amplitude, noise : float
        0-pk of the whirl, and the rms of noise alone there, m.
    resolution : float
        Hz; closer lines are not resolved.
    """

    drop: str
    end: str
    frequency: float
    order: float | None
    amplitude: float
    noise: float
    resolution: float

    @property
    def order_words(self) -> str:
        """Its frequency in multiples of the rotation as text, or a dash."""
        return f"{abs(self.order):.2f}" if self.order is not None else "–"

    @property
    def words(self) -> str:
        """Its frequency and sense: ``46 Hz forward``."""
        if self.frequency == 0:
            return "0 Hz (offset)"
        return f"{abs(self.frequency):.0f} Hz {'forward' if self.frequency > 0 else 'backward'}"


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Full spectrum of the residual at one end of one drop, from the release on.

    Attributes
    ----------
    drop, end : str
    speed : float
        Hz.
    frequency : (n,) array
        Hz, rising; positive is forward, with the rotation.
    amplitude, noise : (n,) arrays
        0-pk, and the rms of noise alone, m.
    threshold : float
        Multiple of the noise that noise alone exceeds somewhere in one of a hundred spectra.
    resolution : float
        Hz; closer lines are not resolved.
    """

    drop: str
    end: str
    speed: float
    frequency: Array
    amplitude: Array
    noise: Array
    threshold: float
    resolution: float

    def lines(self, most: int = 3) -> list[Line]:
        """Return the highest peaks above the threshold, the highest first."""
        a = self.amplitude
        peak = np.zeros(len(a), dtype=bool)
        peak[1:-1] = (a[1:-1] > a[:-2]) & (a[1:-1] >= a[2:]) & (a[1:-1] > self.threshold * self.noise[1:-1])
        found = sorted(np.flatnonzero(peak), key=lambda i: -a[i])[:most]
        return [
            Line(
                self.drop, self.end, float(self.frequency[i]),
                float(self.frequency[i] / self.speed) if self.speed else None, float(a[i]), float(self.noise[i]),
                self.resolution,
            )
            for i in found
        ]  # fmt: skip


def spectra(drop: LeftOver, machine: Machine) -> list[Spectrum]:
    """Return the full spectra of a drop's residual at both ends; none if the probes do not determine the directions.

    Taken over the longest stretch after the release in which all probes were read, since a missing sample is no zero residual.
    Hann window; noise by the autoregressive model of the levitated stretch (G. E. P. Box, G. M. Jenkins, G. C. Reinsel, Time
    Series Analysis, sec. 6.3), whose periodogram is exponentially distributed about its mean.
    """
    runs = np.ma.clump_unmasked(np.ma.masked_array(drop.time, ~drop.complete))
    longest = max(runs, key=lambda run: run.stop - run.start, default=slice(0))
    left = drop.at_ends[:, longest]
    count = left.shape[1]
    if not drop.sees_ends or count < _SHORTEST:
        return []
    interval = float(drop.time[-1] - drop.time[0]) / (len(drop.time) - 1)
    window = np.hanning(count + 2)[1:-1]
    frequency = np.fft.fftshift(np.fft.fftfreq(count, interval))
    turning = np.exp(-2j * np.pi * frequency * interval)
    square = np.zeros((2, count))
    for column, noise in zip(drop.to_ends.T, drop.noise, strict=True):
        colour = 1 - sum((a * turning ** (k + 1) for k, a in enumerate(noise.colour)), np.zeros(count, dtype=complex))
        square += np.abs(column[:, None]) ** 2 * noise.innovation**2 / np.abs(colour) ** 2
    square *= float(np.sum(window**2) / np.sum(window) ** 2)
    amplitude = np.abs(np.fft.fftshift(np.fft.fft(left * window, axis=1), axes=1)) / np.sum(window)
    sense = 1 if drop.omega >= 0 else -1
    order = np.argsort(sense * frequency)
    return [
        Spectrum(
            drop=drop.name,
            end=end,
            speed=drop.speed,
            frequency=(sense * frequency)[order],
            amplitude=amplitude[e][order],
            noise=np.sqrt(square[e])[order],
            threshold=math.sqrt(-math.log(0.01 / count)),
            resolution=2 / (count * interval),
        )
        for e, end in enumerate(machine.ends)
    ]
