"""Residuals of plain and extended model on a held-out drop, compared with the noise."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from tdbmon.diagnosis.evidence import EXTENDED, PLAIN
from tdbmon.figures.style import BLUE, GREY, UM, VERMILION, Margins, new_figure, styled, subplots

if TYPE_CHECKING:
    from tdbmon.diagnosis.held_out import HeldOut


@styled
def extended_gain(proof: HeldOut) -> Figure:
    """Draw three bars: residual of the plain model, of the extended model, and the noise."""
    figure = new_figure(48, f"{proof.drop} · {proof.judge}, measured less simulated")
    ax = subplots(figure, 1, 1, Margins(30, 24, 8, 11))[0, 0]
    bars = (
        (PLAIN, proof.plain, VERMILION),
        (EXTENDED, proof.extended, BLUE),
        ("noise", proof.noise, GREY),
    )
    for row, (_, value, colour) in enumerate(bars):
        ax.barh(row, value * UM, color=colour, height=0.6)
        ax.annotate(
            f"{value * UM:.3g} µm", (value * UM, row), xytext=(4, 0), textcoords="offset points", va="center"
        )  # fmt: skip
    ax.set_xlim(0, 1.2 * max(value for _, value, _ in bars) * UM)
    ax.set_yticks(range(3), [name for name, *_ in bars])
    ax.set_ylim(2.6, -0.6)
    ax.grid(axis="y", visible=False)
    ax.set_ylabel("residual of")
    ax.set_xlabel("residual, measured less simulated [µm rms]")
    return figure
