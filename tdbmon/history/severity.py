"""Severity of a drop from position and speed alone: the velocity of the rotor's centre without dimension.

J. J. Janse van Rensburg, G. van Schoor and P. A. van Vuuren rate rotor drops by the non-dimensionalised velocity of the
rotor's geometric centre (Vval; ISMB13, 2012), and found that such indicators change as a touchdown bearing wears
(Workshop on Magnetic Bearing Technology 10).  The abstracts that are public do not print the formula, so the one here is
this program's own and its values are not theirs:

    V(t) = |d/dt (position of the centre)| / (2 pi f0 c)

with the speed f0 at the release and the radius at rest c of that end.  2 pi f0 c is the velocity of a shaft that whirls
round its clearance with the rotation (V = 1); a free fall through the clearance reaches sqrt(2 g c) / (2 pi f0 c).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tdbsim.errors import InputError

from tdbmon.estimate import Estimate

WINDOW_S = 0.2  # after the release: what any record of a drop holds, and where the blows are
_LOWPASS_HZ = 1000.0  # above it noise outweighs motion in a derivative
_RULE = f"|velocity| / (2 pi f0 c) within {WINDOW_S:g} s of the release, below {_LOWPASS_HZ:g} Hz (own definition)"


@dataclass(frozen=True)
class Severity:
    """Velocity of the rotor's centre at one end, without dimension.

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
        If the record ends before `WINDOW_S` after the release has passed, or holds no samples of this end there.
    """
    time = planes.time.to_numpy()
    if time[-1] < release + WINDOW_S:
        raise InputError(
            f"the record ends {time[-1] - release:.3g} s after the release;"
            f" the severity of {end} needs {WINDOW_S:g} s: record longer"
        )
    why = next((e.why for e in (speed, clearance) if not e.known), "")
    if why:
        missing = Estimate.missing("1", why)
        return Severity(missing, missing)
    position = planes.displacement.sel(end=end).to_numpy()
    velocity = centre_velocity(position, 1 / float(np.median(np.diff(time))))
    inside = (time >= release) & (time < release + WINDOW_S)
    size = np.hypot(velocity[0, inside], velocity[1, inside])
    size = size[np.isfinite(size)]
    if not size.size:
        raise InputError(f"no samples of {end} within {WINDOW_S:g} s of the release")
    unit = 2 * np.pi * float(speed.value or 0) * float(clearance.value or 0)
    noise = _noise(velocity, time, release)
    share = float(np.hypot(_relative(speed), _relative(clearance)))
    peak, rms = float(size.max()) / unit, float(np.sqrt(np.mean(size**2))) / unit
    return Severity(
        _with_interval(peak, float(np.hypot(noise / unit, share * peak))),
        _with_interval(rms, float(np.hypot(noise / unit / np.sqrt(size.size), share * rms))),
    )


def centre_velocity(position: NDArray[np.float64], sampling: float) -> NDArray[np.float64]:
    """Return the velocity (2, k), m/s, of a position (2, k), m: zero-phase low-pass, then central differences."""
    from scipy.signal import butter, sosfiltfilt

    if sampling > 2.5 * _LOWPASS_HZ:
        sos = butter(2, _LOWPASS_HZ, fs=sampling, output="sos")
        position = sosfiltfilt(sos, position, axis=1)
    return np.asarray(np.gradient(position, 1 / sampling, axis=1))


def _noise(velocity: NDArray[np.float64], time: NDArray[np.float64], release: float) -> float:
    """Standard deviation of the velocity that is no motion: what the levitated shaft shows beyond its whirl, m/s."""
    before = velocity[:, time < release - 0.01]
    if before.shape[1] < 100:
        return 0.0
    # successive differences see the noise and hardly the whirl
    return float(np.sqrt(np.mean(np.diff(before, axis=1) ** 2) / 2))


def _relative(estimate: Estimate) -> float:
    if estimate.value is None or estimate.low is None or estimate.high is None:
        return 0.0
    return (estimate.high - estimate.low) / 2 / 1.96 / abs(estimate.value)


def _with_interval(value: float, sigma: float) -> Estimate:
    return Estimate.from_sigma(value, sigma, "1", _RULE)
