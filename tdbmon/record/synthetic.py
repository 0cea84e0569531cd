"""Synthetic records: computed, not measured, and called so wherever they are shown."""

from __future__ import annotations

import json
from collections.abc import Hashable, Mapping
from functools import lru_cache
from typing import Any

from tdbmon.shipped import shipped

_NO = ("", "0", "false", "no")
_TITLES = ("simulated", "synthetic")


def is_synthetic(attributes: Mapping[Hashable, Any]) -> bool:
    """Whether a record is known to be computed: it says so of itself, or it ships with tdbmon.

    It says so by its attribute ``synthetic``, or by how its title begins; a shipped file is known by its SHA-256.

    Parameters
    ----------
    attributes : mapping
        Of the record.  Text formats hand numbers and truth values over as words, so "0", "false" and "no" mean no.
    """
    stated = str(attributes.get("synthetic", "")).strip().lower()
    titled = str(attributes.get("title", "")).strip().lower().startswith(_TITLES)
    return stated not in _NO or titled or attributes.get("sha256") in _shipped_synthetic()


@lru_cache(maxsize=1)
def _shipped_synthetic() -> frozenset[str]:
    """Return the SHA-256 of the shipped files that were computed."""
    try:
        files = json.loads(shipped("manifest.json").read_text(encoding="utf-8"))["files"]
    except FileNotFoundError:
        return frozenset()
    return frozenset(entry["sha256"] for entry in files.values() if entry["kind"] == "synthetic")


def synthetic_note(synthetic: int, among: int | None = None) -> str:
    """Return the sentence that a report says of so many synthetic records, `among` so many in all; "" for none."""
    if not synthetic:
        return ""
    if among is not None and synthetic < among:
        are, computed = ("is", "it was") if synthetic == 1 else ("are", "they were")
        return f"{synthetic} of the {among} records {are} synthetic: {computed} computed, not measured."
    if synthetic == 1:
        return "The record is synthetic: it was computed, not measured."
    return "The records are synthetic: they were computed, not measured."
