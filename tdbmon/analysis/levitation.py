"""The levitated shaft before the release: mean position, orbit once per revolution, and residual noise."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from tdbmon.analysis.bent_line import BENDS, LevitatedMiss
from tdbmon.analysis.gap import Gap
from tdbmon.analysis.left_by_lines import with_lines
from tdbmon.analysis.turning_speed import told_from_orders, turning_speed
from tdbmon.analysis.vibration_zone import share_of_clearance
from tdbmon.estimate import Estimate

_LEAST_TURNS = 3.0  # of the shaft in the stretch: with fewer, orbit and mean position cannot be separated
_HEAD_S = 0.02  # at the start of a record without a drop, for the orbit
_STEADY = 4.0  # times the distance reached there: no levitated orbit grows so much
_FROM_ZERO = "from the probes' zero: without a drop the clearance centre is not known"
_GUARD_S = 1e-3  # left out before the release, as its instant is not exact
# length of the orbit fitted at the end of levitation: over longer the speed changes, and with it the phase of 1X
_FITTED_S, _FITTED_TURNS = 0.2, 10.0


@dataclass(frozen=True)
class Levitation:
    """The levitated shaft at one end (SI).

    Attributes
    ----------
    x, y : Estimate
        Mean position from the probes' zero.
    once : Estimate
        Once-per-revolution (1X) motion: root of the sum of both axes' squared amplitudes, which is invariant to rotation of the
        axes.  Includes run-out of the probe tracks, and hum if the mains frequency is too near to 1X or 2X.
    noise : Estimate
        Standard deviation of the residual of mains, 1X and 2X, mean of both axes.
    reach : Estimate
        Greatest distance from the clearance centre (D_max of ISO 14839-2), run-out and noise included.
    share : Estimate
        The same relative to the least radial clearance (C_min of ISO 14839-2), for `tdbmon.analysis.vibration_zone.zone`.
    """

    x: Estimate
    y: Estimate
    once: Estimate
    noise: Estimate
    reach: Estimate
    share: Estimate


def levitation(
    planes: xr.Dataset,
    end: str,
    release: float,
    speed_hz: float | None,
    mains_hz: float,
    gap: Gap | None,
    clearance: float,
    doubt: str = "",
) -> Levitation:
    """Fit the levitated orbit of an end by least squares over its last 0.2 s or ten turns, and find its greatest distance.

    Parameters
    ----------
    planes : Dataset
        Result of `tdbmon.analysis.axes.to_planes`.
    end : str
    release : float
        Instant of the release, s.
    speed_hz : float or None
        Rotor speed before it, which is refined from the orbit; None if unknown.
    mains_hz : float
    gap : Gap or None
        The clearance circle of the end; None if there is none.
    clearance : float
        The radial gap of the machine file, m.
    doubt : str
        Why the centre of the circle is not the clearance centre (`tdbmon.analysis.set_point.no_centre`).
    """
    shaft = planes.displacement.sel(end=end, time=slice(None, release - _GUARD_S))
    z, t = shaft.to_numpy(), shaft.time.to_numpy()
    good = np.isfinite(z).all(axis=0)
    z, t = z[:, good], t[good]
    whole = z
    if speed_hz is not None and len(t):
        last = t > t[-1] - max(_FITTED_S, _FITTED_TURNS / speed_hz)
        z, t = z[:, last], t[last]
    seconds = float(t[-1] - t[0]) if len(t) > 1 else 0.0
    if speed_hz is None or seconds * speed_hz < _LEAST_TURNS:
        why = (
            "the levitated shaft does not turn, or its speed is not known"
            if speed_hz is None
            else "the levitated stretch is too short"
        )
        return unknown(why)
    periods = seconds * mains_hz
    hums = periods >= _LEAST_TURNS and told_from_orders(periods, seconds * speed_hz, 2)
    turning = turning_speed(t, z, speed_hz, mains_hz if hums else None) or speed_hz
    frequencies = [turning, 2 * turning] + ([mains_hz] if hums else [])
    design = with_lines(t, frequencies)
    coefficients, *_ = np.linalg.lstsq(design, z.T, rcond=None)
    left = z.T - design @ coefficients
    noise = float(np.sqrt(np.sum(left**2) / (left.size - coefficients.size)))
    sigma = np.sqrt(np.diag(np.linalg.pinv(design.T @ design))) * noise
    once = float(np.sqrt(np.sum(coefficients[1:3] ** 2)))
    reach = _reach(whole, gap)
    rule = "least squares over the end of the levitated stretch, noise assumed white"
    return Levitation(
        x=Estimate.from_sigma(float(coefficients[0, 0]), float(sigma[0]), "um", rule),
        y=Estimate.from_sigma(float(coefficients[0, 1]), float(sigma[0]), "um", rule),
        once=Estimate.from_sigma(once, float(sigma[1]), "um", rule, "0-pk", least=0.0),
        noise=Estimate.from_sigma(noise, noise / float(np.sqrt(2 * left.size)), "um", rule, "rms"),
        reach=reach,
        share=share_of_clearance(reach, clearance, doubt),
    )


def levitation_alone(
    planes: xr.Dataset, end: str, speed_hz: float | None, mains_hz: float, clearance: float
) -> Levitation:
    """Fit the levitated orbit of an end in a record without a drop.

    Without a clearance circle the centre is unknown: distances are from the probes' zero, and so have no interval.
    """
    shaft = planes.displacement.sel(end=end)
    z = shaft.to_numpy()[:, np.isfinite(shaft.to_numpy()).all(axis=0)]
    head = int(np.sum(shaft.time < shaft.time[0] + _HEAD_S))
    if z.shape[1] < head:
        return unknown("too few samples have a value")
    away = np.hypot(*(z - np.median(z[:, :head], axis=1)[:, None]))
    if away.max() > _STEADY * away[:head].max():  # a drop in a wrong unit, say
        return unknown("the shaft leaves its initial orbit, which a levitated shaft does not")
    found = levitation(planes, end, float(shaft.time[-1]) + 2 * _GUARD_S, speed_hz, mains_hz, None, clearance)
    far = float(np.hypot(*z).max())
    reach = Estimate(far, unit="um", method="greatest distance from the probes' zero", why=_FROM_ZERO, kind="0-pk")
    return replace(found, reach=reach, share=share_of_clearance(reach, clearance))


def held_bent(found: Levitation, miss: LevitatedMiss, clearance: float) -> Levitation:
    """Widen the intervals of a levitated shaft by the possible error of the rigid line at its bearing.

    `clearance` : the radial gap of the machine file, m.
    """
    both = miss.sag + miss.once
    return replace(
        found,
        y=found.y.widened(miss.sag, BENDS),
        once=found.once.widened(miss.once, BENDS, least=0.0),
        reach=found.reach.widened(both, BENDS, least=0.0),
        share=found.share.widened(both / clearance, BENDS, least=0.0),
    )


def unknown(why: str) -> Levitation:
    """Return a levitation result with all estimates missing for the reason `why`."""
    missing = Estimate.missing("um", why)
    return Levitation(missing, missing, missing, missing, missing, Estimate.missing("1", why))


def _reach(z: np.ndarray, gap: Gap | None) -> Estimate:
    """Return the greatest distance of the levitated shaft `z` (2, n), m, from the clearance centre."""
    if gap is None:
        return Estimate.missing("um", "the centre of the clearance is not known")
    far = z[:, np.argmax(np.hypot(*(z - gap.place[:, None])))]
    return gap.away(far, "greatest distance from the clearance centre before the release", "0-pk")
