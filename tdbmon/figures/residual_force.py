"""Residual force at both ends, against time and against the position in the clearance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tdbmon.figures.drop_names import short_names
from tdbmon.figures.orbit_axes import orbit_axes, show_about
from tdbmon.figures.style import (
    BLACK,
    BLUE,
    GREY,
    PHASE_COLOUR,
    SKY,
    TITLE_LETTERS,
    UM,
    Margins,
    clipped,
    drop_look,
    legend_below,
    legend_room,
    name_axis,
    new_figure,
    styled,
    subplots,
)

if TYPE_CHECKING:
    from tdbmon.diagnosis.residual_force import ResidualForce

_ARROWS = 40  # most arrows at an end
_COLUMNS = 4  # of the legend of drops


@styled
def force_against_time(
    forces: Sequence[ResidualForce], ends: Sequence[str], speeds: Sequence[float], model: str
) -> Figure:
    """Draw x and y of the residual force of a model for some drops side by side; speeds in Hz."""
    note = f"Force on the rotor that the {model} lacks · computed from displacement, not measured"
    figure = new_figure(28 + 23 * 2 * len(ends), note)
    axes = subplots(
        figure, 2 * len(ends), len(forces), Margins(16, 3, 15, 17, across=4, down=3), sharex=True, sharey="row"
    )
    names = short_names([each.drop for each in forces])
    for column, (each, name, speed) in enumerate(zip(forces, names, speeds, strict=True)):
        axes[0, column].set_title(f"{name}, {speed:.0f} Hz")
        time = each.time * 1e3
        for row in range(2 * len(ends)):
            end, part = divmod(row, 2)
            ax = axes[row, column]
            force = each.force[end].imag if part else each.force[end].real
            pressed = np.abs(each.simulated[end]) > 0
            ax.fill_between(
                time, 0, 1, where=pressed, transform=ax.get_xaxis_transform(), color=PHASE_COLOUR["contacts"],
                linewidth=0, zorder=0, label="in contact (simulated)",
            )  # fmt: skip
            ax.fill_between(
                time, force - each.band[end, part], force + each.band[end, part], color=SKY, alpha=0.6, linewidth=0,
                label="95 % band: noise of the probes",
            )  # fmt: skip
            ax.plot(time, force, color=BLUE, label="missing force")
            ax.axhline(0, color=GREY, linewidth=0.6)
        axes[-1, column].set_xlim(0, time[-1])
        axes[-1, column].set_xlabel("time from the release [ms]")
    for row, ax in enumerate(axes[:, 0]):
        name_axis(ax, f"{{}} {'xy'[row % 2]} [N]", ends[row // 2])
        ax.yaxis.set_label_coords(-11 * len(forces) / 151, 0.5)
    legend_below(figure, 3)
    return figure


@styled
def force_against_place(
    forces: Sequence[ResidualForce], ends: Sequence[str], gaps: Sequence[float], speeds: Sequence[float]
) -> Figure:
    """Draw the residual force of all drops at the shaft's positions, as arrows and against the angle.

    Parameters
    ----------
    forces : sequence of ResidualForce
    ends : sequence of str
    gaps : sequence of float
        Fitted radial gap of each end, m.
    speeds : sequence of float
        Speeds of the drops, Hz.
    """
    note = "All instants at which the missing force is outside its 95 % band · angle from +x (right) towards +y (up)"
    more, drops = legend_room(len(forces), _COLUMNS, 3), short_names([each.drop for each in forces])
    figure = new_figure(22 + more + 66 * len(ends), note)
    axes = subplots(figure, len(ends), 2, Margins(16, 3, 12, 22 + more, across=16, down=18))
    for end, name in enumerate(ends):
        orbit, angle = axes[end]
        _clearance(orbit, gaps[end], max(float(np.abs(each.place[end]).max()) for each in forces))
        beyond = [_beyond_band(each, end) for each in forces]
        strongest = max(
            (float(np.abs(each.force[end, out]).max()) for each, out in zip(forces, beyond, strict=True) if out.any()),
            default=0.0,
        )
        for k, (each, speed, out) in enumerate(zip(forces, speeds, beyond, strict=True)):
            (colour, line), label = drop_look(k), f"{drops[k]}, {speed:.0f} Hz"
            place, force = each.place[end], each.force[end]
            orbit.plot(place.real * UM, place.imag * UM, color=colour, linestyle=line, linewidth=0.4, alpha=0.7)
            turned = force[out] * np.exp(-1j * np.angle(place[out]))
            where = np.degrees(np.angle(place[out]))
            fill = colour if line == "-" else "none"
            angle.plot(where, turned.real, "o", color=colour, markerfacecolor=fill, markersize=3, label=label)
            angle.plot(where, turned.imag, "x", color=colour, markersize=3.5)
        if strongest:
            _arrows(orbit, forces, end, 0.5 * gaps[end] * UM / strongest, float(f"{strongest / 2:.1g}"))
        title = clipped(name, TITLE_LETTERS)
        arrows = min(_ARROWS, sum(int(out.sum()) for out in beyond))
        orbit.set_title(
            f"{title}: up to {strongest:{'.0f' if strongest > 10 else '.2g'}} N, the {arrows} strongest"
            if strongest
            else f"{title}: no force outside its band"
        )
        angle.set_title(f"{title}: ● outwards   ✕ counter-clockwise")
        angle.axhline(0, color=GREY, linewidth=0.6)
        angle.set_xlim(-180, 180)
        angle.set_xticks(range(-180, 181, 60))
        angle.set_xlabel("angle of the shaft centre in the clearance [°]")
        angle.set_ylabel("missing force [N]")
    legend_below(figure, _COLUMNS)
    return figure


def _arrows(ax: Axes, forces: Sequence[ResidualForce], end: int, scale: float, key: float) -> None:
    """Draw the 40 greatest residual forces as arrows, `scale` um per newton, and a key of `key` newtons; more would clutter."""
    out = [_beyond_band(each, end) for each in forces]
    place = np.concatenate([each.place[end, o] for each, o in zip(forces, out, strict=True)]) * UM
    force = np.concatenate([each.force[end, o] for each, o in zip(forces, out, strict=True)]) * scale
    colour = np.repeat([drop_look(k)[0] for k in range(len(forces))], [o.sum() for o in out])
    last = np.argsort(-np.abs(force))[:_ARROWS]
    drawn = ax.quiver(
        place[last].real, place[last].imag, force[last].real, force[last].imag, color=colour[last], angles="xy",
        scale_units="xy", scale=1.0, width=0.005, zorder=3,
    )  # fmt: skip
    ax.quiverkey(drawn, 0.86, 0.93, key * scale, f"{key:g} N", labelpos="S", color=BLACK)


def _beyond_band(each: ResidualForce, end: int) -> np.ndarray:
    """Return a mask of the instants at which the residual force at an end exceeds its confidence band."""
    force, band = each.force[end], each.band[end]
    return np.asarray((np.abs(force.real) > band[0]) | (np.abs(force.imag) > band[1]))


def _clearance(ax: Axes, gap: float, furthest: float) -> None:
    turn = np.exp(1j * np.linspace(0, 2 * np.pi, 121)) * gap * UM
    ax.plot(turn.real, turn.imag, color=BLACK, linewidth=0.8, linestyle=(0, (4, 2)))
    show_about(ax, (0.0, 0.0), 1.1 * max(1.2 * gap, furthest) * UM)
    orbit_axes(ax)
