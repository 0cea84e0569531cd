"""Verification of an archive, files against checksums and catalogue against files, and rebuilding of the catalogue."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from math import isclose
from pathlib import Path
from typing import TYPE_CHECKING

from tdbsim.errors import InputError

from tdbmon.history import catalogue
from tdbmon.history.filing import ID_LENGTH, Filing, raw_place
from tdbmon.history.place import INCOMING, sweep, writable
from tdbmon.history.result_file import read_result
from tdbmon.progress import Progress, silent
from tdbmon.quantity import counted
from tdbmon.sha256 import sha256_of

if TYPE_CHECKING:
    from tdbmon.history.archive import Archive

_RESULTS = "results/*/*.nc"


@dataclass(frozen=True)
class Fault:
    """A deviation of the archive from its filed state.

    Attributes
    ----------
    file : str
        In the archive.
    what : str
        What is wrong, and the cure.
    harmless : bool
        Left by a killed writer; nothing that the catalogue names is affected.
    """

    file: str
    what: str
    harmless: bool = False


def verify(archive: Archive, progress: Progress = silent) -> list[Fault]:
    """Check every file of an archive against its SHA-256 and the catalogue against the result files."""
    folder = archive.folder
    faults = [Fault(file, "left over from an interrupted write", True) for _, file in _files(folder, f"{INCOMING}/*")]
    try:
        with catalogue.reading(archive.catalogue) as base:
            whole = base.execute("PRAGMA integrity_check").fetchone()[0]
            if whole != "ok":
                faults.append(Fault(catalogue.NAME, f"damaged ({whole}); rebuild it: tdbmon archive verify --rebuild"))
            entries = catalogue.entries(base)
            results = base.execute("SELECT file, file_sha256, machine_sha256, id FROM results").fetchall()
            known = {row[0]: row[1] for row in results}
            faults += _raw_faults(folder, entries, progress)
            for sha256 in sorted({row[2] for row in results}):
                faults += _checked(folder, f"machines/{sha256}.toml", sha256, "restore the machine file")
            for file, sha256, _, number in results:
                progress(file)
                found = _checked(folder, file, sha256, "add the drop again, with --again and the same machine file")
                faults += found or _disagreements(folder, file, catalogue.features(base, [number])[number])
            named = {entry.raw for entry in entries}
    except InputError as error:
        return [*faults, Fault(catalogue.NAME, str(error))]
    faults += [_left_out(path, file) for path, file in _files(folder, _RESULTS) if file not in known]
    stopped = "no result belongs to it: an add or a remove was interrupted; repeat it"
    faults += [Fault(file, stopped, True) for _, file in _files(folder, "raw/*/*") if file not in named]
    return faults


def rebuild(archive: Archive, progress: Progress = silent) -> list[Fault]:
    """Rebuild the catalogue from the result files; unreadable ones are left out and returned.

    The old catalogue is kept beside the new one if it is damaged or of an older version.
    """
    folder, place = archive.folder, archive.catalogue
    faults = []
    _set_aside(place)
    with catalogue.writing(place) as base:  # locked first, so that no drop is filed meanwhile and left out
        sweep(folder)
        catalogue.clear(base)
        for path, file in _files(folder, _RESULTS):
            progress(file)
            try:
                filing = read_result(path)
            except InputError as error:
                faults.append(Fault(file, str(error)))
                continue
            catalogue.insert(base, filing, raw_of(folder, filing), file, sha256_of(path))
    return faults


def bring_up_to_date(archive: Archive, create: bool) -> None:
    """Rebuild a catalogue of an older version from the result files, which are authoritative.

    Raises
    ------
    InputError
        If results could not be read: their drops are missing in comparisons from then on.
    """
    place = archive.catalogue
    version = catalogue.version_of(place)
    has_results = any(archive.folder.glob(_RESULTS))
    if version >= catalogue.SCHEMA:
        return
    if has_results:
        if lost := rebuild(archive):
            raise InputError(
                f"{archive.folder}: its catalogue was rebuilt from the results, without {counted(len(lost), 'file')} that"
                f" cannot be read ({lost[0].file}): run 'tdbmon archive verify' and add these drops again; other commands"
                " continue without them"
            )
    elif create or not place.exists():
        with catalogue.writing(place):
            pass


def raw_of(folder: Path, filing: Filing) -> str:
    """Return the path of a result's raw file, or its proper path if it is missing: the results are valid without it."""
    place = raw_place(filing.sha256, filing.raw_name)
    found = sorted((folder / place).parent.glob(f"{filing.sha256}*"))
    return str(found[0].relative_to(folder).as_posix()) if found else place


def _set_aside(place: Path) -> None:
    """Move a damaged or older catalogue aside."""
    try:
        if catalogue.version_of(place) in (0, catalogue.SCHEMA):
            with catalogue.reading(place) as base:
                if base.execute("PRAGMA integrity_check").fetchone()[0] == "ok":
                    return
    except InputError:
        pass
    if place.exists():
        number = 1
        while (aside := place.with_name(f"catalogue.old-{number}.sqlite")).exists():
            number += 1
        with writable(place.parent):
            os.replace(place, aside)


def _files(folder: Path, pattern: str) -> Iterator[tuple[Path, str]]:
    """Yield the files of an archive that match a pattern, in order, with their names in the catalogue."""
    for path in sorted(folder.glob(pattern)):
        yield path, str(path.relative_to(folder).as_posix())


def _raw_faults(folder: Path, entries: list[catalogue.Entry], progress: Progress) -> list[Fault]:
    faults = []
    for entry in entries:
        progress(entry.raw)
        faults += _checked(folder, entry.raw, entry.sha256, f"restore the record {entry.raw_name} by adding it again")
        if entry.id != entry.sha256[:ID_LENGTH]:
            faults.append(Fault(entry.raw, "the catalogue has a wrong identifier for it; rebuild the catalogue"))
    return faults


def _checked(folder: Path, file: str, sha256: str, cure: str) -> list[Fault]:
    try:
        if sha256_of(folder / file) == sha256:
            return []
    except FileNotFoundError:
        return [Fault(file, f"missing; {cure}")]
    except OSError as error:
        return [Fault(file, f"cannot be read ({error.strerror}); {cure}")]
    return [Fault(file, f"differs from the filed version (by its SHA-256); {cure}")]


def _left_out(path: Path, file: str) -> Fault:
    """Return the fault of a result missing in the catalogue: an add was stopped, or a rebuild could not read it."""
    try:
        read_result(path)
    except InputError as error:
        return Fault(file, str(error))
    return Fault(file, "not in the catalogue: an add was interrupted; repeat it, or rebuild", True)


def _disagreements(folder: Path, file: str, in_catalogue: tuple[catalogue.Feature, ...]) -> list[Fault]:
    """Return faults for the features of a result that differ between catalogue and file."""
    filed = {f.key: f.estimate.outside for f in read_result(folder / file).features}
    listed = {f.key: f.estimate.outside for f in in_catalogue}
    for key in sorted(filed.keys() | listed.keys()):
        if not _equal(filed.get(key), listed.get(key)):
            name = " ".join(key).strip()
            return [Fault(file, f"the catalogue differs in {name}; rebuild it: tdbmon archive verify --rebuild")]
    return []


def _equal(a: tuple[float | None, ...] | None, b: tuple[float | None, ...] | None) -> bool:
    if a is None or b is None:
        return False
    return all(x == y if x is None or y is None else isclose(x, y, rel_tol=1e-9) for x, y in zip(a, b, strict=True))
