"""The catalogue's features as a table for other tools: CSV or Parquet, in long form."""

from __future__ import annotations

from collections import Counter
from datetime import UTC, datetime
from pathlib import Path

import pandas as pd
from tdbsim.errors import InputError

from tdbmon.atomic import replacing
from tdbmon.history import catalogue
from tdbmon.history.archive import Archive

_QUERY = """
SELECT d.id AS drop_id, d.machine, d.assembly, d.dropped, d.filed, d.speed_hz, d.raw_name, d.sha256, d.synthetic,
    f.name, f.end, f.value, f.low, f.high, f.unit, f.kind, f.method, f.why, f.version, f.forces, f.current
FROM features f JOIN drops d ON d.id = f.drop_id
ORDER BY d.moment, d.filed, d.id, f.version, f.name, f.end
"""


def features_table(archive: Archive) -> pd.DataFrame:
    """Return all features of all results, one row each.

    `current` marks the drop's current result.  `place` is the number of the drop among those of its machine, from 1.
    `dropped` is in UTC, in one format, and empty if unknown; a time without a zone counts as UTC.
    """
    with catalogue.reading(archive.catalogue) as base:
        table = pd.read_sql_query(_QUERY, base)
        entries = catalogue.entries(base)
    count: Counter[str] = Counter()
    places = {}
    for entry in entries:
        count[entry.machine] += 1
        places[entry.id] = count[entry.machine]
    table.insert(1, "place", table["drop_id"].map(places).astype(int))
    for column in ("dropped", "filed"):
        table[column] = table[column].map({stated: _utc(stated) for stated in table[column].unique()})
    for flag in ("synthetic", "forces", "current"):
        table[flag] = table[flag].astype(bool)
    return table.astype(dict.fromkeys(("value", "low", "high", "speed_hz"), float))


def export(archive: Archive, path: Path) -> int:
    """Write all features as .csv or .parquet; return the number of rows.

    Raises
    ------
    InputError
        If the suffix is another, pyarrow is missing, or the file cannot be written.
    """
    suffix = path.suffix.lower()
    if suffix not in (".csv", ".parquet"):
        raise InputError(f"{path}: features are exported as .csv or .parquet, not '{suffix}'")
    table = features_table(archive)
    with replacing(path) as part:
        if suffix == ".csv":
            table.to_csv(part, index=False)
        else:
            try:
                table.to_parquet(part, index=False, engine="pyarrow")
            except ImportError:
                raise InputError(
                    f"{path}: Parquet needs pyarrow; install it with: pip install 'tdbmon[parquet]', or export .csv"
                ) from None
    return len(table)


def _utc(stated: str) -> str | None:
    when = catalogue.seconds(stated)
    if when is None:
        return None
    return datetime.fromtimestamp(when, UTC).replace(tzinfo=None).isoformat(timespec="microseconds") + "Z"
