"""Powers by the tables of `tdbsim.power_table` in eight lanes, whose exponents may differ."""

from __future__ import annotations

from tdbsim.cache import called, inlined
from tdbsim.power_table import (
    INVERSE,
    LOWEST,
    MANTISSA,
    MIDDLE,
    ONE,
    PIECE_BITS,
    PIECES,
    POWER_STOP,
    SCALE,
    SERIES,
    SPAN,
    power_table,
)
from tdbsim.vectors import LANES, as_bits, gather, lane_numbers, load, of_bits, where

POWERS_STOP = POWER_STOP * LANES


@called
def fill_powers(exponents, tables):  # type: ignore[no-untyped-def]
    """Fill the tables for exponents (lanes,)."""
    for a in range(LANES):
        table = power_table(exponents[a])
        for k in range(POWER_STOP):
            tables[k * LANES + a] = table[k]


@inlined
def powers_of(x, tables):  # type: ignore[no-untyped-def]
    """Return x^exponent to rounding, with x positive, as `tdbsim.power_table.power`."""
    bits, lane = as_bits(x), lane_numbers()
    e = (bits >> MANTISSA) + -(ONE + LOWEST)
    e = where(e < 0, 0, where(e > SPAN - 1, SPAN - 1, e))
    piece = ((bits >> (MANTISSA - PIECE_BITS)) & (PIECES - 1)) * LANES + lane
    mantissa = of_bits((bits & ((1 << MANTISSA) - 1)) | (ONE << MANTISSA))
    r = mantissa * gather(tables, piece + INVERSE * LANES) - 1.0
    r2 = r * r
    at = SERIES * LANES
    low = (1.0 + load(tables, at + LANES) * r) + r2 * (load(tables, at + 2 * LANES) + load(tables, at + 3 * LANES) * r)
    high = (load(tables, at + 4 * LANES) + load(tables, at + 5 * LANES) * r) + r2 * (
        load(tables, at + 6 * LANES) + load(tables, at + 7 * LANES) * r
    )
    scale = gather(tables, e * LANES + lane + SCALE * LANES)
    return scale * gather(tables, piece + MIDDLE * LANES) * (low + r2 * r2 * high)
