"""Tick labels of drops along an axis: the names of their records, as used in the text of reports."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import takewhile
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

if TYPE_CHECKING:
    from tdbmon.history.catalogue import Entry

_LETTERS = 9  # longest label: a longer one, slanted, would overlap what lies below
_DIGITS = "0123456789"


def drop_names(ax: Axes, entries: Sequence[Entry], most: int, flat: int = 0) -> None:
    """Label the drops 1, 2, ... along x, at most `most` of them and always the last; slanted if more than `flat`."""
    every = math.ceil(len(entries) / most)
    places = range(len(entries), 0, -every)[::-1]
    names_along(ax, places, [entries[place - 1].raw_name for place in places], aslant=len(places) > flat)
    ax.set_xlim(0.4, len(entries) + 0.6)


def names_along(ax: Axes, places: Sequence[int], names: Sequence[str], *, aslant: bool) -> None:
    """Label places along x with shortened file names."""
    ax.set_xticks(
        list(places),
        short_names(names),
        rotation=40 if aslant else 0,
        ha="right" if aslant else "center",
        rotation_mode="anchor" if aslant else "default",
        fontsize=6,
    )


def end_columns(axes: NDArray[np.object_], shown: int, label: str) -> None:
    """Label the lowest shown panel of each column, and hide the unused panels."""
    for ax in axes.flat[shown:]:
        ax.set_visible(False)
    for ax in axes.flat[max(0, shown - axes.shape[1]) : shown]:
        ax.set_xlabel(label)


def drops_label(entries: Sequence[Entry]) -> str:
    """Return the label of an axis of drops, with the dates of the first and the last drop if both are known."""
    first, last = entries[0].dropped[:10], entries[-1].dropped[:10]
    return f"drop ({first} to {last})" if first and last and first != last else "drop"


def short_names(names: Sequence[str]) -> list[str]:
    """Return file names without their suffix; long ones are shortened to the part that differs, as far as it fits."""
    stems = [name.rsplit(".", 1)[0] for name in names]
    if max(map(len, stems), default=0) <= _LETTERS:
        return stems
    head, tail = 0, 0
    if len(set(stems)) > 1:
        head = _shared(stems)
        tail = _shared([stem[:head:-1] for stem in stems])
    return [_cut(stem, head, len(stem) - tail) for stem in stems]


def _shared(stems: Sequence[str]) -> int:
    """Return the length of the common prefix of all names, without splitting a number."""
    alike = takewhile(lambda letters: len(set(letters)) == 1, zip(*stems, strict=False))
    return len("".join(letters[0] for letters in alike).rstrip(_DIGITS))


def _cut(stem: str, begin: int, end: int) -> str:
    """Return a name from `begin` to `end` with ellipses for omitted parts; if still too long, its last letters."""
    before, after = "…" * (begin > 1), "…" * (end < len(stem) - 1)
    own = stem[begin if before else 0 : end if after else None]
    if not own:  # the whole name is common: another name continues it
        before, own, after = "", stem, ""
    room = _LETTERS - len(before) - len(after)
    return before + own + after if len(own) <= room else f"…{own[-room:]}{after}"
