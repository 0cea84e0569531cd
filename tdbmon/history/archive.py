"""The archive of a machine's or a fleet's drops: a folder.

    archive.toml             the owner's settings (see `settings`)
    raw/ab/<SHA-256>.<ext>   records, byte for byte as received
    machines/<SHA-256>.toml  machine files used in the analyses, likewise
    results/<drop>/<...>.nc  one file per drop, program version and machine file; older ones are kept
    catalogue.sqlite         index of all results in long form, made from the result files
    incoming/                files being written

A drop is filed by one writer at a time (SQLite's lock): raw file, machine file and result are renamed into place, the
catalogue is updated last.  If a writer is killed at any moment, the catalogue names only complete files, and the add can be
repeated.
"""

from __future__ import annotations

import shutil
import sqlite3
import tomllib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from tdbsim.errors import InputError, did_you_mean

from tdbmon.history import catalogue
from tdbmon.history.catalogue import Entry, Result
from tdbmon.history.filing import Filing, raw_place
from tdbmon.history.place import put, sweep, writable
from tdbmon.history.result_file import read_result, result_bytes
from tdbmon.history.settings import SETTINGS, Settings, first_settings, load_settings, machines_stated
from tdbmon.history.twin import at_same_instant, read_and_laid, twin_of
from tdbmon.quantity import first_few, moment
from tdbmon.sha256 import sha256_of

_FEW = 5  # drops with the same record name listed in a message
Filed = Literal["filed", "analysed again", "already filed"]


