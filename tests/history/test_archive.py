"""The archive: whole whatever happens, the same after any repetition, and honest about what is not as it was filed."""

from __future__ import annotations

import errno
import json
import os
import sqlite3
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import netCDF4
import pytest
from tdbsim.errors import InputError

from tdbmon import atomic
from tdbmon.history import catalogue, result_file
from tdbmon.history.archive import open_archive
from tdbmon.history.result_file import read_result
from tdbmon.history.verify import rebuild, verify
from tests.history.made import files, filing, fill, newer, wrong

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="kills a forked process")
def test_killed_at_200_random_instants_the_archive_is_whole_and_the_add_can_be_repeated(tmp_path):
    done = subprocess.run(
        [sys.executable, "-W", "error", "-m", "tests.history.killed", str(tmp_path), "200"],
        capture_output=True, text=True, cwd=ROOT, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"}, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout)
    assert seen["kills"] == 200
    assert seen["unfinished"] > 20  # the kills did hit writers in the middle of an add
    assert seen["faults"] == []
    assert seen["lost"] == 0
    assert set(seen["repeated"]) <= {"filed", "already filed"}


def test_two_writers_at_once_file_every_drop_once(tmp_path):
    program = (
        "import sys; from pathlib import Path; from tdbmon.history.archive import open_archive\n"
        "from tests.history.made import files, filing\n"
        "folder = Path(sys.argv[1]); archive = open_archive(folder / 'archive', create=True)\n"
        "order = range(30) if sys.argv[2] == 'up' else reversed(range(30))\n"
        "for i in order:\n"
        "    raw, machine = files(folder / sys.argv[2], i)\n"
        "    print(archive.add(filing(raw, machine, seed=i, few=True), raw, machine))\n"
    )
    writers = [
        subprocess.Popen(
            [sys.executable, "-c", program, str(tmp_path), way], cwd=ROOT, stdout=subprocess.PIPE, text=True
        )
        for way in ("up", "down")
    ]
    said = [line for writer in writers for line in writer.communicate()[0].splitlines()]
    assert [writer.returncode for writer in writers] == [0, 0]
    assert said.count("filed") == 30
    assert said.count("already filed") == 30
    archive = open_archive(tmp_path / "archive")
    assert len(archive.entries()) == 30
    assert verify(archive) == []


def test_an_archive_that_another_process_creates_meanwhile_is_opened(empty, monkeypatch):
    """It was "not an archive and not empty"."""
    exists, asked = Path.exists, []

    def not_at_first(path):
        if path.name == "archive.toml" and not asked:
            asked.append(path)
            return False
        return exists(path)

    monkeypatch.setattr(Path, "exists", not_at_first)
    assert open_archive(empty.folder, create=True).entries() == empty.entries()
    assert asked


def test_a_result_file_gives_back_what_was_filed(empty, tmp_path):
    raw, machine = files(tmp_path, 1)
    made = filing(raw, machine, stress=3e9)
    empty.add(made, raw, machine)
    read = empty.filing(made.drop)
    assert replace(read, features=(), stress=()) == replace(made, features=(), stress=())
    for mine, theirs in zip(made.features, read.features, strict=True):
        assert (mine.name, mine.end, mine.estimate.unit) == (theirs.name, theirs.end, theirs.estimate.unit)
        assert theirs.estimate.value == pytest.approx(mine.estimate.value, rel=1e-12)
        assert theirs.estimate.low == pytest.approx(mine.estimate.low, rel=1e-12)
    assert read.stress[0].greatest == pytest.approx(3e9)
    assert read.stress[0].outliers == pytest.approx((0.9 * 3e9,))
    with netCDF4.Dataset(next((empty.folder / "results").glob("*/*.nc"))) as file:
        assert file.Conventions.startswith("CF-1.")


def test_the_raw_file_is_kept_byte_for_byte(empty, tmp_path):
    raw, machine = files(tmp_path, 1)
    made = filing(raw, machine)
    empty.add(made, raw, machine)
    kept = empty.folder / empty.entry(made.drop).raw
    assert kept.stem == made.sha256
    assert kept.read_bytes() == raw.read_bytes()
    assert empty.machine_file(made.drop).read_bytes() == machine.read_bytes()


def test_the_same_drop_twice_changes_nothing(empty, tmp_path):
    (made,) = fill(empty, tmp_path, 1)
    before = {path: path.read_bytes() for path in sorted(empty.folder.rglob("*")) if path.is_file()}
    raw, machine = files(tmp_path, 0)
    assert empty.add(made, raw, machine) == "already filed"
    assert {path: path.read_bytes() for path in sorted(empty.folder.rglob("*")) if path.is_file()} == before


def test_a_file_of_another_machine_is_refused(empty, tmp_path):
    fill(empty, tmp_path, 1)
    raw, machine = files(tmp_path, 0)
    with pytest.raises(InputError, match="already filed as a drop of machine 'made up', not 'other'"):
        empty.add(filing(raw, machine, name="other"), raw, machine)


def test_a_newer_version_keeps_the_old_results(empty, tmp_path):
    (old,) = fill(empty, tmp_path, 1)
    raw, machine = files(tmp_path, 0)
    assert empty.add(newer(old, "0.10.0"), raw, machine) == "analysed again"
    assert empty.filing(old.drop).version == "0.10.0"
    # an older one that comes late does not take its place: 0.9 is older than 0.10
    assert empty.add(newer(old, "0.9.0"), raw, machine) == "analysed again"
    assert empty.filing(old.drop).version == "0.10.0"
    assert len(list((empty.folder / "results" / old.drop).glob("*.nc"))) == 3
    assert rebuild(empty) == []
    assert empty.filing(old.drop).version == "0.10.0"


@pytest.mark.parametrize("where", ["raw", "results", "machines"])
def test_verify_finds_a_flipped_bit(empty, tmp_path, where):
    fill(empty, tmp_path, 3)
    assert verify(empty) == []
    file = sorted(path for path in (empty.folder / where).rglob("*") if path.is_file())[0]
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)
    (fault,) = wrong(empty)
    assert file.name in fault
    assert "differs from the filed version" in fault


