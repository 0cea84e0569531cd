"""Contacts of the shaft with its touchdown bearing, seen in displacement alone: touch, lift-off, rebound, restitution.

The shaft touches where its centre reaches the air gap with the ring at rest in the bottom of its ball clearance; that
is the radius at rest less the elastic deflection under the weight.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from tdbmon.analysis.gap import Gap
from tdbmon.analysis.rest import RestTravel
from tdbmon.estimate import Estimate
from tdbmon.record.probe_checks import SHORT_GAP

_HIDES_S = 1e-3  # of missing samples: as long as a short contact, which nobody then sees
_FREE_S = 1.5e-3  # of free flight on either side of a contact, for the velocities
_NOISE_S = 2e-4  # shorter gaps and stretches are noise
_LEVELS = 25  # tried over the interval of the touching radius


@dataclass(frozen=True)
class Contact:
    """One stretch of contact.

    Attributes
    ----------
    start, end : float
        Touch and lift-off, s.
    angle : float
        Direction of the deepest point from the clearance centre, rad from +x towards +y.
    depth : float
        How far beyond the touching radius the shaft centre went, m.
    seen : bool
        Whether it was seen throughout; else its touch or lift-off is not in the record, or much of it is missing.
    """

    start: float
    end: float
    angle: float
    depth: float
    seen: bool = True


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
        Of the deepest point, rad from +x towards +y.
    """

    touch: Estimate
    duration: Estimate
    static_in: Estimate
    static_out: Estimate
    rebound: Estimate
    restitution: Estimate
    direction: float


@dataclass(frozen=True)
class Contacts:
    """All contacts of an end up to the time from which it stays on the ring.

    Attributes
    ----------
    first : FirstContact or None
    events : tuple of Contact
        Those seen.
    count_low, count_high : int
        How many the level's uncertainty makes of them.
    hidden : str
        Which samples are missing where more contacts may lie; "" where none are.
    why : str
        Why the first of them is not known to be the first contact; "" where it is.
    """

    first: FirstContact | None
    events: tuple[Contact, ...]
    count_low: int
    count_high: int
    hidden: str = ""
    why: str = ""


def find_contacts(
    planes: xr.Dataset,
    end: str,
    gap: Gap,
    travel: RestTravel,
    clearance: float,
    release_s: float,
    gravity: float,
    late: str = "",
) -> Contacts:
    """Find the contacts of one end.

    Parameters
    ----------
    planes : Dataset
        Result of `to_planes`.
    end : str
    gap : Gap
        The clearance circle of this end.
    travel : RestTravel
        Deflection at rest.
    clearance : float
        Diametral clearance of the balls, m: half of it is travel without force.
    release_s : float
        The release, s.
    gravity : float
        m/s^2.
    late : str, optional
        Why the first contact seen may not be the first, where the record begins after the release.
    """
    time = planes.time.to_numpy()
    xy = planes.displacement.sel(end=end).to_numpy().T
    centre = np.array([gap.centre[0].value, gap.centre[1].value], float)
    radius, sigma = _value_sigma(gap.radius)
    elastic = travel.total - clearance / 2
    touching = radius - elastic
    # the level is as uncertain as the circle along the direction of the contact and the elastic part together
    sigma_level = float(np.hypot(np.hypot(sigma, _value_sigma(gap.centre[1])[1]) / 2, 0.3 * elastic))
    after = np.flatnonzero((time > release_s) & (time <= max(gap.settled_from, release_s + 0.05)))
    seen = after[np.isfinite(xy[after]).all(axis=1)]
    if not seen.size:
        return Contacts(None, (), 0, 0, why=f"no sample has a value from {release_s:.5g} s until the shaft has settled")
    t, d = time[seen], xy[seen] - centre
    r = np.hypot(d[:, 0], d[:, 1])
    lost = _Lost.between(
        np.concatenate([[release_s], t, time[after[-1:]]]), np.concatenate([r[:1], r, r[-1:]]) - touching
    )
    events = contact_events(t, d, r, touching)
    events = tuple(
        replace(c, seen=not (lost.at(c.start) or lost.at(c.end) or lost.within(c.start, c.end))) for c in events
    )
    counts = [len(contact_events(t, d, r, touching + k * sigma_level)) for k in (-1.96, 1.96)]
    low, high = min(*counts, len(events)), max(*counts, len(events))
    hidden = lost.within(release_s, t[-1])
    if late:
        if events and events[0].start <= t[0]:
            late = f"the record begins during a contact at {end}, after the release"
            events = (replace(events[0], seen=False), *events[1:])
        return Contacts(None, events, low, high, hidden, late)
    before = lost.within(release_s, events[0].start if events else t[-1])
    if before:
        return Contacts(None, events, low, high, hidden, f"{before}, where the shaft may have touched")
    first = _first(t, d, r, events, lost, touching, radius, sigma_level, gravity) if events else None
    return Contacts(first, events, low, high, hidden)


