"""The hooks of the effects, chained into one compiled function per kind.

A hook is a plain function in an effect's file, with the name of its kind.  ``p`` is the row of coefficients of its end (or of the
rotor), ``i`` the index of its first one; where the effect is not used they are all zero, and the hook adds nothing.

    gap(azimuth, heat, p, i)       -> (m, m, m)   added to the radial gap at a fixed azimuth, and its first and second
                                                  derivative by it; heat: frictional heat stored in the bearing, J
    bore(azimuth, p, i)            -> (m, m, m)   the same, fixed to the inner ring: azimuth counts from its mark
    friction(slip, p, i)           -> 1           added to the friction coefficient at a slip speed, m/s
    ball(azimuth, ring_angle, p, i) -> m          added to the interference of a ball at a fixed azimuth
    support(x, y, p, i)            -> (N, N)      added to the force on the outer ring, deflected by x, y
    windage(omega, p, i)           -> rad/s^2     added to the rotor's angular acceleration
    holding(seconds, p, i)         -> 1           residual magnetic force over that at the release
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from tdbsim.cache import called
from tdbsim.effect import EffectDeclaration, catalogue


@cache
def offsets() -> dict[str, int]:
    """Return the index of each effect's first coefficient in the row of an end; of a repeatable one, that of its first instance.

    The element before that is the number of instances of a repeatable effect.
    """
    found, start = {}, 0
    for each in catalogue():
        found[each.identifier] = start + (each.kind.most > 1)
        start += _needed(each)
    return found


def row_length() -> int:
    """Return the number of coefficients of all effects' hooks per end, at least one."""
    return max(1, sum(_needed(each) for each in catalogue()))


def _needed(declared: EffectDeclaration) -> int:
    kind = declared.kind
    return kind.slots if kind.most == 1 else 1 + kind.most * kind.slots


def has_hook(declared: EffectDeclaration, kind: str) -> bool:
    """True where an effect has a hook of a kind."""
    return hasattr(declared.module, kind)


# One maker per signature: compiled code takes no variable argument lists.


def _none_1(a, p):  # type: ignore[no-untyped-def]
    return 0.0


def _none_2(a, b, p):  # type: ignore[no-untyped-def]
    return 0.0


def _none_1_shape(a, p):  # type: ignore[no-untyped-def]
    return 0.0, 0.0, 0.0


def _none_2_shape(a, b, p):  # type: ignore[no-untyped-def]
    return 0.0, 0.0, 0.0


def _none_2_pair(a, b, p):  # type: ignore[no-untyped-def]
    return 0.0, 0.0


def _with_1(first: Any, start: int, rest: Any) -> Callable[..., Any]:
    def chained(a, p):  # type: ignore[no-untyped-def]
        return first(a, p, start) + rest(a, p)

    return chained


def _with_2(first: Any, start: int, rest: Any) -> Callable[..., Any]:
    def chained(a, b, p):  # type: ignore[no-untyped-def]
        return first(a, b, p, start) + rest(a, b, p)

    return chained


def _with_several_2(first: Any, start: int, slots: int, rest: Any) -> Callable[..., Any]:
    def chained(a, b, p):  # type: ignore[no-untyped-def]
        total = rest(a, b, p)
        for k in range(int(p[start - 1])):
            total += first(a, b, p, start + k * slots)
        return total

    return chained


def _with_1_shape(first: Any, start: int, rest: Any) -> Callable[..., Any]:
    def chained(a, p):  # type: ignore[no-untyped-def]
        u, v, w = first(a, p, start)
        x, y, z = rest(a, p)
        return u + x, v + y, w + z

    return chained


def _with_2_shape(first: Any, start: int, rest: Any) -> Callable[..., Any]:
    def chained(a, b, p):  # type: ignore[no-untyped-def]
        u, v, w = first(a, b, p, start)
        x, y, z = rest(a, b, p)
        return u + x, v + y, w + z

    return chained


def _with_2_pair(first: Any, start: int, rest: Any) -> Callable[..., Any]:
    def chained(a, b, p):  # type: ignore[no-untyped-def]
        u, v = first(a, b, p, start)
        x, y = rest(a, b, p)
        return u + x, v + y

    return chained


HOOKS: dict[str, tuple[Callable[..., Any], Callable[..., Any]]] = {
    "gap": (_none_2_shape, _with_2_shape),
    "bore": (_none_1_shape, _with_1_shape),
    "friction": (_none_1, _with_1),
    "ball": (_none_2, _with_2),
    "support": (_none_2_pair, _with_2_pair),
    "windage": (_none_1, _with_1),
    "holding": (_none_1, _with_1),
}


def _chain(kind: str) -> Any:
    nothing, extend = HOOKS[kind]
    chained = called(nothing)
    start = offsets()
    for declared in catalogue():
        if not has_hook(declared, kind):
            continue
        hook, at = called(getattr(declared.module, kind)), start[declared.identifier]
        if declared.kind.most > 1:
            chained = called(_with_several_2(hook, at, declared.kind.slots, chained))
        else:
            chained = called(extend(hook, at, chained))
    return chained


# module globals, so that the kernels that call them are found in the cache
gap = _chain("gap")
bore = _chain("bore")
friction = _chain("friction")
ball = _chain("ball")
support = _chain("support")
windage = _chain("windage")
holding = _chain("holding")
