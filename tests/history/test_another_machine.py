"""A drop of another machine is flagged by what its record shows; wear, a new set-point and the machine's own scatter are not."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace

import pytest
from tdbsim.machine import load_machine

from tdbmon.cli import main
from tdbmon.history.another_machine import likeness
from tdbmon.history.archive import open_archive
from tdbmon.history.compare import compare, filed_drop
from tdbmon.history.contract import comparison_json
from tdbmon.history.standing import Judged
from tdbmon.history.study import study_record
from tdbmon.history.unfiled import as_drop
from tdbmon.history.verdict import verdict_of
from tdbmon.record.read import read
from tdbmon.shipped import shipped
from tests.history.conftest import YEARS
from tests.history.made import ENDS, add, files, filing, fill

ALL = 8  # kinds


def of(archive, folder, **changes):
    """Whether one more drop looks like the machine's."""
    raw, machine = files(folder, 90)
    drop = as_drop(filing(raw, machine, seed=90, dropped="2021-01-01", **changes))
    return likeness(archive, drop.entry, drop.features)


def times(factor, *names):
    return {(name, end): factor for name in names for end in (*ENDS, "")}


def test_a_drop_of_the_machine_is_not_strange(empty, tmp_path):
    fill(empty, tmp_path, 6)
    found = of(empty, tmp_path)
    assert len(found.compared) == ALL
    assert found.far == ()


@pytest.mark.parametrize(
    ("values", "far"),
    [
        (times(1.5, "gap_um", "gap_centre_y_um"), 2),  # worn
        (times(-1.0, "levitated_x_um", "levitated_y_um"), 1),  # another set-point
        (times(3.0, "levitated_noise_um", "levitated_1x_um"), 2),  # other probes, other balance
        ({("gap_um", "DE"): 1.5}, 1),
    ],
)
def test_what_changes_on_a_machine_is_not_another_machine(empty, tmp_path, values, far):
    fill(empty, tmp_path, 6)
    found = of(empty, tmp_path, values=values)
    assert len(found.far) == far
    assert not found.strange


def test_another_machine_is_flagged_at_three_earlier_drops_and_not_before(empty, tmp_path):
    values = times(1.5, "gap_um", "gap_centre_x_um", "levitated_noise_um", "decay_time_s")
    fill(empty, tmp_path, 2)
    assert of(empty, tmp_path, values=values).compared == ()
    fill_more(empty, tmp_path)
    found = of(empty, tmp_path, values=values)
    assert found.strange
    assert len(found.far) == 4


def fill_more(archive, folder):
    raw, machine = files(folder, 2)
    archive.add(filing(raw, machine, seed=2, dropped="2020-01-03T00:00:00Z"), raw, machine)


def test_what_changed_one_by_one_is_not_another_machine(empty, tmp_path):
    """Each change is the machine's own and widens what is usual of it; only a strange drop does not."""
    fill(empty, tmp_path, 4)
    values = {}
    for seed, name in enumerate(("gap_um", "levitated_noise_um", "levitated_1x_um", "decay_time_s"), start=40):
        values |= times(2.0, name)
        add(empty, tmp_path, seed, dropped=f"2020-02-{seed - 30}", values=values)
    assert of(empty, tmp_path, values=values).far == ()


def test_at_another_speed_only_what_does_not_hang_on_it_is_compared(empty, tmp_path):
    fill(empty, tmp_path, 6)
    found = of(empty, tmp_path, speed=150.0, values=times(3.0, "levitated_1x_um"))
    assert len(found.compared) == ALL - 1
    assert found.far == ()


def test_after_an_overhaul_under_another_word_it_begins_anew(empty, tmp_path):
    fill(empty, tmp_path, 6)
    assert of(empty, tmp_path, assembly="overhauled", values=times(2.0, "gap_um")).compared == ()


def test_the_shipped_years_hold_one_machine_wear_included(years):
    for entry in years.entries():
        found = likeness(years, entry, years.filing(entry.id).features)
        assert not found.strange, (entry.raw_name, found.far)


