"""``python -m tdbmon.effects_page`` writes docs/effects.md from the effects' own declarations."""

from __future__ import annotations

from pathlib import Path

from tdbsim.effect import EffectDeclaration, catalogue

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
