"""A clearance circle as settled positions would give it."""

from __future__ import annotations

import numpy as np

from tdbmon.analysis.gap import Gap
from tdbmon.estimate import Estimate


def circle_of(radius: Estimate, x: Estimate, y: Estimate, settled_from: float) -> Gap:
    """Return a round one of an arc alone, about (x, y), m."""
    return Gap(
        lower=radius,
        upper=radius,
        centre=(x, y),
        radius=radius,
        from_arc=radius,
        agrees=None,
        oval=Estimate.missing("um", "assumed circular"),
        settled_from=settled_from,
        points=np.zeros((1, 2)),
    )