@pytest.mark.parametrize("where", ["raw", "results", "machines"])
def test_verify_finds_a_missing_file(empty, tmp_path, where):
    fill(empty, tmp_path, 3)
    file = sorted(path for path in (empty.folder / where).rglob("*") if path.is_file())[0]
    file.unlink()
    (fault,) = wrong(empty)
    assert file.name in fault
    assert "missing" in fault


def test_a_catalogue_that_disagrees_is_found_and_rebuilt_from_the_files(empty, tmp_path):
    fill(empty, tmp_path, 3)
    entries = empty.entries()
    with sqlite3.connect(empty.catalogue) as base:
        base.execute("UPDATE feature_values SET value = value * 1.001 WHERE name = 'gap_um' AND end = 'DE'")
    base.close()
    assert len(wrong(empty)) == 3
    assert all("differs in gap_um DE" in fault for fault in wrong(empty))
    assert rebuild(empty) == []
    assert verify(empty) == []
    assert [replace(entry, result=0) for entry in empty.entries()] == [replace(entry, result=0) for entry in entries]


@pytest.mark.parametrize("damage", ["garbage", "gone", "truncated"])
def test_a_lost_catalogue_is_made_anew(empty, tmp_path, damage):
    made = fill(empty, tmp_path, 3)
    if damage == "gone":
        empty.catalogue.unlink()
    elif damage == "garbage":
        empty.catalogue.write_bytes(b"not a database at all" * 100)
    else:
        empty.catalogue.write_bytes(empty.catalogue.read_bytes()[:5000])
    assert rebuild(empty) == []
    assert [entry.id for entry in empty.entries()] == [one.drop for one in made]
    assert verify(empty) == []


