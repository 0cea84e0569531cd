"""Where results go: never over what was read, and what cannot be written is said before anything is computed."""

from __future__ import annotations

import os
import threading

import pytest
from tdbsim.errors import InputError

from tdbmon.atomic import write_text
from tdbmon.output_file import check_outputs
from tdbmon.shipped import shipped
from tests.test_cli import run


@pytest.fixture
def folder(tmp_path):
    for name in ("machine.toml", "drop_100.nc"):
        (tmp_path / name).write_bytes(shipped(f"short/{name}").read_bytes())
    return tmp_path


@pytest.mark.parametrize("result", ["drop_100.nc", "machine.toml", "link.json", "nowhere/r.json", "there"])
@pytest.mark.parametrize("command", ["analyse", "diagnose"])
def test_no_result_goes_over_what_is_read(capsys, folder, command, result):
    (folder / "link.json").symlink_to(folder / "drop_100.nc")
    (folder / "there").mkdir()
    before = {name: (folder / name).read_bytes() for name in ("machine.toml", "drop_100.nc")}
    machine, record = str(folder / "machine.toml"), str(folder / "drop_100.nc")
    code, out, err = run(capsys, command, machine, record, "--json", str(folder / result))
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert str(folder / result) in err
    assert {name: (folder / name).read_bytes() for name in before} == before


def test_a_simulated_record_does_not_replace_the_machine_file(capsys, folder):
    machine = folder / "machine.nc"
    machine.write_bytes((folder / "machine.toml").read_bytes())
    code, _, err = run(capsys, "simulate", str(machine), "--speed", "50 Hz", "--out", str(machine))
    assert code == 2
    assert "name another" in err


def test_one_file_for_two_results_is_refused(tmp_path):
    with pytest.raises(InputError, match="two results"):
        check_outputs([tmp_path / "a.html", tmp_path / "." / "a.html"], [])
    check_outputs([tmp_path / "a.html", tmp_path / "b.html", None], [tmp_path / "c.nc", None])


def test_a_place_that_cannot_be_written_is_refused_before_anything_is_read(capsys, folder):
    (folder / "drop_100.nc").write_bytes(b"no record")
    record = str(folder / "drop_100.nc")
    code, out, err = run(capsys, "analyse", str(folder / "machine.toml"), record, "--json", "/proc/x.json")
    assert (code, out) == (2, "")
    assert err.startswith("tdbmon: /proc/x.json: cannot be written") and "another folder" in err
    there = sorted(folder.iterdir())
    check_outputs([folder / "r.json"], [])
    assert sorted(folder.iterdir()) == there


def test_what_is_no_file_is_written_to_and_not_replaced(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    came = []
    reader = threading.Thread(target=lambda: came.append(pipe.read_text()))
    reader.start()
    write_text(pipe, "results")
    reader.join(timeout=10)
    assert came == ["results"]
    assert pipe.is_fifo()


def test_a_link_stays_a_link(tmp_path):
    target, link = tmp_path / "results.json", tmp_path / "latest.json"
    target.write_text("old")
    link.symlink_to(target)
    write_text(link, "new")
    assert link.is_symlink()
    assert target.read_text() == "new"
