"""Parts of the splitting: the drift's table, and the laws of motion in a kick, with positions fixed."""

from __future__ import annotations

import math

import numpy as np

from tdbsim import hooks
from tdbsim.cache import called, inlined
from tdbsim.friction import REGULAR_SLIP, sliding_force
from tdbsim.mode_rows import ALONG, BACK, SAME, STAY
from tdbsim.rhs import REGULAR_SPIN

DRIFT = np.array([0.0792036964311957, 0.353172906049774, -0.0420650803577195, 0.0])
DRIFT[3] = 1 - 2 * DRIFT.sum()
KICK = np.array([0.209515106613362, -0.143851773179818, 0.0])
KICK[2] = 0.5 - KICK.sum()

STRONG = 0.3  # damping exponent of a kick, above which the series is not accurate
WEAK_DRAG = 1e-3  # relative loss of a ring's speed by drag in a kick, below which it is linear
SMALL_SLIP = 1.0  # m/s; below it the friction law is not constant within a kick


@called
def swing_table(m, h, table):  # type: ignore[no-untyped-def]
    """Fill the table (4 drifts, rows) with the transition matrix of displacement and velocity of each damped mode."""
    n = len(m.square)
    for s in range(4):
        t = DRIFT[s] * h
        for k in range(n):
            w2 = m.square[k]
            half = 0.5 * m.damping[k]
            if w2 == 0.0:
                same, along, back, stay = 1.0, t, 0.0, 1.0
            else:
                w = math.sqrt(w2 - half * half)
                decay = math.exp(-half * t)
                c = decay * math.cos(w * t)
                along = decay * math.sin(w * t) / w
                same, back, stay = c + half * along, -w2 * along, c - half * along
            table[s, SAME + k], table[s, ALONG + k] = same, along
            table[s, BACK + k], table[s, STAY + k] = back, stay


@called
def stuck(slip, pulled, held, t):  # type: ignore[no-untyped-def]
    """Return the change of the slip where friction stops it within a kick: a backward Euler step, or its inverse."""
    if t < 0.0 or slip == 0.0:
        return pulled - held
    hold = held * math.sqrt(slip * slip + REGULAR_SLIP * REGULAR_SLIP) / slip
    target = slip + pulled
    after = target * REGULAR_SLIP / (REGULAR_SLIP + hold)
    for _ in range(50):
        root = math.sqrt(after * after + REGULAR_SLIP * REGULAR_SLIP)
        miss = after + hold * after / root - target
        change = miss / (1.0 + hold * REGULAR_SLIP * REGULAR_SLIP / (root * root * root))
        # a large Newton step may overshoot: the solution lies between 0 and the target
        after = min(max(after - change, min(0.0, target)), max(0.0, target))
        if abs(change) < 1e-14:
            break
    return after - slip


@inlined
def slide(slip, pull, grip, t, coefficient):  # type: ignore[no-untyped-def]
    """Return the change of the slip in a kick: slip' = pull - grip mu(slip), grip a normal force over a mass."""
    if abs(slip) <= SMALL_SLIP or grip * coefficient * abs(t) > REGULAR_SLIP:
        return slide_slowly(slip, pull, grip, t, coefficient)
    return slide_fast(slip, pull, grip, t, coefficient)


@inlined
def slide_fast(slip, pull, grip, t, coefficient):  # type: ignore[no-untyped-def]
    """Return the same where the slip stays far from zero; numbers or vectors."""
    middle = slip + 0.5 * t * (pull - math.copysign(coefficient * grip, slip))
    return t * (pull + sliding_force(grip, middle, coefficient))


@called
def slide_slowly(slip, pull, grip, t, coefficient):  # type: ignore[no-untyped-def]
    """Return the same where the friction coefficient changes within the kick, or friction stops the slip."""
    if grip * coefficient * abs(t) > REGULAR_SLIP:
        return stuck(slip, pull * t, -sliding_force(grip, slip, coefficient) * t, t)
    return slide_by_parts(slip, pull, grip, t, coefficient)


