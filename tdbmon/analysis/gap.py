"""The clearance circle, fitted to the positions of the shaft after it has settled on the touchdown bearing.

At rest the shaft centre lies at a radius that is the sum of air gap, ball clearance and deflection under the weight
(`tdbmon.analysis.rest`).  The arc of its swing determines the centre of the circle too.

The swing loads the bearing by more than the weight at the bottom and by less at the turning points: N/W = cos(angle) -
a n/g, where a is the acceleration of the mass that the end carries and n the outward normal.  This comprises v^2/R towards the
centre, and the acceleration of the radius itself, which follows the load at twice the swing frequency, a third of the
bearing's resonance frequency and more; as the rotor is rigid, it depends in part on the other end.  If that is not visible, the
end's own acceleration is used instead, and the intervals include the possible error.  So the radius is
r = R + s (N/W - 1), where s is the deflection per unit of relative load.  Along an arc of one amplitude this is equivalent to a
shift of the centre by 3 s; neglected, it would put the centre tens of micrometres too low.  It is fitted together with the
circle, with the machine file's value of s as prior; the arc alone then determines the radius to some ten micrometres
(`Gap.from_arc`).  If the radius from the swing frequency (`tdbmon.analysis.swing`), which is independent, agrees, it constrains
the circle; if it disagrees, there is no circle (`tdbmon.analysis.ends`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from tdbsim.machine import Machine

from tdbmon.analysis.bent_line import BENDS, DRAWN
from tdbmon.analysis.jackknife import jackknife
from tdbmon.analysis.rest import RestTravel
from tdbmon.analysis.settled_arc import BIN_DEG, Arc, Cells, Steady
from tdbmon.estimate import Z95, Estimate

_BESIDE = 0.9  # of an end's samples, for which the other end must be visible too for its share of the load
# Error of radius and height of the centre, relative to the deflection per unit load, if the end's own acceleration stands in for
# that of the mass it carries; 17 um at 9 um, when the ends swing in antiphase (docs/gap.md).
_ALONE = 17 / 9
_PRIOR = 0.35  # relative standard deviation of the machine file's deflection per unit load
_COMMON = 3e-7  # m: variation of the mean radius with the angles of ring and cage, however long the average
_WORST = 20e-6  # m, standard deviation: a radius no better known than this is not worth stating
SETTLED_S = 0.15  # of rest: three blocks of time, the least for an error estimate
_FEWEST = 6  # bins of angle for a circle
_DRAWN = 4000  # settled positions kept for the plot, some more than are discernible
_BOUNCE_SHARE = 0.10  # of the gap: a lift-off smaller than this does not count as a bounce


@dataclass(frozen=True)
class NoCircle:
    """The reason why an end has no clearance circle."""

    why: str


@dataclass(frozen=True, kw_only=True)
class Gap:
    """The clearance circle of one end, at the bearing plane (SI).

    Attributes
    ----------
    lower, upper : Estimate
        2.5 % and 97.5 % quantiles of the settled radius about the fitted centre.
    centre : tuple of Estimate
        Centre (x, y) in machine axes.
    radius : Estimate
        Radius of the circle at the static load.
    from_arc : Estimate
        The same radius from the arc alone.
    agrees : bool or None
        Whether the radii from the arc and from the swing agree within their intervals; None without a swing.
    oval : Estimate
        Second harmonic of the settled radius over the angle (0-pk), if the arc is wide enough to show it.
    settled_from : float
        Time from which the shaft stays on the ring, s.
    points : ndarray (n, 2)
        Settled positions used, m, decimated, for the gap map.
    alone : float
        Possible error of radius and height of the centre, m, if the other end's share of the load is not visible; included in
        the intervals.  0 if it is visible.
    """

    lower: Estimate
    upper: Estimate
    centre: tuple[Estimate, Estimate]
    radius: Estimate
    from_arc: Estimate
    agrees: bool | None
    oval: Estimate
    settled_from: float
    points: np.ndarray
    alone: float = 0.0

    @classmethod
    def missing(cls, why: str) -> Gap:
        """Return a circle with all estimates missing for the reason `why`."""
        um = Estimate.missing("um", why)
        return cls(
            lower=um,
            upper=um,
            centre=(um, um),
            radius=um,
            from_arc=um,
            agrees=None,
            oval=um,
            settled_from=np.inf,
            points=np.empty((0, 2)),
        )

    @property
    def place(self) -> np.ndarray:
        """Centre (x, y), m."""
        return np.array([each.value for each in self.centre], dtype=float)

    @property
    def size(self) -> float:
        """Radius, m."""
        return np.nan if self.radius.value is None else self.radius.value

    def away(self, place: Sequence[float] | np.ndarray, method: str, kind: str = "") -> Estimate:
        """Return the distance of a point (x, y), m, from the centre; its error is that of the centre in that direction."""
        spread = np.array([each.high for each in self.centre], dtype=float) - self.place
        way = np.asarray(place) - self.place
        apart = float(np.hypot(*way))
        half = float(np.hypot(*(spread * way))) / max(apart, 1e-12)
        return Estimate(apart, max(apart - half, 0.0), apart + half, "um", method, kind=kind)


def fit_gap(
    planes: xr.Dataset,
    end: str,
    machine: Machine,
    travel: RestTravel,
    settled_s: float,
    from_swing: Estimate | None = None,
    shares: Mapping[str, float] | None = None,
    beyond: float = 0.0,
) -> Gap | NoCircle:
    """Fit the clearance circle of an end.

    Parameters
    ----------
    planes : Dataset
        Result of `to_planes`.
    end : str
        Name of the end.
    machine : Machine
        For gravity.
    travel : RestTravel
        Deflection under the weight of this end, for the effect of the load on the radius.
    settled_s : float
        Time from which the shaft stays on the ring (`settled_from`), s.
    from_swing : Estimate, optional
        The radius from the swing frequency.
    shares : mapping, optional
        Fractions of the mass carried by this end that move with each end (`tdbmon.analysis.swing.carried_shares`); by default
        all of it moves with this end.
    beyond : float, optional
        How far the rigid line lies below the shaft at rest (`tdbmon.analysis.bent_line.line_beyond`), m.

    Returns
    -------
    Gap or NoCircle
        No circle if the arc is too short, or determines it too poorly.
    """
    time, rate = planes.time.to_numpy(), planes.attrs["sampling_hz"]
    xy = planes.displacement.sel(end=end).to_numpy().T
    after = time >= settled_s
    carried = _carried(planes, end, shares) if shares else xy
    alone = _ALONE * travel.per_load if carried is None else 0.0
    steady = Steady.of(time[after], xy[after], (xy if carried is None else carried)[after], rate)
    if not len(steady.xy):
        return NoCircle(f"no sample has a value from {settled_s:.4g} s on, when the shaft has settled")
    circle = np.array([0.0, 0.0, float(np.median(np.hypot(*steady.xy.T)))])
    for _ in range(2):  # repeated about the centre found, as the bins linearise the circle
        cells = Cells.of(steady, machine.gravity, circle)
        arc = cells.arc()
        if len(arc.angle) < _FEWEST:
            return NoCircle(
                f"the shaft settles at {settled_s:.4g} s, but the arc along which it then swings"
                f" ({2 * np.rad2deg(cells.halfwidth):.2g} degrees in all) is too short to fit a circle: more than"
                f" {BIN_DEG * (_FEWEST - 1):.0f} degrees are needed, each part passed three times"
            )
        found, _ = _fit_circle(arc, travel.per_load)
        circle = np.append(cells.centre + found[:2], found[2])
    parts = cells.parts()
    solution, sigma = _circle(cells.centre, arc, parts, travel.per_load)
    if not np.isfinite(sigma[2]) or (sigma[2] > _WORST and from_swing is None):
        return NoCircle(_too_vague(settled_s, float(time[-1]), float(sigma[2])))
    how = "circle fitted to the settled arc alone"
    from_arc = Estimate.from_sigma(float(solution[2]), float(np.hypot(sigma[2], alone / Z95)), "um", how)
    passed = _bends(arc, travel.per_load, beyond)
    from_arc = from_arc.widened(passed[2], BENDS)
    agrees = None
    if from_swing is not None and from_swing.value is not None:
        agrees = _overlap(from_arc, from_swing)
        if agrees:
            solution, sigma = _circle(cells.centre, arc, parts, travel.per_load, from_swing)
            passed = _bends(arc, travel.per_load, beyond, from_swing)
    return _gap(steady.xy, cells, solution, sigma, settled_s, from_arc, agrees, passed, alone)


def settled_from(planes: xr.Dataset, end: str, nominal: float, start: float = 0.0) -> float | NoCircle:
    """Return the end of the last bounce after `start` that lifts the shaft off by more than a tenth of the gap, s.

    Lift-off is judged by the distance from the probes' zero.  If the shaft stays settled for less than 0.15 s, the result is the
    reason why there is no circle.
    """
    xy = planes.displacement.sel(end=end).to_numpy().T
    seen = np.isfinite(xy).all(axis=1)
    time, xy = planes.time.to_numpy()[seen], xy[seen]
    if not np.any(time > start):
        return NoCircle(f"no sample after {start:.4g} s has a value")
    away = np.hypot(*xy.T)
    inside = float(np.median(away[time > start])) - away
    lifted = np.flatnonzero((inside > _BOUNCE_SHARE * nominal) & (time > start))
    settled = float(time[min(lifted[-1] + 1, len(time) - 1)]) if lifted.size else start
    if time[-1] - settled >= SETTLED_S:
        return settled
    left = f"{max(time[-1] - settled, 0.0):.2g} s before the record ends"
    if lifted.size:
        first_fall = lifted.size == np.count_nonzero((time > start) & (time <= time[lifted[-1]]))
        does = "falls" if first_fall else f"lifts off by more than {_BOUNCE_SHARE * nominal * 1e6:.3g} um"
        left = f"the shaft still {does} at {settled:.4g} s, {left}"
    else:
        left = f"the shaft is seen only from {start:.4g} s on, {left}"
    return NoCircle(f"{left}; a clearance circle needs {SETTLED_S:g} s on the ring")


def _too_vague(settled: float, last: float, sigma: float) -> str:
    """Return in words why the arc determines the radius too poorly."""
    arc = f"the shaft settles at {settled:.4g} s, but its arc in the {last - settled:.2g} s that follow"
    if not np.isfinite(sigma):
        return f"{arc} depends on one part of that time alone: the radius has no error estimate. Record for longer"
    return (
        f"{arc} determines the radius at rest only to ±{1.96e6 * sigma:.0f} um (95 %); beyond ±{1.96e6 * _WORST:.0f} um"
        " it is not reported"
    )


def _carried(planes: xr.Dataset, end: str, shares: Mapping[str, float]) -> np.ndarray | None:
    """Return the path of the mass that an end carries (n, 2), m; None if the other end is not visible at the same time."""
    if any(str(planes.plane.sel(end=each).item()) != "bearing" for each in shares):
        return None
    moved = sum(share * planes.displacement.sel(end=each).to_numpy().T for each, share in shares.items())
    own = planes.displacement.sel(end=end).to_numpy().T
    seen, also = (np.isfinite(each).all(axis=1).sum() for each in (own, moved))
    return np.asarray(moved) if also >= _BESIDE * seen else None


def _overlap(a: Estimate, b: Estimate) -> bool:
    return bool(a.low <= b.high and b.low <= a.high) if None not in (a.low, a.high, b.low, b.high) else False  # type: ignore[operator]


def _circle(
    centre: np.ndarray, arc: Arc, parts: list[Arc], per_load: float, known: Estimate | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Fit centre, radius and deflection per unit load, and return them with standard deviations.

    Neighbouring bins share the same vibration, so that the covariance of the fit is too small for a short settled stretch; the
    jackknife over `parts` of it shows the actual scatter.  The larger of both variances is used.
    """
    solution, covariance = _fit_circle(arc, per_load, known)
    solution[:2] += centre
    if len(parts) < 2:
        return solution, np.full(4, np.inf)
    left_out = np.array([_fit_circle(part, per_load, known)[0] for part in parts])
    return solution, np.sqrt(np.maximum(np.diag(covariance), jackknife(left_out)))