@dataclass(frozen=True)
class _Lost:
    """Stretches without samples that are too long to be bridged: the last instant seen before and the next after.

    `hiding` are those that may hide a contact: long enough for one, and for the way to the touching radius and from it.
    """

    spans: tuple[tuple[float, float], ...]
    hiding: tuple[tuple[float, float], ...]

    @classmethod
    def between(cls, t: np.ndarray, beyond: np.ndarray) -> _Lost:
        """Find them between instants, s, at which the shaft is so far beyond the touching radius, m."""
        steps = np.diff(t)
        long = steps > (SHORT_GAP + 1.5) * np.median(steps)
        fastest = np.max(np.abs(np.diff(beyond))[~long] / np.maximum(steps[~long], 1e-9), initial=0.0)
        way = np.abs(beyond[:-1]) + np.abs(beyond[1:])
        hides = long & (steps > _HIDES_S) & (way < fastest * steps)
        spans, hiding = (
            tuple((float(t[i]), float(t[i + 1])) for i in np.flatnonzero(found)) for found in (long, hides)
        )
        return cls(spans, hiding)

    def at(self, instant: float) -> tuple[float, float] | None:
        """Return the stretch in which an instant lies."""
        return next((span for span in self.spans if span[0] <= instant <= span[1]), None)

    def within(self, start: float, stop: float) -> str:
        """Say which stretch between two instants may hide a contact; "" where none does."""
        found = [s for s in self.hiding if s[0] >= start and s[1] <= stop]
        return _said(found[0]) if found else ""


def _said(span: tuple[float, float]) -> str:
    return f"no sample has a value between {span[0]:.5f} s and {span[1]:.5f} s"


def _value_sigma(estimate: Estimate) -> tuple[float, float]:
    if estimate.value is None or estimate.high is None:
        raise ValueError("an interval is needed")
    return estimate.value, (estimate.high - estimate.value) / 1.96


def contact_events(t: np.ndarray, d: np.ndarray, r: np.ndarray, level: float) -> tuple[Contact, ...]:
    """Return the stretches beyond a level of the radius; gaps and stretches under 0.2 ms belong to their neighbours (noise).

    Parameters
    ----------
    t : (n,) array
        s.
    d : (n, 2) array
        Displacement from the clearance centre, m.
    r : (n,) array
        Its radius, m.
    level : float
        Radius at which the shaft touches, m.
    """
    beyond = r > level
    edges = np.flatnonzero(np.diff(beyond.astype(np.int8))) + 1
    if beyond[0]:
        edges = np.concatenate([[0], edges])
    if beyond[-1]:
        edges = np.concatenate([edges, [len(r)]])
    spans: list[list[int]] = []
    for start, stop in edges.reshape(-1, 2):
        if spans and t[start] - t[spans[-1][1] - 1] < _NOISE_S:
            spans[-1][1] = int(stop)
        else:
            spans.append([int(start), int(stop)])
    out = []
    for start, stop in spans:
        if t[stop - 1] - t[start] < _NOISE_S:
            continue
        deep = start + int(np.argmax(r[start:stop]))
        angle = float(np.arctan2(d[deep, 1], d[deep, 0]))
        out.append(Contact(_crossing(t, r, start, level), _crossing(t, r, stop, level), angle, float(r[deep] - level)))
    return tuple(out)


def _crossing(t: np.ndarray, r: np.ndarray, index: int, level: float) -> float:
    """Instant at which r passes the level between index - 1 and index, linearly."""
    if index <= 0 or index >= len(r):
        return float(t[min(max(index, 0), len(t) - 1)])
    share = (level - r[index - 1]) / (r[index] - r[index - 1])
    return float(t[index - 1] + np.clip(share, 0, 1) * (t[index] - t[index - 1]))


def _first(
    t: np.ndarray,
    d: np.ndarray,
    r: np.ndarray,
    events: tuple[Contact, ...],
    lost: _Lost,
    touching: float,
    static: float,
    sigma: float,
    gravity: float,
) -> FirstContact | None:
    contact = events[0]
    n = np.array([np.cos(contact.angle), np.sin(contact.angle)])
    depth = d @ n
    rule = "radial displacement through the touching radius"
    touched, lifted = lost.at(contact.start), lost.at(contact.end)
    touch_sigma = _crossing_sigma(t, depth, contact.start, sigma)
    touch = Estimate.from_sigma(contact.start, touch_sigma, "s", rule)
    if touched:
        touch = Estimate(contact.start, *touched, "s", "within the missing samples")
    following = events[1].start if len(events) > 1 else float(t[-1])
    if lifted is None and contact.end >= t[-1]:
        unknown = "the shaft does not leave the ring again before it settles"
    elif touched:
        unknown = f"{_said(touched)}, and there the shaft touches"
    elif lifted:
        unknown = f"{_said(lifted)}, and there the shaft lifts off"
    else:
        unknown = _maybe(lost.within(contact.start, contact.end), "lifted off")
    lasted, thrown = _duration_and_rebound(t, d, r, contact, touching, sigma)
    if unknown:
        duration, restitution = (Estimate.missing(unit, unknown) for unit in ("s", "1"))
    else:
        duration = lasted
        restitution = _restitution(t, d, contact, following, n, gravity)
    again = _maybe(lost.within(touched[0] if touched else contact.start, following), "touched again")
    if contact.end >= t[-1] or again:
        rebound = Estimate.missing("um", again or unknown)
    else:
        rebound = thrown
    hidden = _maybe(
        lost.within(touched[0] if touched else contact.start, lifted[1] if lifted else contact.end), "lifted off"
    )
    if hidden:
        t1 = t2 = Estimate.missing("s", hidden)
    else:
        t1, t2 = _static(t, depth, contact, lost, static, sigma)
    return FirstContact(touch, duration, t1, t2, rebound, restitution, contact.angle)


