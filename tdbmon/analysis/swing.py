"""Pendulum swing of the rotor in its clearance, and the clearance radius that follows from its frequency.

A shaft rolling at the bottom of a bore swings like a pendulum whose length is the radius R of its centre's path.  With
different clearances at the two ends, static loads W_i, angular frequency w and mode shape phi, the force that makes the
free rotor move so, H(w)^-1 phi, must equal the restoring force of the weight, -W_i phi_i / R_i, at each end, so that

    R_i = -W_i phi_i / (H(w)^-1 phi)_i

for small swings.  H is the receptance of the free-free rotor at the bearing planes: for a rigid one H^-1 = -w^2 M, and
bending under the inertia forces of the swing makes it a percent or so softer.  The inner ring is driven by friction and
adds J/r^2.  With amplitude A the frequency decreases by (A/R)^2/16 for the swing's own amplitude and by (A/R)^2/8 for
that of the other one (second-order terms of the pendulum).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import xarray as xr
from tdbsim.machine import Machine
from tdbsim.modes import Modes, free_free
from tdbsim.rotor import RotorModel, static_loads

from tdbmon.analysis.jackknife import jackknife
from tdbmon.analysis.rest import path_radius, rolling_mass, total_travel
from tdbmon.analysis.unbroken import pieces
from tdbmon.estimate import Estimate

_WAYS = ("parallel", "conical")  # ends in phase, and in antiphase
_CYCLES = 30  # least periods of the slower swing per window
_BEATS = 3.0  # least beat periods of both swings per window: with fewer, close lines are not resolved
_BENDING = 6  # free-free bending modes in the receptance
_MODEL = 0.0025  # relative standard deviation of the model: masses of the drawing, and rigid line on a bent shaft
_THERE = 0.9  # least share of valid samples in a window
_NEAR = 0.2  # relative search range about a prediction: that of a path radius 40 % off
_STANDS_OUT = 30.0  # least ratio of a peak to the median power in the range
_WIDEST = 0.5  # largest ratio of amplitude to radius for which the second-order term suffices


@dataclass(frozen=True)
class Swing:
    """The swing of the rotor in its clearance.

    Attributes
    ----------
    frequencies : tuple of Estimate
        Small-amplitude frequency of both modes, Hz, the lower one first; one of them may be missing.
    shapes : tuple of dict or None
        Mode shape: signed relative amplitude by end, the largest being one; None for a missing mode.
    gap : dict
        Path radius by end (sum of gap, ball clearance and deflection), m.
    """

    frequencies: tuple[Estimate, Estimate]
    shapes: tuple[dict[str, float] | None, dict[str, float] | None]
    gap: dict[str, Estimate]

    @property
    def ways(self) -> tuple[str, ...]:
        """Type of each mode: "parallel" (ends in phase) or "conical" (ends in antiphase); "" if missing."""
        return tuple("" if shape is None else _way(*shape.values()) for shape in self.shapes)


def find_swing(planes: xr.Dataset, machine: Machine, rotor: RotorModel, settled_s: float) -> Swing | None:
    """Estimate frequencies, mode shapes and path radii of the swing over the settled stretch of a record.

    Parameters
    ----------
    planes : Dataset
        Result of `to_planes`, both ends known.
    machine, rotor
        For loads, masses and the search range of the frequencies.
    settled_s : float
        Time from which both ends stay in contact with their rings, s.

    Returns
    -------
    Swing or None
        None if the settled stretch contains fewer than five windows (none spans a gap in the time axis), or no swing is
        significant.
    """
    ends = machine.ends
    loads = np.array([static_loads(machine, rotor)[end] for end in ends])
    basis = free_free(rotor, _BENDING)
    nominal = _path_radii(machine, loads)
    predicted, _ = _modes(basis, machine, loads, nominal)
    time, rate = planes.time.to_numpy(), planes.attrs["sampling_hz"]
    inside = time >= settled_s
    x = planes.displacement.sel(axis="x").to_numpy()[:, inside]
    apart = max(float(predicted[1] - predicted[0]), 1 / float(np.ptp(time)))
    window = int(max(_CYCLES / predicted[0], _BEATS / apart) * rate)
    if x.shape[1] < 5 * window:
        return None
    whole = [x[:, piece] for piece in pieces(time[inside])]
    if sum(each.shape[1] // window for each in whole) < 5:
        return None
    table = _track(whole, rate, window, predicted, nominal)
    if table is None:
        return None
    lower, higher = (_mode(rows, machine, basis, loads) for rows in table)
    radii = [mode.radii for mode in (lower, higher) if mode is not None]
    if not radii:
        return None
    gap = {}
    for i, end in enumerate(ends):
        values = np.array([r[i][0] for r in radii])
        sigma = np.array([r[i][1] for r in radii])
        weight = sigma**-2
        value = float(np.sum(weight * values) / np.sum(weight))
        # disagreement of the two modes measures the model error
        misfit = max(1.0, float(np.sum(weight * (values - value) ** 2)) / max(len(values) - 1, 1))
        spread = float(np.hypot(np.sqrt(misfit / np.sum(weight)), _MODEL * value))
        gap[end] = Estimate.from_sigma(value, spread, "um", "pendulum swing in the clearance, two ends coupled")
    untold = Estimate.missing("Hz", "only the other swing is above the noise")
    return Swing(
        (untold if lower is None else lower.frequency, untold if higher is None else higher.frequency),
        (None if lower is None else lower.shape, None if higher is None else higher.shape),
        gap,
    )


def predicted_swing(machine: Machine, rotor: RotorModel) -> tuple[float, float]:
    """Return both swing frequencies predicted from the machine file, Hz."""
    (lower, higher), _ = _predicted(machine, rotor)
    return float(lower), float(higher)


def predicted_ways(machine: Machine, rotor: RotorModel) -> tuple[str, ...]:
    """Return the types (`Swing.ways`) of both modes predicted from the machine file."""
    _, shapes = _predicted(machine, rotor)
    return tuple(_way(*shape) for shape in shapes.T)


def _predicted(machine: Machine, rotor: RotorModel) -> tuple[np.ndarray, np.ndarray]:
    """Return the result of `_modes` for the nominal values of the machine file."""
    loads = np.array([static_loads(machine, rotor)[end] for end in machine.ends])
    return _modes(free_free(rotor, _BENDING), machine, loads, _path_radii(machine, loads))


def _way(first: float, second: float) -> str:
    return _WAYS[bool(first * second < 0)]


def _path_radii(machine: Machine, loads: np.ndarray) -> np.ndarray:
    bearings = zip(machine.touchdown_bearings, loads.tolist(), strict=True)
    return np.array([path_radius(bearing, total_travel(bearing, load)) for bearing, load in bearings])


def carried_shares(machine: Machine, rotor: RotorModel) -> dict[str, dict[str, float]]:
    """Return, for the rigid rotor's mass at each end, the shares that move with each of the ends, which add up to one."""
    mass = _rigid_mass_matrix(machine, rotor)
    shares = mass / mass.sum(axis=1, keepdims=True)
    return {
        end: dict(zip(machine.ends, row.tolist(), strict=True)) for end, row in zip(machine.ends, shares, strict=True)
    }