@inlined
def slide_by_parts(slip, pull, grip, t, coefficient):  # type: ignore[no-untyped-def]
    """Return the same where the coefficient changes and friction does not stop the slip; numbers or vectors."""
    k1 = pull + sliding_force(grip, slip, coefficient)
    k2 = pull + sliding_force(grip, slip + 0.5 * t * k1, coefficient)
    k3 = pull + sliding_force(grip, slip + 0.5 * t * k2, coefficient)
    k4 = pull + sliding_force(grip, slip + t * k3, coefficient)
    return t * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0


@called
def slide_by_law(slip, pull, grip, t, coefficient, p):  # type: ignore[no-untyped-def]
    """Return the same where effects make the coefficient depend on the slip."""
    here = coefficient + hooks.friction(slip, p)
    if grip * here * abs(t) > REGULAR_SLIP:
        return stuck(slip, pull * t, -sliding_force(grip, slip, here) * t, t)
    k1 = pull + sliding_force(grip, slip, here)
    at = slip + 0.5 * t * k1
    k2 = pull + sliding_force(grip, at, coefficient + hooks.friction(at, p))
    at = slip + 0.5 * t * k2
    k3 = pull + sliding_force(grip, at, coefficient + hooks.friction(at, p))
    at = slip + t * k3
    k4 = pull + sliding_force(grip, at, coefficient + hooks.friction(at, p))
    return t * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0


@inlined
def drag_grip(speed, drag, t):  # type: ignore[no-untyped-def]
    """Return the relative loss of a ring's speed by its drag in t; numbers or vectors."""
    return t * drag / math.sqrt(speed * speed + REGULAR_SPIN * REGULAR_SPIN)


@inlined
def after_drag(speed, drag, t):  # type: ignore[no-untyped-def]
    """Return the speed of a ring after its drag has acted for t; `drag` in rad/s^2."""
    grip = drag_grip(speed, drag, t)
    if abs(grip) < WEAK_DRAG:
        return speed * (1.0 - grip)
    if abs(grip) > 0.1:
        return speed / (1.0 + grip) if grip > 0.0 else speed * (1.0 - grip)
    middle = speed * (1.0 - 0.5 * grip)
    return speed - t * drag * middle / math.sqrt(middle * middle + REGULAR_SPIN * REGULAR_SPIN)


@inlined
def weakly_damped(rate):  # type: ignore[no-untyped-def]
    """Return phi1 = (1 - exp(-rate)) / rate and (1 - phi1) / rate by a series; numbers or vectors."""
    series = 1.0 - rate * (1 / 4) * (1.0 - rate * (1 / 5) * (1.0 - rate * (1 / 6) * (1.0 - rate * (1 / 7))))
    phi2 = 0.5 * (1.0 - rate * (1 / 3) * series)
    return 1.0 - rate * phi2, phi2


@called
def strongly_damped(rate):  # type: ignore[no-untyped-def]
    """Return the same in closed form."""
    phi1 = -math.expm1(-rate) / rate
    return phi1, (1.0 - phi1) / rate


@inlined
def mean_press(elastic, approach, pull, light, damping, t):  # type: ignore[no-untyped-def]
    """Return the mean normal force in a kick, where approach' = pull - light elastic (1 + damping approach), exactly."""
    rate = light * elastic * damping * t
    if abs(rate) > STRONG:
        phi1, phi2 = strongly_damped(rate)
    else:
        phi1, phi2 = weakly_damped(rate)
    mean = damped_press(elastic, approach, pull, light, damping, t, phi1, phi2)
    return mean if mean > 0.0 else 0.0


@inlined
def damped_press(elastic, approach, pull, light, damping, t, phi1, phi2):  # type: ignore[no-untyped-def]
    """Return the mean normal force without the limit at zero, so it may be tensile; numbers or vectors."""
    return elastic * (1.0 + damping * (approach * phi1 + (pull - light * elastic) * t * phi2))
