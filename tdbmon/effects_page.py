"""The catalogue of effects as text: `tdbmon effects`, and docs/effects.md by ``python -m tdbmon.effects_page``."""

from __future__ import annotations

from pathlib import Path

from tdbsim.effect import EffectDeclaration, catalogue, declaration

from tdbmon.atomic import write_text
from tdbmon.quantity import capitalised

PAGE = Path(__file__).resolve().parents[1] / "docs" / "effects.md"

_HEAD = """# The catalogue of effects

Made by `python -m tdbmon.effects_page` from the declarations in `sim/tdbsim/effects/`; do not edit. An effect is off while its
first parameter has its default (`probe_runout`: both its amplitudes), and then changes no result. *Typical* is a size that a good
record shows; the diagnosis starts its fits there. On the command line:

    tdbmon simulate machine.toml --speed "100 Hz" --seconds 2 --effect oval_clearance:end=NDE,amplitude="20 um" --out drop.nc

and in a machine file:

    [[effect]]
    name = "oval_clearance"
    where = "NDE"
    amplitude = "20 um"

**Where** says what `where` names (on the command line also `end`, `plane` or `probe`): a touchdown bearing or the probes of its
end by the end's name, `both` for the same effect on both bearings, an unbalance plane or a disk of `[rotor]`, a probe. For an
effect on the whole rotor it may be left out on the command line and is `"rotor"` in the machine file.
"""


def render() -> str:
    """Return the page as Markdown."""
    return _HEAD + "".join(_section(each) for each in catalogue())


def catalogue_lines() -> list[str]:
    """Return one line of text per effect."""
    return [f"{each.identifier:<26}{each.place:<18}{each.what}" for each in catalogue()]


def effect_lines(identifier: str) -> list[str]:
    """Return the description of one effect with its parameters as lines (raises `InputError` if the name is unknown)."""
    found = declaration(identifier)
    lines = [f"{found.identifier}: {capitalised(found.title)}", found.what]
    lines += [f"signature: {found.signature}", f"on the machine: {found.on_the_machine}", f"where: {found.place}"]
    for one in found.parameters:
        if one.choices:
            lines.append(f"  {one.name}: {one.meaning}; {' or '.join(one.choices)}, default {one.choices[0]}")
        else:
            bounds = f"{one.text(one.low)} to {one.text(one.high)}"
            lines.append(
                f"  {one.name}: {one.meaning}; {bounds}, off or default {one.text(one.off)}, typical {one.text(one.typical)}"
            )
    return lines


def _section(effect: EffectDeclaration) -> str:
    rows = []
    for one in effect.parameters:
        if one.choices:
            rows.append(f"| `{one.name}` | {one.meaning} | {' or '.join(one.choices)} | {one.choices[0]} | |")
        else:
            bounds = f"{one.text(one.low)} to {one.text(one.high)}"
            rows.append(f"| `{one.name}` | {one.meaning} | {bounds} | {one.text(one.off)} | {one.text(one.typical)} |")
    return (
        f"\n## `{effect.identifier}`\n\n{effect.what} **Where:** {effect.place}. **Signature:** {effect.signature}"
        f" **On the machine:** {effect.on_the_machine}\n\n"
        "| parameter | what | bounds | default | typical |\n|---|---|---|---|---|\n" + "\n".join(rows) + "\n"
    )


if __name__ == "__main__":
    write_text(PAGE, render())
