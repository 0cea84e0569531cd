"""Values of a machine's file: numbers in SI, texts with a unit, and values with a tolerance."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict

from tdbsim.errors import InputError, did_you_mean
from tdbsim.units import is_bare, to_si


class Tolerant(BaseModel):
    """A value with a tolerance (SI), within which calibration fits it."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    nominal: float
    low: float
    high: float

    @property
    def is_exact(self) -> bool:
        """True where no tolerance was stated."""
        return self.low == self.high


def _si(value: Any, si: str) -> float:
    """Return a value in SI; refuse a bare angle of more than a turn, which is one in degrees without its unit."""
    number = to_si(value, si)
    if si == "rad" and is_bare(value) and abs(number) > 2 * math.pi:
        raise InputError(
            f'{number:g} rad is {math.degrees(number):.0f} deg, more than a turn; if degrees are meant, write "{number:g} deg"'
        )
    return number


def quantity(si: str) -> BeforeValidator:
    """Return the validator of an exact value in an SI unit."""

    def parse(value: Any) -> float:
        if isinstance(value, dict):
            raise InputError(f"this value takes no tolerance; write a number in {si} or a text with a unit")
        return _si(value, si)

    return BeforeValidator(parse)


def _tolerant(si: str) -> BeforeValidator:
    def parse(value: Any) -> Any:
        if isinstance(value, Tolerant):
            return value
        if not isinstance(value, dict):
            number = _si(value, si)
            return {"nominal": number, "low": number, "high": number}
        unknown = set(value) - {"nominal", "tolerance"}
        if unknown:
            name = sorted(unknown)[0]
            raise InputError(f"unknown key '{name}'{did_you_mean(name, ['nominal', 'tolerance'])}")
        if "nominal" not in value:
            raise InputError("a value with a tolerance needs 'nominal'")
        nominal = _si(value["nominal"], si)
        tolerance = value.get("tolerance", 0)
        if isinstance(tolerance, str) and tolerance.strip().endswith(("%", "percent")):
            share = to_si(tolerance, "1")
            if nominal == 0 and share != 0:
                cure = "write its half-width with a unit, or correct the nominal value"
                raise InputError(f"tolerance {tolerance!r} of a nominal value of zero is zero: {cure}")
            width = abs(nominal) * share
        elif si != "1" and is_bare(tolerance) and not is_bare(value["nominal"]) and to_si(tolerance, si) != 0:
            raise InputError(
                f"tolerance {tolerance!r} has no unit, but the value has one ({value['nominal']!r}); write it with its unit, or"
                ' as a share, e.g. "20 %"'
            )
        else:
            width = _si(tolerance, si)
        if width < 0:
            raise InputError(f"tolerance {tolerance!r} is negative; write its half-width as a positive value")
        return {"nominal": nominal, "low": nominal - width, "high": nominal + width}

    return BeforeValidator(parse)


Length = Annotated[float, quantity("m")]
Mass = Annotated[float, quantity("kg")]
Inertia = Annotated[float, quantity("kg m^2")]
Pressure = Annotated[float, quantity("Pa")]
Density = Annotated[float, quantity("kg/m^3")]
Number = Annotated[float, quantity("1")]
Angle = Annotated[float, quantity("rad")]
Voltage = Annotated[float, quantity("V")]
Sensitivity = Annotated[float, quantity("V/m")]
Acceleration = Annotated[float, quantity("m/s^2")]

TolerantLength = Annotated[Tolerant, _tolerant("m")]
TolerantNumber = Annotated[Tolerant, _tolerant("1")]
TolerantStiffness = Annotated[Tolerant, _tolerant("N/m")]
TolerantDamping = Annotated[Tolerant, _tolerant("N s/m")]
TolerantTime = Annotated[Tolerant, _tolerant("s")]
TolerantUnbalance = Annotated[Tolerant, _tolerant("kg m")]
TolerantAngle = Annotated[Tolerant, _tolerant("rad")]
TolerantMoment = Annotated[Tolerant, _tolerant("N m")]
TolerantContactDamping = Annotated[Tolerant, _tolerant("s/m")]


class Part(BaseModel):
    """A table of a machine file, without unknown keys or non-finite values."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
