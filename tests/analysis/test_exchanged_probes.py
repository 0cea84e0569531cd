"""Probes exchanged between the ends are told, and no sound record is accused of it (synthetic records)."""

from __future__ import annotations

from pathlib import Path

import pytest
from tdbsim.machine import load_machine

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.axes import to_planes
from tdbmon.analysis.exchanged_probes import exchanged_probes
from tdbmon.record.assign import assign
from tdbmon.record.read import read

DATASETS = Path(__file__).parents[2] / "datasets"
RECORDS = sorted(path for part in ("short", "loose", "coastdown", "years") for path in (DATASETS / part).glob("*.nc"))


def _found(path: Path, *exchanged: str):
    machine = load_machine(path.parent / "machine.toml")
    record = assign(read(path), machine).sel(time=slice(0, 2.2))
    if exchanged:
        one, other = exchanged
        record = record.assign({one: record[other].variable, other: record[one].variable})
    return exchanged_probes(to_planes(record, machine), record, machine, 0.1)


@pytest.mark.parametrize("path", RECORDS, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_sound_records_have_no_probe_exchanged(path):
    assert _found(path) is None


@pytest.mark.parametrize(
    "name", ["short/drop_060", "short/drop_100", "short/drop_210", "loose/drop_150", "coastdown/drop_150"]
)
@pytest.mark.parametrize("pair", [("NDE_A", "DE_A"), ("NDE_B", "DE_B"), ("NDE_A", "DE_B"), ("NDE_B", "DE_A")])
def test_exchanged_probes_are_named_among_the_two_pairs_that_look_alike(name, pair):
    found = _found(DATASETS / f"{name}.nc", *pair)
    rest = tuple(each for each in ("NDE_A", "NDE_B", "DE_A", "DE_B") if each not in pair)
    assert set(found.pairs) == {pair, rest}
    assert not found.check.passed
    assert all(each in found.check.detail for each in (*pair, *rest))


@pytest.mark.parametrize("end", ["NDE", "DE"])
def test_where_the_file_has_all_probes_at_one_end_none_is_accused(end, machine):
    at_one_end = tuple(probe.model_copy(update={"end": end}) for probe in machine.probes)
    machine = machine.model_copy(update={"probes": at_one_end})
    record = assign(read(DATASETS / "short" / "drop_100.nc"), machine)
    record = record.assign({"NDE_A": record["DE_A"].variable, "DE_A": record["NDE_A"].variable})
    assert exchanged_probes(to_planes(record, machine), record, machine, 0.1) is None


def test_an_analysis_says_so(machine):
    raw = read(DATASETS / "short" / "drop_100.nc")
    raw = raw.assign({"NDE_A": raw["DE_A"].variable, "DE_A": raw["NDE_A"].variable})
    assert [check.check for check in analyse(raw, machine).checks if not check.passed] == ["cabling"]
