"""Conversion of units at input: text with a unit to SI numbers.  No other module sees a unit.

Three traps of general unit libraries are avoided.  In this field ``mil`` is a thousandth of an inch, never an angle.  Speeds and
frequencies are in cycles per second: ``rpm`` is divided by 60 and ``rad/s`` by 2 pi.  ``pk-pk`` and ``0-pk`` are not units; they
are split off (`split_kind`) and kept separately.
"""

from __future__ import annotations

import math
import re
from functools import cache
from typing import Any

from tdbsim.errors import InputError

_KINDS = {"pp": "pk-pk", "p-p": "pk-pk", "pkpk": "pk-pk", "pk-pk": "pk-pk", "pk": "0-pk", "0-pk": "0-pk", "rms": "rms"}

# spellings of data acquisition systems, and their meaning
_VENDOR = {
    "mil": "thou", "mils": "thou", "volts": "volt", "volt": "volt", "micron": "micrometer", "microns": "micrometer",
    "mue": "micrometer", "mikrometer": "micrometer", "mikron": "micrometer",
    "seconds": "second", "sec": "second", "secs": "second", "hertz": "hertz",
    "vdc": "volt", "v dc": "volt", "mvdc": "mV", "mv dc": "mV",
    "rps": "hertz", "rev": "turn", "rpm": "rpm", "r.p.m.": "rpm", "upm": "rpm", "cpm": "rpm", "kcpm": "krpm", "hz": "hertz",
    "counts": "dimensionless", "%": "percent", "-": "dimensionless", "": "dimensionless", "1": "dimensionless",
}  # fmt: skip

# products written without a space; case matters here, since nm is a length
_TOGETHER = {"Nm": "N m", "mNm": "mN m", "kNm": "kN m", "Ns/m": "N s/m", "kNs/m": "kN s/m", "Nmm": "N mm", "kgm": "kg m",
             "kgm^2": "kg m^2", "gmm": "g mm", "kgmm": "kg mm", "gcm": "g cm"}  # fmt: skip

# revolutions per unit of time in English, German and French notation; alone or in brackets, as in mV/(U/min)
_TURNS = re.compile(
    r"(?i)(?:^|(?<=\())(?:cycles?|cyc|revs?|r|u|umdr\.?|umdrehungen|tr|tours?|1)?\s*/\s*"
    r"(?:(?P<minute>min(?:utes?)?\.?)|s|secs?|seconds?|sek\.?|sekunden?)(?=$|\))"
)
_COUNTED = ("Hz", "V s")  # SI units in which a turn counts 1, not 2 pi: speed, and volts of a speed signal per hertz

_COMMA = re.compile(r"^(\s*[-+]?\d+),(\d+)")  # a decimal comma
_NUMBER = re.compile(r"^\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*$")


@cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


def split_kind(unit: str) -> tuple[str, str | None]:
    """Split ``"um pp"`` into ``("um", "pk-pk")``; the kind is None where the text names none."""
    words = unit.split()
    if len(words) > 1 and words[-1].lower() in _KINDS:
        return " ".join(words[:-1]), _KINDS[words[-1].lower()]
    return unit.strip(), None


def _spelling(unit: str) -> str:
    text = unit.strip().replace("µ", "u").replace("μ", "u").replace("°", "deg").replace("²", "^2").replace("³", "^3")
    text = text.replace("æ", "u").replace("⁻¹", "^-1")  # the µ of a DOS code page is read as æ on Windows
    if text.lower() in _VENDOR:
        return _VENDOR[text.lower()]
    text = _TURNS.sub(lambda found: "rpm" if found["minute"] else "hertz", text)
    text = re.sub(r"\bmils?\b", "thou", text)
    text = re.sub(r"(?<=[a-zA-Z])(-1|[23])(?!\d)", r"^\1", text)
    return _TOGETHER.get(text, text)


