"""The catalogue: an SQLite file of all drops, results and features, which can be rebuilt from the result files.

Values are in the unit in their row.  ``features`` is a view for any SQL tool; the tables behind it store each method and
reason once (``wordings``), since these sentences repeat from drop to drop.
"""

from __future__ import annotations

import json
import math
import re
import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from tdbsim.errors import InputError

from tdbmon.estimate import OUTSIDE, Estimate
from tdbmon.history.feature import Feature
from tdbmon.history.filing import Filing, StressBox
from tdbmon.history.speed_class import stood
from tdbmon.quantity import moment

SCHEMA = 3  # PRAGMA user_version; 2: a drop keeps the time of its first filing, 3: one without a time is the earliest
NAME = "catalogue.sqlite"
_WAIT_S = 120.0  # for another writer

_TABLES = """
CREATE TABLE drops (
    id TEXT PRIMARY KEY, sha256 TEXT NOT NULL, raw TEXT NOT NULL, raw_name TEXT NOT NULL, machine TEXT NOT NULL,
    assembly TEXT NOT NULL, dropped TEXT NOT NULL, moment REAL NOT NULL, filed TEXT NOT NULL, speed_hz REAL,
    synthetic INTEGER NOT NULL, failed_checks TEXT NOT NULL, result INTEGER NOT NULL
) WITHOUT ROWID;
CREATE INDEX drops_matching ON drops (machine, assembly, speed_hz);
CREATE TABLE results (
    id INTEGER PRIMARY KEY, drop_id TEXT NOT NULL, file TEXT NOT NULL UNIQUE, file_sha256 TEXT NOT NULL,
    version TEXT NOT NULL, machine_sha256 TEXT NOT NULL, forces INTEGER NOT NULL, filed TEXT NOT NULL
);
CREATE INDEX results_of_drop ON results (drop_id);
CREATE TABLE wordings (id INTEGER PRIMARY KEY, words TEXT NOT NULL UNIQUE);
CREATE TABLE feature_values (
    result_id INTEGER NOT NULL, name TEXT NOT NULL, end TEXT NOT NULL, value REAL, low REAL, high REAL,
    unit TEXT NOT NULL, kind TEXT NOT NULL, method INTEGER NOT NULL, why INTEGER NOT NULL,
    PRIMARY KEY (result_id, name, end)
) WITHOUT ROWID;
CREATE TABLE stress (
    result_id INTEGER NOT NULL, end TEXT NOT NULL, max_mpa REAL, mean_mpa REAL, median_mpa REAL, q1_mpa REAL, q3_mpa REAL,
    outliers_mpa TEXT NOT NULL, PRIMARY KEY (result_id, end)
) WITHOUT ROWID;
CREATE VIEW features AS
    SELECT r.drop_id AS drop_id, f.name, f.end, f.value, f.low, f.high, f.unit, f.kind, m.words AS method, w.words AS why,
        r.version, r.machine_sha256, r.forces, d.result = r.id AS current
    FROM feature_values f JOIN results r ON r.id = f.result_id JOIN drops d ON d.id = r.drop_id
    JOIN wordings m ON m.id = f.method JOIN wordings w ON w.id = f.why;
"""


# in the order of `Entry`
_COLUMNS = (
    "id, sha256, raw, raw_name, machine, assembly, dropped, moment, filed, speed_hz, synthetic, failed_checks, result"
)


@dataclass(frozen=True)
class Entry:
    """A drop of the catalogue.

    Attributes
    ----------
    id, sha256, raw_name, machine, assembly, dropped
        As in `Filing`.
    filed : str
        Time of the first filing: a later analysis does not change the drop's place in the order.
    raw : str
        Path of the raw file in the archive.
    moment : float
        Time of the drop, s since 1970; minus infinity if unknown: such a drop is never the latest of its machine.
    speed : float or None
        At the release, Hz.
    synthetic : bool
    failed_checks : tuple of str
    result : int
        The current result: of the newest program version, and of these the latest filed.
    """

    id: str
    sha256: str
    raw: str
    raw_name: str
    machine: str
    assembly: str
    dropped: str
    moment: float
    filed: str
    speed: float | None
    synthetic: bool
    failed_checks: tuple[str, ...]
    result: int

    @property
    def when(self) -> str:
        """Time of the drop, or of its filing if that is unknown, as text."""
        return moment(self.dropped) if self.dropped else f"filed {moment(self.filed)}"

    @property
    def speed_words(self) -> str:
        """Its speed at the release, as text."""
        if stood(self.speed):
            return "standstill"
        return "speed unknown" if self.speed is None else f"{f'{self.speed:#.4g}'.rstrip('.')} Hz"

    @property
    def order(self) -> tuple[float, str, str]:
        """Sort key for chronological order; a time that states the day alone may be that of several drops."""
        return self.moment, self.filed, self.id


