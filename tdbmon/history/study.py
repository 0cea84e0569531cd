"""The study of one record for the archive: read, analyse, fit where asked, and gather; the task of every worker."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from tdbmon.history.filing import Filing, StressBox, sha256_of


@dataclass(frozen=True)
class Order:
    """What shall be done with a record.

    Attributes
    ----------
    machine, record : Path
    forces : bool
        Fit the simulation: forces and stresses.
    assembly : str
    dropped : str
        ISO 8601 time of the drop, where the record's own is missing or wrong.
    """

    machine: Path
    record: Path
    forces: bool = False
    assembly: str = ""
    dropped: str = ""


def _silent(_: str) -> None:
    return None


def study(order: Order, progress: Callable[[str], None] = _silent) -> Filing:
    """Analyse a record for the archive.

    Raises
    ------
    InputError
        If the machine or the record cannot be used, or the record names another machine.
    """
    from tdbsim.errors import InputError
    from tdbsim.machine import load_machine

    from tdbmon import __version__
    from tdbmon.analysis.analyse import analyse
    from tdbmon.analysis.contract import analysis_json
    from tdbmon.history.extract import features_of
    from tdbmon.record.read import read

    machine = load_machine(order.machine)
    raw = sha256_of(order.record)
    record = read(order.record)
    result = analyse(record, machine, progress)
    if result.planes is None:
        raise InputError(f"{order.record}: holds no orbit of machine '{machine.name}'; an archive files whole drops")
    fitted = None
    if order.forces:
        from tdbmon.identify.fitted import fit_drop

        fitted = fit_drop(machine, record, progress)
    content = analysis_json(result)
    boxes = []
    if fitted is not None:
        from tdbmon.identify.contract import calibration_json, end_json

        for end, found in fitted.forces.ends.items():
            content["ends"].setdefault(end, {}).update(end_json(fitted.calibration, found))
            s = found.stress
            if s.greatest.value is not None:
                boxes.append(StressBox(end, s.greatest.value, s.mean, s.median, s.q1, s.q3, s.outliers))
        content["calibration"] = calibration_json(fitted.calibration)
    if sha256_of(order.record) != raw:
        raise InputError(f"{order.record}: changed while it was read; file it once it is written whole")
    return Filing(
        sha256=raw,
        raw_name=order.record.name,
        machine=machine.name,
        machine_sha256=sha256_of(order.machine),
        dropped=order.dropped or str(record.attrs.get("drop_time") or ""),
        filed=datetime.now(UTC).isoformat(timespec="seconds"),
        assembly=order.assembly,
        synthetic=bool(record.attrs.get("synthetic")),
        version=__version__,
        forces=order.forces,
        features=features_of(result, fitted),
        stress=tuple(boxes),
        failed_checks=tuple(f"{c.check} {c.channel}".strip() for c in result.checks if not c.passed),
        analysis=content,
    )