@cache
def scale(unit: str, si: str) -> float:
    """Return the factor from `unit` to the SI unit `si`.

    Parameters
    ----------
    unit : str
        As written by people or instruments: ``"um"``, ``"mil"``, ``"rpm"``, ``"g mm"``.
    si : str
        The SI unit wanted, e.g. ``"m"``, ``"Hz"``, ``"rad"``, ``"V/m"``, ``"1"``.

    Raises
    ------
    InputError
        If the unit is unknown or of another dimension.
    """
    spelled, kind = split_kind(unit)
    if kind is not None:
        raise InputError(
            f"'{unit}' is a {kind} amplitude, not an instantaneous value; give the unit alone: '{spelled}'"
        )
    spelled = _spelling(spelled)
    registry = _registry()
    try:
        parsed = registry.Quantity(1.0, spelled)
        if si == "Hz":
            if parsed.dimensionality != {"[time]": -1.0}:
                raise InputError(f"'{unit}' is not a frequency or a speed; write Hz, rpm or rad/s")
        if si in _COUNTED:
            angle = dict(parsed.to_root_units().unit_items()).get("radian", 0)
            return float(parsed.to("1/s" if si == "Hz" else si).magnitude) / (2 * math.pi) ** float(angle)
        factor = parsed.to("dimensionless" if si == "1" else si)
        zero = registry.Quantity(0.0, spelled).to("dimensionless" if si == "1" else si)
        if zero.magnitude != 0.0:
            raise InputError(f"'{unit}' has an offset relative to {si}; write the value in {si}")
        return float(factor.magnitude)
    except InputError:
        raise
    except Exception as error:  # pint raises many kinds, several of them not its own
        cure = "a number" if si == "1" else f"a unit like {si}"
        raise InputError(f"'{unit}' is not a unit that can be converted to {cure}") from error


def to_si(value: Any, si: str) -> float:
    """Convert a number (already SI) or a text such as ``"250 um"`` to SI.

    Raises
    ------
    InputError
        If it is neither, is not finite, or its unit is unknown or of another dimension.
    """
    if isinstance(value, bool) or value is None:
        raise InputError(f"{value!r} is not a quantity; write a number in {si} or a text with a unit")
    if isinstance(value, (int, float)):
        number = float(value)
    elif isinstance(value, str):
        found = _NUMBER.match(value)
        if not found:
            example = "a number, e.g. 1.5" if si == "1" else f'a number and a unit, e.g. "1.5 {si}"'
            raise InputError(f"'{value}' is not a quantity; write {example}")
        if _COMMA.match(value):
            pointed = _COMMA.sub(r"\1.\2", value).strip()
            raise InputError(f"'{value}' has a decimal comma; write '{pointed}'")
        if "±" in value or "+-" in value or "+/-" in value:
            raise InputError(
                f"'{value}' holds a tolerance; where a value may have one, write nominal and tolerance:"
                ' { nominal = "250 um", tolerance = "50 um" }'
            )
        number = float(found.group(1))
        if found.group(2):
            number *= scale(found.group(2), si)
    else:
        raise InputError(f"{value!r} is not a quantity; write a number in {si} or a text with a unit")
    if not math.isfinite(number):
        raise InputError(f"{value!r} is not a finite number")
    return number


def is_bare(value: Any) -> bool:
    """Return whether a quantity is stated without a unit, as a number or as a text (``"135"``)."""
    found = _NUMBER.match(value) if isinstance(value, str) else None
    return not isinstance(value, str) or (found is not None and not found.group(2))


def is_unit(unit: str) -> bool:
    """Return whether a text is a unit of any quantity, or of an amplitude (``um pp``)."""
    spelled, kind = split_kind(unit)
    try:
        _registry().Quantity(1.0, _spelling(spelled))
    except Exception:  # pint raises many kinds, several of them not its own
        return kind is not None and is_unit(spelled)
    return True


def si_unit_of(unit: str) -> tuple[str, float] | None:
    """Return the SI unit and factor of a channel's unit, or None where the unit is unknown.

    Displacements become m, speeds and frequencies Hz, voltages V, times s, angles rad, accelerations m/s^2,
    forces N, temperatures stay unconverted (None) since they carry an offset.
    """
    if _spelling(split_kind(unit)[0]) in ("dimensionless", "percent"):  # a plain number, not an angle
        return "1", scale(unit, "1")
    for si in ("m", "Hz", "V", "s", "rad", "m/s", "m/s^2", "N", "A", "1"):
        try:
            return si, scale(unit, si)
        except InputError:
            continue
    return None
