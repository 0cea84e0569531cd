"""Contacts of the shaft with its touchdown bearing from displacement alone: touch, lift-off, rebound, restitution.

The shaft touches when its centre has crossed the air gap to the ring, which rests at the bottom of its ball clearance or, if the
balls are preloaded, in the middle; that touching radius is the radius at rest less the elastic deflection under the weight.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from tdbmon.analysis.contact_events import Contact, contact_events
from tdbmon.analysis.first_contact import FirstContact, first_contact
from tdbmon.analysis.gap import Gap
from tdbmon.analysis.missing_stretches import MissingStretches
from tdbmon.analysis.rest import RestTravel
from tdbmon.estimate import Z95, Estimate

# Fraction of the circle's errors that remains in the touching radius.  Fitted to an arc at the bottom, radius and height of the
# centre have correlated errors (0.99 on the shipped records), which mostly cancel along a contact: of their root sum of squares
# 0.2 remains at the bottom, 0.6 a quarter turn from it.
_OF_CIRCLE = 0.5
# Standard deviation relative to the deflection at rest: the shaft returns to a ring that still moves.  In 24 simulated drops with
# values anywhere within the tolerances of the shipped machine, all 45 first touches lay within the interval, and 83 % of 473
# later ones.
_OF_DEFLECTION = 0.3
_FIRST_S = 0.05  # searched at least, for fall and first contact: a shaft that does not bounce counts as settled before they end


@dataclass(frozen=True)
class Contacts:
    """All contacts of an end until it stays on the ring.

    Attributes
    ----------
    first : FirstContact or None
    events : tuple of Contact
        Observed contacts.
    count_low, count_high : int
        Bounds of their number for the uncertainty of the touching radius.
    hidden : str
        Which missing samples may hide more contacts; "" if none do.
    why : str
        Why the first of `events` may not be the first contact; "" if it is.
    """

    first: FirstContact | None
    events: tuple[Contact, ...]
    count_low: int
    count_high: int
    hidden: str = ""
    why: str = ""

    @property
    def count(self) -> Estimate:
        """Number of contacts before the shaft settled; missing if some may be unobserved."""
        if self.hidden:
            return Estimate.missing("1", f"{self.hidden}: more contacts may be hidden there")
        if self.why or not self.events:
            return Estimate.missing("1", self.why or "no contact was found")
        rule = "contacts before settling; interval: their number at the limits of the touching radius"
        return Estimate(float(len(self.events)), float(self.count_low), float(self.count_high), "1", rule)


def find_contacts(
    planes: xr.Dataset,
    end: str,
    gap: Gap,
    travel: RestTravel,
    play: float,
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
    play : float
        Force-free part of the travel, m: `tdbsim.machine.Balls.play`.
    release_s : float
        The release, s.
    gravity : float
        m/s^2.
    late : str, optional
        Why the first observed contact may not be the first, if the record begins after the release.
    """
    time = planes.time.to_numpy()
    xy = planes.displacement.sel(end=end).to_numpy().T
    elastic = travel.total - play
    touching = gap.size - elastic
    of_circle = np.hypot(gap.radius.sigma or 0.0, gap.centre[1].sigma or 0.0)
    sigma_level = float(np.hypot(_OF_CIRCLE * of_circle, _OF_DEFLECTION * elastic))
    after = np.flatnonzero((time > release_s) & (time <= max(gap.settled_from, release_s + _FIRST_S)))
    seen = after[np.isfinite(xy[after]).all(axis=1)]
    if not seen.size:
        return Contacts(None, (), 0, 0, why=f"no sample has a value from {release_s:.5g} s until the shaft has settled")
    t, d = time[seen], xy[seen] - gap.place
    r = np.hypot(d[:, 0], d[:, 1])
    lost = MissingStretches.between(
        np.concatenate([[release_s], t, time[after[-1:]]]), np.concatenate([r[:1], r, r[-1:]]) - touching
    )
    events = contact_events(t, d, r, touching)
    events = tuple(
        replace(c, seen=not (lost.at(c.start) or lost.at(c.end) or lost.within(c.start, c.end))) for c in events
    )
    counts = [len(contact_events(t, d, r, touching + k * sigma_level)) for k in (-Z95, Z95)]
    low, high = min(*counts, len(events)), max(*counts, len(events))
    hidden = lost.within(release_s, np.inf)
    if late:
        if events and events[0].start <= t[0]:
            late = f"the record begins during a contact at {end}, after the release"
            events = (replace(events[0], seen=False), *events[1:])
        return Contacts(None, events, low, high, hidden, late)
    touched = events[0].start if events else np.inf
    before = lost.within(release_s, (lost.at(touched) or (touched,))[0])  # without a gap that holds the touch itself
    if before:
        return Contacts(None, events, low, high, hidden, f"{before}: the shaft may have touched there")
    first = first_contact(t, d, r, events, lost, touching, gap.size, sigma_level, gravity) if events else None
    return Contacts(first, events, low, high, hidden)