@dataclass(frozen=True)
class Result:
    """A result of a drop.

    Attributes
    ----------
    file, file_sha256 : str
        Its file in the archive.
    version, machine_sha256 : str
        Program version and machine file that it was made with.
    forces : bool
        Whether forces were computed.
    """

    file: str
    file_sha256: str
    version: str
    machine_sha256: str
    forces: bool

    def overtakes(self, version: str, machine_sha256: str) -> bool:
        """Return whether it was made by this version with another machine file, and so supersedes a result made with these."""
        return self.version == version and self.machine_sha256 != machine_sha256


@contextmanager
def writing(path: Path) -> Iterator[sqlite3.Connection]:
    """Lock the catalogue for one writer; its changes are committed as a whole or not at all.

    Raises
    ------
    InputError
        If it cannot be written, is damaged, or another writer holds it for minutes.
    """
    with _told(path):
        base = sqlite3.connect(path, timeout=_WAIT_S, isolation_level=None)
        try:
            base.execute("PRAGMA synchronous = EXTRA")
            base.execute("BEGIN IMMEDIATE")
            version = _version(base, path)
            if version == 0:
                _create(base)
            yield base
            base.execute("COMMIT")
        finally:
            base.close()  # rolls back uncommitted changes


@contextmanager
def reading(path: Path) -> Iterator[sqlite3.Connection]:
    """Open the catalogue for reading, also in a read-only folder.

    Raises
    ------
    InputError
        If it is missing, damaged or written by a newer version.
    """
    with _told(path):
        if not path.exists():
            raise InputError(f"{path}: no catalogue; 'tdbmon archive verify --rebuild' creates it from the result files")
        try:
            base = _connection(path, "rw")
            base.execute("SELECT 1 FROM sqlite_master")
        except sqlite3.OperationalError:
            base = _connection(path, "ro")
        try:
            base.execute("BEGIN")
            _version(base, path)
            yield base
        finally:
            base.close()


def version_of(path: Path) -> int:
    """Return the schema version of a catalogue; 0 if there is none yet.

    Raises
    ------
    InputError
        If it is damaged.
    """
    if not path.exists():
        return 0
    with _told(path):
        base = _connection(path, "ro")
        try:
            return _user_version(base)
        finally:
            base.close()


def clear(base: sqlite3.Connection) -> None:
    """Empty the catalogue, before it is rebuilt from the result files."""
    for table in ("drops", "results", "wordings", "feature_values", "stress"):
        base.execute(f"DELETE FROM {table}")


def insert(base: sqlite3.Connection, filing: Filing, raw: str, file: str, file_sha256: str) -> None:
    """Insert a result, replacing that of the same file."""
    forget_result(base, file)
    cursor = base.execute(
        "INSERT INTO results (drop_id, file, file_sha256, version, machine_sha256, forces, filed) VALUES (?,?,?,?,?,?,?)",
        (filing.drop, file, file_sha256, filing.version, filing.machine_sha256, filing.forces, filing.filed),
    )
    result = cursor.lastrowid
    said = {words for f in filing.features for words in (f.estimate.method, f.estimate.why)}
    wordings = {words: _wording(base, words) for words in said}
    base.executemany(
        "INSERT INTO feature_values VALUES (?,?,?,?,?,?,?,?,?,?)", [_row(result, f, wordings) for f in filing.features]
    )
    base.executemany("INSERT INTO stress VALUES (?,?,?,?,?,?,?,?)", [_stress_row(result, s) for s in filing.stress])
    best = max(
        base.execute("SELECT version, filed, forces, file, id FROM results WHERE drop_id = ?", (filing.drop,)),
        key=lambda r: (version_key(r[0]), *r[1:4]),
    )
    known = base.execute("SELECT filed FROM drops WHERE id = ?", (filing.drop,))
    first = min([filing.first or filing.filed, *(row[0] for row in known)])
    if best[4] == result or not base.execute("SELECT 1 FROM drops WHERE id = ?", (filing.drop,)).fetchone():
        base.execute(
            "INSERT OR REPLACE INTO drops VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?)",
            (
                filing.drop, filing.sha256, raw, filing.raw_name, filing.machine, filing.assembly, filing.dropped,
                0.0, filing.filed, speed_of(filing.features), filing.synthetic, json.dumps(filing.failed_checks), best[4],
            ),
        )  # fmt: skip
    (dropped,) = base.execute("SELECT dropped FROM drops WHERE id = ?", (filing.drop,)).fetchone()
    base.execute("UPDATE drops SET filed = ?, moment = ? WHERE id = ?", (first, moment_of(dropped), filing.drop))