def test_an_archive_of_an_older_version_is_brought_up_to_date_and_nothing_is_lost(empty, tmp_path, monkeypatch):
    made = fill(empty, tmp_path, 3)
    monkeypatch.setattr(catalogue, "SCHEMA", catalogue.SCHEMA + 1)
    again = open_archive(empty.folder)
    assert [entry.id for entry in again.entries()] == [one.drop for one in made]
    assert (empty.folder / "catalogue.old-1.sqlite").exists()
    with sqlite3.connect(again.catalogue) as base:
        assert base.execute("PRAGMA user_version").fetchone()[0] == catalogue.SCHEMA
    base.close()


def test_a_drop_whose_raw_file_is_lost_stays_where_the_catalogue_is_made_anew(empty, tmp_path, monkeypatch):
    """An update of the program left it out of all comparisons, and said nothing."""
    made = fill(empty, tmp_path, 3)
    before = empty.entries()
    (empty.folder / before[1].raw).unlink()
    monkeypatch.setattr(catalogue, "SCHEMA", catalogue.SCHEMA + 1)
    again = open_archive(empty.folder)
    assert [replace(entry, result=0) for entry in again.entries()] == [replace(entry, result=0) for entry in before]
    (fault,) = wrong(again)
    assert fault == f"{before[1].raw}: missing; restore the record drop_1.nc by adding it again"
    raw, machine = files(tmp_path, 1)
    assert again.add(made[1], raw, machine) == "analysed again"
    assert verify(again) == []


def test_results_that_cannot_be_read_are_told_where_the_catalogue_is_made_anew(empty, tmp_path, monkeypatch):
    """Their drops were gone from the history without a word, and `verify` took them for an add that was stopped."""
    made = fill(empty, tmp_path, 3)
    (file,) = (empty.folder / "results" / made[1].drop).glob("*.nc")
    file.write_bytes(b"no result")
    monkeypatch.setattr(catalogue, "SCHEMA", catalogue.SCHEMA + 1)
    with pytest.raises(InputError, match=r"without 1 file that cannot be read \(results/.* add these drops again"):
        open_archive(empty.folder)
    (fault,) = wrong(open_archive(empty.folder))
    assert "cannot be read as a result" in fault


def test_a_drop_without_a_time_keeps_its_place_where_an_earlier_machine_file_counts_again(empty, tmp_path):
    """Its first result was overwritten, and with it the time of its first filing: it became the latest of them."""
    made = []
    for i in range(2):
        raw, machine = files(tmp_path, i)
        made.append(replace(filing(raw, machine, seed=i), filed=f"2026-01-0{i + 1}T00:00:00+00:00"))
        empty.add(made[i], raw, machine)
    raw, machine = files(tmp_path, 0)
    other = tmp_path / "other.toml"
    other.write_text('name = "made up"\nnote = "another"\n')
    for number, file in enumerate((other, machine), start=3):
        again = filing(raw, file, seed=0)
        assert empty.add(replace(again, filed=f"2026-01-0{number}T00:00:00+00:00"), raw, file) == "analysed again"
    assert [entry.id for entry in empty.entries()] == [one.drop for one in made]
    before = empty.entries()
    assert before[0].filed == "2026-01-01T00:00:00+00:00"
    assert rebuild(empty) == []
    assert [replace(entry, result=0) for entry in empty.entries()] == [replace(entry, result=0) for entry in before]
    assert empty.result(empty.entries()[0].id).machine_sha256 == made[0].machine_sha256


