"""A probe's reading of the levitated rotor: orbit, mains hum and coloured noise.

The orbit is a constant and harmonics of the shaft's angle, fitted together with the hum by least squares; the residual is
noise.  An autoregressive model (order by the Bayesian information criterion) whitens it, so that correlated errors are not
counted as independent.

Over a small part of a turn the orders look like one slow bend and cannot be separated from each other and the mean.  Then only
the noise is determined, and the mean with the size of the orbit as its error.

G. E. P. Box, G. M. Jenkins, G. C. Reinsel, Time Series Analysis, ch. 6 and 7.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from tdbsim.errors import InputError

from tdbmon.analysis.autoregression import whitened
from tdbmon.analysis.turning_speed import told_from_orders

Array = NDArray[np.float64]

HARMONICS = 3  # of the shaft's angle
_HIGHEST_ORDER = 8  # of the autoregressive model
_ROUNDS = 3  # of fitting orbit and colour alternately
_LEAST_PART = 0.75  # of a turn or of a period of hum, needed to separate it from the mean
_LEAST_HUM = 1.5  # periods, needed to separate hum from the bend of an orbit that is not determined itself
_UNDETERMINED = (
    3e-6  # m, of an undetermined orbit: runout of a good probe track is 6 um pk-pk (API 670, 5th ed., 6.1.2)
)


@dataclass(frozen=True, eq=False)
class Noise:
    """Noise, orbit and hum of one probe in the levitated stretch.

    Attributes
    ----------
    sigma : float
        Standard deviation of the noise, m.
    colour : (p,) array
        Coefficients of e[t] = w[t] + sum a[k] e[t - k]; empty for white noise.
    innovation : float
        Standard deviation of the white w, m.
    mean, mean_sigma : float
        Levitated position along the probe's axis and its standard deviation, m.
    orders : (3,) complex array
        c of Re(c exp(i k angle)) for k = 1, 2, 3, m; zero where the stretch does not determine them.
    order_sigma : float
        Standard deviation of the real and imaginary part of the first, m; infinite where they are not determined.
    hum : complex
        c of Re(c exp(i 2 pi mains t)), m; zero where the stretch does not determine it.
    """

    sigma: float
    colour: Array
    innovation: float
    mean: float
    mean_sigma: float
    orders: NDArray[np.complex128]
    order_sigma: float
    hum: complex

    def whiten(self, residual: Array) -> Array:
        """Return residuals whitened along the last axis, in units of the innovation; earlier ones are taken as 0."""
        return whitened(residual, self.colour) / self.innovation


def levitated_noise(time: Array, reading: Array, angle: Array, mains: float, place: str = "probe") -> Noise:
    """Fit orbit, hum and noise of one probe.

    Where an order of the shaft is too near the mains frequency to be separated over the stretch, hum counts as part of the
    order.  Less than three quarters of a turn determines no order.

    Parameters
    ----------
    time : (n,) array
        s, evenly sampled, of the levitated stretch.
    reading : (n,) array
        m.
    angle : (n,) array
        Of the shaft from an arbitrary mark, rad.
    mains : float
        Hz.
    place : str
        Name of the probe in error messages.

    Raises
    ------
    InputError
        If the stretch is too short for the fit, or the reading does not change.
    """
    turns, periods = abs(angle[-1] - angle[0]) / (2 * np.pi), mains * (time[-1] - time[0])
    told = turns >= _LEAST_PART
    columns = [np.ones_like(time)]
    for k in range(1, (HARMONICS if told else 1) + 1):
        columns += [np.cos(k * angle), -np.sin(k * angle)]
    slow = len(columns)
    hums = periods >= (_LEAST_PART if told else _LEAST_HUM) and told_from_orders(periods, turns, HARMONICS)
    if hums:
        columns += [np.cos(2 * np.pi * mains * time), -np.sin(2 * np.pi * mains * time)]
    design = np.column_stack(columns)
    fewest = 4 * (1 + 2 * HARMONICS + 2 * hums) + _HIGHEST_ORDER
    if len(time) < fewest:
        raise InputError(
            f"{place}: the levitated stretch has {len(time)} samples, too few to separate orbit and noise;"
            f" record at least {fewest} before the release"
        )
    colour = np.empty(0)
    for _ in range(_ROUNDS):
        white_design = whitened(design.T, colour).T[len(colour) :]
        solution, *_ = np.linalg.lstsq(white_design, whitened(reading, colour)[len(colour) :], rcond=None)
        left = reading - design @ solution
        if not np.std(left) > 0:
            raise InputError(f"{place}: the reading has no noise at all; the probe is dead, or it is no measurement")
        colour = _colour(left)
    white = whitened(left, colour)[len(colour) :]
    innovation = float(np.sqrt(np.sum(white**2) / (len(white) - design.shape[1])))
    noise = Noise(
        sigma=float(np.sqrt(np.sum(left**2) / (len(left) - design.shape[1]))),
        colour=colour,
        innovation=innovation,
        mean=float(solution[0]),
        mean_sigma=np.inf,
        orders=np.zeros(HARMONICS, dtype=complex),
        order_sigma=np.inf,
        hum=complex(solution[-2], solution[-1]) if hums else 0j,
    )
    if not told:
        seen = design[:, :slow] @ solution[:slow]
        return replace(noise, mean=float(np.mean(seen)), mean_sigma=float(np.hypot(_UNDETERMINED, np.std(seen))))
    white_design = whitened(design.T, colour).T[len(colour) :]
    covariance = innovation**2 * np.linalg.pinv(white_design.T @ white_design)
    spread = np.sqrt(np.diag(covariance))
    return replace(
        noise,
        mean_sigma=float(spread[0]),
        orders=solution[1 : 2 * HARMONICS : 2] + 1j * solution[2 : 2 * HARMONICS + 1 : 2],
        order_sigma=float(np.hypot(spread[1], spread[2]) / np.sqrt(2)),
    )


def _colour(left: Array) -> Array:
    """Return the autoregressive coefficients of the order with the least information criterion, by least squares.

    With this many samples least squares is stable, and it preserves sharp peaks, which the Yule-Walker equations flatten (see
    `tdbmon.analysis.autoregression.noise_of`).
    """
    least, best = np.inf, np.empty(0)
    target = left[_HIGHEST_ORDER:]
    n = len(target)
    for order in range(_HIGHEST_ORDER + 1):
        past = np.column_stack(
            [left[_HIGHEST_ORDER - k : len(left) - k] for k in range(1, order + 1)] or [np.empty((n, 0))]
        )
        a, *_ = np.linalg.lstsq(past, target, rcond=None)
        criterion = n * float(np.log(np.mean((target - past @ a) ** 2))) + order * float(np.log(n))
        if criterion < least:
            least, best = criterion, np.asarray(a, dtype=float)
    return best