def forget_result(base: sqlite3.Connection, file: str) -> None:
    """Delete the rows of a result file."""
    for (old,) in base.execute("SELECT id FROM results WHERE file = ?", (file,)).fetchall():
        for table in ("feature_values", "stress"):
            base.execute(f"DELETE FROM {table} WHERE result_id = ?", (old,))
        base.execute("DELETE FROM results WHERE id = ?", (old,))


def forget_drop(base: sqlite3.Connection, drop: str) -> None:
    """Delete the rows of a drop and all its results."""
    for (file,) in base.execute("SELECT file FROM results WHERE drop_id = ?", (drop,)).fetchall():
        forget_result(base, file)
    base.execute("DELETE FROM drops WHERE id = ?", (drop,))


def entries(base: sqlite3.Connection, where: str = "1", values: Iterable[object] = ()) -> list[Entry]:
    """Return drops in chronological order; `where` is a trusted SQL condition, `values` fill its placeholders."""
    found = base.execute(f"SELECT {_COLUMNS} FROM drops WHERE {where}", tuple(values))
    return sorted((_entry(row) for row in found), key=lambda entry: entry.order)


def features(base: sqlite3.Connection, results: list[int], name: str = "") -> dict[int, tuple[Feature, ...]]:
    """Return the features by result, all or those of one name."""
    rows: dict[int, list[Feature]] = {result: [] for result in results}
    words = dict(base.execute("SELECT id, words FROM wordings"))
    for some in _batches(results):
        marks = ",".join("?" * len(some))
        asked = f"SELECT * FROM feature_values WHERE result_id IN ({marks})" + (" AND name = ?" if name else "")
        for row in base.execute(asked, [*some, name] if name else some):
            factor = OUTSIDE[row[6]]
            value, low, high = (None if x is None else x / factor for x in row[3:6])
            estimate = Estimate(value, low, high, row[6], words[row[8]], words[row[9]], row[7])
            rows[row[0]].append(Feature(row[1], row[2], estimate))
    return {result: tuple(found) for result, found in rows.items()}


def stress(base: sqlite3.Connection, results: list[int]) -> dict[int, tuple[StressBox, ...]]:
    """Return the stress boxes by result; results without forces are left out."""
    rows: dict[int, list[StressBox]] = {}
    factor = OUTSIDE["MPa"]
    for some in _batches(results):
        marks = ",".join("?" * len(some))
        for row in base.execute(f"SELECT * FROM stress WHERE result_id IN ({marks})", some):
            greatest, mean, median, q1, q3 = (x / factor for x in row[2:7])
            outliers = tuple(x / factor for x in json.loads(row[7]))
            rows.setdefault(row[0], []).append(StressBox(row[1], greatest, mean, median, q1, q3, outliers))
    return {result: tuple(found) for result, found in rows.items()}


def result(base: sqlite3.Connection, drop: str) -> Result:
    """Return a drop's current result (raises `InputError` if there is no such drop)."""
    row = base.execute(
        "SELECT r.file, r.file_sha256, r.version, r.machine_sha256, r.forces FROM results r JOIN drops d ON d.result = r.id"
        " WHERE d.id = ?",
        (drop,),
    ).fetchone()
    if row is None:
        raise InputError(f"no drop '{drop}' is in the catalogue; 'tdbmon archive list' lists the filed drops")
    file, file_sha256, version, machine_sha256, forces = row
    return Result(file, file_sha256, version, machine_sha256, bool(forces))


