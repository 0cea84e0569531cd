"""The support of the outer ring: a mass on a spring and a damper, on a foundation that may move."""

from __future__ import annotations

from tdbsim import hooks
from tdbsim.cache import inlined
from tdbsim.columns import HAS_SPRING, SUPPORT_XX, SUPPORT_XY, SUPPORT_YY


@inlined
def linear_spring(x, y, xx, xy, yy):  # type: ignore[no-untyped-def]
    """Return the force (x, y) of a spring of stiffness [[xx, xy], [xy, yy]], N/m, deflected by (x, y)."""
    return -(xx * x + xy * y), -(xy * x + yy * y)


@inlined
def spring_force(columns, effect, end, x, y):  # type: ignore[no-untyped-def]
    """Return the spring's force (x, y) on the outer ring, deflected by (x, y) against the foundation, N."""
    fx, fy = linear_spring(x, y, columns[end, SUPPORT_XX], columns[end, SUPPORT_XY], columns[end, SUPPORT_YY])
    if columns[end, HAS_SPRING] > 0.0:
        gx, gy = hooks.support(x, y, effect[end])
        fx += gx
        fy += gy
    return fx, fy
