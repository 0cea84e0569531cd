"""Many records at once: pool and cluster give what the serial run gives, failures are listed and the rest is done."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from tdbsim.errors import InputError

from tdbmon.history.archive import Archive, open_archive
from tdbmon.history.batch import add_all
from tdbmon.history.study import Order
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


def test_a_batch_that_is_stopped_keeps_what_is_done(empty):
    going = add_all(empty, orders(RECORDS))
    assert next(going).state == "filed"
    going.close()
    assert len(empty.entries()) == 1
    assert [outcome.state for outcome in add_all(empty, orders(RECORDS))].count("filed") == 2
