"""Placement of names in axes, so that they overlap no other name and as few lines as possible."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.transforms import Bbox

_NEIGHBOUR = 2.0  # pixels kept free about a name
# costs, in crossed lines, of covering another name or leaving the axes, and of each later candidate place
_COVERED, _NEXT = 1000.0, 0.12


@dataclass(frozen=True)
class Place:
    """Candidate place of a name: a data point, with the offset from it (points) and its side."""

    x: float
    y: float
    offset: tuple[float, float] = (2.0, 0.0)
    ha: str = "left"
    va: str = "center"


@dataclass
class Labels:
    """The names of one axes, whose limits must be set before the first is written.

    Attributes
    ----------
    ax : matplotlib.axes.Axes
    look : dict
        Of all names, e.g. colour and size.
    must : bool
        Whether a name without a free place is written nevertheless, where it overlaps least.
    """

    ax: Axes
    look: dict[str, Any]
    must: bool = True
    taken: list[Bbox] = field(default_factory=list)

    def write(self, words: str, places: Sequence[Place], rotation: float = 0.0) -> bool:
        """Write a name at the best of some places, the earlier the better; returns whether it was written."""
        if not places:
            return False
        text = self.ax.annotate(
            words, (0, 0), xytext=(0, 0), textcoords="offset points", rotation=rotation, **self.look
        )
        costs = []
        for rank, place in enumerate(places):
            self._move(text, place)
            costs.append(self._cost(text.get_window_extent()) + _NEXT * rank)
        best = min(range(len(places)), key=costs.__getitem__)
        if costs[best] >= _COVERED and not self.must:
            text.remove()
            return False
        self._move(text, places[best])
        self.taken.append(text.get_window_extent())
        return True

    @staticmethod
    def _move(text: Any, place: Place) -> None:
        text.xy = (place.x, place.y)
        text.xyann = place.offset
        text.set_horizontalalignment(place.ha)
        text.set_verticalalignment(place.va)

    def _cost(self, box: Bbox) -> float:
        """Return the number of lines that a name would cross, with a large penalty if it covers a name or leaves the axes."""
        wide = box.padded(_NEIGHBOUR)
        inside = self.ax.get_window_extent()
        leaves = box.x0 < inside.x0 or box.x1 > inside.x1 or box.y0 < inside.y0 or box.y1 > inside.y1
        covered = sum(wide.overlaps(other) for other in self.taken)
        crossed = 0
        for line in self.ax.lines:
            path = line.get_path().transformed(line.get_transform()).cleaned(remove_nans=True)
            crossed += bool(np.shape(path.vertices)[0] > 1 and path.intersects_bbox(wide, filled=False))
        return _COVERED * (covered + leaves) + crossed