def test_a_record_of_another_machine_under_this_name_is_told_and_not_refused(years):
    name = years.machines()[0]
    other = load_machine(shipped("coastdown/machine.toml")).model_copy(update={"name": name})
    record = read(shipped("coastdown/drop_100.nc"))
    del record.attrs["machine"]  # it would say so itself
    drop = as_drop(study_record(record, other, "0" * 64, dropped="2021-12-01T00:00:00Z"))  # before the wear
    comparison = compare(years, drop)
    verdict = verdict_of(comparison)
    assert comparison.likeness.strange
    assert verdict.alarm
    assert verdict.reasons[0].startswith("looks like a drop of another machine")
    told = comparison_json(Judged(comparison))["another_machine"]
    assert told["flag"] and len(told["far"]) >= 3


def test_adding_a_drop_of_another_machine_is_told_and_filed(capsys, tmp_path):
    own, folder = tmp_path / "own.toml", tmp_path / "archive"
    text = shipped("coastdown/machine.toml").read_text()
    name = load_machine(YEARS / "machine.toml").name
    mine = load_machine(shipped("coastdown/machine.toml")).name
    assert text.count(f'"{mine}"') == 1
    own.write_text(text.replace(f'"{mine}"', f'"{name}"'))
    first = [str(YEARS / f"drop_0{i}.nc") for i in (1, 2, 3)]
    other = [str(shipped("coastdown/drop_100.nc")), "--json", str(tmp_path / "f.json")]
    for machine, records in ((str(YEARS / "machine.toml"), first), (str(own), other)):
        with pytest.raises(SystemExit) as stop:
            main(["archive", "add", "--archive", str(folder), machine, *records])
        assert stop.value.code == 0
        out, err = capsys.readouterr()
        assert ("looks like a drop of another machine" in err) == (records == other)
    assert "1 of 1 records are in" in out
    assert "another machine" in json.loads((tmp_path / "f.json").read_text())["records"][0]["remark"]


def test_filed_and_unfiled_look_the_same(years):
    entry = years.entries()[-1]
    assert compare(years, filed_drop(years, entry.id)).likeness == likeness(
        years, entry, years.filing(entry.id).features
    )


def test_a_record_that_names_another_machine_is_told_with_both_names_and_counts_for_nothing(years, tmp_path, capsys):
    folder = tmp_path / "archive"
    shutil.copytree(years.folder, folder)
    own, other = str(YEARS / "machine.toml"), str(shipped("short/drop_210.nc"))
    names = ("Compressor rotor with two wheels", "Generator rotor on two radial magnetic bearings")

    def run(*arguments):
        with pytest.raises(SystemExit) as stop:
            main([*arguments])
        return stop.value.code, *capsys.readouterr()

    code, out, _ = run("analyse", own, other)
    assert code == 0
    assert all(name in out for name in names)
    code, out, _ = run("compare", "--archive", str(folder), "--machine", own, other, "--fail-on", "alarm")
    assert code == 3
    assert "verdict: inspect" in out
    assert all(name in out for name in names)
    dropped = ("--dropped", "2024-06-01T00:00:00Z", "--json", str(tmp_path / "f.json"))
    code, out, err = run("archive", "add", "--archive", str(folder), own, other, *dropped)
    assert code == 0
    (line,) = [line for line in err.splitlines() if names[1] in line]
    archive = open_archive(folder)
    added = archive.entries()[-1]
    assert names[0] in line and f"tdbmon archive remove --archive {folder} {added.id}" in line
    assert names[1] in json.loads((tmp_path / "f.json").read_text())["records"][0]["remark"]
    found = compare(archive, filed_drop(archive, added.id))
    assert all(name in verdict_of(found).reasons[0] for name in names)
    assert names[1] in comparison_json(Judged(found))["another_machine"]["named"]
    assert found.life.full_drops == 10  # those before: it is no drop of this machine
    later = filed_drop(archive, archive.entries()[-2].id)
    later = replace(later, entry=replace(later.entry, id="later", moment=added.moment + 1, speed=added.speed))
    found = compare(archive, later)
    assert added.id not in [entry.id for entry in found.matched]
    assert any("drop_210.nc (machine" in remark for remark in found.remarks)
    assert found.life.full_drops == 11  # the ten and itself


def test_a_drop_of_bad_probes_does_not_make_another_machine_look_like_this_one(empty, tmp_path):
    values = times(1.5, "gap_um", "gap_centre_x_um", "levitated_noise_um", "decay_time_s")
    fill(empty, tmp_path, 5)
    raw, machine = files(tmp_path, 50)
    checks = ("probe scales NDE_A",)
    empty.add(filing(raw, machine, seed=50, dropped="2020-02-01", values=values, failed_checks=checks), raw, machine)
    assert of(empty, tmp_path, values=values).strange