def test_a_drop_that_is_filed_while_the_catalogue_is_made_anew_is_in_it(empty, tmp_path, monkeypatch):
    """Another writer waits for the lock; it did not, and what it filed was lost from the catalogue."""
    fill(empty, tmp_path, 2)
    monkeypatch.setattr(catalogue, "_WAIT_S", 0.1)
    raw, machine = files(tmp_path, 7)
    refused = []

    def file_one_more(_: str) -> None:
        try:
            empty.add(filing(raw, machine, seed=7), raw, machine)
        except InputError as error:
            refused.append(str(error))

    assert rebuild(empty, file_one_more) == []
    assert all("another program is using it" in each for each in refused)
    assert len(empty.entries()) == (2 if refused else 3)
    assert verify(empty) == []


def test_a_catalogue_of_a_newer_version_is_left_alone(empty, tmp_path):
    fill(empty, tmp_path, 1)
    with sqlite3.connect(empty.catalogue) as base:
        base.execute(f"PRAGMA user_version = {catalogue.SCHEMA + 1}")
    base.close()
    before = empty.catalogue.read_bytes()
    with pytest.raises(InputError, match="update tdbmon"):
        open_archive(empty.folder).entries()
    assert empty.catalogue.read_bytes() == before


@pytest.mark.parametrize(("code", "says"), [(errno.ENOSPC, "the disk is full"), (errno.EROFS, "cannot be written")])
@pytest.mark.parametrize("moment", [0, 1, 3])
def test_a_disk_that_is_full_or_read_only_leaves_the_archive_as_it_was(
    empty, tmp_path, monkeypatch, code, says, moment
):
    fill(empty, tmp_path, 2)
    raw, machine = files(tmp_path, 7)
    count = 0
    forced = atomic._to_disk

    def fails(path: Path) -> None:
        nonlocal count
        count += 1
        if count > moment:
            raise OSError(code, os.strerror(code))
        forced(path)

    with monkeypatch.context() as patched:
        patched.setattr(atomic, "_to_disk", fails)
        with pytest.raises(InputError, match=says):
            empty.add(filing(raw, machine, seed=7), raw, machine)
    assert count == moment + 1
    assert len(empty.entries()) == 2
    assert wrong(empty) == []
    assert empty.add(filing(raw, machine, seed=7), raw, machine) == "filed"
    assert verify(empty) == []


def test_a_full_database_is_told_and_nothing_filed(empty, tmp_path, monkeypatch):
    fill(empty, tmp_path, 1)
    connect = sqlite3.connect

    def small(*args, **options):
        base = connect(*args, **options)
        base.execute(f"PRAGMA max_page_count = {base.execute('PRAGMA page_count').fetchone()[0]}")
        return base

    raw, machine = files(tmp_path, 7)
    with monkeypatch.context() as patched:
        patched.setattr(sqlite3, "connect", small)
        with pytest.raises(InputError, match=r"full.*free some space"):
            for seed in range(7, 40):  # until the free pages are used up
                raw, machine = files(tmp_path, seed)
                empty.add(filing(raw, machine, seed=seed), raw, machine)
    assert wrong(empty) == []
    assert empty.add(filing(raw, machine, seed=seed), raw, machine) == "filed"


def test_a_drop_can_be_taken_out_again(empty, tmp_path):
    made = fill(empty, tmp_path, 3)
    assert empty.remove(made[1].drop[:8]).id == made[1].drop
    assert [entry.id for entry in empty.entries()] == [made[0].drop, made[2].drop]
    assert verify(empty) == []
    assert rebuild(empty) == []
    assert len(empty.entries()) == 2


def test_unknown_and_ambiguous_drops_are_told(empty, tmp_path):
    made = fill(empty, tmp_path, 2)
    with pytest.raises(InputError, match=f"did you mean '{made[0].drop}'"):
        empty.entry(made[0].drop[:-1] + ("0" if made[0].drop[-1] != "0" else "1"))
    with pytest.raises(InputError, match="no drop"):
        empty.entry("../results")


