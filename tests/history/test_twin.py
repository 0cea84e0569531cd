"""The same measurement in another file, format or length is the drop that is filed; another drop is not."""

from __future__ import annotations

import shutil
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.signal import resample_poly
from tdbsim.errors import InputError

from tdbmon.estimate import Estimate
from tdbmon.history import catalogue
from tdbmon.history.archive import open_archive
from tdbmon.history.batch import add_all
from tdbmon.history.study import Order
from tdbmon.history.twin import read_and_laid, twin_of
from tdbmon.history.unfiled import drop_to_compare
from tdbmon.progress import silent
from tdbmon.record.read import read, write
from tdbmon.record.same_samples import same_samples
from tdbmon.shipped import shipped
from tests.history.conftest import YEARS
from tests.history.made import add, files, filing, fill, wrong


def test_the_same_measurement_in_another_file_is_refused(empty, tmp_path):
    fill(empty, tmp_path, 1)
    other, machine = files(tmp_path, 99)  # other bytes, the same numbers
    with pytest.raises(InputError, match=r"drop_99.nc: holds the same measurement as drop \w{12} \(drop_0.nc\)"):
        empty.add(filing(other, machine, seed=0), other, machine)
    assert len(empty.entries()) == 1
    assert wrong(empty) == []


def test_a_second_drop_of_one_machine_at_one_instant_is_refused(empty, tmp_path):
    """A copy with one channel changed: counts of drops are agreed with the maker of the bearings."""
    raw, machine = files(tmp_path, 0)
    first = filing(raw, machine, dropped="2020-01-01T09:30:05Z", seed=0)
    assert empty.add(first, raw, machine) == "filed"
    other, _ = files(tmp_path, 1)
    made = filing(other, machine, dropped="2020-01-01T10:30:05.4+01:00", seed=1)
    with pytest.raises(
        InputError, match=r"drop_1.nc: states the same time .* as drop \w{12} \(drop_0.nc\).*--dropped TIME"
    ):
        empty.add(made, other, machine)
    assert len(empty.entries()) == 1
    assert empty.add(replace(made, dropped="2020-01-01T09:40:05Z"), other, machine) == "filed"


@pytest.mark.parametrize("change", [{"speed": 90.0}, {"name": "another"}, {"dropped": "2020-01-01"}])
def test_another_speed_machine_or_a_bare_date_is_another_drop(empty, tmp_path, change):
    raw, machine = files(tmp_path, 0)
    stated = {"dropped": change.get("dropped", "2020-01-01T09:30:05Z")}
    empty.add(filing(raw, machine, seed=0, **stated), raw, machine)
    other, _ = files(tmp_path, 1)
    assert empty.add(filing(other, machine, seed=1, **{**stated, **change}), other, machine) == "filed"


def test_the_same_measurement_in_another_format_is_refused_and_compared_as_the_filed_one(years, tmp_path):
    """Exported with two decimals and without its last line, under a name and a time of its own."""
    record = read(YEARS / "drop_03.nc").isel(time=slice(0, -1))
    names = [str(name) for name in record.data_vars]
    factors = [1e6 if record[name].attrs["units"] == "m" else 1.0 for name in names]
    units = ["um" if factor > 1 else record[name].attrs["units"] for name, factor in zip(names, factors, strict=True)]
    columns = [record[name].to_numpy() * factor for name, factor in zip(names, factors, strict=True)]
    header = ",".join(["time [s]", *(f"{name} [{unit}]" for name, unit in zip(names, units, strict=True))])
    exported = tmp_path / "exported.csv"
    table = np.column_stack([record.time.to_numpy(), *columns])
    np.savetxt(exported, table, fmt=["%.4f"] + ["%.2f"] * len(names), delimiter=",", header=header, comments="")

    archive = open_archive(Path(shutil.copytree(years.folder, tmp_path / "archive")))
    (outcome,) = add_all(archive, [Order(YEARS / "machine.toml", exported)])
    (filed,) = [entry for entry in archive.entries() if entry.raw_name == "drop_03.nc"]
    assert outcome.failed
    assert f"holds the same measurement as drop {filed.id} (drop_03.nc)" in outcome.why
    assert f"tdbmon archive remove --archive {archive.folder} {filed.id}" in outcome.why
    assert len(archive.entries()) == 10
    compared = drop_to_compare(archive, str(exported), None, False, silent)
    assert compared.entry.id == filed.id

    archive.remove(filed.id)
    assert [o.state for o in add_all(archive, [Order(YEARS / "machine.toml", exported)])] == ["filed"]


