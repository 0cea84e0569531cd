"""Effects stated on the command line or in a machine file, and the checked set of all effects on a machine.

More instances at one place than allowed are refused (`Effect.most`, `Effect.once`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from tdbsim.effect import Effect, EffectDeclaration, Place, declaration
from tdbsim.errors import InputError
from tdbsim.machine import EffectSetting, Machine


def parse(text: str) -> Effect:
    """Read an effect in the form of the command line: ``oval_clearance:end=NDE,amplitude=20 um,angle=35 deg``.

    The place is given as ``where=`` or ``end=`` (or by its kind: ``plane=``, ``probe=``); effects of the whole rotor
    need none.  A value may be quoted.

    Raises
    ------
    InputError
        If the form, a name or a value is wrong.
    """
    identifier, _, rest = text.partition(":")
    found = declaration(identifier.strip())
    values: dict[str, str] = {}
    where = None
    for part in filter(None, (piece.strip() for piece in rest.split(","))):
        name, equals, value = (piece.strip() for piece in part.partition("="))
        value = value.strip("\"'")  # quotes within quotes, or not removed by a shell
        if not equals or not name or not value:
            raise InputError(f"{identifier}: '{part}' is not of the form name=value, e.g. \"amplitude=20 um\"")
        if name in ("where", "end", "plane", "probe"):
            if where is not None:
                raise InputError(f"{identifier}: the place is given twice")
            where = value
        elif name in values:
            raise InputError(f"{identifier}: {name} is given twice")
        else:
            values[name] = value
    return _placed(found, where, values)


def from_setting(setting: EffectSetting) -> Effect:
    """Return the effect of an ``[[effect]]`` section of a machine file (raises as `parse`)."""
    with _named_in_errors(setting):
        return _placed(declaration(setting.name), setting.where, setting.parameters)


@contextmanager
def _named_in_errors(setting: EffectSetting) -> Iterator[None]:
    """Add to errors that the effect is in the machine file."""
    try:
        yield
    except InputError as wrong:
        raise InputError(f"[[effect]] at '{setting.where}': {wrong}") from None


def _placed(found: EffectDeclaration, where: str | None, values: Mapping[str, Any]) -> Effect:
    if where is None:
        if found.place is not Place.ROTOR:
            wanted = "a bearing, or both" if found.place is Place.BEARING_OR_BOTH else f"its {found.place}"
            raise InputError(
                f"{found.identifier}: no place given; write where=... with the machine file's name of {wanted}"
            )
        where = "rotor"
    return found.at(where, values)


def all_effects(machine: Machine, more: Iterable[Effect] = ()) -> tuple[Effect, ...]:
    """Return the machine's own and additional effects, checked against the machine and against each other.

    Raises
    ------
    InputError
        If a place does not exist, or has more instances of an effect than allowed.
    """
    own = tuple(from_setting(setting) for setting in machine.effects)
    for setting, effect in zip(machine.effects, own, strict=True):
        with _named_in_errors(setting):
            effect.check_place(machine)
    further = tuple(more)
    for each in further:
        each.check_place(machine)
    _check_how_often(machine, own, further)
    return (*own, *further)


def _check_how_often(machine: Machine, own: Sequence[Effect], more: Sequence[Effect]) -> None:
    standing: Counter[tuple[object, ...]] = Counter()
    stated = {key for each in own for key in _occupied(machine, each)}
    for count, each in enumerate((*own, *more)):
        name = each.identifier()
        for key in _occupied(machine, each):
            standing[key] += 1
            if standing[key] <= each.most:
                continue
            if each.most > 1:
                raise InputError(f"{name} is given more than {each.most} times for '{each.where}'; combine some of them")
            cure = (
                "the machine file already has it: change it or remove it there"
                if count >= len(own) and key in stated
                else "give it once"
            )
            raise InputError(f"{name} is given twice for '{each.where}'; it can act only once at a place: {cure}")


def _occupied(machine: Machine, effect: Effect) -> list[tuple[object, ...]]:
    """Return the keys of the places that an effect occupies, of which each holds `most`; none where instances add up."""
    if not (effect.slots or effect.once):
        return []
    # choices distinguish effects that act side by side (crosstalk into either probe), but not ones with common compiled slots
    words = () if effect.slots else tuple(getattr(effect, each.name) for each in effect.parameters() if each.choices)
    return [(effect.identifier(), place, *words) for place in effect.standing_places(machine)]
