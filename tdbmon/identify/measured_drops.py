"""Several records as drops of one machine: each once, and under a unique name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import xarray as xr
from tdbsim.errors import InputError
from tdbsim.machine import Machine

from tdbmon.identify.drop import MeasuredDrop, measured_drop
from tdbmon.record.assign import assign
from tdbmon.record.quality import names_another
from tdbmon.record.same_samples import same_samples

_NEAR = 3e-3  # relative: the speeds of two exports of one drop


def measured_drops(records: Sequence[xr.Dataset], machine: Machine) -> tuple[MeasuredDrop, ...]:
    """Return the drops of records; a repeated name (files of different folders) gets a number appended.

    Raises
    ------
    InputError
        If there is no record, one is given twice under whatever name or format, some name another machine and others do not,
        or one cannot be used; the message then says what becomes of the others.
    """
    if not records:
        raise InputError("no record given; give the records of one or more drops of the machine")
    _check_twice(records)
    check_names(records, machine)
    drops = _usable(records, machine)
    _check_exports(drops, records, machine)
    names = [drop.name for drop in drops]
    return tuple(
        replace(drop, name=f"{drop.name} ({again})") if (again := names[: k + 1].count(drop.name)) > 1 else drop
        for k, drop in enumerate(drops)
    )


def _usable(records: Sequence[xr.Dataset], machine: Machine) -> list[MeasuredDrop]:
    """Return the drops of records; raise InputError where one cannot be used, saying what becomes of the others."""
    drops: list[MeasuredDrop] = []
    refused: list[tuple[str, InputError]] = []
    for record in records:
        try:
            drops.append(measured_drop(record, machine))
        except InputError as wrong:
            refused.append((_name(record), wrong))
    if not refused:
        return drops
    more = [name for name, _ in refused[1:]]
    also = f"; nor can {', '.join(more)} be used" if more else ""
    others = "drop" if len(drops) == 1 else f"{len(drops)} drops"
    rest = f"; leave {'them' if more else 'it'} out to use the other {others}" if drops else ""
    raise InputError(f"{refused[0][1]}{also}{rest}")


def check_names(records: Sequence[xr.Dataset], machine: Machine) -> None:
    """Refuse records of two machines by what they name; where all name another one, the name in the file may be wrong."""
    foreign = [(_name(record), said) for record in records if (said := names_another(record, machine))]
    others = len(records) - len(foreign)
    if not foreign or not others:
        return
    (first, said), *more = foreign
    also = f"; so {'are' if len(more) > 1 else 'is'} {', '.join(name for name, _ in more)}" if more else ""
    rest = "record" if others == 1 else f"{others} records"
    raise InputError(f"{first}: {said}{also}; leave {'them' if more else 'it'} out to use the other {rest}")


def _name(record: xr.Dataset) -> str:
    return str(record.attrs.get("source_file", "record"))


def _check_twice(records: Sequence[xr.Dataset]) -> None:
    seen: dict[str, str] = {}
    for record in records:
        content, name = record.attrs.get("sha256"), str(record.attrs.get("source_file", "a record"))
        if content in seen:
            other = "" if seen[content] == name else f", also as {seen[content]}"
            raise InputError(f"{name} is given twice{other}; a drop counts once, give each record once")
        if content:
            seen[content] = name


def _check_exports(drops: Sequence[MeasuredDrop], records: Sequence[xr.Dataset], machine: Machine) -> None:
    """Refuse two exports of one measurement, such as a CSV and a TDMS file: compared by samples, since digests differ."""
    laid: dict[int, xr.Dataset] = {}
    for (i, one), (k, other) in combinations(enumerate(drops), 2):
        if abs(one.speed - other.speed) > _NEAR * max(one.speed, other.speed):
            continue
        for j in {i, k} - laid.keys():
            laid[j] = assign(records[j], machine)
        if same_samples(laid[i], laid[k]):
            raise InputError(
                f"{other.name} holds the same measurement as {one.name}; a drop counts once, give one of the two files"
            )