def test_the_same_measurement_without_a_speed_is_refused_too(empty, tmp_path):
    """Displacements alone, as recorded and rounded to a nanometre."""
    probes = read(YEARS / "drop_01.nc").isel(time=slice(0, 12000))[["NDE_A", "NDE_B", "DE_A", "DE_B"]]
    rounded = probes.map(lambda channel: channel.round(9), keep_attrs=True)
    for name, record in (("a.nc", probes), ("b.nc", rounded)):
        write(record, tmp_path / name)
    first, second = add_all(empty, [Order(YEARS / "machine.toml", tmp_path / name) for name in ("a.nc", "b.nc")])
    assert first.state == "filed"
    assert f"holds the same measurement as drop {first.drop} (a.nc)" in second.why


def test_the_same_measurement_under_other_names_and_without_its_speed_is_refused(empty, tmp_path):
    """As another logger exports it: its own channel names, in a machine file that knows them, and no speed."""
    record = read(YEARS / "drop_01.nc").isel(time=slice(0, 12000))
    names = {name: f"A{k}" for k, name in enumerate(("NDE_A", "NDE_B", "DE_A", "DE_B"), 1)}
    write(record, tmp_path / "a.nc")
    write(record[list(names)].rename(names).map(lambda each: each.round(9), keep_attrs=True), tmp_path / "b.nc")
    written = (YEARS / "machine.toml").read_text()
    for name, other in names.items():
        written = written.replace(f'"{name}"', f'"{other}"')
    (tmp_path / "other.toml").write_text(written)
    (first,) = add_all(empty, [Order(YEARS / "machine.toml", tmp_path / "a.nc")])
    (second,) = add_all(empty, [Order(tmp_path / "other.toml", tmp_path / "b.nc")])
    assert first.state == "filed"
    assert f"holds the same measurement as drop {first.drop} (a.nc)" in second.why


def cut(name: str, start: float, end: float, place: Path) -> Path:
    """A shipped drop from one time to another, s, rounded to 0.01 um as an export is, with its time and name gone."""
    record = read(YEARS / name)
    rounded = record.map(
        lambda channel: channel.round(8) if channel.attrs["units"] == "m" else channel, keep_attrs=True
    )
    part = rounded.isel(time=(record.time.to_numpy() >= start) & (record.time.to_numpy() < end))
    for attribute in ("drop_time", "date"):
        part.attrs.pop(attribute, None)
    target = place / f"cut {name}"
    write(part.assign_coords(time=("time", part.time.to_numpy() - part.time.to_numpy()[0], part.time.attrs)), target)
    return target


@pytest.mark.parametrize(
    ("name", "start", "end"),
    [
        ("drop_04.nc", 0.06, 9.0),  # some of the levitation
        ("drop_01.nc", 1.0, 9.0),  # the release too: a bounce is taken for it
        ("drop_04.nc", 1.0, 9.0),  # the same, and none is found
        ("drop_09.nc", 0.3, 2.0),
        ("drop_02.nc", 0.0, 1.0),
    ],
)
def test_a_measurement_whose_start_or_end_is_cut_away_is_the_filed_one(years, tmp_path, name, start, end):
    archive = open_archive(Path(shutil.copytree(years.folder, tmp_path / "archive")))
    part = cut(name, start, end, tmp_path)
    (filed,) = [entry for entry in archive.entries() if entry.raw_name == name]
    (outcome,) = add_all(archive, [Order(YEARS / "machine.toml", part)])
    assert f"holds the same measurement as drop {filed.id} ({name})" in outcome.why
    assert len(archive.entries()) == 10
    assert drop_to_compare(archive, str(part), None, False, silent).entry.id == filed.id


def test_a_cut_measurement_of_another_drop_is_filed_and_then_refuses_the_whole_of_it(years, tmp_path):
    archive = open_archive(Path(shutil.copytree(years.folder, tmp_path / "archive")))
    (filed,) = [entry for entry in archive.entries() if entry.raw_name == "drop_04.nc"]
    archive.remove(filed.id)
    part, rest = cut("drop_04.nc", 1.0, 9.0, tmp_path), YEARS / "drop_04.nc"
    first, second = add_all(archive, [Order(YEARS / "machine.toml", each) for each in (part, rest)])
    assert first.state == "filed"
    assert f"holds the same measurement as drop {first.drop} (cut drop_04.nc)" in second.why


