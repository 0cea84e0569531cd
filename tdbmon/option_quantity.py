"""A quantity given on the command line: a number with its unit, and the option's name in what is wrong with it."""

from __future__ import annotations

import re

from tdbsim.errors import InputError
from tdbsim.units import to_si


def speed_of(text: str) -> float:
    """Return `--speed`, Hz (raises InputError where it is no speed or has no unit)."""
    return _quantity("--speed", text, "Hz", '"100 Hz" or "6000 rpm"')


def seconds_of(text: str) -> float:
    """Return `--seconds`, s; a number alone counts as seconds (raises InputError where it is no time)."""
    return _quantity("--seconds", text, "s", None)


def sampling_of(text: str) -> float:
    """Return `--sampling`, Hz (raises InputError where it is no rate or has no unit)."""
    return _quantity("--sampling", text, "Hz", '"20 kHz"')


def noise_of(text: str) -> float:
    """Return `--noise`, a probe's, m rms (raises InputError where it is no length, has no unit, or is not positive)."""
    noise = _quantity("--noise", text, "m", '"0.3 um"')
    if noise <= 0:
        raise InputError(f"--noise {text.strip()} must be positive; without noise everything shows")
    return noise


def _quantity(option: str, text: str, si: str, example: str | None) -> float:
    """Return the option in SI; with an example, a number alone is refused."""
    if example and re.fullmatch(r"[-+.\deE\s]+", text):
        raise InputError(f"{option} {text.strip()} has no unit; write e.g. {example}")
    try:
        return to_si(text, si)
    except InputError as error:
        raise InputError(f"{option} {text.strip()}: {error}") from error
