"""Writing of machine files: the TOML that `tdbsim.machine.load_machine` reads, in customary units.

A file states a tolerance symmetric about its nominal value.  If the limits of a value are not symmetric, as after a calibration
that moved the value, a tolerance of the same width is written about the new value.
"""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel
from tdbsim.bearing_heat import BearingHeat, HeatMaterial
from tdbsim.effect import Effect, Parameter
from tdbsim.errors import InputError
from tdbsim.machine import (
    Balls,
    Disk,
    EffectSetting,
    Keyphasor,
    Machine,
    MagneticBearing,
    Probe,
    Rotor,
    Section,
    SlowRoll,
    Tolerant,
    TouchdownBearing,
    Unbalance,
    parse_machine,
)
from tdbsim.stated_effects import all_effects
from tdbsim.units import scale, to_si

from tdbmon.atomic import write_text

if TYPE_CHECKING:
    from tdbmon.identify.calibration import Calibration

# the unit in which each value is written, by part; values not listed are plain numbers in SI
UNITS: dict[type[BaseModel], dict[str, str]] = {
    Section: {"length": "mm", "outer_diameter": "mm", "inner_diameter": "mm"},
    Disk: {"position": "mm", "mass": "kg", "polar_inertia": "kg m^2", "diametral_inertia": "kg m^2"},
    Unbalance: {"position": "mm", "amount": "g mm", "phase": "deg"},
    Rotor: {"elastic_modulus": "GPa", "density": "kg/m^3", "speed_decay_time": "s"},
    MagneticBearing: {"position": "mm", "stiffness": "N/m", "damping": "N s/m"},
    Balls: {"diameter": "mm", "pitch_diameter": "mm", "diametral_clearance": "um", "contact_angle": "deg"},
    TouchdownBearing: {
        "position": "mm",
        "journal_radius": "mm",
        "radial_gap": "um",
        "contact_damping": "s/m",
        "inner_ring_mass": "kg",
        "inner_ring_inertia": "kg m^2",
        "inner_ring_drag": "mN m",
        "ball_damping": "N s/m",
        "support_mass": "kg",
        "support_stiffness": "N/m",
        "support_damping": "N s/m",
    },
    BearingHeat: {
        "inner_race_radius": "mm",
        "outer_race_radius": "mm",
        "outer_radius": "mm",
        "housing_radius": "mm",
        "width": "mm",
        "housing_width": "mm",
        "shaft_length": "mm",
        "viscosity": "mm^2/s",
    },
    HeatMaterial: {
        "elastic_modulus": "GPa",
        "density": "kg/m^3",
        "conductivity": "W/(m K)",
        "specific_heat": "J/(kg K)",
        "expansion": "1/K",
    },
    Probe: {"position": "mm", "angle": "deg", "sensitivity": "mV/um", "offset": "V", "range": "um"},
    SlowRoll: {"peak_to_peak": "um", "phase_lag": "deg"},
    Keyphasor: {"angle": "deg"},
    Machine: {"gravity": "m/s^2", "mains": "Hz"},
}
SI = {
    "mm": "m",
    "um": "m",
    "GPa": "Pa",
    "g mm": "kg m",
    "deg": "rad",
    "mV/um": "V/m",
    "mN m": "N m",
    "mm^2/s": "m^2/s",
}

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")


def machine_text(machine: Machine, head: str = "") -> str:
    """Return the text of a machine's file.

    `parse_machine` reads it back exactly, except that limits asymmetric about the nominal value become symmetric with the same
    width: relative if the value is a positive size, else absolute.

    Parameters
    ----------
    machine : Machine
    head : str
        Comment at the top of the file, e.g. its author and the drops it is based on.

    Raises
    ------
    InputError
        If a setting of an effect has a type that no effect accepts (a table, a list, a date).
    """
    plain, tables = [], []
    for key, value in _entries(machine):
        if isinstance(value, tuple):
            tables += ["\n".join([f"[[{key}]]", *_lines(part)]) for part in value]
        elif isinstance(value, BaseModel):
            tables.append("\n".join([f"[{key}]", *_lines(value)]))
        elif isinstance(value, dict):
            rows = [f"{_key(name)} = {_string(channel)}" for name, channel in value.items()]
            tables += ["\n".join([f"[{key}]", *rows])] if rows else []
        else:
            plain.append(f"{key} = {_toml(value, UNITS[Machine].get(key))}")
    comment = [f"# {_printable(line)}".rstrip() for line in head.splitlines()]
    return "\n\n".join(["\n".join([*comment, *plain]), *tables]) + "\n"


def write_machine(machine: Machine, path: Path, head: str = "") -> None:
    """Write a machine's file, whole or not at all (see `machine_text`).

    Raises
    ------
    InputError
        If the machine could not be read back, or the path cannot be written.
    """
    text = machine_text(machine, head)
    parse_machine(tomllib.loads(text), str(path))
    write_text(path, text)


def check_suffix(path: Path | None) -> None:
    """Raise InputError if a machine file to write is not .toml, before time is spent on a fit."""
    if path is None:
        return
    if path.suffix.lower() != ".toml":
        raise InputError(
            f"{path}: a machine file is .toml, not '{path.suffix}'; name it {path.with_suffix('.toml').name}"
        )