def test_no_stretch_of_a_shipped_drop_lies_in_another():
    """Of one machine at one speed, and of one at four: levitated, in the fall, rolling, at rest."""
    for folder in ("years", "short"):
        machine = shipped(folder) / "machine.toml"
        drops = [read_and_laid(record, machine) for record in sorted(shipped(folder).glob("*.nc"))[:4]]
        for start, end in ((0.0, 0.03), (0.02, 0.7), (1 / 3, 1.0), (0.9, 1.0)):
            for one in drops:
                size = one.sizes["time"]
                part = one.isel(time=slice(int(start * size), int(end * size)))
                assert [same_samples(part, other) for other in drops] == [other is one for other in drops]


@pytest.mark.parametrize("rate", [0.8, 0.4, 1.25])
def test_another_sampling_rate_and_other_zeros_are_the_same_measurement(rate):
    """As tools export again: through a filter at another rate, and with the levitated shaft set to nought."""
    machine = YEARS / "machine.toml"
    drops = [read_and_laid(YEARS / f"drop_{k:02d}.nc", machine) for k in (1, 2, 3)]
    up, down = Fraction(rate).limit_denominator(10).as_integer_ratio()
    whole = drops[0]
    again = xr.Dataset(
        {
            name: ("time", resample_poly(channel.values - channel.values[:900].mean(), up, down), channel.attrs)
            for name, channel in whole.items()
            if channel.attrs.get("units") == "m"
        }
    )
    step = float(whole.time[1] - whole.time[0]) / rate
    again = again.assign_coords(time=5.0 + step * np.arange(again.sizes["time"]))
    assert [same_samples(again, each) for each in drops] == [True, False, False]
    assert [same_samples(each, again) for each in drops] == [True, False, False]


def test_what_two_cut_records_have_in_common_tells_that_they_are_one_drop():
    """One lacks its start, the other its end."""
    whole = read_and_laid(YEARS / "drop_01.nc", YEARS / "machine.toml")
    first, last = whole.isel(time=slice(0, 20000)), whole.isel(time=slice(10000, None))
    assert same_samples(first, last)
    assert same_samples(last, first)
    other = read_and_laid(YEARS / "drop_02.nc", YEARS / "machine.toml").isel(time=slice(10000, None))
    assert not same_samples(first, other)


def test_probes_that_do_not_move_tell_nothing():
    whole = read_and_laid(YEARS / "drop_01.nc", YEARS / "machine.toml").isel(time=slice(0, 4000))
    still = whole.map(lambda channel: channel * 0.0, keep_attrs=True)
    assert not same_samples(still.isel(time=slice(0, 2000)), still)


@pytest.mark.parametrize(
    ("check", "held_against_all"),
    [
        ("dropout NDE_A", False),  # not "drop"
        ("dead NDE_A", False),
        ("drop", True),
        ("levitated stretch", True),
        ("free fall NDE", True),
        ("set point NDE", True),
    ],
)
def test_all_drops_are_read_for_one_without_a_sound_release_alone(
    empty, tmp_path, monkeypatch, check, held_against_all
):
    """A record that lacks a sample was held against all drops sample by sample, and each later record against it."""
    read = []

    def reading(raw, machine):
        read.append(raw)
        raise InputError("it is made up of numbers")

    monkeypatch.setattr("tdbmon.history.twin.read_and_laid", reading)
    fill(empty, tmp_path, 3)
    assert read == []
    for seed, checks, filed_before in ((7, (check,), 3), (8, (), 1)):  # the second against the first alone
        add(empty, tmp_path, seed, dropped=f"2021-01-{seed:02d}", failed_checks=checks)
        assert len(read) == (filed_before if held_against_all else 0)
        read.clear()


def test_two_drops_of_like_features_are_two(years):
    """Where but half of the features are alike, the samples decide."""
    entry = years.entries()[0]
    found = years.filing(entry.id)
    with catalogue.reading(years.catalogue) as base:
        near = replace(found, features=tuple(replace(f, estimate=_off(f.estimate, 1e-6)) for f in found.features))
        for name, expected in (("drop_01.nc", entry), ("drop_02.nc", None)):
            record = read_and_laid(YEARS / name, YEARS / "machine.toml")
            assert twin_of(years, base, near, lambda record=record: record) == expected


def _off(estimate, share):
    return estimate if estimate.value is None else Estimate(estimate.value * (1 + share), unit=estimate.unit, why="off")
