"""Remark in a caption on the ends that a figure leaves out."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tdbmon.analysis.result import Analysis


def left_out(analysis: Analysis, drawn: Iterable[str], lacking: str) -> str:
    """Return a sentence for each end that has an orbit but is not drawn, stating what it lacks."""
    shown = set(drawn)
    return "".join(f" {name} has {lacking} and is left out." for name in analysis.seen_ends if name not in shown)
