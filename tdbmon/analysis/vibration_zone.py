"""The zone of ISO 14839-2 in which the levitated shaft runs: its greatest distance from the clearance centre over C_min.

C_min is the smallest radial clearance of rotor and stator; in a machine with touchdown bearings it is theirs.  The standard
judges steady running; here it is the stretch of the record before the release.
"""

from __future__ import annotations

from tdbmon.estimate import Estimate

ZONES = (("A", 0.3), ("B", 0.4), ("C", 0.5))
"""Each zone with the share of C_min at which it ends (ISO 14839-2:2004); above is D."""


def share_of_clearance(reach: Estimate, clearance: float, doubt: str = "") -> Estimate:
    """Return the greatest distance from the clearance centre as a share of C_min.

    Parameters
    ----------
    reach : Estimate
        D_max, m.
    clearance : float
        C_min, m.
    doubt : str
        Why the centre is not sure (`tdbmon.analysis.set_point.no_centre`); then nothing is told.
    """
    if doubt:
        return Estimate.missing("1", doubt)
    if reach.value is None:
        return Estimate.missing("1", reach.why)
    low, high = (None if bound is None else bound / clearance for bound in (reach.low, reach.high))
    method = f"{reach.method}, over the radial gap of the machine file"
    return Estimate(reach.value / clearance, low, high, "1", method, reach.why)


def zone(share: Estimate) -> str:
    """Return the zone, or both of them as ``"A or B"`` where the interval goes from the one into the other; "" if unknown."""
    if share.value is None:
        return ""
    bounds = (share.value if bound is None else bound for bound in (share.low, share.high))
    low, high = (_zone_of(bound) for bound in bounds)
    return low if low == high else f"{low} or {high}"


def _zone_of(share: float) -> str:
    return next((name for name, end in ZONES if share <= end), "D")
