"""The first contact of an end: touch, duration, rebound, restitution, and the instants of passing the position at rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tdbmon.analysis.contact_events import NOISE_S, Contact, contact_events, crossing
from tdbmon.analysis.missing_stretches import MissingStretches, said
from tdbmon.estimate import Z95, Estimate
from tdbmon.record.timebase import usual_interval

_FREE_S = 1.5e-3  # of free flight on either side of a contact, for the velocities
_FREE_TRIED_S = (1e-3, 1.5e-3, 2e-3)  # alternatives, whose spread enters the uncertainty
_LEVELS = 25  # touching radii tried over the interval
_PASSING_S = 4e-4  # on either side of a crossing, for its velocity: a small part of a contact
_FEWEST_STEPS = 1.5  # sampling intervals on either side at least: a velocity needs three samples
_SLOWEST = 1e-3  # m/s, least velocity of a crossing: it vanishes if the shaft turns back at the level


@dataclass(frozen=True)
class FirstContact:
    """The first contact of an end.

    Attributes
    ----------
    touch, duration : Estimate
        Instant of the touch, s, and time to the lift-off, s.
    static_in, static_out : Estimate
        Instants t1 and t2 at which the shaft passes its position at rest, inwards and outwards, s.
    rebound : Estimate
        How far the shaft comes back inside the touching radius before the next contact, along the first contact's
        direction, m.
    restitution : Estimate
        Velocity after over velocity before the contact, along its direction.
    direction : float
        Angle of the deepest point, rad from +x towards +y.
    """

    touch: Estimate
    duration: Estimate
    static_in: Estimate
    static_out: Estimate
    rebound: Estimate
    restitution: Estimate
    direction: float

    @classmethod
    def missing(cls, why: str) -> FirstContact:
        """Return a first contact with all estimates missing for the reason `why`."""
        s, um, ratio = (Estimate.missing(unit, why) for unit in ("s", "um", "1"))
        return cls(touch=s, duration=s, static_in=s, static_out=s, rebound=um, restitution=ratio, direction=np.nan)


def first_contact(
    t: np.ndarray,
    d: np.ndarray,
    r: np.ndarray,
    events: tuple[Contact, ...],
    lost: MissingStretches,
    touching: float,
    static: float,
    sigma: float,
    gravity: float,
) -> FirstContact:
    """Return instants, duration, rebound and restitution of the first contact of an end.

    Parameters
    ----------
    t : (n,) array
        Time from the release on, s.
    d, r : (n, 2) and (n,) array
        Displacement from the clearance centre and its magnitude, m.
    events : tuple of Contact
        One at least.
    lost : MissingStretches
        Where samples are missing.
    touching, static : float
        Radius at which the shaft touches, and at which it rests, m.
    sigma : float
        Standard deviation of the former, m.
    gravity : float
        m/s^2.
    """
    contact = events[0]
    n = np.array([np.cos(contact.angle), np.sin(contact.angle)])
    depth = d @ n
    rule = "radial displacement crosses the touching radius"
    touched, lifted = lost.at(contact.start), lost.at(contact.end)
    step = usual_interval(t)
    touch_sigma = _crossing_sigma(t, depth, contact.start, sigma, step)
    touch = Estimate.from_sigma(contact.start, touch_sigma, "s", rule)
    if touched:
        # a gap as long as a contact only shows that the shaft touched in it, once or several times
        touch = Estimate(contact.start, *touched, "s", "within the missing samples")
        if touched in lost.hiding:
            touch = Estimate.missing("s", f"{said(touched)}, and the shaft touches there")
    following = events[1].start if len(events) > 1 else np.inf
    unknown = _open(contact, lost, float(t[-1]))
    tried = _tried(t, d, r, contact, touching, sigma)
    duration, rebound = _duration_and_rebound(t, depth, tried, step)
    restitution = _restitution(t, d, tried, n, gravity)
    if unknown:
        duration, restitution = (Estimate.missing(unit, unknown) for unit in ("s", "1"))
    begin, end = touched[0] if touched else contact.start, lifted[1] if lifted else contact.end
    again = _maybe(lost.within(begin, following), "touched again")
    if contact.end >= t[-1] or again:
        rebound = Estimate.missing("um", again or unknown)
    hidden = _maybe(lost.within(begin, end), "lifted off")
    if hidden:
        t1 = t2 = Estimate.missing("s", hidden)
    else:
        t1, t2 = _static(t, depth, contact, lost, static, sigma, step)
    return FirstContact(
        touch=touch,
        duration=duration,
        static_in=t1,
        static_out=t2,
        rebound=rebound,
        restitution=restitution,
        direction=contact.angle,
    )


def _open(contact: Contact, lost: MissingStretches, last: float) -> str:
    """Return why touch or lift-off of a contact is unknown, for data up to the instant `last`; "" if both are known."""
    touched, lifted = lost.at(contact.start), lost.at(contact.end)
    if lifted is None and contact.end >= last:
        return "the shaft does not leave the ring again before it settles"
    if touched:
        return f"{said(touched)}, and the shaft touches there"
    if lifted:
        return f"{said(lifted)}, and the shaft lifts off there"
    return _maybe(lost.within(contact.start, contact.end), "lifted off")


def _maybe(missing: str, did: str) -> str:
    return f"{missing}: the shaft may have {did} there" if missing else ""


@dataclass(frozen=True)
class _Tried:
    """A contact for one possible touching radius: that radius, m, and when the next contact begins, s."""

    level: float
    contact: Contact
    following: float


def _tried(t: np.ndarray, d: np.ndarray, r: np.ndarray, contact: Contact, level: float, sigma: float) -> list[_Tried]:
    """Return a contact for the touching radius, and for others across its interval.

    If the shaft hardly leaves the ring, a small shift of the level merges the contact with the next one.
    """
    out = []
    for shift in (0.0, *np.linspace(-Z95, Z95, _LEVELS)):
        at = level + shift * sigma
        later = [each for each in contact_events(t, d, r, at) if each.end > contact.start]
        if later and later[0].start <= contact.end:
            out.append(_Tried(at, later[0], later[1].start if len(later) > 1 else float(t[-1])))
    return out


def _restitution(t: np.ndarray, d: np.ndarray, tried: list[_Tried], n: np.ndarray, gravity: float) -> Estimate:
    """Return velocity after over velocity before a contact whose touch and lift-off were observed.

    In flight the shaft vibrates in bending with periods of a few milliseconds: the velocity of a straight-line fit depends on
    start and length of the line by more than its standard error.
    """
    told = _ratio(t, d, tried[0], _FREE_S, n, gravity)
    if told is None:
        return Estimate.missing("1", "no free flight of 1.5 ms before and after the first contact")
    ratios = [
        each[0] for at in tried for free in _FREE_TRIED_S if (each := _ratio(t, d, at, free, n, gravity)) is not None
    ]
    rule = "velocity ratio from 1.5 ms of flight before touch and after lift-off; above 1 if the other end's impact adds energy"
    apart = float(np.sqrt(np.mean((np.array(ratios) - told[0]) ** 2)))
    also = "flights of 1 to 2 ms and all touching radii within their uncertainty"
    return Estimate.from_sigma(*told, "1", rule, least=0.0).widened(Z95 * apart, also, least=0.0)


def _ratio(
    t: np.ndarray, d: np.ndarray, at: _Tried, free: float, n: np.ndarray, gravity: float
) -> tuple[float, float] | None:
    """Return velocity after over velocity before a contact, fitted to free flight of `free`, s, and its standard deviation."""
    contact = at.contact
    before = _flight(t, d, contact.start - free, contact.start, contact.start, n, gravity)
    after = _flight(t, d, contact.end, contact.end + free, contact.end, n, gravity)
    if before is None or after is None or before[0] <= 0 or after[0] >= 0 or at.following - contact.end < free:
        return None
    ratio = -after[0] / before[0]
    return ratio, ratio * float(np.hypot(after[1] / after[0], before[1] / before[0]))


def _duration_and_rebound(
    t: np.ndarray, depth: np.ndarray, tried: list[_Tried], step: float
) -> tuple[Estimate, Estimate]:
    """Return duration and rebound of a contact, with intervals over all possible touching radii."""
    lasted, risen = [], []
    for at in tried:
        flight = (t >= at.contact.end) & (t <= at.following)
        lasted.append(at.contact.end - at.contact.start)
        risen.append(max(at.level - float(np.min(depth[flight])), 0.0) if flight.any() else 0.0)
    half = float(Z95 * np.sqrt(2) * step / 4)
    among = "interval: for all touching radii within their uncertainty"
    return (
        Estimate(
            lasted[0], max(min(lasted) - half, 0.0), max(lasted) + half, "s", f"time beyond the touching radius; {among}"
        ),
        Estimate(risen[0], min(risen), max(risen), "um", f"highest point before the next contact; {among}"),
    )


def _crossing_sigma(t: np.ndarray, depth: np.ndarray, at: float, sigma: float, step: float) -> float:
    """Return the standard deviation of the instant of crossing a level known to `sigma`, m, with samples `step`, s, apart."""
    near = np.abs(t - at) < max(_PASSING_S, _FEWEST_STEPS * step)
    slope = np.polyfit(t[near] - at, depth[near], 1)[0] if near.sum() > 2 else 0.0
    return float(np.hypot(sigma / max(abs(slope), _SLOWEST), step / 4))


def _flight(
    t: np.ndarray, d: np.ndarray, start: float, stop: float, at: float, n: np.ndarray, gravity: float
) -> tuple[float, float] | None:
    """Return the velocity along n at the instant `at` of a free flight, and its standard deviation, m/s; None for few samples."""
    inside = (t >= start) & (t <= stop)
    if inside.sum() < 5:
        return None
    s = t[inside] - at
    along = d[inside] @ n + 0.5 * gravity * n[1] * s**2
    design = np.column_stack([np.ones_like(s), s])
    solution, *_ = np.linalg.lstsq(design, along, rcond=None)
    scatter = float(np.sqrt(np.sum((along - design @ solution) ** 2) / max(len(s) - 2, 1)))
    return float(solution[1]), scatter / float(np.sqrt(np.sum((s - s.mean()) ** 2)))


def _static(
    t: np.ndarray,
    depth: np.ndarray,
    contact: Contact,
    lost: MissingStretches,
    static: float,
    sigma: float,
    step: float,
) -> tuple[Estimate, Estimate]:
    """Return the instants at which the shaft passes its position at rest, inwards and outwards, within the first contact."""
    inside = np.flatnonzero((t >= contact.start) & (t <= contact.end))
    beyond = inside[depth[inside] > static]
    apart = np.flatnonzero(np.diff(beyond) > max(round(NOISE_S / step), 1))
    beyond = beyond[: apart[0] + 1] if apart.size else beyond  # only the first excursion, if there are several
    rule = "radial displacement crosses its value at rest"
    if not beyond.size:
        missing = Estimate.missing("s", "the first contact does not reach the position at rest")
        return missing, missing
    instants = (crossing(t, depth, int(beyond[0]), static), crossing(t, depth, int(beyond[-1]) + 1, static))
    made = [
        Estimate.missing("s", f"{said(gap)}, and the shaft passes its position at rest there")
        if (gap := lost.at(at))
        else Estimate.from_sigma(at, _crossing_sigma(t, depth, at, sigma, step), "s", rule)
        for at in instants
    ]
    return made[0], made[1]
