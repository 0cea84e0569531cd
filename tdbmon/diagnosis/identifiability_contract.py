"""The JSON of `tdbmon identifiability`, and its lines on a terminal."""

from __future__ import annotations

from typing import Any

from tdbsim.stated_effects import all_effects

from tdbmon.diagnosis.contract import standing_json
from tdbmon.diagnosis.effect_size import off_of, off_when_stiff
from tdbmon.diagnosis.identifiability import ALIKE, DETECTABLE, Detectable, Identifiability, about
from tdbmon.diagnosis.suspects import Suspect
from tdbmon.identify.free_effect import effect_in_words
from tdbmon.identify.slowing import LAST_S

_SHOWN = 20  # pairs on a terminal; the JSON has all


def identifiability_json(found: Identifiability) -> dict[str, Any]:
    """Return the content of the JSON."""
    return {
        "machine": found.machine.name,
        "speeds_hz": list(found.speeds),
        "noise_um": found.noise * 1e6,
        "horizon_s": found.horizon,
        "detectable_sigmas": DETECTABLE,
        "alike_above": ALIKE,
        "effects": [
            {
                **_suspect(each.suspect),
                "parameter": each.parameter,
                "smallest_detectable": each.size.to_json(),
                "may_show_later": each.may_show_later,
                "looks_like": {**_suspect(each.looks_like[0]), "similarity": each.looks_like[1]}
                if each.looks_like
                else None,
            }
            for each in found.detectable
        ],
        "pairs": [
            {"one": _suspect(one), "other": _suspect(other), "similarity": similar}
            for one, other, similar in found.pairs
        ],
        "next_drops": [{"speed_hz": speed, "pairs_left": left} for speed, left in found.next_drops],
        "next_test": _advice(found),
        "standing": [standing_json(each) for each in all_effects(found.machine)],
        "limits": list(found.limits),
        "synthetic": True,
        "seconds": found.seconds,
    }


def identifiability_lines(found: Identifiability) -> list[str]:
    """Return the command's lines."""
    speeds = ", ".join(f"{speed:g}" for speed in found.speeds)
    effect = max([44, *(len(_text(each.suspect)) + 2 for each in found.detectable)])
    place = max([12, *(len(each.suspect.where) + 2 for each in found.detectable)])
    size = max([44, *(len(_size(each)) + 2 for each in found.detectable)])
    out = [
        f"{found.machine.name}: drops from {speeds} Hz, probe noise {found.noise * 1e6:g} um rms (nothing measured)",
        f"{'effect':<{effect}}{'at':<{place}}{'detectable (about)':<{size}}{'similarity':<12}to",
    ]
    if standing := all_effects(found.machine):
        out.insert(
            1, f"already in the machine file, and not tried in the same place: {'; '.join(map(effect_in_words, standing))}"
        )
    for each in found.detectable:
        like = ""
        if each.looks_like:
            other, similar = each.looks_like
            like = f"{similar:<12.2f}{_text(other)} at {other.where}"
        line = f"{_text(each.suspect):<{effect}}{each.suspect.where:<{place}}{_size(each):<{size}}{like}"
        out.append(line.rstrip())
    if found.pairs:
        out.append(f"not distinguishable (similarity above {ALIKE:g}, of 1): {len(found.pairs)} pairs")
    for one, other, similar in found.pairs[:_SHOWN]:
        out.append(f"  {similar:.3f}  {_text(one)} at {one.where} - {_text(other)} at {other.where}")
    if len(found.pairs) > _SHOWN:
        out.append(f"  and {len(found.pairs) - _SHOWN} more, in the JSON")
    out.append(f"next drop: {_advice(found)}")
    if any(each.may_show_later for each in found.detectable):
        out.append(
            f"so early: in the first {found.horizon * 1e3:g} ms; such an effect may show in the rest of a record of {LAST_S:g} s,"
            " in how the rotor slows and whirls, which `diagnose` evaluates too"
        )
    out += [f"limit: {each}" for each in found.limits]
    return out


def _size(found: Detectable) -> str:
    """Return the size from which, or the stiffness up to which, an effect shows."""
    name = found.parameter.replace("_", " ")
    size = next(size for size, _ in found.suspect.sizes if size.name == found.parameter)
    off, stiff = off_of(size), off_when_stiff(size)
    named = f"|{name} - {off:g}|" if off and not stiff else name
    if found.size.value is not None:
        return f"{named} {'up to' if stiff else 'from'} about {about(found.size.value, found.size.unit)}"
    later = " so early" if found.may_show_later else ""
    if found.unseen is None:
        return f"{named} not detectable{later}"
    return f"{named} not detectable{later} {'down' if stiff else 'up'} to {about(found.unseen, found.size.unit)}"


def _advice(found: Identifiability) -> str:
    now = len(found.pairs)
    if not now:
        return "none needed to distinguish these effects; drop from one more speed to hold that drop out"
    if not found.next_drops:
        return "none of the speeds tried can be simulated; drop from another set-point"
    speed, left = found.next_drops[0]
    if left >= now:
        return f"none of the speeds tried separates more pairs; a drop from {speed:g} Hz lowers the detectable sizes"
    return f"from {speed:g} Hz, with another set-point: of {now} pairs that are not distinguishable {left} remain"


def _suspect(suspect: Suspect) -> dict[str, Any]:
    return {"effect": suspect.declared.identifier, "where": suspect.where, "held": dict(suspect.held)}


def _text(suspect: Suspect) -> str:
    held = ", ".join(
        value if isinstance(value, str) else f"{name} {suspect.declared.parameter(name).text(value)}"
        for name, value in suspect.held.items()
    )
    return suspect.declared.identifier + (f" ({held})" if held else "")
