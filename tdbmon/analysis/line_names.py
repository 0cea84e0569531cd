"""Names of spectral lines: orders, mains, swings and their combination frequencies, and bands expected by the caller.

The rotor swings on an arc, so that its vertical motion follows the square of the horizontal: two swings f1 and f2 also appear
at 2 f1, 2 f2, f1 + f2 and f2 - f1, and at combinations of third and fourth order.  Such a line is no mode of its own.  It is
recognised window by window, since it follows its parents when their frequency changes with amplitude.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from tdbmon.estimate import Z95, Estimate

if TYPE_CHECKING:
    from tdbmon.analysis.lines import Trace

_ORDERS = 4  # highest order of a combination
_WEAKER = 0.5  # greatest amplitude of a combination, relative to its stronger parent
_CELLS = 0.3  # cells: greatest mean distance of a combination from its expected frequency
_MAINS = 0.004  # relative deviation of a grid's frequency
_HARMONICS = 12
_TONE = 0.25  # cells: greatest standard deviation of the frequency of a tone
_SWING_HZ = (10.0, 100.0)  # for clearances of 2.5 mm to 25 um
_HORIZONTAL = 0.8  # least share of x in a swing's power
_SECOND = 0.01  # of the stronger swing's amplitude: a weaker line is not taken for the other swing


class Band(NamedTuple):
    """Band from `low` to `high`, Hz, in which a line of constant frequency gets a name; `swing` for swings in the clearance."""

    name: str
    low: float
    high: float
    swing: bool = False


def order_name(order: float) -> str:
    """Return the name of an order, such as "1X", "1/2X" or "4.75X"."""
    fraction = Fraction(order).limit_denominator(3)
    if abs(fraction - order) > 1e-9:
        return f"{order:.2f}X"
    return f"{fraction}X"


def name_constants(
    traces: Sequence[Trace], mains_hz: float, resolution: float, expected: Sequence[Band]
) -> list[Trace]:
    """Name the lines of constant frequency; mains lines get the kind "mains".

    Parameters
    ----------
    traces : sequence of Trace
    mains_hz : float
    resolution : float
        Width of a cell, Hz.
    expected : sequence of Band

    Returns
    -------
    list of Trace
        In the same order.
    """
    multiples = dict(_mains(traces, mains_hz, resolution))
    named = {i: "mains" if n == 1 else f"{n} x mains" for i, n in multiples.items()}
    mains = set(named)
    combined = {i for i, n in multiples.items() if n > 1}
    parents = _swings(traces, expected, mains)
    named |= {i: name for name, i in parents.items()}
    if parents:
        for i, trace in enumerate(traces):
            if i not in named and (name := _combination(trace, traces, parents, resolution)):
                named[i] = name
                combined.add(i)
    for band in expected:
        inside = [i for i, t in enumerate(traces) if i not in named and band.low <= _hz(t) <= band.high]
        if inside and not band.swing and band.name not in named.values():
            named[max(inside, key=lambda i: _height(traces[i]))] = band.name
    out = []
    for i, trace in enumerate(traces):
        line = replace(trace.line, name=named.get(i, f"{_hz(trace):.4g} Hz"), combined=i in combined)
        if i in mains:
            line = replace(line, kind="mains", amplitude=_median(trace.height))
        out.append(replace(trace, line=line))
    return out


def _median(height: np.ndarray) -> Estimate:
    """Return the median amplitude of a steady line, which is robust against other lines that cross it."""
    middle = float(np.median(height))
    spread = 1.4826 * float(np.median(np.abs(height - middle)))
    return Estimate.from_sigma(
        middle, 1.2533 * spread / np.sqrt(len(height)), "um", "median semi-major axis over its windows", "0-pk", least=0.0
    )


def _hz(trace: Trace) -> float:
    return float(trace.line.frequency.value or 0.0)


def _height(trace: Trace) -> float:
    return float(trace.line.amplitude.value or 0.0)


def _mains(traces: Sequence[Trace], mains_hz: float, resolution: float) -> list[tuple[int, int]]:
    """Return index and multiple of lines at mains multiples that are tones (a mode's frequency fluctuates) and do not decay."""
    found = []
    for i, trace in enumerate(traces):
        n = round(_hz(trace) / mains_hz)
        low, high = trace.line.frequency.low or 0.0, trace.line.frequency.high or 0.0
        near = _MAINS * n * mains_hz + min((high - low) / 2, _CELLS * resolution)
        tone = 1.4826 * np.median(np.abs(trace.place - np.median(trace.place))) < _TONE * resolution
        if 1 <= n <= _HARMONICS and trace.steady and tone and abs(_hz(trace) - n * mains_hz) <= near:
            found.append((i, n))
    return found


def _swings(traces: Sequence[Trace], expected: Sequence[Band], mains: set[int]) -> dict[str, int]:
    """Return the swings by name: the strongest horizontal line in each of their bands, or without bands the two strongest of all.

    A shaft in full whirl and a vibrating floor cause lines in those bands too, but not horizontal ones.
    """
    bands = [band for band in expected if band.swing]
    free = [i for i, trace in enumerate(traces) if i not in mains and trace.horizontal >= _HORIZONTAL]
    parents: dict[str, int] = {}
    for band in bands:
        inside = [i for i in free if band.low <= _hz(traces[i]) <= band.high and i not in parents.values()]
        if inside:
            parents[band.name] = max(inside, key=lambda i: _height(traces[i]))
    if bands:
        return parents
    level = [i for i in free if _SWING_HZ[0] <= _hz(traces[i]) <= _SWING_HZ[1]]
    level = sorted(level, key=lambda i: -_height(traces[i]))[:2]
    level = [i for i in level if _height(traces[i]) >= _SECOND * _height(traces[level[0]])]
    return {f"swing {n}": i for n, i in enumerate(sorted(level, key=lambda i: _hz(traces[i])), start=1)}


def _combination(trace: Trace, traces: Sequence[Trace], parents: dict[str, int], resolution: float) -> str:
    """Return the name of the lowest-order combination of swings that the line follows; "" if there is none."""
    names = list(parents)[:2]
    ways = [(a, b) for a in range(_ORDERS + 1) for b in range(-_ORDERS, _ORDERS + 1) if 2 <= a + abs(b) <= _ORDERS]
    if len(names) == 1:
        ways = [(a, b) for a, b in ways if b == 0]
    for a, b in sorted(ways, key=lambda w: (abs(w[0]) + abs(w[1]), abs(w[1]))):
        used = [(n, traces[parents[name]]) for n, name in ((a, names[0]), (b, names[-1])) if n]
        if _height(trace) > _WEAKER * max(_height(parent) for _, parent in used):
            continue
        even = (a + b) % 2 == 0
        if (trace.horizontal < 0.5) != even:  # the square is vertical, the cube horizontal
            continue
        common = trace.window
        for _, parent in used:
            common = np.intersect1d(common, parent.window)
        if common.size < 3:
            continue
        for sign in (1, -1):
            gap = trace.place_at(common) - sign * sum(n * parent.place_at(common) for n, parent in used)
            spread = Z95 * np.std(gap, ddof=1) / np.sqrt(common.size)
            if abs(np.mean(gap)) < _CELLS * resolution + min(spread, _CELLS * resolution):
                return _sum_name([(sign * n, name) for n, name in ((a, names[0]), (b, names[-1])) if n])
    return ""


def _sum_name(terms: list[tuple[int, str]]) -> str:
    """Return the name of a combination, such as "2 x swing 1" or "swing 2 - swing 1"."""
    first, *rest = sorted(terms, key=lambda term: -term[0])

    def times(n: int, name: str) -> str:
        return name if abs(n) == 1 else f"{abs(n)} x {name}"

    return times(*first) + "".join(f" {'+' if n > 0 else '-'} {times(n, name)}" for n, name in rest)
