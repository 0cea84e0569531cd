"""Distance between simulated and measured orbits as the friction is varied, with the least-squares value."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from tdbmon.figures.style import BLACK, BLUE, GREY, SKY, UM, Margins, legend_below, new_figure, styled, subplots

if TYPE_CHECKING:
    from tdbmon.identify.friction_choice import FrictionChoice

_LEAST = 0.05  # of the measured excursion: least range shown to either side


@styled
def friction_choice(found: FrictionChoice) -> Figure:
    """Draw distance of the orbits (above) and deepest excursion (below) against the friction coefficient, one column per end."""
    note = f"One coefficient for both ends, all other values as fitted · the first {found.seconds * 1e3:.0f} ms"
    figure = new_figure(112, note)
    ends = list(found.distance)
    axes = subplots(figure, 2, len(ends), Margins(17, 3, 14, 19, across=15, down=4), sharex=True)
    for column, end in enumerate(ends):
        above, below = axes[:, column]
        above.set_title(end)
        above.plot(found.tried, found.distance[end] * UM, ".-", color=BLUE, markersize=3, label="tried")
        below.plot(found.tried, found.deepest[end] * UM, ".-", color=BLUE, markersize=3, label="tried")
        below.axhline(found.measured_deepest[end] * UM, color=BLACK, linestyle="--", label="measured excursion")
        shown = found.measured_deepest[end] * UM
        low, high = (float(pick(found.deepest[end])) * UM for pick in (np.min, np.max))
        below.set_ylim(min(low, (1 - _LEAST) * shown), max(high, (1 + _LEAST) * shown))
        fitted = found.fitted[end]
        for ax in (above, below):
            ax.axvline(found.chosen, color=GREY, linestyle=":", linewidth=1.3, label="chosen by sensitivity")
            if fitted.low is not None and fitted.high is not None:
                ax.axvspan(fitted.low, fitted.high, color=SKY, alpha=0.6, linewidth=0, label="least squares (95 %)")
        above.set_ylim(bottom=0)
        below.set_xlabel("coefficient of friction [1]")
    axes[0, 0].set_ylabel("orbit error [µm rms]")
    axes[1, 0].set_ylabel("max. excursion [µm 0-pk]")
    legend_below(figure, 4)
    return figure
