"""Parquet files: tables whose columns are channels, with units in the column names or the field metadata."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tdbmon.record.channel import Content
from tdbmon.record.date import first_dated
from tdbmon.record.format import library
from tdbmon.record.tree import Branch, Leaf, channels_of, stated_date, stated_title

_STAMP = "datetime64[ns]"


class Parquet:
    """Parquet files with a time column (numbers, timestamps or durations), or ``dt`` or ``fs`` in the table's metadata."""

    name = "Parquet"
    extra: str | None = "parquet"

    def recognises(self, head: bytes, path: Path) -> bool:
        return head.startswith(b"PAR1")

    def read(self, path: Path) -> Content:
        library("pyarrow", self, path)
        import pyarrow.parquet

        with path.open("rb") as file:
            table = pyarrow.parquet.read_table(file)
        entries = _decoded(table.schema.metadata)
        leaves: list[Leaf] = []
        date = stated_date(entries)
        for field, column in zip(table.schema, table.columns, strict=True):
            attributes = _decoded(field.metadata)
            kind = str(field.type)
            if kind.startswith("timestamp"):
                stamps = column.to_numpy().astype(_STAMP)
                if stamps.size:
                    date = first_dated((date, str(np.datetime_as_string(stamps[0], unit="ms"))))
                    leaves.append(Leaf(field.name, stamps, {"units": "s"}))
                continue
            if kind.startswith("duration"):
                elapsed = column.to_numpy().astype("timedelta64[ns]") / np.timedelta64(1, "s")
                leaves.append(Leaf(field.name, elapsed, {"units": "s"}))
                continue
            if kind == "bool" or kind.startswith(("int", "uint", "float", "double", "halffloat")):
                values = column.to_numpy()
                if values.dtype.kind in "iufb":
                    leaves.append(Leaf(field.name, values, attributes))
        return Content(channels_of(Branch("", tuple(leaves), entries), path), stated_title(entries), date)


def _decoded(metadata: dict[bytes, bytes] | None) -> dict[str, Any]:
    return {key.decode("utf-8", "replace"): value.decode("utf-8", "replace") for key, value in (metadata or {}).items()}