def _maybe(said: str, did: str) -> str:
    return f"{said}, and there the shaft may have {did}" if said else ""


def _restitution(
    t: np.ndarray, d: np.ndarray, contact: Contact, following: float, n: np.ndarray, gravity: float
) -> Estimate:
    """Velocity after over velocity before a contact whose touch and lift-off were seen."""
    before = _flight(t, d, contact.start - _FREE_S, contact.start, contact.start, n, gravity)
    after = _flight(t, d, contact.end, contact.end + _FREE_S, contact.end, n, gravity)
    if before is None or after is None or before[0] <= 0 or after[0] >= 0 or following - contact.end < _FREE_S:
        return Estimate.missing("1", "no free flight of 1.5 ms on both sides of the first contact")
    ratio = -after[0] / before[0]
    spread = ratio * float(np.hypot(after[1] / after[0], before[1] / before[0]))
    rule = "velocities 1.5 ms before the touch and after the lift-off; above one where the other end's impact feeds it"
    return Estimate.from_sigma(ratio, spread, "1", rule, least=0.0)


def _duration_and_rebound(
    t: np.ndarray, d: np.ndarray, r: np.ndarray, contact: Contact, level: float, sigma: float
) -> tuple[Estimate, Estimate]:
    """Return how long a contact lasts and how far it throws the shaft, for all levels at which the shaft may touch.

    Where the shaft hardly leaves the ring, a small shift of the level joins the contact to the next one.
    """
    depth = d @ np.array([np.cos(contact.angle), np.sin(contact.angle)])
    lasted, risen = [], []
    for shift in (0.0, *np.linspace(-1.96, 1.96, _LEVELS)):
        at = level + shift * sigma
        later = [each for each in contact_events(t, d, r, at) if each.end > contact.start]
        if not later or later[0].start > contact.end:
            continue
        flight = (t >= later[0].end) & (t <= (later[1].start if len(later) > 1 else t[-1]))
        lasted.append(later[0].end - later[0].start)
        risen.append(max(at - float(np.min(depth[flight])), 0.0) if flight.any() else 0.0)
    half = float(1.96 * np.sqrt(2) * (t[1] - t[0]) / 4)
    among = "for all touching radii within the interval"
    return (
        Estimate(
            lasted[0], max(min(lasted) - half, 0.0), max(lasted) + half, "s", f"beyond the touching radius, {among}"
        ),
        Estimate(risen[0], min(risen), max(risen), "um", f"highest point before the next contact, {among}"),
    )


def _crossing_sigma(t: np.ndarray, depth: np.ndarray, at: float, sigma: float) -> float:
    """Standard deviation of the instant of a crossing whose level is uncertain by sigma."""
    near = np.abs(t - at) < 4e-4
    slope = np.polyfit(t[near] - at, depth[near], 1)[0] if near.sum() > 2 else 0.0
    return float(np.hypot(sigma / max(abs(slope), 1e-3), (t[1] - t[0]) / 4))


def _flight(
    t: np.ndarray, d: np.ndarray, start: float, stop: float, at: float, n: np.ndarray, gravity: float
) -> tuple[float, float] | None:
    """Velocity along n at the instant `at` of a free flight, and its standard deviation, m/s."""
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
    t: np.ndarray, depth: np.ndarray, contact: Contact, lost: _Lost, static: float, sigma: float
) -> tuple[Estimate, Estimate]:
    """Instants at which the shaft passes its position at rest within the first contact."""
    inside = np.flatnonzero((t >= contact.start - 5e-4) & (t <= contact.end + 5e-4))
    beyond = inside[depth[inside] > static]
    apart = np.flatnonzero(np.diff(beyond) > max(int(_NOISE_S / (t[1] - t[0])), 1))
    beyond = beyond[: apart[0] + 1] if apart.size else beyond  # the first half swing, where the shaft dips in again
    rule = "radial displacement through its value at rest"
    if not beyond.size:
        missing = Estimate.missing("s", "the first contact does not reach the position at rest")
        return missing, missing
    instants = (_crossing(t, depth, int(beyond[0]), static), _crossing(t, depth, int(beyond[-1]) + 1, static))
    made = [
        Estimate.missing("s", f"{_said(gap)}, and there the shaft passes its position at rest")
        if (gap := lost.at(at))
        else Estimate.from_sigma(at, _crossing_sigma(t, depth, at, sigma), "s", rule)
        for at in instants
    ]
    return made[0], made[1]
