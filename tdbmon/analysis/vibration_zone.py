"""ISO 14839-2 zone of the levitated shaft, by its largest distance from the clearance centre (D_max) over C_min.

C_min is the smallest radial clearance between rotor and stator; in a machine with touchdown bearings it is theirs.  The
standard evaluates steady-state operation; here the stretch of the record before the release is used.
"""

from __future__ import annotations

from tdbmon.estimate import Estimate

ZONES = (("A", 0.3), ("B", 0.4), ("C", 0.5))
"""Zones with their upper limits as shares of C_min (ISO 14839-2:2004); above is zone D."""


def share_of_clearance(reach: Estimate, clearance: float, doubt: str = "") -> Estimate:
    """Return the largest distance from the clearance centre as a share of C_min.

    Parameters
    ----------
    reach : Estimate
        D_max, m.
    clearance : float
        C_min, m.
    doubt : str
        Why the centre is uncertain (`tdbmon.analysis.set_point.no_centre`); the share is then missing for this reason.
    """
    if doubt:
        return Estimate.missing("1", doubt)
    if reach.value is None:
        return Estimate.missing("1", reach.why)
    low, high = (None if bound is None else bound / clearance for bound in (reach.low, reach.high))
    method = f"{reach.method}, over the radial gap of the machine file"
    return Estimate(reach.value / clearance, low, high, "1", method, reach.why)


def zone(share: Estimate) -> str:
    """Return the zone of a share, or ``"A or B"`` with the zones of both limits if the interval crosses zones; "" if unknown."""
    if share.value is None:
        return ""
    bounds = (share.value if bound is None else bound for bound in (share.low, share.high))
    low, high = (_zone_of(bound) for bound in bounds)
    return low if low == high else f"{low} or {high}"


def _zone_of(share: float) -> str:
    return next((name for name, end in ZONES if share <= end), "D")
