"""Drops along an axis by the names of their records, as the words of a report name them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from matplotlib.axes import Axes

if TYPE_CHECKING:
    from tdbmon.history.catalogue import Entry


def drop_names(ax: Axes, entries: Sequence[Entry], most: int, flat: int = 0) -> None:
    """Name the drops 1, 2, ... along x, at most so many of them and the last one surely; aslant where more than `flat`."""
    every = math.ceil(len(entries) / most)
    places = range(len(entries), 0, -every)[::-1]
    aslant = len(places) > flat
    ax.set_xticks(
        list(places),
        [short_name(entries[place - 1].raw_name) for place in places],
        rotation=40 if aslant else 0,
        ha="right" if aslant else "center",
        rotation_mode="anchor" if aslant else "default",
        fontsize=6,
    )
    ax.set_xlim(0.4, len(entries) + 0.6)


def drops_label(entries: Sequence[Entry]) -> str:
    """Return the words under such an axis: with the days of the first and the last drop, where both state one."""
    first, last = entries[0].dropped[:10], entries[-1].dropped[:10]
    return f"drop ({first} to {last})" if first and last and first != last else "drop"


def short_name(name: str) -> str:
    """Return a file's name without its ending, its middle cut out where it is long: drops differ in how names end."""
    stem = name.rsplit(".", 1)[0]
    return stem if len(stem) <= 14 else f"{stem[:4]}…{stem[-9:]}"
