"""`tdbmon archive` and `tdbmon compare` as a user meets them."""

from __future__ import annotations

import csv
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from tdbsim.errors import InputError
from tdbsim.machine import load_machine

from tdbmon import __version__
from tdbmon.cli import main
from tdbmon.history import batch
from tdbmon.history.archive import open_archive
from tdbmon.history.export import export
from tdbmon.shipped import shipped
from tests.history.conftest import YEARS
from tests.history.made import add, files, filing, fill

MACHINE = str(YEARS / "machine.toml")
OTHER = str(shipped("short/machine.toml"))


def run(capsys, *arguments):
    """Run a command in this process; return exit code, output and errors."""
    with pytest.raises(SystemExit) as stop:
        main([str(argument) for argument in arguments])
    out, err = capsys.readouterr()
    return stop.value.code, out, err


def test_from_records_to_a_verdict(capsys, tmp_path):
    folder = tmp_path / "archive"
    records = [YEARS / f"drop_{i:02d}.nc" for i in (1, 2)]
    code, out, err = run(
        capsys, "archive", "add", "--archive", folder, MACHINE, *records, "--json", tmp_path / "a.json"
    )
    assert (code, err) == (0, "")
    assert "2 of 2 records are in" in out
    assert [r["state"] for r in json.loads((tmp_path / "a.json").read_text())["records"]] == ["filed", "filed"]
    code, out, _ = run(capsys, "archive", "list", "--archive", folder)
    assert (code, out.count("synthetic")) == (0, 2)
    drop = out.splitlines()[1].split()[0]
    code, out, _ = run(capsys, "archive", "show", "--archive", folder, drop[:6], "--json", tmp_path / "s.json")
    assert code == 0
    assert re.search(r"gap_um +NDE +[\d.]+ um \([\d.]+ to [\d.]+\)\n", out)
    assert json.loads((tmp_path / "s.json").read_text())["drop"] == drop
    code, out, _ = run(capsys, "archive", "verify", "--archive", folder)
    assert (code, "sound, 2 drops" in out) == (0, True)
    # a record that is not filed is compared and stays unfiled
    code, out, _ = run(capsys, "compare", "--archive", folder, YEARS / "drop_03.nc", "--fail-on", "alarm")
    assert code == 0  # too few drops are no alarm
    assert "verdict: too few drops" in out
    code, out, _ = run(capsys, "archive", "remove", "--archive", folder, drop)
    assert code == 0
    code, out, _ = run(capsys, "archive", "list", "--archive", folder)
    assert out.count("synthetic") == 1


def test_an_alarm_fails_only_where_it_shall(capsys, years, tmp_path):
    drops = [entry.id for entry in years.entries()]
    assert run(capsys, "compare", "--archive", years.folder, drops[7])[0] == 0
    assert run(capsys, "compare", "--archive", years.folder, drops[7], "--fail-on", "alarm")[0] == 3
    assert run(capsys, "compare", "--archive", years.folder, drops[6], "--fail-on", "alarm")[0] == 0
    target = tmp_path / "c.json"
    code, out, _ = run(capsys, "compare", "--archive", years.folder, "--json", target)
    assert (code, "verdict: changed" in out) == (0, True)
    assert json.loads(target.read_text())["drop"] == drops[-1]


def test_what_was_found_is_said_though_a_report_fails(capsys, years, tmp_path, monkeypatch):
    """A figure that cannot be drawn took the verdict with it."""

    def fails(*_):
        raise RuntimeError("no figure")

    monkeypatch.setattr("tdbmon.report.html.write_html", fails)
    last = ("compare", "--archive", str(years.folder), "--report", str(tmp_path / "r.html"))
    with pytest.raises(RuntimeError, match="no figure"):
        main(last)
    assert "verdict: changed" in capsys.readouterr().out


def test_a_filed_record_by_its_file_is_the_filed_drop(capsys, years):
    by_file = run(capsys, "compare", "--archive", years.folder, YEARS / "drop_08.nc")[1]
    assert by_file == run(capsys, "compare", "--archive", years.folder, years.entries()[7].id)[1]


