"""Synthetic records: computed, not measured, and called so wherever they are shown."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from typing import Any

_NO = ("", "0", "false", "no")
_TITLES = ("simulated", "synthetic")


def is_synthetic(attributes: Mapping[Hashable, Any]) -> bool:
    """Whether a record says of itself that it was computed: by its attribute ``synthetic``, or by how its title begins.

    Parameters
    ----------
    attributes : mapping
        Of the record.  Text formats hand numbers and truth values over as words, so "0", "false" and "no" mean no.
    """
    stated = str(attributes.get("synthetic", "")).strip().lower()
    return stated not in _NO or str(attributes.get("title", "")).strip().lower().startswith(_TITLES)


def synthetic_note(records: int) -> str:
    """Return the sentence that a report says of one or of several synthetic records."""
    if records == 1:
        return "The record is synthetic: it was computed, not measured."
    return "The records are synthetic: they were computed, not measured."
