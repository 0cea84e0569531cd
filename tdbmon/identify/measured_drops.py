"""Several records as drops of one machine: each counts once, and has a name of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import xarray as xr
from tdbsim.errors import InputError
from tdbsim.machine import Machine

from tdbmon.identify.drop import MeasuredDrop, measured_drop


def measured_drops(records: Sequence[xr.Dataset], machine: Machine) -> tuple[MeasuredDrop, ...]:
    """Return the drops of records; one whose name comes again (files of different folders) has a number behind it.

    Raises
    ------
    InputError
        If there is no record, one is given twice, whatever its name, or one cannot be used.
    """
    if not records:
        raise InputError("no record given; give the records of one or more drops of the machine")
    _check_twice(records)
    drops = [measured_drop(record, machine) for record in records]
    names = [drop.name for drop in drops]
    return tuple(
        replace(drop, name=f"{drop.name} ({again})") if (again := names[: k + 1].count(drop.name)) > 1 else drop
        for k, drop in enumerate(drops)
    )


def _check_twice(records: Sequence[xr.Dataset]) -> None:
    seen: dict[str, str] = {}
    for record in records:
        content, name = record.attrs.get("sha256"), str(record.attrs.get("source_file", "a record"))
        if content in seen:
            other = "" if seen[content] == name else f", also as {seen[content]}"
            raise InputError(f"{name} is given twice{other}; a drop counts once, give each record once")
        if content:
            seen[content] = name
