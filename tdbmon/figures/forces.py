"""Normal force on each touchdown bearing against time, from the fitted model, with its 95 % band."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from tdbmon.figures.style import BLUE, GREY, SKY, Margins, legend_below, name_axis, new_figure, say, styled, subplots

if TYPE_CHECKING:
    from tdbmon.identify.forces import DropForces


@styled
def forces(drop: DropForces) -> Figure:
    """Draw the normal force at each end from the release until the members of the ensemble diverge."""
    note = f"Normal force of rotor on inner ring · fitted simulation, ensemble of {drop.members} · not measured"
    figure = new_figure(90, note)
    axes = subplots(figure, len(drop.ends), 1, Margins(17, 3, 11, 20, down=5), sharex=True)[:, 0]
    for ax, (name, end) in zip(axes, drop.ends.items(), strict=True):
        history = end.history
        name_axis(ax, "{} force [kN]", name)
        if not history.time.size:
            say(ax, "the simulations diverge from the release on")
            continue
        together = history.time <= history.parted
        time = history.time[together] * 1e3
        low, high = history.low[together] / 1e3, history.high[together] / 1e3
        ax.fill_between(
            time, low, high, color=SKY, alpha=0.6, linewidth=0, label="95 % of the ensemble", rasterized=True
        )
        ax.plot(time, history.force[together] / 1e3, color=BLUE, label="median", rasterized=True)
        if history.parted > history.time[-1]:
            ax.axvline(history.parted * 1e3, color=GREY, linestyle=":", label="members diverge")
        ax.set_ylim(bottom=0)
    axes[-1].set_xlabel("time from the release [ms]")
    # a little beyond the later divergence: nothing is drawn after it
    parted = max(end.history.parted for end in drop.ends.values())
    axes[-1].set_xlim(0, min(drop.seconds, 1.05 * parted) * 1e3)
    legend_below(figure)
    return figure
