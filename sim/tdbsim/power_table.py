"""A power of fixed exponent by a table: it is on the critical path of a kick, and logarithm and exponential take twice as long.

For x = 2^e c (1 + r), with c the midpoint of one of 32 intervals between 1 and 2, x^p = 2^(e p) c^p (1 + r)^p; the first two
factors come from the table, the third from a short series since |r| < 1/64.
"""

from __future__ import annotations

import numpy as np

from tdbsim.cache import inlined

MANTISSA = 52  # bits
ONE = 1023  # biased exponent of 1.0
LOWEST = -64  # least exponent in the table; smaller numbers do not occur as depths, and their powers are wrong
SPAN = 64
PIECE_BITS = 5
PIECES = 1 << PIECE_BITS
SCALE, MIDDLE, INVERSE, SERIES, POWER_STOP = 0, SPAN, SPAN + PIECES, SPAN + 2 * PIECES, SPAN + 2 * PIECES + 8


@inlined
def power_table(exponent):  # type: ignore[no-untyped-def]
    """Return the table of an exponent between -1 and 2."""
    table = np.empty(POWER_STOP)
    for k in range(SPAN):
        table[SCALE + k] = 2.0 ** ((LOWEST + k) * exponent)
    for k in range(PIECES):
        middle = 1.0 + (k + 0.5) / PIECES
        table[MIDDLE + k], table[INVERSE + k] = middle**exponent, 1.0 / middle
    table[SERIES] = 1.0
    for k in range(7):
        table[SERIES + k + 1] = table[SERIES + k] * (exponent - k) / (k + 1)
    return table


@inlined
def power(x, tables, which):  # type: ignore[no-untyped-def]
    """Return x^exponent to rounding, with x positive, by the table `which` of several."""
    bits = np.float64(x).view(np.int64)
    e = min(max((bits >> MANTISSA) - (ONE + LOWEST), 0), SPAN - 1)
    piece = (bits >> (MANTISSA - PIECE_BITS)) & (PIECES - 1)
    mantissa = np.int64((bits & ((1 << MANTISSA) - 1)) | (ONE << MANTISSA)).view(np.float64)
    r = mantissa * tables[which, INVERSE + piece] - 1.0
    r2 = r * r
    low = (1.0 + tables[which, SERIES + 1] * r) + r2 * (tables[which, SERIES + 2] + tables[which, SERIES + 3] * r)
    high = (tables[which, SERIES + 4] + tables[which, SERIES + 5] * r) + r2 * (
        tables[which, SERIES + 6] + tables[which, SERIES + 7] * r
    )
    return tables[which, SCALE + e] * tables[which, MIDDLE + piece] * (low + r2 * r2 * high)
