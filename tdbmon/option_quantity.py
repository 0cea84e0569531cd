"""Parsing of quantities given as command-line options; error messages name the option."""

from __future__ import annotations

import re

from tdbsim.errors import InputError
from tdbsim.units import to_si


def speed_of(text: str) -> float:
    """Return `--speed` in Hz (raises InputError if it is not a speed or has no unit)."""
    return _quantity("--speed", text, "Hz", '"100 Hz" or "6000 rpm"')


def seconds_of(text: str) -> float:
    """Return `--seconds` in s; a bare number is in seconds (raises InputError if it is not a time)."""
    return _quantity("--seconds", text, "s", None)


def sampling_of(text: str) -> float:
    """Return `--sampling` in Hz (raises InputError if it is not a rate or has no unit)."""
    return _quantity("--sampling", text, "Hz", '"20 kHz"')


def noise_of(text: str) -> float:
    """Return `--noise`, the noise of each probe in m rms (raises InputError if it is no length, has no unit or is <= 0)."""
    noise = _quantity("--noise", text, "m", '"0.3 um"')
    if noise <= 0:
        raise InputError(f"--noise {text.strip()} must be positive; without noise every effect would be detectable")
    return noise


def _quantity(option: str, text: str, si: str, example: str | None) -> float:
    """Return the option's value in SI; if an example is given, a bare number is refused."""
    if example and re.fullmatch(r"[-+.\deE\s]+", text):
        raise InputError(f"{option} {text.strip()} has no unit; write e.g. {example}")
    try:
        return to_si(text, si)
    except InputError as error:
        raise InputError(f"{option} {text.strip()}: {error}") from error
