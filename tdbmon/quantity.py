"""Quantities as text: a value with its interval, rounded to the interval's significant digits, in a readable unit."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from datetime import datetime
from decimal import Decimal

from tdbsim.quantity import Tolerant

from tdbmon.estimate import OUTSIDE, Estimate

_UNIT_WORD = {"um": "µm", "1": "", "deg": "°", "N/m": "N/m", "N s/m": "N s/m", "N m": "N m"}
_PREFIXED = ("N", "N/m", "N s/m", "N m")  # units that may be written with a prefix
_LENGTHS = ("um", "mm", "m")
_FINEST = 0.05  # um, finest interval width resolved: two decimals
_LONG, _TINY = 1e6, 1e-4  # numbers above _LONG, or dimensionless ones below _TINY, are written with a power of ten
_RAISED = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_MICRO, _MINUS = re.compile(r"(?<=\d )µ(?=[A-Za-z])"), re.compile(r"−(?=\d)")  # in numbers, not in names
_PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"))


def signed(value: float, digits: int) -> str:
    """Return a number with its sign and this many decimals; zero never has a minus."""
    return f"{round(value, digits) + 0.0:+.{digits}f}".replace("-", "−")


def percent(share: float, digits: int = 0) -> str:
    """Return a fraction as text in per cent with this many decimals: ``5 %``."""
    return f"{round(100 * share, digits) + 0.0:.{digits}f} %".replace("-", "−")


def stated_percent(share: float) -> str:
    """Return a fraction stated by the user as text in per cent with all its digits (six at most): ``2.5 %``."""
    return f"{100 * share:.6g} %"


def off_by(ratio: float) -> str:
    """Return the deviation of a ratio from one in per cent with its sign: ``+1.2 %``."""
    return f"{signed(100 * (ratio - 1), 1)} %"


def whole_degrees(angle: float) -> str:
    """Return an angle (rad) as text in whole degrees: ``−90°``."""
    return f"{math.degrees(angle):.0f}°".replace("-", "−")


def counted(number: int, noun: str) -> str:
    """Return a count with its noun, given in the singular: ``1 drop``, ``3 drops``."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def first_few(names: Sequence[str], most: int, between: str = ", ") -> str:
    """Return the first `most` names and the number of the others: ``a, b and 3 more``."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return between.join(names[:most]) + more


def capitalised(words: str) -> str:
    """Return a text with its first letter as a capital; the rest is unchanged."""
    return words[:1].upper() + words[1:]


def decapitalised(words: str) -> str:
    """Return a text with its first letter in lower case, for use within a sentence; an abbreviation there keeps its capitals."""
    return words if words[:2].isupper() else words[:1].lower() + words[1:]


def words(estimate: Estimate, unit: str | None = None) -> str:
    """Return an estimate as text: ``282.1 µm (279.0 to 285.2)``.

    Parameters
    ----------
    estimate : Estimate
    unit : str, optional
        Another unit of `tdbmon.estimate.OUTSIDE` of the same quantity (e.g. ms for s).
    """
    if estimate.value is None:
        return f"not estimated: {estimate.why}"
    factor, name = _unit(estimate, unit)
    tail = f" {name}{_kind(estimate)}".rstrip() if name != "°" else name
    value = estimate.value * factor
    if estimate.low is None or estimate.high is None:
        count = not tail and float(value).is_integer()
        return _fixed(value, 0) if count else f"{number(value, abs(value) * 1e-2)}{tail}"
    low, high = estimate.low * factor, estimate.high * factor
    width = _told_apart(value, low, high)
    if estimate.unit == "um" and unit is None:
        width = _as_probes_tell(width, value, low, high)
    return f"{number(value, width)}{tail} ({number(low, width)} to {number(high, width)})"


def printed(estimate: Estimate, unit: str | None = None) -> str:
    """Return an estimate as `words` does, in characters that every terminal has: ``282.1 um (279.0 to 285.2)``."""
    if estimate.value is None:
        return f"not estimated ({estimate.why})"
    return plain(words(estimate, unit))


def toleranced(stated: Tolerant, unit: str) -> str:
    """Return a stated value with its tolerance, in a unit of `tdbmon.estimate.OUTSIDE`: ``5.5 kN s/m (3.3 to 7.7)``."""
    factor, name = _unit(Estimate(stated.nominal, stated.low, stated.high, unit), None)
    value, low, high = (f"{x * factor:.4g}".replace("-", "−") for x in (stated.nominal, stated.low, stated.high))
    tail = name if name == "°" else f" {name}".rstrip()
    return f"{value}{tail} ({'no tolerance' if stated.is_exact else f'{low} to {high}'})"


def why_no_interval(estimate: Estimate) -> str:
    """Return in brackets the reason why a value has no interval; "" if it has one, or if there is no value."""
    return f" ({estimate.why})" if estimate.known and estimate.low is None and estimate.why else ""


def plain(text: str) -> str:
    """Return text with its numbers and units in characters that every terminal has: ``-3 um`` for ``−3 µm``."""
    return _MINUS.sub("-", _MICRO.sub("u", text))


def _told_apart(value: float, low: float, high: float) -> float:
    """Return the width that sets the digits of an interval so that rounding keeps the value off its ends, and zero outside it.

    The digits must separate the value from the nearer end, and an interval that excludes zero from zero.  All in printed units.
    """
    nearest = min((away for away in (value - low, high - value) if away > 0), default=0.0)
    finest = (high - low) / 100
    width = min(high - low, max(4 * nearest, finest)) if nearest else high - low
    from_zero = max(low, -high)
    return max(4 * from_zero, finest) if from_zero > 0 and not float(_fixed(from_zero, _decimals(width))) else width


def _as_probes_tell(width: float, *shown: float) -> float:
    """Return the width for hundredths of a micrometre instead of a finer one, if the numbers (um) still differ when so rounded.

    An interval may be finer than the resolution of any probe, as that of a mean over thousands of noisy samples.
    """
    return _FINEST if width < _FINEST and len({_fixed(x, _decimals(_FINEST)) for x in shown}) == len(shown) else width


def short(estimate: Estimate, width: float | None = None) -> str:
    """Return an estimate as text without its interval; a dash if it is missing.

    `width` (SI) of an interval sets the digits; by default the estimate's own, but at least a hundredth of the value.
    """
    if estimate.value is None:
        return "–"
    factor, name = _unit(estimate, None)
    if width is None:
        width = max(abs(estimate.value) * 1e-2, estimate.width or 0.0)
    return f"{number(estimate.value * factor, width * factor)} {name}{_kind(estimate)}".strip()


def subtracted(estimate: Estimate, before: float, difference: Estimate) -> tuple[str, str, str]:
    """Return an estimate, the value before it and their difference (SI) as text in one unit.

    The digits follow the difference's interval (the estimate's if it has none), with one more if the rounded numbers do not
    subtract exactly; if that is not enough, the value before is rounded the other way.
    """
    if estimate.value is None or difference.value is None:
        return short(estimate), "–", words(difference)
    numbers = [estimate.value, before, difference.value]
    factor, name = _unit(Estimate(max(map(abs, numbers)), unit=estimate.unit), None)
    width = max(estimate.width or 0.0, abs(estimate.value) * 1e-2) * factor
    if difference.low is not None and difference.high is not None:
        numbers += [difference.low, difference.high]
        width = _told_apart(*(x * factor for x in numbers[2:]))
    decimals = _decimals(width)
    for more in range(2):
        texts = [_fixed(x * factor, decimals + more) for x in numbers]
        this, old, apart = (Decimal(text.replace("−", "-")) for text in texts[:3])
        if this - old == apart:
            break
    texts[1] = f"{this - apart:f}".replace("-", "−")
    unit, kind = f" {name}" if name else "", _kind(estimate)
    interval = f" ({texts[3]} to {texts[4]})" if len(texts) > 3 else ""
    return f"{texts[0]}{unit}{kind}", f"{texts[1]}{unit}{kind}", f"{texts[2]}{unit}{interval}"


def number(value: float, width: float) -> str:
    """Return a number with the decimals that show `width` to two significant digits (one if its first is 4 or more)."""
    return _fixed(value, _decimals(width)) if width > 0 else f"{value:.6g}"


def _decimals(width: float) -> int:
    if not width > 0:
        return 0
    power = math.floor(math.log10(width))
    return max(0, min(9, 1 - power) - (width / 10.0**power >= 4))  # a width of 6.1 needs no tenth


def _fixed(value: float, decimals: int) -> str:
    text = f"{value:.{decimals}f}"
    if float(text) == 0:
        text = text.removeprefix("-")
    return text.replace("-", "−")


def _kind(estimate: Estimate) -> str:
    """Return the suffix for the kind of an amplitude (``0-pk``): only lengths have one, as forces do not swing about a mean."""
    return f" {estimate.kind}" if estimate.kind and estimate.unit in _LENGTHS else ""


def _unit(estimate: Estimate, unit: str | None) -> tuple[float, str]:
    """Return the factor from SI and the unit's name, with a prefix or power of ten if the number would be long."""
    chosen = unit or estimate.unit
    factor = OUTSIDE[chosen]
    if chosen in _PREFIXED and estimate.value:
        size = max(abs(x) for x in (estimate.value, estimate.low or 0.0, estimate.high or 0.0))
        for scale, prefix in _PREFIXES:
            if size >= scale:
                return factor / scale, prefix + _UNIT_WORD.get(chosen, chosen)
    size = max(abs(x) for x in (estimate.value or 0.0, estimate.low or 0.0, estimate.high or 0.0)) * factor
    if size >= _LONG or (chosen == "1" and 0 < size < _TINY):  # 1302123761 N/m^(10/9) is 1.302 ×10⁹ N/m^(10/9)
        power = 3 * int(math.log10(size) // 3)
        return factor / 10.0**power, f"×10{raised(power)} {_UNIT_WORD.get(chosen, chosen)}".rstrip()
    return factor, _UNIT_WORD.get(chosen, chosen)


def raised(power: int) -> str:
    """Return an exponent in superscript digits: ``⁻³``."""
    return str(power).translate(_RAISED)


def rpm(speed: Estimate) -> str:
    """Return a speed as text in Hz with its interval, followed by the value in whole rpm."""
    if speed.value is None:
        return words(speed)
    return f"{words(speed)}, {_fixed(speed.value * 60, 0)} rpm"


def moment(text: str) -> str:
    """Return an ISO 8601 date and time in readable form, the date alone if no time is stated; any other text unchanged."""
    try:
        when = datetime.fromisoformat(text)
    except ValueError:
        return text
    if len(text) <= len("2026-03-11"):
        return f"{when:%Y-%m-%d}"
    zone = "" if when.tzinfo is None else f" {when.tzname()}"
    return f"{when:%Y-%m-%d %H:%M:%S}{zone}"