@pytest.fixture
def quick(monkeypatch):
    """A study that makes its numbers up, and the forces that it was asked for."""
    asked = []

    def study(order, progress):
        asked.append(order.forces)
        stress = 3e9 if order.forces else None
        name = load_machine(order.machine).name
        made = filing(order.record, order.machine, name=name, stress=stress, dropped="2020-01-01", version=__version__)
        return replace(made, filed=order.filed)

    monkeypatch.setattr(batch, "study", study)
    return asked


def test_a_drop_with_forces_that_is_analysed_again_keeps_them(capsys, tmp_path, quick):
    """The stresses left the history without a word, where a newer version or machine file came and --forces was left out."""
    folder, machine, mended = tmp_path / "archive", tmp_path / "machine.toml", tmp_path / "mended.toml"
    record, _ = files(tmp_path, 1)
    machine.write_text(Path(MACHINE).read_text())
    mended.write_text(Path(MACHINE).read_text() + "# mended\n")
    assert run(capsys, "archive", "add", "--archive", folder, "--forces", machine, record)[::2] == (0, "")
    code, out, err = run(capsys, "archive", "add", "--archive", folder, mended, record)
    assert "already filed, so not analysed again: analysed 1 drop with another machine file; use --again" in out
    assert (code, err, quick) == (0, "", [True])
    code, out, err = run(capsys, "archive", "add", "--again", "--archive", folder, mended, record)
    assert (code, "analysed again" in out, err) == (0, True, "")
    assert quick == [True, True]
    (entry,) = open_archive(folder).entries()
    assert open_archive(folder).filing(entry.id).stress
    assert "already filed" in run(capsys, "archive", "add", "--archive", folder, mended, record)[1]


def test_the_machine_file_that_is_given_last_counts_though_it_was_given_before(capsys, tmp_path, quick):
    """It was "already filed", and the result by the file in between went on to count."""
    folder, machine, other = tmp_path / "archive", tmp_path / "machine.toml", tmp_path / "other.toml"
    record, _ = files(tmp_path, 1)
    machine.write_text(Path(MACHINE).read_text())
    other.write_text(Path(MACHINE).read_text() + "# tried\n")
    for path in (machine, other, machine):
        said = run(capsys, "archive", "add", "--again", "--archive", folder, path, record)[1]
        assert "already filed" not in said
        (entry,) = open_archive(folder).entries()
        assert open_archive(folder).machine_file(entry.id).read_text() == path.read_text()
    assert "already filed" in run(capsys, "archive", "add", "--again", "--archive", folder, machine, record)[1]
    assert len(quick) == 3


def test_forces_that_no_longer_count_since_they_were_left_out_are_told_with_the_cure(capsys, tmp_path, quick):
    folder, machine, mended = tmp_path / "archive", tmp_path / "machine.toml", tmp_path / "mended.toml"
    record, _ = files(tmp_path, 1)
    machine.write_text(Path(MACHINE).read_text())
    mended.write_text(Path(MACHINE).read_text() + "# mended\n")
    run(capsys, "archive", "add", "--archive", folder, "--forces", machine, record)
    code, _, err = run(capsys, "archive", "add", "--again", "--archive", folder, "--no-forces", mended, record)
    assert code == 0
    assert f"drop_1.nc: its result with forces, by tdbmon {__version__}, is kept but no longer used" in err
    assert f"tdbmon archive add --again --archive {folder} --forces {mended} {record}" in err
    # who leaves them out has them left out
    assert "already filed" in run(capsys, "archive", "add", "--archive", folder, mended, record)[1]
    assert run(capsys, "archive", "add", "--archive", folder, "--forces", mended, record)[::2] == (0, "")
    assert quick == [True, False, True]


def test_a_new_drop_is_filed_without_forces_unless_they_are_asked_for(capsys, tmp_path, quick):
    record, _ = files(tmp_path, 1)
    assert run(capsys, "archive", "add", "--archive", tmp_path / "archive", MACHINE, record)[::2] == (0, "")
    assert not open_archive(tmp_path / "archive").filing(open_archive(tmp_path / "archive").entries()[0].id).forces


