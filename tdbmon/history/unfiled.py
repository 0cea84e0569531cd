"""The drop that `tdbmon compare` looks at: one of the archive, or a record that is not filed (and is not by this)."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

from tdbsim.errors import InputError

from tdbmon.history import catalogue
from tdbmon.history.archive import Archive
from tdbmon.history.catalogue import Entry
from tdbmon.history.compare import Drop, filed_drop
from tdbmon.history.filing import Filing, sha256_of
from tdbmon.history.study import Order, study


def drop_to_compare(
    archive: Archive, drop: str, machine: Path | None, forces: bool, progress: Callable[[str], None]
) -> Drop:
    """Return the drop of an identifier, of a record's file, or the last one filed.

    Parameters
    ----------
    archive : Archive
    drop : str
        Identifier or file; empty for the last drop.
    machine : Path or None
        Machine file for a record; by default the one of the archive's last drop, where it has but one machine.
    forces : bool
        Fit the simulation to a record.

    Raises
    ------
    InputError
        If the archive is empty, there is no such drop or file, or it is not clear of which machine.
    """
    if not drop:
        entries = archive.entries()
        if not entries:
            raise InputError(f"{archive.folder}: holds no drops yet; file some with 'tdbmon archive add'")
        return filed_drop(archive, entries[-1].id)
    path = Path(drop)
    if not path.exists():
        if path.suffix or len(path.parts) > 1:
            raise InputError(f"{drop}: no such file; give a record, or the identifier of a filed drop")
        return filed_drop(archive, drop)
    sha256 = sha256_of(path)
    if any(entry.sha256 == sha256 for entry in archive.entries()):
        return filed_drop(archive, sha256[:12])
    if machine is not None:
        return as_drop(study(Order(machine, path, forces), progress))
    names = archive.machines()
    if len(names) != 1:
        raise InputError(
            f"{drop}: the archive holds {len(names)} machines; say whose drop it is with --machine machine.toml"
        )
    last = archive.entries()[-1]
    with tempfile.TemporaryDirectory() as folder:
        # the owner's edits of a machine file go through here too: the archive's copy is never touched
        copy = Path(folder) / "machine.toml"
        copy.write_bytes(archive.machine_file(last.id).read_bytes())
        return as_drop(study(Order(copy, path, forces, last.assembly), progress))


def as_drop(filing: Filing) -> Drop:
    """Return a drop to compare from results that are not filed."""
    entry = Entry(
        id=filing.drop,
        sha256=filing.sha256,
        raw="",
        raw_name=filing.raw_name,
        machine=filing.machine,
        assembly=filing.assembly,
        dropped=filing.dropped,
        moment=catalogue.moment_of(filing),
        filed=filing.filed,
        speed=next((f.estimate.value for f in filing.features if f.name == "initial_hz"), None),
        synthetic=filing.synthetic,
        failed_checks=filing.failed_checks,
        result=0,
    )
    return Drop(entry, filing.features, filing.stress)