def calibration_head(calibration: Calibration, machine_file: Path, remark: str = "") -> str:
    """Return the comment at the top of a calibrated machine's file: its source, the misfit and poorly determined values.

    `remark` is a further remark on its values.
    """
    from tdbmon import __version__

    drops = ", ".join(fit.name for fit in calibration.drops)
    lines = [
        f"Written by tdbmon {__version__}: {machine_file.name} with the values fitted to {drops}.",
        "Values with a tolerance are fitted; the tolerances have the same width as in that file, now about these values.",
        f"The residual of the fit is {calibration.misfit:.2f} times the noise of the probes.",
    ]
    if calibration.undetermined:
        names = ", ".join(each.name for each in calibration.undetermined)
        lines.append(f"Hardly determined by the fitted drops: {names}.")
    if calibration.at_bound:
        names = ", ".join(calibration.at_bound)
        lines.append(f"At a limit of their range, so the true value may lie beyond it: {names}.")
    if remark:
        lines.append(remark)
    return "\n".join(lines)


def with_effects(machine: Machine, effects: Sequence[Effect]) -> Machine:
    """Return a machine with effects added to its own.

    Raises
    ------
    InputError
        If a place does not exist on the machine, or an effect that may act only once at a place is given there twice.
    """
    all_effects(machine, effects)
    return machine.model_copy(update={"effects": (*machine.effects, *(_setting(effect) for effect in effects))})


def _setting(effect: Effect) -> EffectSetting:
    """Return an effect as a machine file states it; non-finite values (a rigid foundation) are left at their default."""
    values = {each.name: _written(getattr(effect, each.name), each) for each in effect.parameters()}
    kept = {name: value for name, value in values.items() if value is not None}
    return EffectSetting.model_validate({"name": effect.identifier(), "where": effect.where, **kept})


def _written(value: float | str, parameter: Parameter) -> float | str | None:
    if isinstance(value, str):
        return value
    if not math.isfinite(value):
        return None
    return float(value) if parameter.unit == "1" else _quantity(value, parameter.unit, parameter.si)


def _entries(part: BaseModel) -> Iterator[tuple[str, Any]]:
    """Yield the entries of a part's table; defaults that were not set explicitly are left out."""
    for name, field in type(part).model_fields.items():
        value = getattr(part, name)
        default = field.get_default(call_default_factory=True)
        if value is not None and (name in part.model_fields_set or value != default):
            yield field.alias or name, value
    yield from (part.model_extra or {}).items()


def _lines(part: BaseModel) -> list[str]:
    units = UNITS.get(type(part), {})
    return [f"{_key(key)} = {_toml(value, units.get(key))}" for key, value in _entries(part)]


def _toml(value: Any, unit: str | None) -> str:
    """Return a value as TOML; numbers are written in `unit`, or as plain SI numbers if it is None."""
    if isinstance(value, Tolerant):
        return _tolerant(value, unit)
    if isinstance(value, BaseModel):
        return "{ " + ", ".join(_lines(value)) + " }"
    if isinstance(value, tuple) and any(isinstance(each, BaseModel) for each in value):
        return "[\n" + "".join(f"  {_toml(each, unit)},\n" for each in value) + "]"
    if isinstance(value, tuple):
        return "[" + ", ".join(_toml(each, unit) for each in value) + "]"
    if isinstance(value, str):
        return _string(value)
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return _number(value) if unit is None else _string(_quantity(value, unit, SI.get(unit, unit)))
    raise InputError(f"{value!r} cannot be written to a machine file; give a number or a text")


def _tolerant(value: Tolerant, unit: str | None) -> str:
    nominal = _toml(value.nominal, unit)
    if value.low == value.nominal == value.high:
        return nominal
    return f"{{ nominal = {nominal}, tolerance = {_string(_tolerance(value, unit or '1'))} }}"


def _tolerance(value: Tolerant, unit: str) -> str:
    """Return the shortest tolerance that reproduces a value's limits exactly; else the symmetric one of the same width."""
    si = SI.get(unit, unit)
    nominal, half = abs(float(value.nominal)), (value.high - value.low) / 2
    for digits in range(3, 18):
        for width in (half, value.high - value.nominal, value.nominal - value.low):
            percent = f"{100 * width / nominal:.{digits}g} %" if width < 10 * nominal else "0 %"
            absolute = _with_unit(f"{width / scale(unit, si):.{digits}g}", unit)
            for text, read in ((percent, nominal * to_si(percent, "1")), (absolute, to_si(absolute, si))):
                if (value.nominal - read, value.nominal + read) == (value.low, value.high):
                    return text
    # rounding of the limits may have moved the width by a few units in the last place
    for width in (half, value.high - value.nominal, value.nominal - value.low):
        for ulps in range(-4, 5):
            near = width + ulps * math.ulp(width)
            if (value.nominal - near, value.nominal + near) == (value.low, value.high):
                return _with_unit(repr(near), si)
    # per cent keeps a non-negative size non-negative; an angle has no fixed origin
    if value.low >= 0 and nominal and si != "rad":
        return f"{100 * (value.high - value.low) / (value.high + value.low):.12g} %"
    return _with_unit(f"{half / scale(unit, si):.12g}", unit)


def _quantity(value: float, unit: str, si: str) -> str:
    """Return a text that parses to exactly this value, in `unit` unless only SI gives it in few digits or at all."""
    for name, digits in ((unit, range(6, 13)), (si, range(6, 13)), (unit, range(13, 18))):
        outside = float(value) / scale(name, si)
        for count in digits:
            text = _with_unit(f"{outside:.{count}g}", name)
            if to_si(text, si) == value:
                return text
    return _with_unit(repr(float(value)), si)


def _with_unit(number: str, unit: str) -> str:
    return number if unit == "1" else f"{number} {unit}"


def _number(value: float) -> str:
    texts = (f"{value:.{digits}g}" for digits in range(6, 18))
    return next((text for text in texts if float(text) == value), repr(float(value)))


def _string(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _key(name: str) -> str:
    return name if _BARE_KEY.fullmatch(name) else _string(name)


def _printable(line: str) -> str:
    """Return a line without control characters, which TOML comments must not contain."""
    return "".join(character if character.isprintable() else "?" for character in line)