def test_forces_are_added_to_a_drop_that_lacks_them_unless_the_machine_file_is_another(capsys, tmp_path, quick):
    folder, machine, mended = tmp_path / "archive", tmp_path / "machine.toml", tmp_path / "mended.toml"
    record, _ = files(tmp_path, 1)
    machine.write_text(Path(MACHINE).read_text())
    mended.write_text(Path(MACHINE).read_text() + "# mended\n")
    run(capsys, "archive", "add", "--archive", folder, machine, record)
    assert "not analysed again" in run(capsys, "archive", "add", "--archive", folder, "--forces", mended, record)[1]
    assert "analysed again" in run(capsys, "archive", "add", "--archive", folder, "--forces", machine, record)[1]
    assert [bool(forces) for forces in quick] == [False, True]


def test_the_json_of_an_add_says_of_each_record_what_is_wrong_with_it(capsys, tmp_path, monkeypatch):
    """Four failed checks were told on standard error alone, and the remark in the JSON was empty."""
    records = [files(tmp_path, i)[0] for i in range(4)]
    checks = {"drop_0.nc": ("fall DE", "free fall DE"), "drop_1.nc": ("present speed",), "drop_2.nc": ("date",)}

    def study(order, progress):
        failed = checks.get(order.record.name, ())
        dropped = "" if "date" in failed else f"2020-01-0{order.record.stem[-1]}T09:00:00Z"
        name = load_machine(order.machine).name
        seed = int(order.record.stem[-1])
        return filing(order.record, order.machine, name=name, dropped=dropped, failed_checks=failed, seed=seed + 1)

    monkeypatch.setattr(batch, "study", study)
    target = tmp_path / "a.json"
    code, _, err = run(capsys, "archive", "add", "--archive", tmp_path / "a", MACHINE, *records, "--json", target)
    rows = json.loads(target.read_text())["records"]
    assert code == (2 if any(row["state"] == "failed" for row in rows) else 0)
    turned, lacking, undated, sound = rows
    assert (turned["failed_checks"], turned["reference"]) == (["fall DE", "free fall DE"], False)
    assert "no drop is compared with it" in turned["remark"]
    assert (lacking["failed_checks"], lacking["reference"], lacking["counted"]) == (["present speed"], True, True)
    assert undated["remarks"][1] == "made up"  # the detail of the check, which quotes the date
    assert any(
        "states no readable time of the drop: it counts as earlier" in each for each in undated["remarks"]
    )
    assert (sound["failed_checks"], sound["reference"], sound["remark"]) == ([], True, "")
    for row in rows:
        assert all(remark in err for remark in row["remarks"])


def test_an_ambiguous_date_is_quoted_where_the_record_is_filed(capsys, tmp_path):
    from tdbmon.record.read import read, write

    drop = read(YEARS / "drop_01.nc")
    drop.attrs["drop_time"], drop.attrs["date"] = "03/04/2020 06:12:33", ""
    write(drop, tmp_path / "a.nc")
    code, _, err = run(capsys, "archive", "add", "--archive", tmp_path / "a", MACHINE, tmp_path / "a.nc")
    assert code == 0
    assert (
        "a.nc: the file states '03/04/2020 06:12:33' as its date, which may be 2020-04-03T06:12:33 or 2020-03-04" in err
    )
    assert "it counts as earlier than all drops with a time" in err
    stated = ["--dropped", "2020-03-04T06:12:33", MACHINE, tmp_path / "a.nc"]
    assert run(capsys, "archive", "add", "--archive", tmp_path / "b", *stated)[2] == ""


