"""A drop as filed in the archive: machine, time, results and their provenance."""

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
        Its name at the first filing.
    machine : str
        The machine's name.
    machine_sha256 : str
        Of the machine file used in the analysis.
    dropped : str
        ISO 8601 time of the drop; empty if neither the record nor its owner states one.
    filed : str
        ISO 8601 time of the filing.
    assembly : str
        Name of the machine's assembly (new after an overhaul, say), chosen by the owner; empty by default.
    synthetic : bool
        The record states that it was simulated.
    version : str
        Of the program.
    forces : bool
        Whether the simulation was fitted too.
    features : tuple of Feature
    stress : tuple of StressBox
        Empty without forces.
    failed_checks : tuple of str
        Quality checks that the record did not pass.
    analysis : dict
        The JSON of `tdbmon analyse`.
    first : str
        Time of the drop's first filing, by an earlier result; "" if this is the first one.
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
        """Remark if the record names another machine; else ""."""
        return self._failed("machine")

    @property
    def no_drop(self) -> str:
        """Remark if the shaft does not fall in the record; else ""."""
        return self._failed("drop")

    @property
    def unread_date(self) -> str:
        """Remark if the record states a date that cannot be parsed; else ""."""
        return self._failed("date")

    def _failed(self, check: str) -> str:
        checks = self.analysis.get("quality", ())
        return next((str(c["detail"]) for c in checks if c["check"] == check and not c["passed"]), "")

    @property
    def name(self) -> str:
        """Name of the result file, unique for program version, machine file, and with or without forces."""
        return result_name(self.version, self.machine_sha256, self.forces)


def raw_place(sha256: str, name: str) -> str:
    """Return the path in an archive of a raw file with this SHA-256 and name."""
    return f"raw/{sha256[:2]}/{sha256}{PurePath(name).suffix.lower()}"


def result_name(version: str, machine_sha256: str, forces: bool) -> str:
    """Return the name of the result file of a program version with a machine file.

    "forces2" includes the fatigue of the drop; older results named "forces" do not.  They are kept, and made anew when their
    drop is analysed again.
    """
    return f"{version}-{machine_sha256[:8]}{'-forces2' if forces else ''}.nc"


def satisfying_names(version: str, machine_sha256: str, forces: bool) -> tuple[str, ...]:
    """Return the names of the result files that satisfy a request: those with forces if requested, else any."""
    own = result_name(version, machine_sha256, True)
    if forces:
        return (own,)
    return (own, f"{version}-{machine_sha256[:8]}-forces.nc", result_name(version, machine_sha256, False))
