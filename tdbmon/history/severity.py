"""Severity of a drop from position and speed alone: the dimensionless velocity of the rotor's centre.

J. J. Janse van Rensburg, G. van Schoor and P. A. van Vuuren rate rotor drops by the non-dimensionalised velocity of the
rotor's geometric centre (Vval; ISMB13, 2012), and found that such indicators change as a touchdown bearing wears
(Workshop on Magnetic Bearing Technology 10).  The public abstracts do not give the formula; the one here is this program's
own, so that its values are not comparable with theirs:

    V(t) = |d/dt (position of the centre)| / (2 pi f0 c)

with the speed f0 at the release and the radius at rest c of that end.  2 pi f0 c is the velocity of a shaft in synchronous
whirl round its clearance (V = 1); a free fall through the clearance reaches V = sqrt(2 g c) / (2 pi f0 c).

Noise biases velocities upwards.  Its level is taken from the levitated shaft: the noise floor of the displacement spectrum
between the lines of motion, propagated through low-pass and derivative.  Its power is subtracted from the mean square, and its
expected excess from the peak.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tdbsim.errors import InputError

from tdbmon.analysis.unbroken import pieces
from tdbmon.estimate import Z95, Estimate
from tdbmon.record.speed_checks import STANDSTILL_HZ

WINDOW_S = 0.2  # after the release: in any record of a drop, and contains the hard impacts
_LOWPASS_HZ = 1000.0  # above it noise dominates the derivative
_NOISY = 0.25  # of that frequency: above lie nearly all noise of a velocity and little motion
_LEAST_BINS = 5  # of the spectrum there, needed for an estimate of the noise
_RINGING_S = 0.01  # settling time of the low-pass after an impulse
_GUARD_S = 1e-3  # before the release: its instant is not exact
_RIVALS = 4.0  # standard deviations of the noise below the greatest velocity: any sample within may be the true peak
_RULE = f"|velocity| / (2 pi f0 c) within {WINDOW_S:g} s of the release, below {_LOWPASS_HZ:g} Hz (own definition)"
_UNSEEN = "the levitated stretch is too short to determine the noise, and from it the confidence interval"


@dataclass(frozen=True)
class Severity:
    """Dimensionless velocity of the rotor's centre at one end.

    Attributes
    ----------
    peak, rms : Estimate
        Over the first `WINDOW_S` after the release.
    """

    peak: Estimate
    rms: Estimate


def severity(planes: xr.Dataset, end: str, release: float, speed: Estimate, clearance: Estimate) -> Severity:
    """Return the severity of one end.

    Parameters
    ----------
    planes : Dataset
        Result of `tdbmon.analysis.axes.to_planes`.
    end : str
    release : float
        s from the record's first sample.
    speed : Estimate
        At the release, Hz.
    clearance : Estimate
        Radius at rest, m.

    Raises
    ------
    InputError
        If the record ends within `WINDOW_S` after the release, or until then samples of this end are missing or the time axis
        has a gap.
    """
    time = planes.time.to_numpy()
    if time[-1] < release + WINDOW_S:
        raise InputError(
            f"the record ends {time[-1] - release:.3g} s after the release;"
            f" the severity of {end} needs {WINDOW_S:g} s: record longer"
        )
    why = next((e.why for e in (speed, clearance) if not e.known), "")
    if speed.value is not None and speed.value < STANDSTILL_HZ:
        why = f"the shaft is at standstill at the release (below {STANDSTILL_HZ:g} Hz), and V is relative to its rotation"
    if why:
        missing = Estimate.missing("1", why)
        return Severity(missing, missing)
    near = time < release + WINDOW_S + _RINGING_S
    time, position = time[near], planes.displacement.sel(end=end).to_numpy()[:, near]
    if not np.isfinite(position).all():
        raise InputError(f"samples of {end} are missing before {WINDOW_S:g} s after the release: V needs all samples")
    before, *after = pieces(time)
    if after:
        begin, stop = time[before.stop - 1], time[after[0].start]
        raise InputError(
            f"no samples for {stop - begin:.3g} s after {begin:.5g} s: V of {end} needs all samples up to {WINDOW_S:g} s after"
            " the release; record without a pause"
        )
    sampling = float(planes.attrs["sampling_hz"])
    inside = (time >= release) & (time < release + WINDOW_S)
    size = np.hypot(*centre_velocity(position, sampling)[:, inside])
    unit = 2 * np.pi * float(speed.value or 0) * float(clearance.value or 0)
    share = math.hypot(_relative(speed), _relative(clearance))
    noise = _noise(position[:, time < release - _GUARD_S], sampling)
    if noise is None:
        peak, rms = float(size.max()), math.sqrt(float(np.mean(size**2)))
        return Severity(*(Estimate(each / unit, method=_RULE, why=_UNSEEN) for each in (peak, rms)))
    # a low-passed signal has two independent values per Hz and s
    independent = 2 * min(_LOWPASS_HZ, sampling / 2) * size.size / sampling
    return Severity(
        *(_stated(found, unit, share) for found in (_peak(size, noise, sampling), _rms(size, noise, independent)))
    )


def centre_velocity(position: NDArray[np.float64], sampling: float) -> NDArray[np.float64]:
    """Return the velocity (n, k), m/s, of a position (n, k), m: zero-phase low-pass, then the slope of a cubic spline.

    Central differences would underestimate a velocity at 1 kHz by 2 % at a sampling rate of 20 kHz, and by 24 % at 5 kHz.
    """
    from scipy.interpolate import CubicSpline
    from scipy.signal import butter, sosfiltfilt

    if sampling > 2.5 * _LOWPASS_HZ:
        sos = butter(2, _LOWPASS_HZ, fs=sampling, output="sos")
        position = sosfiltfilt(sos, position, axis=1)
    time = np.arange(position.shape[1]) / sampling
    return np.asarray(CubicSpline(time, position, axis=1)(time, 1))


@dataclass(frozen=True)
class _Noise:
    """Standard deviation of the velocity noise of an axis, and its upper bound (97.5 %), m/s."""

    sigma: float
    most: float


def _noise(levitated: NDArray[np.float64], sampling: float) -> _Noise | None:
    """Return the noise of the velocity from levitated positions (2, k), m; None if the stretch is too short.

    The median of a periodogram is insensitive to the lines of whirl and hum; for white noise it is ln 2 times the mean.  Over n
    bins, correlated with their neighbours by the Hann window, its root has a relative standard deviation of 1 / sqrt(n).
    """
    from scipy.signal import periodogram

    top = min(_LOWPASS_HZ, sampling / 2)
    if (1 - _NOISY) * top * levitated.shape[1] / sampling < _LEAST_BINS:
        return None
    frequency, density = periodogram(levitated, sampling, window="hann", detrend="linear", axis=1)
    bins = density[:, (frequency >= _NOISY * top) & (frequency <= top)]
    impulse = np.zeros((1, 2 * int(_RINGING_S * sampling) + 1))
    impulse[0, impulse.shape[1] // 2] = 1.0
    gain = float(np.linalg.norm(centre_velocity(impulse, sampling)))
    sigma = gain * math.sqrt(float(np.median(bins)) / math.log(2) * sampling / 2)
    return _Noise(sigma, sigma * (1 + Z95 / math.sqrt(bins.size)))


def _peak(size: NDArray[np.float64], noise: _Noise, sampling: float) -> tuple[float, float, float]:
    """Return the peak of velocities (k,), corrected for noise, and its 95 % interval, m/s.

    Noise with nu zero upcrossings per second stays below u sigma for a time T with the probability exp(-nu T exp(-u^2 / 2))
    (S. O. Rice, Bell System Technical Journal 24 (1945) 46); T is the time that the velocity is near its peak.  For white noise
    after derivative and low-pass, nu equals the low-pass frequency.  The sample of the true peak has the noise of one sample,
    which bounds how far the true peak may lie above the greatest velocity.
    """
    greatest = float(size.max())
    crossings = min(_LOWPASS_HZ, sampling / 2) * np.count_nonzero(size > greatest - _RIVALS * noise.sigma) / sampling
    usual, most = (math.sqrt(2 * math.log(max(crossings / -math.log(level), 1.0))) for level in (0.5, 0.975))
    value, low = greatest - usual * noise.sigma, greatest - max(most, Z95) * noise.most
    return max(value, 0.0), max(low, 0.0), greatest + Z95 * noise.most


def _rms(size: NDArray[np.float64], noise: _Noise, independent: float) -> tuple[float, float, float]:
    """Return the root mean square of velocities s (k,) without the noise of both axes, and its 95 % interval, m/s.

    Noise of standard deviation sigma per axis adds 2 sigma^2 to the mean of s^2, with the variance
    4 sigma^2 (<s^2> + sigma^2) over the number of independent values.
    """
    power = float(np.mean(size**2)) - 2 * noise.sigma**2
    scatter = Z95 * 2 * noise.most * math.sqrt((max(power, 0.0) + noise.most**2) / independent)
    half = math.hypot(scatter, 2 * (noise.most**2 - noise.sigma**2))
    value, low, high = (math.sqrt(max(each, 0.0)) for each in (power, power - half, power + half))
    return value, low, high


def _relative(estimate: Estimate) -> float:
    if estimate.value is None or estimate.width is None:
        return 0.0
    return estimate.width / 2 / Z95 / abs(estimate.value)


def _stated(found: tuple[float, float, float], unit: float, share: float) -> Estimate:
    """Return a velocity and its interval, m/s, divided by a unit of relative standard deviation `share`."""
    value, low, high = (each / unit for each in found)
    scale = Z95 * share * value
    return Estimate(
        value,
        max(value - math.hypot(value - low, scale), 0.0),
        value + math.hypot(high - value, scale),
        "1",
        _RULE,
    )
