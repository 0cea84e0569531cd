"""The catalogue of effects as text: `tdbmon effects`, and docs/effects.md by ``python -m tdbmon.effects_page``."""

from __future__ import annotations

from pathlib import Path

from tdbsim.effect import EffectDeclaration, catalogue, declaration

from tdbmon.atomic import write_text

PAGE = Path(__file__).resolve().parents[1] / "docs" / "effects.md"

_HEAD = """# The catalogue of effects

Made by `python -m tdbmon.effects_page` from the declarations in `sim/tdbsim/effects/`; do not edit. An effect is off at its
default and then changes no result. On the command line:

    tdbmon simulate machine.toml --speed "100 Hz" --effect oval_clearance:end=NDE,amplitude="20 um" --out drop.nc

and in a machine file:

    [[effect]]
    name = "oval_clearance"
    where = "NDE"
    amplitude = "20 um"
"""


def render() -> str:
    """Return the page."""
    return _HEAD + "".join(_section(each) for each in catalogue())


def catalogue_lines() -> list[str]:
    """Return a line an effect."""
    return [f"{each.identifier:<26}{each.place:<18}{each.what}" for each in catalogue()]


def effect_lines(identifier: str) -> list[str]:
    """Return one effect with its parameters (raises `InputError` where there is none of that name)."""
    found = declaration(identifier)
    lines = [f"{found.identifier}: {found.title}", found.what]
    lines += [f"signature: {found.signature}", f"where: {found.place}"]
    for one in found.parameters:
        if one.choices:
            lines.append(f"  {one.name}: {one.meaning}; {' or '.join(one.choices)}")
        else:
            bounds = f"{one.text(one.low)} to {one.text(one.high)}"
            lines.append(f"  {one.name}: {one.meaning}; {bounds}, off or default {one.text(one.off)}")
    return lines


def _section(effect: EffectDeclaration) -> str:
    rows = []
    for one in effect.parameters:
        if one.choices:
            rows.append(f"| `{one.name}` | {one.meaning} | {' or '.join(one.choices)} | {one.choices[0]} |")
        else:
            bounds = f"{one.text(one.low)} to {one.text(one.high)}"
            rows.append(f"| `{one.name}` | {one.meaning} | {bounds} | {one.text(one.off)} |")
    return (
        f"\n## `{effect.identifier}`\n\n{effect.what} **Where:** {effect.place}. **Signature:** {effect.signature}\n\n"
        "| parameter | what | bounds | default |\n|---|---|---|---|\n" + "\n".join(rows) + "\n"
    )


if __name__ == "__main__":
    write_text(PAGE, render())
