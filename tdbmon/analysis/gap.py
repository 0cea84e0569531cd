"""The clearance circle, from the positions in which the shaft settled on the touchdown bearing.

At rest the shaft centre lies at the radius that the air gap, the ball clearance and the deflection under the weight add
up to (`tdbmon.analysis.rest`).  The arc that it swings along gives the circle's centre too.

The swing loads the bearing by more than the weight at the bottom and by less at the turning points: N/W = cos(angle) -
a n/g, where a is the acceleration of the mass that the end carries and n the outward normal.  That is v^2/R towards the
centre, and the acceleration of the radius itself, which follows the load at twice the swing's frequency, a third of the
bearing's resonance and more; and as the rotor is rigid, it is in part that of the other end.  Where that one is not seen, the
end's own stands for it, and the intervals hold what this may miss.  So the radius is
r = R + s (N/W - 1), where s is the deflection a unit of relative load.  Along the arc of one amplitude this looks just like a
shift of the centre by 3 s; left out, it would put the centre tens of micrometres too low.  It is fitted with the circle, with
the machine file's value of s as prior knowledge; the arc alone then gives the radius to some ten micrometres
(`Gap.from_arc`).  Where the swing frequency gives the same radius independently (`tdbmon.analysis.swing`) and both agree, it
settles the circle; where they disagree no circle is told (`tdbmon.analysis.ends`).
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

_BESIDE = 0.9  # of an end's samples, at which the other end must be seen too to tell of its load
# Of the deflection a unit of load: how far radius and height of the centre may err where the end's own acceleration stands for
# that of the mass it carries; 17 um at 9 um, where the ends swing against each other (docs/gap.md).
_ALONE = 17 / 9
_PRIOR = 0.35  # relative standard deviation of the deflection a unit of load that the machine file gives
_COMMON = 3e-7  # m: how much the mean radius wanders with the angles of ring and cage, whatever the averaging
_WORST = 20e-6  # m, standard deviation: a radius known no better than this is not worth stating
SETTLED_S = 0.15  # of rest: three blocks of time, the least that tells an error
_FEWEST = 6  # bins of angle for a circle
_DRAWN = 4000  # settled positions kept, some more than can be seen
_BOUNCE_SHARE = 0.10  # of the gap: a lift-off smaller than this is no longer a bounce


@dataclass(frozen=True)
class NoCircle:
    """An end without a clearance circle, and why it has none."""

    why: str


@dataclass(frozen=True, kw_only=True)
class Gap:
    """The clearance circle of one end, at the bearing plane (SI).

    Attributes
    ----------
    lower, upper : Estimate
        Radius below and above which the settled shaft spends 2.5 % of the time each, about the fitted centre.
    centre : tuple of Estimate
        Centre (x, y) in machine axes.
    radius : Estimate
        Radius of the circle at the static load.
    from_arc : Estimate
        The same radius from the arc alone.
    agrees : bool or None
        Whether the radius from the arc and the one from the swing agree within their intervals; None without a swing.
    oval : Estimate
        Second harmonic of the settled radius over the angle (0-pk), where the arc is wide enough to show it.
    settled_from : float
        Time from which the shaft stays on the ring, s.
    points : ndarray (n, 2)
        Settled positions used, m, thinned: for the gap map.
    alone : float
        How far radius and height of the centre may err, as the other end's share of the load is not seen, m; the intervals hold
        it.  0 where it is seen.
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
        """Return that nothing of a circle is known, for the reason `why`."""
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
        """Return how far a place (x, y), m, lies from the centre; its error is the centre's along that way."""
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
        Deflection under the weight of this end, for the load's part of the radius.
    settled_s : float
        Time from which the shaft stays on the ring (`settled_from`), s.
    from_swing : Estimate, optional
        The radius from the swing frequency.
    shares : mapping, optional
        Of the mass that this end carries, how much moves with each end (`tdbmon.analysis.swing.carried_shares`); by default all
        with its own.
    beyond : float, optional
        By how much the rigid line lies below the shaft at rest (`tdbmon.analysis.bent_line.line_beyond`), m.

    Returns
    -------
    Gap or NoCircle
        No circle where the arc is too short to tell one, or tells it too badly.
    """
    time, rate = planes.time.to_numpy(), planes.attrs["sampling_hz"]
    xy = planes.displacement.sel(end=end).to_numpy().T
    after = time >= settled_s
    carried = _carried(planes, end, shares) if shares else xy
    alone = _ALONE * travel.per_load if carried is None else 0.0
    steady = Steady.of(time[after], xy[after], (xy if carried is None else carried)[after], rate)
    if not len(steady.xy):
        return NoCircle(f"no sample has a value from {settled_s:.4g} s on, where the shaft has settled")
    circle = np.array([0.0, 0.0, float(np.median(np.hypot(*steady.xy.T)))])
    for _ in range(2):  # the second time about the centre found: the bins linearise the circle
        cells = Cells.of(steady, machine.gravity, circle)
        arc = cells.arc()
        if len(arc.angle) < _FEWEST:
            return NoCircle(
                f"the shaft settles at {settled_s:.4g} s, but the arc that it then swings along,"
                f" {2 * np.rad2deg(cells.halfwidth):.2g} degrees in all, is too short to tell a circle: it takes more than"
                f" {BIN_DEG * (_FEWEST - 1):.0f}, each part of it seen three times"
            )
        found, _ = _fit_circle(arc, travel.per_load)
        circle = np.append(cells.centre + found[:2], found[2])
    parts = cells.parts()
    solution, sigma = _circle(cells.centre, arc, parts, travel.per_load)
    if not np.isfinite(sigma[2]) or (sigma[2] > _WORST and from_swing is None):
        return NoCircle(_too_vague(settled_s, float(time[-1]), float(sigma[2])))
    how = "circle through the settled arc alone"
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
    """Return the end of the last bounce that lifts the shaft off by more than a tenth of the gap, s, after an instant `start`.

    It is looked for in the distance from the probes' zero.  No circle can be told where the shaft stays settled for less than
    0.15 s.
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
        left = f"the shaft is seen from {start:.4g} s on only, {left}"
    return NoCircle(f"{left}; a clearance circle takes {SETTLED_S:g} s on the ring")


