"""The support of the outer ring: a mass on a spring and a damper, on a foundation that may move."""

from __future__ import annotations

from tdbsim import hooks
from tdbsim.cache import inlined
from tdbsim.columns import HAS_SPRING, SUPPORT_XX, SUPPORT_XY, SUPPORT_YY


@inlined
def spring_force(x, y, row, p):  # type: ignore[no-untyped-def]
    """Return the spring's force (x, y) on the outer ring, deflected by (x, y) against the foundation, N."""
    fx = -(row[SUPPORT_XX] * x + row[SUPPORT_XY] * y)
    fy = -(row[SUPPORT_XY] * x + row[SUPPORT_YY] * y)
    if row[HAS_SPRING] > 0.0:
        gx, gy = hooks.support(x, y, p)
        fx += gx
        fy += gy
    return fx, fy
