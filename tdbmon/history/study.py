"""The study of one record for the archive, the task of a worker: read, analyse, fit on request, and collect the results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tdbsim.errors import InputError

from tdbmon.history.filing import Filing, StressBox
from tdbmon.progress import Progress, silent
from tdbmon.record.synthetic import is_synthetic
from tdbmon.sha256 import sha256_of

if TYPE_CHECKING:
    import xarray as xr
    from tdbsim.machine import Machine

    from tdbmon.identify.fitted import FittedDrop
    from tdbmon.record.finding import Check


@dataclass(frozen=True)
class Order:
    """Order to study a record.

    Attributes
    ----------
    machine, record : Path
    forces : bool, optional
        Fit the simulation for forces and stresses; by default if the drop is filed with them.
    assembly : str
    dropped : str
        ISO 8601 time of the drop, if the record's own is missing or wrong.
    filed : str
        ISO 8601 time of the filing; the present by default.
    """

    machine: Path
    record: Path
    forces: bool | None = None
    assembly: str = ""
    dropped: str = ""
    filed: str = ""


def study(order: Order, progress: Progress = silent) -> Filing:
    """Read and analyse a record for the archive.

    Raises
    ------
    InputError
        If the machine or the record cannot be used, or the record changes while it is read.
    """
    from tdbsim.machine import load_machine

    from tdbmon.record.read import read

    machine = load_machine(order.machine)
    record = read(order.record)
    if sha256_of(order.record) != record.attrs["sha256"]:
        raise InputError(f"{order.record}: changed while it was read; file it once it is complete")
    found = study_record(
        record, machine, sha256_of(order.machine), bool(order.forces), order.assembly, order.dropped, progress
    )
    return replace(found, filed=order.filed) if order.filed else found


def study_record(
    record: xr.Dataset,
    machine: Machine,
    machine_sha256: str,
    forces: bool = False,
    assembly: str = "",
    dropped: str = "",
    progress: Progress = silent,
) -> Filing:
    """Analyse a record that was read from a file (raises `InputError` if it has no orbit of the machine)."""
    from tdbmon import __version__
    from tdbmon.analysis.analyse import analyse
    from tdbmon.analysis.contract import analysis_json
    from tdbmon.history.extract import features_of

    name = str(record.attrs.get("source_file", "record"))
    result = analyse(record, machine, progress)
    if result.planes is None:
        raise InputError(
            f"{name}: contains no orbit of machine '{machine.name}', and only whole drops are filed{_why(result.checks)}"
        )
    fitted = None
    if forces:
        from tdbmon.identify.fitted import fit_drop

        fitted = fit_drop(machine, record, progress).beside(result)
    content = analysis_json(result)
    if fitted is not None:
        _add_forces(content, fitted)
    return Filing(
        sha256=str(record.attrs["sha256"]),
        raw_name=name,
        machine=machine.name,
        machine_sha256=machine_sha256,
        dropped=dropped or str(record.attrs.get("drop_time") or ""),
        filed=datetime.now(UTC).isoformat(timespec="seconds"),
        assembly=assembly,
        synthetic=is_synthetic(record.attrs),
        version=__version__,
        forces=forces,
        features=features_of(result, fitted),
        stress=() if fitted is None else _boxes(fitted),
        failed_checks=tuple(
            f"{c.check} {c.channel}".strip()
            for c in result.checks
            if not c.passed and not (c.check == "date" and dropped)  # the owner's date replaces the record's
        ),
        analysis=content,
    )


def _add_forces(content: dict[str, Any], fitted: FittedDrop) -> None:
    """Add the forces and the calibration to the JSON of an analysis.

    Not all of `with_fitted`: agreement, friction and natural frequencies would need simulations for every drop filed, and
    nothing in an archive uses them.
    """
    from tdbmon.identify.contract import calibration_json, end_json

    calibration = fitted.calibration
    for end, found in fitted.forces.ends.items():
        content["ends"].setdefault(end, {}).update(end_json(calibration, found, calibration.drops[0].release.value))
    content["calibration"] = calibration_json(calibration)


def _boxes(fitted: FittedDrop) -> tuple[StressBox, ...]:
    """Return the stresses of the ends that have any."""
    return tuple(
        StressBox(end, s.greatest.value, s.mean, s.median, s.q1, s.q3, s.outliers)
        for end, s in ((end, found.stress) for end, found in fitted.forces.ends.items())
        if s.greatest.value is not None
    )


def _why(checks: Sequence[Check]) -> str:
    """Return the failed checks of a record without an orbit, with one finding per kind of check."""
    channels: dict[str, list[str]] = {}
    details: dict[str, str] = {}
    for check in checks:
        if not check.passed:
            channels.setdefault(check.check, []).append(check.channel)
            details.setdefault(check.check, check.detail)
    told = [f"{check} {', '.join(filter(None, of))}".strip() + f": {details[check]}" for check, of in channels.items()]
    return f"; checks failed: {'; '.join(told)}" if told else ""
