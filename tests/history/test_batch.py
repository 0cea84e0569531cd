"""Many records at once: pool and cluster give what the serial run gives, failures are listed and the rest is done."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tdbsim.errors import InputError

from tdbmon.history.archive import Archive, open_archive
from tdbmon.history.batch import add_all
from tdbmon.history.study import Order, study
from tdbmon.history.verify import verify
from tdbmon.record.read import read, write
from tests.history.conftest import YEARS

RECORDS = sorted(YEARS.glob("*.nc"))[:3]


def orders(records) -> list[Order]:
    return [Order(YEARS / "machine.toml", Path(record)) for record in records]


def contents(archive: Archive) -> list:
    """All that is filed but the time of the filing."""
    return [replace(archive.filing(entry.id), filed="") for entry in archive.entries()]


@pytest.fixture(scope="module")
def serial(tmp_path_factory) -> Archive:
    archive = open_archive(tmp_path_factory.mktemp("serial") / "archive", create=True)
    assert {outcome.state for outcome in add_all(archive, orders(RECORDS))} == {"filed"}
    return archive


@pytest.mark.slow
def test_two_processes_file_what_one_does(serial, empty):
    outcomes = list(add_all(empty, orders(RECORDS), workers=2))
    assert sorted(outcome.record.name for outcome in outcomes) == [record.name for record in RECORDS]
    assert contents(empty) == contents(serial)


def undated(folder: Path, count: int) -> list[Path]:
    """Copies of a shipped drop that state no time, no two alike."""
    folder.mkdir(exist_ok=True)
    drop = read(RECORDS[0]).isel(time=slice(0, 12000))
    for name in ("drop_time", "date"):
        drop.attrs.pop(name, None)
    found = []
    for i in range(count):
        rng = np.random.default_rng(i)
        own = drop.copy(deep=True)
        for name in ("NDE_A", "NDE_B", "DE_A", "DE_B"):
            own[name] = own[name] + rng.normal(0, 1e-6, own.sizes["time"])
        found.append(folder / f"drop {i} ü.nc")
        write(own, found[-1])
    return found


def test_drops_without_a_time_come_as_they_were_given_whoever_is_ready_first(empty, tmp_path, monkeypatch):
    """Workers end in any order, and several drops are filed within a second."""
    from tdbmon.history import batch

    def backwards(orders, workers, scheduler, progress):
        yield from reversed([(order, study(order)) for order in orders])

    monkeypatch.setattr(batch, "_studies", backwards)
    records = undated(tmp_path / "many", 4)
    assert {outcome.state for outcome in add_all(empty, orders(records))} == {"filed"}
    assert [entry.raw_name for entry in empty.entries()] == [record.name for record in records]


def test_a_drop_that_is_analysed_again_keeps_assembly_time_and_place(empty, tmp_path):
    """With a mended machine file, say: nobody states the words of ten years again."""
    records = undated(tmp_path / "many", 2)
    first = [replace(orders([records[0]])[0], assembly="rebuilt", dropped="2031-05-01"), orders([records[1]])[0]]
    assert [outcome.state for outcome in add_all(empty, first)] == ["filed", "filed"]
    before = {entry.id: entry for entry in empty.entries()}
    mended = tmp_path / "mended.toml"
    mended.write_text((YEARS / "machine.toml").read_text() + "# mended\n")
    again = [replace(order, machine=mended) for order in orders(reversed(records))]
    assert [outcome.state for outcome in add_all(empty, again, again=True)] == ["analysed again"] * 2
    after = {entry.id: entry for entry in empty.entries()}
    assert list(after) == list(before)
    for drop, entry in after.items():
        assert replace(entry, result=before[drop].result) == before[drop]
        assert empty.machine_file(drop).read_text().endswith("# mended\n")


def poorer(folder: Path) -> Path:
    """The machine file with the speed and the keyphasor looked for where the records have none."""
    made = folder / "poorer.toml"
    text = (YEARS / "machine.toml").read_text()
    for channel in ("speed", "keyphasor"):
        assert text.count(f'channel = "{channel}"') == 1
        text = text.replace(f'channel = "{channel}"', f'channel = "another {channel}"')
    made.write_text(text)
    return made


def test_a_filed_drop_is_passed_over_though_it_comes_with_another_machine_file(empty, tmp_path):
    """A folder that was added every night with one machine file replaced good results by worse ones."""
    list(add_all(empty, orders(RECORDS[:1])))
    (before,) = empty.entries()
    nightly = [replace(orders(RECORDS[:1])[0], machine=poorer(tmp_path))]
    (outcome,) = add_all(empty, nightly)
    assert (outcome.state, outcome.otherwise) == ("already filed", ("with another machine file",))
    assert empty.entries() == [before]


def test_what_a_drop_loses_where_it_is_analysed_again_is_told(empty, tmp_path):
    list(add_all(empty, orders(RECORDS[:1])))
    (before,) = empty.entries()
    own = empty.machine_file(before.id)
    (outcome,) = add_all(empty, [replace(orders(RECORDS[:1])[0], machine=poorer(tmp_path))], again=True)
    assert outcome.state == "analysed again"
    speed, channels, values = outcome.lost
    assert speed == f"the speed at the release ({before.speed:.4g} Hz before)"
    assert channels == "2 channels (speed, keyphasor)"
    assert "Stated speed over that of the keyphasor" in values
    assert outcome.machine_before == own.stem
    # and it comes back by the machine file that is kept, with nothing lost
    (back,) = add_all(empty, [replace(orders(RECORDS[:1])[0], machine=own)], again=True)
    assert (back.state, back.lost) == ("analysed again", ())
    assert empty.entries()[0].speed == before.speed


def test_a_damaged_drop_is_mended_with_its_own_machine_file(empty, tmp_path):
    list(add_all(empty, orders(RECORDS[:1])))
    (before,) = empty.entries()
    (raw,) = (empty.folder / "raw").glob("*/*")
    raw.unlink()
    (outcome,) = add_all(empty, [replace(orders(RECORDS[:1])[0], machine=poorer(tmp_path))])
    assert (outcome.state, outcome.lost) == ("analysed again", ())
    assert empty.entries()[0].speed == before.speed
    assert verify(empty) == []


def test_a_filed_drop_with_the_file_of_another_machine_is_refused_before_it_is_analysed(empty, tmp_path, monkeypatch):
    list(add_all(empty, orders(RECORDS[:1])))
    other = tmp_path / "other.toml"
    other.write_text((YEARS / "machine.toml").read_text().replace("Compressor rotor with two wheels", "another"))
    monkeypatch.setattr("tdbmon.history.batch.study", None)
    (outcome,) = add_all(empty, [replace(orders(RECORDS[:1])[0], machine=other)])
    assert outcome.failed
    assert "filed as a drop of machine 'Compressor rotor with two wheels', not 'another'" in outcome.why


@pytest.mark.parametrize("words", [{"assembly": "rebuilt"}, {"dropped": "2031-05-01"}])
def test_another_assembly_or_time_of_a_filed_drop_is_refused_with_the_cure(empty, words):
    (first,) = add_all(empty, orders(RECORDS[:1]))
    (outcome,) = add_all(empty, [replace(orders(RECORDS[:1])[0], **words)])
    assert outcome.failed
    assert f"tdbmon archive remove --archive {empty.folder} {first.drop}" in outcome.why
    assert "''" not in outcome.why  # where nothing was stated
    # the same instant in another zone is no other time
    (again,) = add_all(empty, [replace(orders(RECORDS[:1])[0], dropped="2015-05-11T11:00:00+02:00")])
    assert again.state == "already filed"
    (entry,) = empty.entries()
    assert (entry.assembly, entry.dropped) == ("", "2015-05-11T09:00:00Z")


def test_whoever_takes_a_drop_without_a_time_out_is_told_to_state_one(empty, tmp_path):
    record = undated(tmp_path / "many", 1)
    list(add_all(empty, orders(record)))
    (outcome,) = add_all(empty, [replace(orders(record)[0], assembly="rebuilt")])
    assert "with --dropped TIME, which sets its position" in outcome.why


@pytest.mark.parametrize("place", ["raw", "results"])
def test_adding_again_mends_a_file_that_was_damaged(empty, place):
    list(add_all(empty, orders(RECORDS[:1])))
    (file,) = (empty.folder / place).glob("*/*")
    sound = file.read_bytes()
    file.write_bytes(sound[: len(sound) // 2])
    assert [fault.harmless for fault in verify(empty)] == [False]
    assert [outcome.state for outcome in add_all(empty, orders(RECORDS[:1]))] == ["analysed again"]
    assert verify(empty) == []
    assert len(file.read_bytes()) == len(sound)


@pytest.mark.slow
def test_a_cluster_of_separate_processes_files_what_one_does(serial, empty):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, host="127.0.0.1"
    ) as cluster:
        outcomes = list(add_all(empty, orders([*RECORDS, "nowhere.nc"]), scheduler=cluster.scheduler_address))
    failed = [outcome for outcome in outcomes if outcome.failed]
    assert [outcome.record.name for outcome in failed] == ["nowhere.nc"]
    assert "no such file" in failed[0].why
    assert contents(empty) == contents(serial)


def test_a_scheduler_that_is_not_there_is_told(empty, monkeypatch):
    pytest.importorskip("distributed")
    from tdbmon.history import batch

    monkeypatch.setattr(batch, "_REACH_S", 0.5)
    with pytest.raises(InputError, match=r"scheduler tcp://127.0.0.1:9: cannot be reached"):
        list(add_all(empty, orders(RECORDS[:1]), scheduler="tcp://127.0.0.1:9"))


def test_what_fails_is_listed_and_the_rest_is_done_and_a_second_run_goes_on_where_it_stopped(empty, tmp_path):
    damaged = tmp_path / "damaged.nc"
    damaged.write_bytes(RECORDS[0].read_bytes()[:3000])
    some = orders([RECORDS[0], damaged, "nowhere.nc", RECORDS[1]])
    outcomes = {outcome.record.name: outcome for outcome in add_all(empty, some)}
    assert [name for name, outcome in outcomes.items() if outcome.failed] == ["damaged.nc", "nowhere.nc"]
    assert "damaged" in outcomes["damaged.nc"].why
    assert len(empty.entries()) == 2
    again = {outcome.record.name: outcome.state for outcome in add_all(empty, orders(RECORDS))}
    assert list(again.values()) == ["already filed", "already filed", "filed"]


def test_a_record_without_an_orbit_is_refused_with_the_checks_that_failed(empty, tmp_path):
    """A displacement in um that is labelled mm "holds no orbit", and `tdbmon analyse` knew the factor."""
    drop = read(RECORDS[0])
    for name in ("NDE_A", "NDE_B", "DE_A", "DE_B"):
        drop[name] = (drop[name].dims, 1e3 * drop[name].values, drop[name].attrs)
    write(drop, tmp_path / "mm.nc")
    (outcome,) = add_all(empty, orders([tmp_path / "mm.nc"]))
    assert outcome.failed
    assert "checks failed: unit NDE_A, NDE_B, DE_A, DE_B: moves by" in outcome.why
    assert "most likely a factor 1000" in outcome.why


def test_a_batch_that_is_stopped_keeps_what_is_done(empty):
    going = add_all(empty, orders(RECORDS))
    assert next(going).state == "filed"
    going.close()
    assert len(empty.entries()) == 1
    assert [outcome.state for outcome in add_all(empty, orders(RECORDS))].count("filed") == 2
