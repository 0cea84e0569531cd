"""A power of fixed exponent by a table: in a kick all else waits for it, and on logarithm and exponential twice as long.

A number x = 2^e c (1 + r), with c the middle of one of 32 pieces between 1 and 2, has x^p = 2^(e p) c^p (1 + r)^p; the first
two come from the table, the third is a short series since |r| < 1/64.
"""

from __future__ import annotations

import numpy as np

from tdbsim.cache import inlined

_MANTISSA = 52  # bits
_ONE = 1023  # exponent's bits of 1.0
_LOWEST = -64  # exponents; numbers beyond them are no depths, and their powers wrong
_SPAN = 64
_PIECE_BITS = 5
_PIECES = 1 << _PIECE_BITS
_SCALE, _MIDDLE, _INVERSE, _SERIES, POWER_STOP = 0, _SPAN, _SPAN + _PIECES, _SPAN + 2 * _PIECES, _SPAN + 2 * _PIECES + 8


@inlined
def power_table(exponent):  # type: ignore[no-untyped-def]
    """Return the table of an exponent between -1 and 2."""
    table = np.empty(POWER_STOP)
    for k in range(_SPAN):
        table[_SCALE + k] = 2.0 ** ((_LOWEST + k) * exponent)
    for k in range(_PIECES):
        middle = 1.0 + (k + 0.5) / _PIECES
        table[_MIDDLE + k], table[_INVERSE + k] = middle**exponent, 1.0 / middle
    table[_SERIES] = 1.0
    for k in range(7):
        table[_SERIES + k + 1] = table[_SERIES + k] * (exponent - k) / (k + 1)
    return table


@inlined
def power(x, tables, which):  # type: ignore[no-untyped-def]
    """Return x^exponent to rounding, x positive, by one of several tables."""
    bits = np.float64(x).view(np.int64)
    e = min(max((bits >> _MANTISSA) - (_ONE + _LOWEST), 0), _SPAN - 1)
    piece = (bits >> (_MANTISSA - _PIECE_BITS)) & (_PIECES - 1)
    mantissa = np.int64((bits & ((1 << _MANTISSA) - 1)) | (_ONE << _MANTISSA)).view(np.float64)
    r = mantissa * tables[which, _INVERSE + piece] - 1.0
    r2 = r * r
    low = (1.0 + tables[which, _SERIES + 1] * r) + r2 * (tables[which, _SERIES + 2] + tables[which, _SERIES + 3] * r)
    high = (tables[which, _SERIES + 4] + tables[which, _SERIES + 5] * r) + r2 * (
        tables[which, _SERIES + 6] + tables[which, _SERIES + 7] * r
    )
    return tables[which, _SCALE + e] * tables[which, _MIDDLE + piece] * (low + r2 * r2 * high)
