"""A first run comes to the same last digits as later ones: the process that simulates never compiles a kernel."""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from tdbsim import first_use
from tdbsim.drop_model import build_model
from tdbsim.machine import load_machine
from tdbsim.simulate import DropPlan, run

MACHINE = Path(__file__).parents[2] / "datasets" / "loose" / "machine.toml"
SCRIPT = """
import hashlib, sys
from tdbsim import splitting
from tdbsim.drop_model import build_model
from tdbsim.machine import load_machine
from tdbsim.simulate import DropPlan, run
model, plan = build_model(load_machine(sys.argv[1])), DropPlan(speed=100.0, seconds=0.05)
drop = run(model, plan)
assert drop.peak_normal.min() > 0
print(sum(splitting.integrate.stats.cache_misses.values()), hashlib.sha256(drop.state.tobytes()).hexdigest())
"""


@pytest.mark.slow
def test_first_runs_load_their_kernels_as_later_ones_do(tmp_path):
    """Two that begin at a time, and a later one."""
    environment = os.environ | {"TDBMON_CACHE": str(tmp_path)}

    def begun():
        command = [sys.executable, "-c", SCRIPT, str(MACHINE)]
        return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)

    def ended(process):
        out, _ = process.communicate()
        assert process.returncode == 0
        return out.split()

    said = [ended(process) for process in [begun(), begun()]]
    said.append(ended(begun()))
    misses, *_ = said[0]
    assert misses == "0"
    assert said[0] == said[1] == said[2]
    assert len(list(tmp_path.rglob("splitting.integrate-*.nbc"))) == 1


@pytest.fixture
def children(monkeypatch):
    """Count the processes that are begun to compile; none of them does."""
    begun = []
    monkeypatch.setattr(first_use, "_seen", set())
    monkeypatch.setattr(first_use, "_in_cache", lambda kernel: False)
    monkeypatch.setattr(first_use.subprocess, "run", lambda *given, **said: begun.append(given))
    return begun


@pytest.fixture(scope="module")
def drop():
    return build_model(load_machine(MACHINE)), DropPlan(speed=100.0, seconds=0.02)


def test_a_kernel_is_asked_for_once_and_the_drop_is_simulated_all_the_same(children, drop):
    with ThreadPoolExecutor(2) as threads:
        found = list(threads.map(lambda _: run(*drop), range(4)))
    assert len(children) == 1
    assert all(each.peak_normal.max() > 0 for each in found)


@pytest.mark.parametrize("without", ["frozen", "executable"])
def test_no_process_is_begun_where_there_is_no_interpreter(children, drop, monkeypatch, without):
    monkeypatch.setattr(sys, without, without == "frozen" or "", raising=False)
    first_use.compile_apart("splitting", *drop)
    assert children == []


def test_a_kernel_is_known_as_compiled_once_that_was_seen_to(children, drop):
    assert not first_use.is_compiled("splitting")
    first_use.compile_apart("splitting", *drop)
    assert first_use.is_compiled("splitting")