def _fit_circle(arc: Arc, per_load: float, known: Estimate | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Fit centre (relative to the bins' centre), radius and deflection per unit load to a binned arc; return the covariance too.

    The errors of the bins exclude the variation with the position of ring and cage; a common error is added, at least
    `_COMMON`, and increased until the arc fits with a reduced chi-square of one: per bin beyond three, as the fourth
    parameter, the deflection, has a prior.
    """
    prior = _PRIOR * per_load
    jac = np.column_stack([np.sin(arc.angle), -np.cos(arc.angle), np.ones_like(arc.angle), arc.load - 1])
    common = _COMMON
    for _ in range(40):
        weight = 1.0 / (arc.sigma**2 + common**2)
        normal = jac.T @ (jac * weight[:, None])
        normal[3, 3] += prior**-2
        target = jac.T @ (weight * arc.radius)
        target[3] += per_load / prior**2
        if known is not None and known.value is not None and known.sigma is not None:
            normal[2, 2] += known.sigma**-2
            target[2] += known.value / known.sigma**2
        p = np.linalg.solve(normal, target)
        chi = float(np.sum(weight * (arc.radius - jac @ p) ** 2)) / max(len(arc.radius) - 3, 1)
        if chi <= 1.0:
            break
        common *= 1.3
    return p, np.linalg.inv(normal)


def _bends(arc: Arc, per_load: float, beyond: float, known: Estimate | None = None) -> list[float]:
    """Return the greatest error of centre (x, y) and radius, m, if the line lies `beyond` below a shaft under its static load.

    The error of the line is proportional to the load: the fit attributes part of it to deflection, and a `known` radius holds.
    """
    straight = replace(arc, radius=arc.radius - DRAWN * beyond * arc.load)
    off = _fit_circle(arc, per_load, known)[0] - _fit_circle(straight, per_load, known)[0]
    return [float(each) for each in np.abs(off[:3])]


def _gap(
    xy: np.ndarray,
    cells: Cells,
    p: np.ndarray,
    sigma: np.ndarray,
    settled: float,
    from_arc: Estimate,
    agrees: bool | None,
    passed: Sequence[float],
    alone: float,
) -> Gap:
    """Return the circle of a fit `p` (x, y, radius, deflection per unit load), m, given its `sigma` and errors from `_bends`."""
    how = "settled arc and swing frequency" if agrees else "settled arc, assumed circular"
    if alone:  # as an independent error, not one common to all drops: another drop may show the other end
        how += "; interval: also the load from the motion of the other end, which is not seen"
        sigma = np.hypot(sigma, [0.0, alone / Z95, alone / Z95, 0.0])
    x, y, radius = (
        Estimate.from_sigma(float(p[i]), float(sigma[i]), "um", f"{what}: {how}").widened(passed[i], BENDS)
        for i, what in enumerate(("centre", "centre", "radius"))
    )
    low, high = np.quantile(np.hypot(*(xy - p[:2]).T), [0.025, 0.975])
    rule = "2.5 % and 97.5 % quantile of the settled radius about the fitted centre"
    return Gap(
        lower=Estimate.from_sigma(float(low), float(sigma[2]), "um", rule).widened(passed[2], BENDS),
        upper=Estimate.from_sigma(float(high), float(sigma[2]), "um", rule).widened(passed[2], BENDS),
        centre=(x, y),
        radius=radius,
        from_arc=from_arc,
        agrees=agrees,
        oval=_oval(cells, p),
        settled_from=settled,
        points=xy[:: max(1, len(xy) // _DRAWN)],
        alone=alone,
    )


def _oval(cells: Cells, p: np.ndarray) -> Estimate:
    """Return the second harmonic of the radius over the angle; its error comes from the variation between parts of the time."""
    if cells.halfwidth < np.deg2rad(50):
        return Estimate.missing(
            "um", "the settled arc spans less than 100 degrees, too little to distinguish an ellipse from a circle"
        )
    parts = cells.parts()
    if len(parts) < 2:
        return Estimate.missing("um", "the shaft is settled too briefly to distinguish an ellipse from a vibration")
    harmonic, variance = _second_harmonic(cells.arc(), p)
    sigma = np.sqrt(np.maximum(variance, jackknife(np.array([_second_harmonic(part, p)[0] for part in parts]))))
    amplitude = float(np.hypot(*harmonic))
    width = Z95 * float(np.sqrt(np.mean(sigma**2)))
    rule = "second harmonic of the settled radius over the angle"
    return Estimate(amplitude, max(0.0, amplitude - width), amplitude + width, "um", rule, kind="0-pk")


def _second_harmonic(arc: Arc, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the cosine and sine amplitudes of twice the angle in the radius, and their variances from the errors of the bins."""
    columns = [
        np.sin(arc.angle),
        -np.cos(arc.angle),
        np.ones_like(arc.angle),
        np.cos(2 * arc.angle),
        np.sin(2 * arc.angle),
    ]
    jac = np.column_stack(columns)
    y = arc.radius - p[3] * (arc.load - 1)
    solution, *_ = np.linalg.lstsq(jac / arc.sigma[:, None], y / arc.sigma, rcond=None)
    left = (y - jac @ solution) / arc.sigma
    chi = max(1.0, float(left @ left) / max(len(y) - 5, 1))
    covariance = np.linalg.pinv(jac.T @ (jac / arc.sigma[:, None] ** 2)) * chi
    return solution[3:], np.diag(covariance)[3:]
