"""The drop for `tdbmon compare`: one of the archive, or a record that is analysed without being filed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tdbsim.errors import InputError, did_you_mean
from tdbsim.machine import load_machine

from tdbmon.history import catalogue
from tdbmon.history.archive import Archive
from tdbmon.history.catalogue import Entry
from tdbmon.history.compare import filed_drop
from tdbmon.history.drop import Drop
from tdbmon.history.filing import Filing
from tdbmon.history.study import study_record
from tdbmon.history.twin import at_same_instant, laid, twin_of
from tdbmon.progress import Progress
from tdbmon.quantity import moment
from tdbmon.sha256 import sha256_of

if TYPE_CHECKING:
    import xarray as xr


def drop_to_compare(archive: Archive, drop: str, machine: Path | None, forces: bool, progress: Progress) -> Drop:
    """Return the drop with an identifier, of a record file or of a filed record with that name; by default the latest one.

    Parameters
    ----------
    archive : Archive
    drop : str
        Identifier, file or name of a filed record; empty for the last drop.
    machine : Path or None
        Machine file for a record; by default that of the archive's last drop, if the archive has only one machine.  A record
        is assigned to the assembly of the machine's last drop.
    forces : bool
        Also fit the simulation to a record.

    Raises
    ------
    InputError
        If the archive is empty, there is no such drop or file, the machine is ambiguous, a filed drop lacks the requested
        forces or belongs to another machine than requested, or an unfiled record states the same time as a filed drop.
    """
    if not drop:
        entries = archive.entries()
        if not entries:
            raise InputError(f"{archive.folder}: contains no drops yet; file some with 'tdbmon archive add'")
        return _filed(archive, entries[-1].id, machine, forces)
    path = Path(drop)
    if not path.exists():
        names = {entry.raw_name for entry in archive.entries()}
        if len(path.parts) > 1 or (path.suffix and drop not in names):
            raise InputError(
                f"{drop}: no such file, and no filed drop has this record; give a record, or a drop's identifier"
            )
        return _filed(archive, archive.entry(drop).id, machine, forces)
    from tdbmon.record.read import read

    return record_to_compare(archive, read(path), machine, forces, progress)


def record_to_compare(
    archive: Archive, record: xr.Dataset, machine: Path | None, forces: bool, progress: Progress
) -> Drop:
    """Return a record as a drop to compare; if it is filed, also from another file of the same drop, the filed results.

    Raises as `drop_to_compare`.
    """
    entries = archive.entries()
    same = [entry for entry in entries if entry.sha256 == record.attrs.get("sha256")]
    if same:
        return _filed(archive, same[0].id, machine, forces)
    if machine is None:
        names = archive.machines()
        if len(names) != 1:
            raise InputError(
                f"{record.attrs.get('source_file', 'record')}: the archive contains {len(names)} machines;"
                " state the machine of this drop with --machine machine.toml"
            )
        machine = archive.machine_file(entries[-1].id)
    plan = load_machine(machine)
    of_machine = [entry for entry in entries if entry.machine == plan.name]
    if not of_machine:
        known = archive.machines()
        raise InputError(
            f"{machine}: the archive contains no drops of machine '{plan.name}'{did_you_mean(plan.name, known)}"
        )
    assembly = of_machine[-1].assembly
    found = study_record(record, plan, sha256_of(machine), forces, assembly, progress=progress)
    with catalogue.reading(archive.catalogue) as base:
        twin = twin_of(archive, base, found, lambda: laid(record, plan))
        dated = at_same_instant(base, found) if twin is None else None
    if dated is not None:
        raise InputError(
            f"{found.raw_name}: states the same time ({moment(found.dropped)}), machine and speed as drop {dated.id}"
            f" ({dated.raw_name}), which is filed: it would be compared with itself; compare {dated.id}, or, if this is another"
            " drop, file it with tdbmon archive add --dropped TIME and compare it then"
        )
    return as_drop(found) if twin is None else _filed(archive, twin.id, machine, forces)


def _filed(archive: Archive, drop: str, machine: Path | None, forces: bool) -> Drop:
    """Return a filed drop; raise InputError if the requested machine or forces differ from the filed ones."""
    found = filed_drop(archive, drop)
    name = found.entry.machine if machine is None else load_machine(machine).name
    if name != found.entry.machine:
        raise InputError(
            f"{machine}: is the file of machine '{name}', but drop {drop} ({found.entry.raw_name}) is filed under machine"
            f" '{found.entry.machine}'; leave --machine out"
        )
    if forces and not archive.result(found.entry.id).forces:
        raise InputError(
            f"drop {drop} ({found.entry.raw_name}) is filed without forces; add its record again with"
            f" tdbmon archive add --archive {archive.folder} --forces, then compare it"
        )
    return found


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
        # a drop without a time counts as the latest, so that it is compared with all filed ones
        moment=catalogue.moment_of(filing.dropped or filing.filed),
        filed=filing.filed,
        speed=catalogue.speed_of(filing.features),
        synthetic=filing.synthetic,
        failed_checks=filing.failed_checks,
        result=0,
    )
    return Drop(
        entry=entry,
        features=filing.features,
        stress=filing.stress,
        version=filing.version,
        machine_sha256=filing.machine_sha256,
        ends=tuple(dict.fromkeys(f.end for f in filing.features if f.end)),
        foreign=filing.foreign,
        no_drop=filing.no_drop,
    )