def test_the_table_for_other_tools(capsys, years, tmp_path):
    code, out, _ = run(capsys, "archive", "export", "--archive", years.folder, "--out", tmp_path / "f.csv")
    assert code == 0
    with (tmp_path / "f.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == int(out.split()[0])
    assert {row["drop_id"] for row in rows} == {entry.id for entry in years.entries()}
    pytest.importorskip("pyarrow")
    assert run(capsys, "archive", "export", "--archive", years.folder, "--out", tmp_path / "f.parquet")[0] == 0
    table = pd.read_parquet(tmp_path / "f.parquet")
    gap = table[(table.name == "gap_um") & (table.end == "DE") & table.current].value.dropna()
    assert len(table) == len(rows)
    assert gap.between(200, 350).all()
    assert len(gap) >= 8


def test_an_archive_that_cannot_be_written_to_can_be_read(capsys, years, tmp_path):
    folder = tmp_path / "archive"
    shutil.copytree(years.folder, folder)
    for path in [folder, *folder.rglob("*")]:
        path.chmod(path.stat().st_mode & ~0o222)
    try:
        assert run(capsys, "archive", "list", "--archive", folder)[0] == 0
        assert run(capsys, "compare", "--archive", folder)[0] == 0
    finally:
        for path in [folder, *folder.rglob("*")]:
            path.chmod(path.stat().st_mode | 0o200)


def test_a_filed_drop_is_found_by_its_records_name(capsys, years, empty, tmp_path, monkeypatch):
    """Reports name drops by their records."""
    monkeypatch.chdir(tmp_path)  # where no such file is
    code, out, _ = run(capsys, "compare", "--archive", str(years.folder), "drop_09.nc")
    assert code == 0
    assert out.startswith("drop e944eaa488ac (drop_09.nc)")
    first = fill(empty, tmp_path / "first", 1)[0].drop
    raw, machine = files(tmp_path, 7)
    raw = raw.rename(tmp_path / "drop_0.nc")
    other = filing(raw, machine, name="another", seed=7)
    empty.add(other, raw, machine)
    with pytest.raises(InputError, match="2 drops have a record named 'drop_0.nc'") as caught:
        empty.entry("drop_0.nc")
    assert f"{first} of made up" in str(caught.value)
    assert f"{other.drop} of another" in str(caught.value)


def test_the_times_of_the_table_are_of_one_format_beside_their_order(empty, tmp_path):
    """Times with and without a zone stood in one column, which pandas refused, and nothing told the order."""
    times = ("2020-01-03T09:00:00", "2020-01-02", "", "2020-01-03T09:30:00.5+01:00")
    for i, dropped in enumerate(times):
        add(empty, tmp_path, i, dropped=dropped)
    add(empty, tmp_path, 9, name="another", dropped="2019-01-01")
    export(empty, tmp_path / "f.csv")
    table = pd.read_csv(tmp_path / "f.csv")
    drops = table[table.machine == "made up"].drop_duplicates("drop_id").set_index("raw_name")
    found = pd.to_datetime(drops.dropped)
    assert str(found["drop_0.nc"]) == "2020-01-03 09:00:00+00:00"
    assert str(found["drop_3.nc"]) == "2020-01-03 08:30:00.500000+00:00"
    assert pd.isna(found["drop_2.nc"])
    assert drops.place.to_dict() == {"drop_2.nc": 1, "drop_1.nc": 2, "drop_3.nc": 3, "drop_0.nc": 4}
    assert set(table[table.machine == "another"].place) == {1}


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["archive", "list", "--archive", "nowhere"], "nowhere: no archive"),
        (["archive", "add", "--archive", "new", "nowhere.toml", "nowhere.nc"], "nowhere.toml"),
        (["archive", "add", "--archive", "new", MACHINE, "a.nc", "--dropped", "yesterday"], "--dropped 'yesterday'"),
        (["archive", "add", "--archive", "new", MACHINE, "a.nc", "b.nc", "--dropped", "2020-01-01"], "one by one"),
        (["archive", "show", "--archive", "ARCHIVE", "ffffffffffff"], "no drop 'ffffffffffff'"),
        (["archive", "show", "--archive", "ARCHIVE", "ffffffffffff"], "lists the filed drops"),
        (["archive", "show", "--archive", "ARCHIVE", "drop_1.nc"], "did you mean 'drop_"),
        (["archive", "remove", "--archive", "ARCHIVE", ""], "no drop ''"),
        (["archive", "export", "--archive", "ARCHIVE", "--out", "f.xlsx"], ".csv or .parquet"),
        (["archive", "list", "--archive", "ARCHIVE", "--json", "nowhere/f.json"], "nowhere does not exist"),
        (["archive", "verify", "--archive", "ARCHIVE", "--json", "nowhere/f.json"], "nowhere does not exist"),
        (["archive", "report", "--archive", "ARCHIVE"], "no --report file"),
        (["archive", "list", "--archive", "ARCHIVE", "--machine", "Compresor rotor"], "did you mean 'Compressor rotor"),
        (["compare", "--archive", "ARCHIVE", "nowhere.nc"], "nowhere.nc: no such file"),
        (["compare", "--archive", "ARCHIVE", "--machine", "nowhere.toml"], "nowhere.toml"),
        (
            ["compare", "--archive", "ARCHIVE", "--machine", OTHER],
            "but drop 1e9d536f2c65 (drop_10.nc) is filed under machine",
        ),
        (
            ["compare", "--archive", "ARCHIVE", "0810", "--forces"],
            "drop 0810c0837e77 (drop_01.nc) is filed without forces",
        ),
        (["compare", "--archive", "ARCHIVE", str(YEARS / "drop_01.nc"), "--forces"], "tdbmon archive add --archive"),
        (["compare", "--archive", "ARCHIVE", "--fail-on", "everything"], "--fail-on alarm"),
        (["compare", "--archive", "ARCHIVE", str(YEARS / "machine.toml")], "machine.toml"),
    ],
)
def test_a_wrong_input_is_one_line_and_exit_code_two(capsys, years, arguments, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, _, err = run(capsys, *[str(years.folder) if a == "ARCHIVE" else a for a in arguments])
    assert code == 2
    assert err.startswith("tdbmon: ")
    assert err.count("\n") == 1
    assert says in err


def test_what_failed_is_told_line_by_line_and_the_code_is_two(capsys, tmp_path):
    (tmp_path / "empty.nc").touch()
    code, out, err = run(
        capsys, "archive", "add", "--archive", tmp_path / "a", MACHINE, tmp_path / "empty.nc", YEARS / "drop_01.nc"
    )
    assert code == 2
    assert "1 of 2 records" in out
    assert err.count("\n") == 1
    assert "is empty" in err


def test_drops_of_one_time_stamp_are_refused_in_one_line(capsys, tmp_path, monkeypatch):
    """A clock that stood still; each had a long line of its own, all alike but for the name."""

    def study(order, progress):
        seed = int(order.record.stem[-1])
        made = filing(order.record, order.machine, seed=seed, dropped="2020-01-01T09:30:05Z")
        return replace(made, machine=load_machine(order.machine).name, filed=order.filed)

    monkeypatch.setattr(batch, "study", study)
    records = [files(tmp_path, i)[0] for i in range(4)]
    code, out, err = run(capsys, "archive", "add", "--archive", tmp_path / "a", MACHINE, *records)
    assert code == 2
    assert "1 of 4 records" in out
    (line,) = err.splitlines()
    assert "each of drop_1.nc, drop_2.nc, drop_3.nc: states the same time" in line
    assert "(drop_0.nc)" in line and "--dropped TIME" in line


def test_verify_with_a_fault_is_code_two_and_rebuild_mends_the_catalogue(capsys, years, tmp_path):
    folder = tmp_path / "archive"
    shutil.copytree(years.folder, folder)
    (folder / "catalogue.sqlite").write_bytes(b"rubbish" * 1000)
    code, _, err = run(capsys, "archive", "verify", "--archive", folder)
    assert code == 2
    assert "--rebuild" in err
    assert run(capsys, "archive", "verify", "--archive", folder, "--rebuild")[0] == 0
    assert run(capsys, "archive", "verify", "--archive", folder)[0] == 0


def test_a_machine_whose_name_is_written_otherwise_is_told(capsys, tmp_path):
    other = tmp_path / "machine.toml"
    other.write_text(Path(MACHINE).read_text().replace("Compressor rotor with two", "compressor rotor  with two"))
    assert run(capsys, "archive", "add", "--archive", tmp_path / "a", MACHINE, YEARS / "drop_01.nc")[2] == ""
    code, _, err = run(capsys, "archive", "add", "--archive", tmp_path / "a", other, YEARS / "drop_02.nc")
    assert code == 0
    assert (
        "machine 'compressor rotor  with two wheels': drops of 'Compressor rotor with two wheels' are also filed" in err
    )


def test_a_drop_without_its_raw_file_is_told_with_the_cure(capsys, years, tmp_path):
    folder = tmp_path / "archive"
    shutil.copytree(years.folder, folder)
    (folder / years.entries()[0].raw).unlink()
    code, _, err = run(
        capsys, "archive", "report", "--archive", folder, "--drop", "0810", "--report", tmp_path / "d.html"
    )
    assert code == 2
    assert "is missing; restore it by adding drop_01.nc again" in err