def test_a_result_of_a_newer_format_is_told(empty, tmp_path, monkeypatch):
    with monkeypatch.context() as later:
        later.setattr(result_file, "FORMAT", 99)
        fill(empty, tmp_path, 1)
    file = next((empty.folder / "results").glob("*/*.nc"))
    with pytest.raises(InputError, match="format 99 is of a newer tdbmon"):
        read_result(file)


def test_a_folder_with_other_things_is_no_archive(tmp_path):
    (tmp_path / "holiday.jpg").write_bytes(b"x")
    with pytest.raises(InputError, match="no archive"):
        open_archive(tmp_path)
    with pytest.raises(InputError, match=r"not empty \(holiday.jpg\)"):
        open_archive(tmp_path, create=True)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("format = 1\n[compare]\nleast_drop = 3\n", "did you mean 'least_drops'"),
        ("format = 1\n[compare]\nleast_drops = 1\n", "compare.least_drops"),
        ("format = 1\n[inspect]\nstress = '4200 N'\n", "inspect.stress"),
        ('format = 1\n[machine."a".life]\nagreed = 3\n', 'machine."a".life.agreed'),
        # of all machines, though one has a table too
        (
            'format = 1\n[compare]\nleast_drop = 3\n[machine."a".life]\nagreed_drops = 3\n',
            "unknown key 'compare.least_drop'",
        ),
        (
            'format = 1\n[inspect]\nstress = "4200 N"\n[machine."a".life]\nagreed_drops = 3\n',
            "archive.toml: inspect.stress",
        ),
        ('format = 1\n[machine]\n"a" = 5\n', 'machine."a" = 5 is not a table; write [machine."a".life]'),
        ('format = 1\n[machine."a"]\nlife = 5\n', 'machine."a".life = 5 is not a table'),
        (
            'format = 1\ncompare = 5\n[machine."a".compare]\nleast_drops = 3\n',
            "compare = 5 is not a table; write [compare]",
        ),
        ("format = 1\nmachine = 5\n", "machine = 5 is not a table"),
        (
            "format = 1\n[inspect]\ngap_growth = 20\n",
            "inspect.gap_growth = 20.0: Input should be less than or equal to 1",
        ),
        ("format = 1\n[matching]\nspeed = '5 um'\n", "matching.speed = '5 um': 'um' is not a unit"),
        ("format = 2\n", "newer tdbmon"),
        ("formt = 1\n", "'format' is missing"),
        ("format = ", "not valid TOML"),
    ],
)
def test_settings_that_cannot_be_used_are_told(empty, text, says):
    (empty.folder / "archive.toml").write_text(text)
    with pytest.raises(InputError) as error:
        empty.settings()
    assert says in str(error.value)
    assert "archive.toml" in str(error.value)


def test_settings_of_one_machine_go_before_those_of_all(empty):
    (empty.folder / "archive.toml").write_text(
        'format = 1\n[life]\nagreed_drops = 20\nfull_speed = "100 Hz"\n[machine."a".life]\nagreed_drops = 5\n'
    )
    assert empty.settings("a").life.agreed_drops == 5
    assert empty.settings("a").life.full_speed == 100.0
    assert empty.settings("b").life.agreed_drops == 20


def test_settings_with_the_mark_that_some_editors_put_before_them_are_read(empty):
    (empty.folder / "archive.toml").write_text("format = 1\n[compare]\nleast_drops = 7\n", encoding="utf-8-sig")
    assert empty.settings().compare.least_drops == 7


def test_a_drop_that_is_added_again_from_the_archive_keeps_its_name(empty, tmp_path):
    (old,) = fill(empty, tmp_path, 1)
    entry = empty.entry(old.drop)
    copy = empty.folder / entry.raw
    again = replace(newer(old, "0.2.0"), raw_name=copy.name)
    assert empty.add(again, copy, files(tmp_path, 0)[1]) == "analysed again"
    assert empty.entry(old.drop).raw_name == old.raw_name
    assert rebuild(empty) == []
    assert empty.entry(old.drop).raw_name == old.raw_name