def _too_vague(settled: float, last: float, sigma: float) -> str:
    """Say that the arc tells the radius too badly."""
    arc = f"the shaft settles at {settled:.4g} s, but its arc in the {last - settled:.2g} s that follow"
    if not np.isfinite(sigma):
        return f"{arc} rests on one part of that time alone, which does not show how well it tells the radius: record for longer"
    return (
        f"{arc} tells the radius at rest to ±{1.96e6 * sigma:.0f} um only (95 %), worse than the ±{1.96e6 * _WORST:.0f} um"
        " that are worth stating"
    )


def _carried(planes: xr.Dataset, end: str, shares: Mapping[str, float]) -> np.ndarray | None:
    """Return the path of the mass that an end carries (n, 2), m; None where the other end is not seen beside it."""
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
    """Fit centre, radius and deflection a unit of load, with standard deviations.

    Neighbouring bins see the same vibration, so that the fit's own covariance is too small where the settled stretch
    is short; leaving out `parts` of it in turn (jackknife) tells.  The larger of both is taken.
    """
    solution, covariance = _fit_circle(arc, per_load, known)
    solution[:2] += centre
    if len(parts) < 2:
        return solution, np.full(4, np.inf)
    left_out = np.array([_fit_circle(part, per_load, known)[0] for part in parts])
    return solution, np.sqrt(np.maximum(np.diag(covariance), jackknife(left_out)))


def _fit_circle(arc: Arc, per_load: float, known: Estimate | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Fit centre (from the bins' centre), radius and deflection a unit of load to a binned arc; with covariance.

    The bins' own errors leave out what differs from one position of ring and cage to the next; a common error is
    added, at least `_COMMON` and more until the arc fits: chi-square of one for each bin beyond three, as the fourth
    parameter, the deflection, is in part known before.
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
    """Return by how much centre and radius err at most, m, where the line lies `beyond` below a shaft under its load at rest.

    It does so in proportion to the load: part of it the fit takes for deflection, and the radius it knows stays.
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
    """Return the circle of a fit `p` (x, y, radius, deflection a unit of load), m, its standard deviations, and `_bends`."""
    how = "settled arc and swing frequency" if agrees else "settled arc, taken as round"
    if alone:  # not as an error that drops share: another one may show the other end
        how += "; interval: also what the other end, not seen, may add to the load"
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
    """Second harmonic of the radius over the angle; what differs from one part of the time to the next is its error."""
    if cells.halfwidth < np.deg2rad(50):
        return Estimate.missing(
            "um", "the settled arc spans less than 100 degrees; an ellipse looks like a circle there"
        )
    parts = cells.parts()
    if len(parts) < 2:
        return Estimate.missing("um", "the shaft settles too briefly to tell an ellipse from a vibration")
    harmonic, variance = _second_harmonic(cells.arc(), p)
    sigma = np.sqrt(np.maximum(variance, jackknife(np.array([_second_harmonic(part, p)[0] for part in parts]))))
    amplitude = float(np.hypot(*harmonic))
    width = Z95 * float(np.sqrt(np.mean(sigma**2)))
    rule = "second harmonic of the settled radius over the angle"
    return Estimate(amplitude, max(0.0, amplitude - width), amplitude + width, "um", rule, kind="0-pk")


def _second_harmonic(arc: Arc, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cosine and sine of twice the angle in the radius, and their variances by the bins' own errors."""
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