def _rigid_mass_matrix(machine: Machine, rotor: RotorModel) -> np.ndarray:
    """Return the mass matrix of the rigid rotor in the displacements of the ends."""
    a, b = (machine.bearing(end).position - rotor.centre_of_mass for end in machine.ends)
    # translation and tilt from the ends' displacements
    turn = np.linalg.inv(np.array([[1.0, a], [1.0, b]]))
    return np.asarray(turn.T @ np.diag([rotor.total_mass, rotor.diametral_inertia]) @ turn)


def _pull(basis: Modes, machine: Machine, w: float, phi: np.ndarray) -> np.ndarray:
    """Return the forces at the ends, towards the centre, for which the free rotor with the rolling rings moves as `phi`.

    `w` is the angular frequency, rad/s.
    """
    shapes = basis.at([machine.bearing(end).position for end in machine.ends])
    receptance = shapes / ((2 * np.pi * basis.frequencies) ** 2 - w**2) @ shapes.T
    rings = [rolling_mass(bearing) for bearing in machine.touchdown_bearings]
    return np.asarray(-np.linalg.solve(receptance, phi) + w**2 * np.array(rings) * phi)


def _modes(basis: Modes, machine: Machine, loads: np.ndarray, radii: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies, Hz, and shapes (end, mode) of both swings of a flexible rotor with path radii `radii`, m, at its ends.

    A slender rotor swings much more slowly than a rigid one, since the shaft between heavy wheels bends in the swing.
    """
    shapes = basis.at([machine.bearing(end).position for end in machine.ends])
    rings = np.diag([rolling_mass(bearing) for bearing in machine.touchdown_bearings])
    mass = np.eye(len(basis.frequencies)) + shapes.T @ rings @ shapes
    stiffness = np.diag((2 * np.pi * basis.frequencies) ** 2) + shapes.T @ np.diag(loads / radii) @ shapes
    values, vectors = np.linalg.eig(np.linalg.solve(mass, stiffness))
    lowest = np.argsort(values)[:2]
    return np.sqrt(values[lowest]) / (2 * np.pi), shapes @ vectors[:, lowest]


def _track(
    whole: list[np.ndarray], rate: float, window: int, predicted: np.ndarray, nominal: np.ndarray
) -> list[np.ndarray] | None:
    """Return frequency and complex amplitude of both swings by window, over the stretches (end, samples) without a gap.

    For each mode an array (windows, 2 + 4): frequency corrected for both amplitudes, its weight, and real, then imaginary
    parts of the amplitude at both ends; None if the lower swing is found in fewer than four windows.
    """
    thin = max(1, int(rate / (20 * predicted[1])))
    rate, window = rate / thin, window // thin
    rows: list[list[np.ndarray]] = [[], []]
    for part in _windows(whole, thin, window):
        there = np.isfinite(part).all(axis=0)
        if there.mean() < _THERE:
            continue
        taper = np.hanning(window) * there
        fit = _fit_window(np.where(there, part, 0.0), there, taper, rate, predicted)
        if fit is None:
            continue
        wide = np.abs(fit.amplitude) / nominal  # (mode, end)
        if wide.max() > _WIDEST:
            continue
        # the frequency decreases with the square of its own amplitude, and twice as much with that of the other swing
        own = np.mean(wide**2, axis=1)
        correction = 1 + own / 16 + 2 * own[::-1] / 16
        least = 4 * np.sqrt(fit.noise * 4 / np.sum(taper**2))
        for mode in np.flatnonzero(np.isfinite(fit.frequency)):
            a = fit.amplitude[mode]
            if np.abs(a).max() < least:
                continue
            frequency = fit.frequency[mode] * correction[mode]
            rows[mode].append(np.concatenate([[frequency, fit.sigma[mode] ** -2], a.real, a.imag]))
    if len(rows[0]) < 4:
        return None
    return [np.array(r).reshape(-1, 6) for r in rows]


def _windows(whole: list[np.ndarray], thin: int, window: int) -> Iterator[np.ndarray]:
    """Yield consecutive windows of stretches decimated by averaging over `thin` samples; none spans two stretches."""
    for x in whole:
        length = x.shape[1] // thin * thin
        thinned = x[:, :length].reshape(2, -1, thin).mean(axis=2)
        for k in range(thinned.shape[1] // window):
            yield thinned[:, k * window : (k + 1) * window]


@dataclass(frozen=True)
class _WindowFit:
    """Fit of both swings in one window; a mode that is not significant has frequency NaN and amplitude 0."""

    frequency: np.ndarray  # (mode,) Hz
    sigma: np.ndarray  # (mode,) Hz, for white noise
    amplitude: np.ndarray  # (mode, end) complex, m
    noise: float  # residual variance, m^2


def _fit_window(
    part: np.ndarray, there: np.ndarray, taper: np.ndarray, rate: float, predicted: np.ndarray
) -> _WindowFit | None:
    """Fit one sinusoid per mode to both ends: Gauss-Newton on the frequencies, amplitudes eliminated (variable projection).

    Samples not `there` are zero in `part` and `taper`, and have no weight.
    """
    part = (part - part.sum(axis=1, keepdims=True) / there.sum()) * there
    middle = float(np.mean(predicted))  # limit between the search ranges, so that one line is not taken for both swings
    found = [
        _peak(part * taper, rate, f, *span)
        for f, span in zip(predicted, ((0.0, middle), (middle, np.inf)), strict=True)
    ]
    if found[0] is None:
        return None
    frequency = np.array([np.nan if f is None else f for f in found])
    seen = np.flatnonzero(np.isfinite(frequency))
    t = np.arange(part.shape[1]) / rate
    weighted = (part * taper).T
    m = len(seen)
    # if peaks of one side are clipped, the mean of the remaining samples is biased: fit the mean as well
    missing = taper[:, None] if not there.all() else np.empty((len(t), 0))
    for _ in range(4):
        phase = np.outer(t, 2 * np.pi * frequency[seen])
        cosine, sine = np.cos(phase) * taper[:, None], np.sin(phase) * taper[:, None]
        basis = np.concatenate([cosine, sine, missing], axis=1)
        q, triangle = np.linalg.qr(basis)
        amplitude = np.linalg.solve(triangle, q.T @ weighted)
        rest = weighted - basis @ amplitude
        # derivative with respect to each angular frequency, with the amplitudes projected out
        slope = np.stack(
            [
                t[:, None] * (np.outer(cosine[:, j], amplitude[m + j]) - np.outer(sine[:, j], amplitude[j]))
                for j in range(m)
            ]
        )
        slope = (slope - np.einsum("tk,mke->mte", q, np.einsum("tk,mte->mke", q, slope))).reshape(m, -1)
        normal = slope @ slope.T
        frequency[seen] += np.linalg.solve(normal, slope @ rest.ravel()) / (2 * np.pi)
    noise = float(np.sum(rest**2)) / (len(part) * int(there.sum()))
    sigma = np.full(2, np.nan)
    sigma[seen] = np.sqrt(noise * np.diag(np.linalg.inv(normal))) / (2 * np.pi)
    complex_amplitude = np.zeros((2, 2), complex)
    complex_amplitude[seen] = amplitude[:m] - 1j * amplitude[m : 2 * m]
    return _WindowFit(frequency, sigma, complex_amplitude, noise)


def _peak(part: np.ndarray, rate: float, near: float, low: float = 0.0, high: float = np.inf) -> float | None:
    """Return the frequency, Hz, of the highest significant peak near a prediction and between two limits; None without one."""
    from scipy.fft import next_fast_len, rfft, rfftfreq

    n = next_fast_len(4 * part.shape[1], real=True)
    power = np.sum(np.abs(rfft(part, n, axis=1)) ** 2, axis=0)
    frequency = rfftfreq(n, 1 / rate)
    band = np.flatnonzero((np.abs(frequency / near - 1) < _NEAR) & (frequency > low) & (frequency < high))
    if band.size < 3:  # sampling rate too low, or window too short
        return None
    top = band[int(np.argmax(power[band]))]
    if top in (band[0], band[-1]) or power[top] < _STANDS_OUT * np.median(power[band]):
        return None
    return float(frequency[top])


@dataclass(frozen=True)
class _Mode:
    """One of the swings, and the path radius at each end that follows from it, m, with its standard deviation."""

    frequency: Estimate
    shape: dict[str, float]
    radii: list[tuple[float, float]]


def _mode(table: np.ndarray, machine: Machine, basis: Modes, loads: np.ndarray) -> _Mode | None:
    """Combine the windows of one mode, with intervals by the jackknife; None with too few windows or no positive radii."""
    if len(table) < 4:
        return None
    frequency = table[:, 0]
    centre = np.median(frequency)
    spread = 1.4826 * np.median(np.abs(frequency - centre)) + 1e-6
    table = table[np.abs(frequency - centre) < 4 * spread]
    if len(table) < 4:
        return None
    weight = 1.0 / (1.0 / table[:, 1] + spread**2)
    amplitude = table[:, 2:4] + 1j * table[:, 4:6]
    cross = amplitude[:, 0] * np.conj(amplitude[:, 1])
    power = np.abs(amplitude) ** 2

    def reduce(keep: np.ndarray) -> np.ndarray:
        f = np.sum(weight[keep] * table[keep, 0]) / np.sum(weight[keep])
        first, second = np.sum(power[keep], axis=0)
        ratio = float(np.sum(cross[keep]).real)
        phi = np.array([first, ratio]) if first > second else np.array([ratio, second])
        phi = phi / phi[np.argmax(np.abs(phi))]
        radii = loads * phi / _pull(basis, machine, 2 * np.pi * f, phi)
        return np.concatenate([[f], phi, radii])

    everything = np.ones(len(table), bool)
    value = reduce(everything)
    groups = np.array_split(np.arange(len(table)), min(12, len(table)))
    left_out = []
    for group in groups:
        keep = everything.copy()
        keep[group] = False
        left_out.append(reduce(keep))
    sigma = np.sqrt(jackknife(np.array(left_out)))
    estimate = Estimate.from_sigma(
        float(value[0]), float(sigma[0]), "Hz", f"{_way(*value[1:3])} swing, small amplitude"
    )
    shape = {end: float(v) for end, v in zip(machine.ends, value[1:3], strict=True)}
    radii = [(float(value[3 + i]), float(sigma[3 + i])) for i in range(2)]
    if any(r <= 0 for r, _ in radii):
        return None
    return _Mode(estimate, shape, radii)