@dataclass(frozen=True)
class Archive:
    """An archive; `open_archive` gives one."""

    folder: Path

    @property
    def catalogue(self) -> Path:
        """Its catalogue."""
        return self.folder / catalogue.NAME

    def settings(self, machine: str = "") -> Settings:
        """Return the owner's settings, including those that `archive.toml` has for the machine, if given."""
        return load_settings(self.folder / SETTINGS, machine)

    def settings_of_nobody(self) -> tuple[str, ...]:
        """Return the machines with settings in `archive.toml` but without drops in the archive."""
        stated = machines_stated(self.folder / SETTINGS)
        known = self.machines() if stated else []
        return tuple(name for name in stated if name not in known)

    def entries(self, machine: str = "") -> list[Entry]:
        """Return the drops of one machine or of all, in chronological order."""
        with catalogue.reading(self.catalogue) as base:
            if not machine:
                return catalogue.entries(base)
            found = catalogue.entries(base, "machine = ?", (machine,))
            if not found:
                known = [row[0] for row in base.execute("SELECT DISTINCT machine FROM drops")]
                raise InputError(f"{self.folder}: no drops of machine '{machine}'{did_you_mean(machine, known)}")
            return found

    def entry(self, drop: str) -> Entry:
        """Return a drop by its identifier, the first digits of it, or the name of its record.

        Raises
        ------
        InputError
            If none or several match.
        """
        with catalogue.reading(self.catalogue) as base:
            found = catalogue.entries(base, "id LIKE ? || '%' OR sha256 = ?", (drop, drop)) if drop.isalnum() else []
            if len(found) == 1:
                return found[0]
            if found:
                raise InputError(f"{self.folder}: {len(found)} drops begin with '{drop}'; give more digits")
            found = catalogue.entries(base, "raw_name = ?", (drop,))
            if len(found) == 1:
                return found[0]
            if found:
                several = first_few([f"{entry.id} of {entry.machine}" for entry in found], _FEW)
                raise InputError(f"{self.folder}: {len(found)} drops have a record named '{drop}'; give one: {several}")
            some = [each for row in base.execute("SELECT id, raw_name FROM drops") for each in row]
        near = did_you_mean(drop, some)
        shown = (
            near if "mean" in near else f"; 'tdbmon archive list --archive {self.folder}' lists the filed drops"
        )
        raise InputError(f"{self.folder}: no drop '{drop}'{shown}")

    def machines(self) -> list[str]:
        """Return the names of the machines with drops in the archive."""
        with catalogue.reading(self.catalogue) as base:
            return [row[0] for row in base.execute("SELECT DISTINCT machine FROM drops ORDER BY machine")]

    def machine_file(self, drop: str) -> Path:
        """Return the path of the machine file of a drop's current result."""
        return self.folder / "machines" / f"{self.result(drop).machine_sha256}.toml"

    def ends(self, drop: str) -> tuple[str, ...]:
        """Return the names of the touchdown bearings in a drop's machine file; empty if that is lost or damaged."""
        try:
            content = tomllib.loads(self.machine_file(drop).read_text(encoding="utf-8-sig"))
            return tuple(bearing["name"] for bearing in content["touchdown_bearing"])
        except (OSError, ValueError, KeyError, TypeError):
            return ()

    def filing(self, drop: str) -> Filing:
        """Return a drop's current result, read from its file."""
        return read_result(self.folder / self.result(drop).file)

    def result(self, drop: str) -> Result:
        """Return the catalogue's row on a drop's current result."""
        with catalogue.reading(self.catalogue) as base:
            return catalogue.result(base, drop)

    def drop_of(self, sha256: str) -> Entry | None:
        """Return the drop of a raw file by its SHA-256; None if it is not filed."""
        with catalogue.reading(self.catalogue) as base:
            return next(iter(catalogue.entries(base, "sha256 = ?", (sha256,))), None)

    def has(self, entry: Entry, name: str) -> bool:
        """Return whether a drop has a result of this name (see `Filing.name`), with result and raw file intact."""
        with catalogue.reading(self.catalogue) as base:
            return self._whole(base, entry.raw, entry.sha256, f"results/{entry.id}/{name}")

    def sound(self, entry: Entry) -> bool:
        """Return whether a drop's raw file and current result are intact."""
        result = self.result(entry.id)
        return self._holds(result.file, result.file_sha256) and self._holds(entry.raw, entry.sha256)

    def forces_before(self, entry: Entry) -> str:
        """Return the program version of a drop's newest result with forces if its current one has none; "" otherwise."""
        with catalogue.reading(self.catalogue) as base:
            if catalogue.result(base, entry.id).forces:
                return ""
            found = base.execute("SELECT version FROM results WHERE drop_id = ? AND forces", (entry.id,))
            return max((str(row[0]) for row in found), key=catalogue.version_key, default="")

    def add(self, filing: Filing, raw: Path, machine: Path) -> Filed:
        """File a drop; repeating it changes nothing.

        Parameters
        ----------
        filing : Filing
            The result of `tdbmon.history.study`.
        raw, machine : Path
            The record and the machine file that it was made from.

        Raises
        ------
        InputError
            If the record is filed under another machine, the same measurement is filed from another file, another drop at the
            same instant is filed, or the archive cannot be written.
        """
        in_raw = raw_place(filing.sha256, raw.name)
        machine_place = f"machines/{filing.machine_sha256}.toml"
        result_place = f"results/{filing.drop}/{filing.name}"
        with catalogue.writing(self.catalogue) as base:
            sweep(self.folder)
            before = catalogue.entries(base, "id = ?", (filing.drop,))
            if before:
                self.check_same(before[0], filing.sha256, filing.machine, raw)
                in_raw = before[0].raw
                # `raw` may be the archive's own copy; a drop without a time keeps its place by its first filing
                filing = replace(filing, raw_name=before[0].raw_name, first=before[0].filed)
            else:
                self._refuse_twin(base, filing, raw, machine)
            overtaken = bool(before) and catalogue.result(base, filing.drop).overtakes(
                filing.version, filing.machine_sha256
            )
            if self._whole(base, in_raw, filing.sha256, result_place) and not overtaken:
                return "already filed"
            again = base.execute("SELECT filed FROM results WHERE file = ?", (result_place,)).fetchone()
            if again and not overtaken:  # its file was lost or damaged
                filing = replace(filing, filed=again[0])
            self._copy(raw, in_raw, filing.sha256)
            self._copy(machine, machine_place, filing.machine_sha256)
            content = result_bytes(filing)
            put(self.folder, self.folder / result_place, lambda part: part.write_bytes(content))
            catalogue.insert(base, filing, in_raw, result_place, sha256_of(self.folder / result_place))
        return "analysed again" if before else "filed"

    def check_same(self, entry: Entry, sha256: str, machine: str, raw: Path) -> None:
        """Raise `InputError` if a record's identifier belongs to another record, or it is filed under another machine."""
        if entry.sha256 != sha256:
            raise InputError(f"{raw}: its identifier {entry.id} is already that of another drop ({entry.raw_name})")
        if entry.machine != machine:
            raise InputError(
                f"{raw}: is already filed as a drop of machine '{entry.machine}', not '{machine}';"
                f" remove it first (tdbmon archive remove --archive {self.folder} {entry.id})"
            )

    def remove(self, drop: str) -> Entry:
        """Remove a drop with its results and its raw file."""
        entry = self.entry(drop)
        with catalogue.writing(self.catalogue) as base:
            sweep(self.folder)
            catalogue.forget_drop(base, entry.id)
        with writable(self.folder):  # after the catalogue, which must never name missing files
            shutil.rmtree(self.folder / "results" / entry.id, ignore_errors=True)
            (self.folder / entry.raw).unlink(missing_ok=True)
        return entry

    def _whole(self, base: sqlite3.Connection, raw: str, sha256: str, result: str) -> bool:
        """Return whether a result is catalogued and its file and the raw file are intact."""
        row = base.execute("SELECT file_sha256 FROM results WHERE file = ?", (result,)).fetchone()
        return row is not None and self._holds(result, row[0]) and self._holds(raw, sha256)

    def _holds(self, place: str, sha256: str) -> bool:
        target = self.folder / place
        return target.exists() and sha256_of(target) == sha256

    def _copy(self, source: Path, place: str, sha256: str) -> None:
        if self._holds(place, sha256):
            return

        def write(part: Path) -> None:
            shutil.copyfile(source, part)
            if sha256_of(part) != sha256:
                raise InputError(f"{source}: changed while it was filed; file it once it is complete")

        put(self.folder, self.folder / place, write)

    def _refuse_twin(self, base: sqlite3.Connection, filing: Filing, raw: Path, machine: Path) -> None:
        """Raise `InputError` if the same measurement, or a drop at the same instant, is filed already."""
        twin = twin_of(self, base, filing, lambda: read_and_laid(raw, machine))
        if twin is not None:
            raise InputError(
                f"{raw}: holds the same measurement as drop {twin.id} ({twin.raw_name}), which is filed;"
                " a drop counts once: leave it out, or remove the other first"
                f" (tdbmon archive remove --archive {self.folder} {twin.id})"
            )
        same = at_same_instant(base, filing)
        if same is not None:
            raise InputError(
                f"{raw}: states the same time ({moment(filing.dropped)}), machine and speed as drop {same.id} ({same.raw_name}),"
                " which is filed; a drop counts once: leave it out, or remove the other first"
                f" (tdbmon archive remove --archive {self.folder} {same.id}); if it is another drop, state its time with"
                " --dropped TIME"
            )


def open_archive(folder: Path, create: bool = False) -> Archive:
    """Return the archive in a folder, migrated if an older version wrote it.

    Parameters
    ----------
    folder : Path
    create : bool
        Create it if there is none.

    Raises
    ------
    InputError
        If there is none and `create` is false, the folder holds other files, or a newer version wrote it.
    """
    settings = folder / SETTINGS
    if not settings.exists():
        if not create:
            raise InputError(
                f"{folder}: no archive (no {SETTINGS} in it); 'tdbmon archive add' creates one, or give another folder"
            )
        if folder.exists() and not folder.is_dir():
            raise InputError(f"{folder}: is a file; give a folder for the archive")
        strange = [p.name for p in folder.iterdir() if not p.name.startswith(".")] if folder.exists() else []
        # another process may have created the archive since
        if strange and not {"results", "raw", SETTINGS} & set(strange):
            raise InputError(f"{folder}: is not an archive and not empty ({strange[0]}); give a new folder")
        with writable(folder):
            folder.mkdir(parents=True, exist_ok=True)
            first_settings(settings)
    load_settings(settings)
    archive = Archive(folder)
    from tdbmon.history.verify import bring_up_to_date

    bring_up_to_date(archive, create)
    return archive
