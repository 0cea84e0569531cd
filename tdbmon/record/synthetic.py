"""Identification of synthetic records, which are labelled as computed, not measured, wherever they are shown."""

from __future__ import annotations

import json
from collections.abc import Hashable, Mapping
from functools import lru_cache
from typing import Any

from tdbmon.shipped import shipped

_NO = ("", "0", "false", "no")
_TITLES = ("simulated", "synthetic")


def is_synthetic(attributes: Mapping[Hashable, Any]) -> bool:
    """Return whether a record is known to be computed: it declares so itself, or is a synthetic record shipped with tdbmon.

    It declares so by the attribute ``synthetic`` or the beginning of its title; a shipped file is identified by its SHA-256.

    Parameters
    ----------
    attributes : mapping
        Attributes of the record.  Text formats store numbers and booleans as text, so "0", "false" and "no" mean no.
    """
    stated = str(attributes.get("synthetic", "")).strip().lower()
    titled = str(attributes.get("title", "")).strip().lower().startswith(_TITLES)
    return stated not in _NO or titled or attributes.get("sha256") in _shipped_synthetic()


@lru_cache(maxsize=1)
def _shipped_synthetic() -> frozenset[str]:
    """Return the SHA-256 of the synthetic files shipped with tdbmon."""
    try:
        files = json.loads(shipped("manifest.json").read_text(encoding="utf-8"))["files"]
    except FileNotFoundError:
        return frozenset()
    return frozenset(entry["sha256"] for entry in files.values() if entry["kind"] == "synthetic")


def synthetic_note(synthetic: int, among: int | None = None) -> str:
    """Return the sentence for a report on the number of synthetic records, out of `among` in total; "" if there are none."""
    if not synthetic:
        return ""
    if among is not None and synthetic < among:
        are, computed = ("is", "it was") if synthetic == 1 else ("are", "they were")
        return f"{synthetic} of the {among} records {are} synthetic: {computed} computed, not measured."
    if synthetic == 1:
        return "The record is synthetic: it was computed, not measured."
    return "The records are synthetic: they were computed, not measured."
