"""A drop to compare: what the archive, or the analysis of a record that is not filed, tells of it."""

from __future__ import annotations

from dataclasses import dataclass

from tdbmon.history.catalogue import Entry
from tdbmon.history.feature import Feature
from tdbmon.history.filing import StressBox


@dataclass(frozen=True)
class Drop:
    """A drop to compare: of the archive, or one that is not filed."""

    entry: Entry
    features: tuple[Feature, ...]
    stress: tuple[StressBox, ...]
    version: str
    machine_sha256: str
    ends: tuple[str, ...]  # as in its machine file
    foreign: str = ""  # what to tell where the record names another machine
    no_drop: str = ""  # and where the shaft does not fall in it
