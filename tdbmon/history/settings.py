"""The owner's settings of an archive in `archive.toml`: matching, significance, alarm limits and agreed number of drops."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError
from tdbsim.errors import InputError, did_you_mean
from tdbsim.fatigue import STATIC_LIMIT
from tdbsim.units import to_si

from tdbmon.atomic import write_text
from tdbmon.history.correction import Method

SETTINGS = "archive.toml"
FORMAT = 1

_FIRST = f"""\
# Archive of dropdowns; tdbmon made this file once and never changes it.  docs/history.md says what each setting means.
format = {FORMAT}

[matching]
speed = "5 %"            # largest difference in speed at the release between drops that are compared

[compare]
least_drops = 5          # matching drops before, needed for the verdict "as before"
significance = 0.05      # probability of a false flag on a drop like those before, over all features together
correction = "holm"      # or "fdr_bh": share of false flags among the flags (Benjamini and Hochberg)

[inspect]                # a change (flagged, or a drift) beyond these limits: inspect before the next start
gap_growth = "20 %"      # of the radius at rest; no standard states it: put the bearing maker's wear limit here
stress = "4200 MPa"      # Hertz stress for a permanent deformation of 1e-4 of the ball diameter (ISO 76)
backward_whirl = "0.1 s" # longest backward whirl

[life]
# agreed_drops = 20      # full drops agreed between vendor and user (ISO 14839-4); API 617 asks for at least two
# full_speed = "100 Hz"  # a drop from 90 % of it on counts as full; without it every drop does

# [machine."Name of a machine".life]     # any of these for one machine alone
# agreed_drops = 5
"""


def _si(unit: str) -> BeforeValidator:
    return BeforeValidator(lambda value: to_si(value, unit))


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Matching(_Part):
    """Matching conditions."""

    speed: Annotated[float, _si("1")] = Field(0.05, gt=0, lt=1)


class Compare(_Part):
    """Least number of earlier drops, significance level and correction for multiple testing."""

    least_drops: int = Field(5, ge=2)
    significance: Annotated[float, _si("1")] = Field(0.05, gt=0, lt=0.5)
    correction: Method = "holm"


class Inspect(_Part):
    """Limits of the verdict "inspect"."""

    gap_growth: Annotated[float, _si("1")] = Field(0.2, gt=0, le=1)  # rejects 20 for 20 %
    stress: Annotated[float, _si("Pa")] = Field(STATIC_LIMIT, gt=0)
    backward_whirl: Annotated[float, _si("s")] = Field(0.1, ge=0)


class Life(_Part):
    """Agreed number of full drops, and the speed of one."""

    agreed_drops: int | None = Field(None, ge=1)
    full_speed: Annotated[float, _si("Hz")] | None = Field(None, gt=0)


class Settings(_Part):
    """All settings, for one machine."""

    matching: Matching = Matching()
    compare: Compare = Compare()
    inspect: Inspect = Inspect()
    life: Life = Life()


def first_settings(path: Path) -> None:
    """Write the settings of a new archive."""
    write_text(path, _FIRST)


def load_settings(path: Path, machine: str = "") -> Settings:
    """Read the settings of a machine, or the general ones.

    Raises
    ------
    InputError
        If the file is not TOML, of a newer format, or a key or value is wrong.
    """
    content = _read(path)
    form = content.pop("format", None)
    if not isinstance(form, int):
        raise InputError(f"{path}: 'format' is missing; write format = {FORMAT}")
    if form > FORMAT:
        raise InputError(f"{path}: archive format {form} is of a newer tdbmon than this one ({FORMAT}): update tdbmon")
    own = content.pop("machine", {})
    _check_tables(path, content, "")
    _validated(path, content, "")  # before those of machines, which inherit its errors
    if not isinstance(own, dict):
        raise InputError(f'{path}: machine = {own!r} is not a table; write [machine."name".life] and the like')
    for name, part in own.items():
        if not isinstance(part, dict):
            raise InputError(
                f'{path}: machine."{name}" = {part!r} is not a table; write [machine."{name}".life] and the like'
            )
        _check_tables(path, part, f'machine."{name}".')
        _validated(path, _merged(content, part), f'machine."{name}".')
    return _validated(path, _merged(content, own.get(machine, {})), "")


def machines_stated(path: Path) -> tuple[str, ...]:
    """Return the names of the machines that have settings of their own."""
    return tuple(_read(path).get("machine", {}))


def _read(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; the folder is not an archive") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: is not valid TOML ({error}); correct it there") from None


def _check_tables(path: Path, content: dict[str, Any], where: str) -> None:
    for key, value in content.items():
        if not isinstance(value, dict):
            raise InputError(
                f"{path}: {where}{key} = {value!r} is not a table; write [{where}{key}] with its keys below it"
            )


def _merged(content: dict[str, Any], own: dict[str, Any]) -> dict[str, Any]:
    return {**content, **{key: {**content.get(key, {}), **value} for key, value in own.items()}}


def _validated(path: Path, content: dict[str, Any], where: str) -> Settings:
    try:
        return Settings.model_validate(content)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        if first["type"] == "extra_forbidden":
            known = _keys(first["loc"][:-1])
            raise InputError(
                f"{path}: unknown key '{where}{place}'{did_you_mean(str(first['loc'][-1]), known)}"
            ) from None
        said = first["msg"].removeprefix("Value error, ")
        raise InputError(f"{path}: {where}{place} = {first['input']!r}: {said}; correct it there") from None


def _keys(location: tuple[int | str, ...]) -> list[str]:
    model: Any = Settings
    for part in location:
        model = model.model_fields[str(part)].annotation
    return list(model.model_fields)
