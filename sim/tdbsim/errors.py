"""The error for unusable input, and the search for the name that was meant."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

_NEAR = 0.8  # least similarity by difflib; a name with a word left out has less
_BEGINNING = 3  # least number of letters of a beginning: fewer match too many names


class InputError(ValueError):
    """An input cannot be used; the message says where, what, the value with its unit, and the cure.

    The command line prints it as one line and exits with code 2.
    """


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return ``"; did you mean 'x'?"``, or the list of known names where none is near.

    The beginning of any word of a name is near to that name.
    """
    names = sorted(set(known))
    near = _nearest(name, names, _NEAR) or _begins_like(name.lower(), names) or _nearest(name, names, 0.6)
    if near:
        meant = "' or '".join(near)
        return f"; did you mean '{meant}'?"
    return f"; known: {', '.join(names)}" if names else ""


def _nearest(name: str, names: list[str], cutoff: float) -> list[str]:
    return get_close_matches(name, names, 1, cutoff) or get_close_matches(name.lower(), names, 1, cutoff)


def _begins_like(name: str, names: list[str]) -> list[str]:
    """Return the names with a word that begins similarly: ``stribeck_friction`` for ``stribek``."""
    begun = {each.lower()[at : at + len(name)] for each in names for at in _words_of(each)}
    near = get_close_matches(name, sorted(begun), 1, _NEAR) if len(name) >= _BEGINNING else []
    return [each for each in names if near and any(each.lower().startswith(near[0], at) for at in _words_of(each))]


def _words_of(name: str) -> list[int]:
    """Return the indices at which the words of a name begin."""
    return [0, *(at + 1 for at, letter in enumerate(name) if letter in "_- ./")]
