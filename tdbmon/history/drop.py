"""A drop to compare, from the archive or from the analysis of a record that is not filed."""

from __future__ import annotations

from dataclasses import dataclass

from tdbmon.history.catalogue import Entry
from tdbmon.history.feature import Feature
from tdbmon.history.filing import StressBox


@dataclass(frozen=True)
class Drop:
    """A drop to compare, filed or not."""

    entry: Entry
    features: tuple[Feature, ...]
    stress: tuple[StressBox, ...]
    version: str
    machine_sha256: str
    ends: tuple[str, ...]  # as in its machine file
    foreign: str = ""  # remark if the record names another machine
    no_drop: str = ""  # remark if the shaft does not fall in the record