def version_key(version: str) -> tuple[int, ...]:
    """Return the sort key of a program version: its numbers."""
    return tuple(int(part) for part in re.findall(r"\d+", version))


def moment_of(dropped: str) -> float:
    """Return the time of a drop, s since 1970; a time without a zone counts as UTC, no time as minus infinity."""
    stated = seconds(dropped)
    return -math.inf if stated is None else stated


def instant(time: str) -> float | None:
    """Return an ISO 8601 time in s since 1970; None without a time of day (exactly midnight is taken for a bare date)."""
    stated = seconds(time)
    if stated is None or datetime.fromisoformat(time).time() == datetime.min.time():
        return None
    return stated


def seconds(time: str) -> float | None:
    """Return an ISO 8601 time in s since 1970, one without a zone as UTC; None if it cannot be parsed."""
    try:
        when = datetime.fromisoformat(time)
    except ValueError:
        return None
    return (when if when.tzinfo is not None else when.replace(tzinfo=UTC)).timestamp()


def _create(base: sqlite3.Connection) -> None:
    for statement in _TABLES.split(";\n"):
        if statement.strip():
            base.execute(statement)
    base.execute(f"PRAGMA user_version = {SCHEMA}")


def _connection(path: Path, mode: Literal["rw", "ro"]) -> sqlite3.Connection:
    return sqlite3.connect(f"{path.resolve().as_uri()}?mode={mode}", uri=True, timeout=_WAIT_S, isolation_level=None)


def _user_version(base: sqlite3.Connection) -> int:
    return int(base.execute("PRAGMA user_version").fetchone()[0])


def _version(base: sqlite3.Connection, path: Path) -> int:
    version = _user_version(base)
    if version > SCHEMA:
        raise InputError(
            f"{path}: catalogue of a newer tdbmon (schema {version}, this one has {SCHEMA}): update tdbmon"
        )
    return version


def _entry(row: tuple[Any, ...]) -> Entry:
    *stated, synthetic, failed_checks, result = row
    fields = (*stated, bool(synthetic), tuple(json.loads(failed_checks)), result)
    return Entry(*fields)


def _row(result: int | None, feature: Feature, wordings: dict[str, int]) -> tuple[object, ...]:
    e = feature.estimate
    return (result, feature.name, feature.end, *e.outside, e.unit, e.kind, wordings[e.method], wordings[e.why])


def _wording(base: sqlite3.Connection, words: str) -> int:
    found = base.execute("SELECT id FROM wordings WHERE words = ?", (words,)).fetchone()
    if found is None:
        return int(base.execute("INSERT INTO wordings (words) VALUES (?)", (words,)).lastrowid or 0)
    return int(found[0])


def _stress_row(result: int | None, box: StressBox) -> tuple[object, ...]:
    factor = OUTSIDE["MPa"]
    numbers = [factor * x for x in (box.greatest, box.mean, box.median, box.q1, box.q3)]
    return (result, box.end, *numbers, json.dumps([factor * x for x in box.outliers]))


def speed_of(found: tuple[Feature, ...]) -> float | None:
    """Return the speed at the release from a drop's features, Hz; None if unknown."""
    return next((f.estimate.value for f in found if f.name == "initial_hz"), None)


def _batches(results: list[int], size: int = 500) -> Iterator[list[int]]:
    for start in range(0, len(results), size):
        yield results[start : start + size]


@contextmanager
def _told(path: Path) -> Iterator[None]:
    """Turn SQLite's errors into an `InputError` with the cure."""
    try:
        yield
    except sqlite3.OperationalError as error:
        said = str(error)
        if "locked" in said:
            cure = "another program is using it: wait until it has finished"
        elif "full" in said:
            cure = "the disk is full; nothing was changed: free some space and try again"
        elif "readonly" in said or "unable to open" in said:
            cure = "it cannot be written; nothing was changed: get write permission for the folder"
        else:
            cure = "run 'tdbmon archive verify --rebuild'"
        raise InputError(f"{path}: {said}; {cure}") from None
    except sqlite3.DatabaseError as error:
        raise InputError(f"{path}: damaged ({error}); 'tdbmon archive verify --rebuild' rebuilds it") from None
