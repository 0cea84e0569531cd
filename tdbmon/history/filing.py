"""A drop as the archive files it: whose it is, when it was, what was found, and by what."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

from tdbmon.history.feature import Feature

ID_LENGTH = 12  # hexadecimal digits of the raw file's SHA-256


@dataclass(frozen=True)
class StressBox:
    """Box statistics of the greatest ball stress at one end in one drop, Pa."""

    end: str
    greatest: float
    mean: float
    median: float
    q1: float
    q3: float
    outliers: tuple[float, ...]


@dataclass(frozen=True)
class Filing:
    """The results of one drop by one version of the program.

    Attributes
    ----------
    sha256 : str
        Of the raw file.
    raw_name : str
        Its name when it was filed first.
    machine : str
        The machine's name.
    machine_sha256 : str
        Of the machine file that it was analysed with.
    dropped : str
        ISO 8601 time of the drop; empty where neither the record nor its owner tells.
    filed : str
        ISO 8601 time of the filing.
    assembly : str
        Which assembly of the machine (after an overhaul, say); the owner's own word, empty by default.
    synthetic : bool
        The record says of itself that it was computed.
    version : str
        Of the program.
    forces : bool
        The simulation was fitted too.
    features : tuple of Feature
    stress : tuple of StressBox
        Empty without forces.
    failed_checks : tuple of str
        Quality checks that the record did not pass.
    analysis : dict
        The JSON of `tdbmon analyse`.
    first : str
        When the drop was filed first, by an earlier result; "" where this is the first one.
    """

    sha256: str
    raw_name: str
    machine: str
    machine_sha256: str
    dropped: str
    filed: str
    assembly: str
    synthetic: bool
    version: str
    forces: bool
    features: tuple[Feature, ...]
    stress: tuple[StressBox, ...]
    failed_checks: tuple[str, ...]
    analysis: dict[str, Any]
    first: str = ""

    @property
    def drop(self) -> str:
        """The drop's identifier."""
        return self.sha256[:ID_LENGTH]

    @property
    def foreign(self) -> str:
        """What to tell where the record names another machine; "" where it does not."""
        return self._failed("machine")

    @property
    def no_drop(self) -> str:
        """What to tell where the shaft does not fall in the record; "" where it does."""
        return self._failed("drop")

    @property
    def unread_date(self) -> str:
        """What to tell where the record states a date that is not understood; "" where it does not."""
        return self._failed("date")

    def _failed(self, check: str) -> str:
        checks = self.analysis.get("quality", ())
        return next((str(c["detail"]) for c in checks if c["check"] == check and not c["passed"]), "")

    @property
    def name(self) -> str:
        """Name of the result file: one for each drop, version, machine file, and with or without forces."""
        return result_name(self.version, self.machine_sha256, self.forces)


def raw_place(sha256: str, name: str) -> str:
    """Return where in an archive the raw file of a record with this name belongs."""
    return f"raw/{sha256[:2]}/{sha256}{PurePath(name).suffix.lower()}"


def result_name(version: str, machine_sha256: str, forces: bool) -> str:
    """Return the name of the result file that a program version makes of a drop with a machine file.

    "forces2" holds the fatigue of the drop; what was filed as "forces" before that was counted stays, and is made again
    where its drop is analysed again.
    """
    return f"{version}-{machine_sha256[:8]}{'-forces2' if forces else ''}.nc"


def satisfying_names(version: str, machine_sha256: str, forces: bool) -> tuple[str, ...]:
    """Return the names of the results that hold what is wanted of a drop: with forces where they are wanted, else any."""
    own = result_name(version, machine_sha256, True)
    if forces:
        return (own,)
    return (own, f"{version}-{machine_sha256[:8]}-forces.nc", result_name(version, machine_sha256, False))
