"""Adaptive integration: the Dormand-Prince pair of orders 5 and 4 with dense output.

J. R. Dormand, P. J. Prince, A family of embedded Runge-Kutta formulae, J. Comp. Appl. Math. 6 (1980) 19; dense output
of order 4 and the step control after E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I,
section II.6.  The slow method, for reference runs: any accuracy, and all forces evaluated in one right-hand side.
"""

from __future__ import annotations

import math

import numpy as np

from tdbsim.cache import compiled
from tdbsim.rhs import derivative

C = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
A = np.array(
    [
        [0, 0, 0, 0, 0, 0],
        [1 / 5, 0, 0, 0, 0, 0],
        [3 / 40, 9 / 40, 0, 0, 0, 0],
        [44 / 45, -56 / 15, 32 / 9, 0, 0, 0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0, 0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0],
        [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
ERROR = np.array([71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
DENSE = np.array(
    [
        -12715105075 / 11282082432,
        0,
        87487479700 / 32700410799,
        -10690763975 / 1880347072,
        701980252875 / 199316789632,
        -1453857185 / 822651844,
        69997945 / 29380423,
    ]
)
SMALLEST_STEP = 1e-11  # s

DONE, NO_CONVERGENCE = 0, 1


@compiled
def integrate(m, y, t, step, largest, rtol, scale, times, out):  # type: ignore[no-untyped-def]
    """Advance `y` (in place) from `t` through `times`, filling the rows of `out`.

    Returns a code, the time reached, the next step and the number of steps.  The error of component k per step is held below
    ``rtol * scale[k]``.
    """
    size = len(y)
    k = np.zeros((7, size))
    trial = np.empty(size)
    derivative(m, t, y, k[0])
    row = 0
    steps = 0
    while row < len(times):
        step = min(step, largest)
        if not step >= SMALLEST_STEP:
            return NO_CONVERGENCE, t, step, steps
        for s in range(1, 7):
            for c in range(size):
                total = 0.0
                for r in range(s):
                    total += A[s, r] * k[r, c]
                trial[c] = y[c] + step * total
            derivative(m, t + C[s] * step, trial, k[s])
        worst = 0.0
        for c in range(size):
            total = 0.0
            for r in range(7):
                total += ERROR[r] * k[r, c]
            worst = max(worst, abs(step * total) / (rtol * scale[c]))
            if not math.isfinite(total):
                worst = 1e10
        if worst <= 1.0:
            while row < len(times) and times[row] <= t + step * (1 + 1e-12):
                theta = (times[row] - t) / step
                rest = 1.0 - theta
                for c in range(size):
                    change = trial[c] - y[c]
                    start = step * k[0, c] - change
                    finish = change - step * k[6, c] - start
                    bump = 0.0
                    for r in range(7):
                        bump += DENSE[r] * k[r, c]
                    out[row, c] = y[c] + theta * (change + rest * (start + theta * (finish + rest * step * bump)))
                row += 1
            t += step
            steps += 1
            for c in range(size):
                y[c] = trial[c]
                k[0, c] = k[6, c]
        step *= min(5.0, max(0.2, 0.9 * (worst + 1e-30) ** -0.2))
    return DONE, t, step, steps
