"""Run-down of the speed, the drag law chosen for it, and the residual of the law."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from tdbsim.errors import InputError

from tdbmon.analysis.coast_down_times import HALF, TENTH
from tdbmon.estimate import Z95
from tdbmon.figures.style import (
    BLACK,
    BLUE,
    GREY,
    LIGHT,
    PURPLE,
    SKY,
    VERMILION,
    Margins,
    legend_below,
    mark_phases,
    new_figure,
    styled,
    subplots,
)
from tdbmon.quantity import percent

if TYPE_CHECKING:
    from tdbmon.analysis.result import Analysis
    from tdbmon.analysis.rundown import RunDown

_BINS = 700
_IN_HZ = 0.3  # greatest residual in the fitted stretch, Hz, drawn in mHz


@styled
def speed_decay(analysis: Analysis) -> Figure:
    """Draw speed against time, with the chosen law and, below, the residual (measured minus law) if there is a law.

    Raises
    ------
    InputError
        If the record holds no speed.
    """
    rundown = analysis.rundown
    if rundown is None or not analysis.has_speed:
        raise InputError("the record holds no speed")
    time, speed = analysis.speed_time, analysis.speed_hz
    means, spreads, at = _binned(time, speed)
    each = len(time) / len(at)
    height, ratios = (72, [1.0]) if rundown.law is None else (105, [1.8, 1.0])
    figure = new_figure(
        height, f"Speed from the {rundown.source} · mean over {each:.0f} values · shaded: 95 % range of its samples"
    )
    margins = Margins(17, 3, 11, 20, down=5)  # left margin for the tick label −50000
    upper, *lower = subplots(figure, len(ratios), 1, margins, height_ratios=ratios, sharex=True)[:, 0]
    upper.set_xlim(float(time[0]), float(time[-1]))
    mark_phases(upper, analysis, names=True)
    upper.fill_between(at, *spreads, color=SKY, alpha=0.5, linewidth=0, rasterized=True)
    upper.plot(at, means, color=BLUE, label="speed as recorded")
    upper.set_ylabel("speed [Hz]")
    turns = bool((speed > 0).any())
    if not turns:
        upper.set_yticks([0])
    for ax in lower:
        _law(upper, ax, rundown, at, means)
    figure.axes[-1].set_xlabel("time from the record's first sample [s]")
    _coast_down(upper, rundown)
    _standstill(upper, rundown, turns)
    legend_below(figure)
    return figure


def _binned(time: np.ndarray, speed: np.ndarray) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray], np.ndarray]:
    """Return mean, 95 % range and centre time of nearly equal bins that cover all values."""
    edges = np.linspace(0, len(time), min(_BINS, len(time) // 4) + 1).astype(int)
    first, count = edges[:-1], np.diff(edges)
    mean = np.add.reduceat(speed, first) / count
    sigma = np.sqrt(np.add.reduceat((speed - np.repeat(mean, count)) ** 2, first) / count)
    return mean, (mean - Z95 * sigma, mean + Z95 * sigma), np.add.reduceat(time, first) / count


def _law(upper: Axes, lower: Axes, rundown: RunDown, at: np.ndarray, means: np.ndarray) -> None:
    """Draw the law in its fitted stretch and (thinner) beyond it, and its residual."""
    name = next((model.name for model in rundown.models if model.chosen), "law")
    law = rundown.speed_at(at)
    fitted = np.ones(len(at), bool)
    if rundown.fitted_from is not None and rundown.fitted_to is not None:
        fitted = (at >= rundown.fitted_from) & (at <= rundown.fitted_to)
        lower.axvspan(
            rundown.fitted_from, rundown.fitted_to, color=LIGHT, alpha=0.6, linewidth=0, label="fitted stretch"
        )
    upper.plot(at, np.where(fitted, law, np.nan), color=VERMILION, linestyle=(0, (5, 2)), label=f"law: {name}")
    beyond = np.where(~fitted, law, np.nan)
    upper.plot(
        at, beyond, color=VERMILION, linewidth=0.7, linestyle=(0, (1, 1.5)), label="law beyond the fitted stretch"
    )
    rest = means - law
    near = 3.0 * float(np.quantile(np.abs(rest[fitted]), 0.99)) + 1e-12 if fitted.any() else float(np.abs(rest).max())
    unit, factor = ("Hz", 1.0) if near > _IN_HZ else ("mHz", 1e3)
    lower.set_ylabel(f"residual [{unit}]")
    lower.axhline(0.0, color=BLACK, linewidth=0.7)
    lower.plot(at, rest * factor, color=BLUE, linewidth=0.7)
    if fitted.any():
        _reach(lower, near * factor, rest * factor, unit)


def _reach(ax: Axes, near: float, rest: np.ndarray, unit: str) -> None:
    """Scale the axis to the residual in the fitted stretch, logarithmic beyond, since elsewhere a law may be far off."""
    near = _round(near)
    least, most = float(np.nanmin(rest)), float(np.nanmax(rest))
    if max(-least, most) <= near:
        ax.set_ylim(-near, near)
        return
    ax.set_yscale("symlog", linthresh=near, linscale=1.0)
    ax.set_ylim(min(-near, 1.3 * least), max(near, 1.3 * most))
    powers = near * 10.0 ** np.arange(1, 9)
    ticks = np.concatenate((-powers[powers <= -least][::-1], [-near, 0.0, near], powers[powers <= most]))
    ax.set_yticks(ticks, [f"{tick:g}".replace("-", "−") for tick in ticks])
    ax.minorticks_off()
    for edge in (-near, near):
        ax.axhline(edge, color=GREY, linewidth=0.5, linestyle=":")
    ax.annotate(
        f"logarithmic beyond ±{near:g} {unit}", (0.99, 0.93), xycoords="axes fraction", ha="right", va="top", color=GREY
    )


def _round(size: float) -> float:
    """Return the nearest of 1, 2, 5, 10, ..."""
    power = 10.0 ** np.floor(np.log10(size))
    return float(min((power * first for first in (1, 2, 5, 10)), key=lambda each: abs(np.log(each / size))))


def _coast_down(ax: Axes, rundown: RunDown) -> None:
    """Mark the times at which half and a tenth of the speed at the release are left, within the record."""
    initial, (left, right) = rundown.initial.value, ax.get_xlim()
    reached = [(rundown.coast_down.half.value, HALF), (rundown.coast_down.tenth.value, TENTH)]
    shown = [(time, share) for time, share in reached if time is not None and left <= time <= right]
    if initial is None or not shown:
        return
    times, speeds = zip(*((time, share * initial) for time, share in shown), strict=True)
    shares = " and ".join(percent(share) for _, share in shown)
    ax.plot(times, speeds, "o", color=BLACK, fillstyle="none", label=f"{shares} of the speed at the release")


def _standstill(ax: Axes, rundown: RunDown, turns: bool) -> None:
    still = rundown.standstill_time
    left, right = ax.get_xlim()
    if not turns or still.value is None or not left <= still.value <= right:
        why = "throughout" if not turns else "beyond the record" if still.value is not None else "not estimated"
        ax.annotate(f"standstill: {why}", (0.99, 0.93), xycoords="axes fraction", ha="right", va="top", color=GREY)
        return
    ax.axvline(still.value, color=PURPLE, label="standstill, with its range")
    if still.low is not None and still.high is not None:
        ax.axvspan(max(still.low, left), min(still.high, right), color=PURPLE, alpha=0.2, linewidth=0)
