"""Compiled kernels follow the sources: no edit of any file may leave old physics behind."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import tdbsim
from tdbsim import cache

# one kernel that has every force in it, on a rotor pressed into the non-drive end's gap
SCRIPT = """
import sys, time
sys.path.insert(0, sys.argv[1])
start = time.perf_counter()
import numpy as np
import tdbsim
from tdbsim.drop_model import build_model
from tdbsim.effect import catalogue
from tdbsim.stated_effects import parse
from tdbsim.machine import load_machine
from tdbsim.rhs import derivative
from tdbsim.state_layout import mode_rates_x, modes_x, modes_y, size
assert tdbsim.__file__.startswith(sys.argv[1]), tdbsim.__file__
model = build_model(load_machine(sys.argv[2]), [parse(text) for text in sys.argv[3:]])
state = np.zeros(size(model.n))
state[modes_x(model.n)][:2] = np.linalg.solve(model.arrays.at_end[:, :2], [2e-4, 2e-4])
state[modes_y(model.n)][:2] = np.linalg.solve(model.arrays.at_end[:, :2], [-2e-4, -2e-4])
rate = np.zeros_like(state)
derivative(model.arrays, 0.0, state, rate)
print(repr(float(rate[mode_rates_x(model.n)][0])), len(catalogue()), time.perf_counter() - start)
"""
OVAL = "oval_clearance:end=NDE,amplitude=20 um,angle=20 deg"
MACHINE = Path(__file__).parents[2] / "datasets" / "coastdown" / "machine.toml"


@pytest.fixture
def sources(tmp_path):
    copy = tmp_path / "src"
    shutil.copytree(Path(tdbsim.__file__).parent, copy / "tdbsim", ignore=shutil.ignore_patterns("__pycache__"))
    return copy


def drop(sources, *effects):
    environment = os.environ | {"TDBMON_CACHE": str(sources.parent / "cache"), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(sources), str(MACHINE), *effects],
        capture_output=True, text=True, env=environment, check=False, cwd=sources,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    place, count, seconds = done.stdout.split()
    return float(place), int(count), float(seconds)


@pytest.mark.slow
def test_an_edited_and_an_added_effect_change_the_result(sources):
    """An edit of a hook, which numba's own cache does not see, acts at once; a new effect is one new file."""
    first, count, _ = drop(sources, OVAL)
    again, _, seconds = drop(sources, OVAL)
    assert again == first
    assert seconds < 20  # from the cache; the figure proper is in benchmarks/

    hook = sources / "tdbsim" / "effects" / "oval_clearance.py"
    text = hook.read_text()
    assert "2.0 * (azimuth" in text
    hook.write_text(text.replace("2.0 * (azimuth", "4.0 * (azimuth"))
    edited, _, _ = drop(sources, OVAL)
    assert abs(edited - first) > 1.0

    added = hook.with_name("square_clearance.py")
    added.write_text(hook.read_text().replace("OvalClearance", "SquareClearance"))
    hook.write_text(text)
    other, grown, _ = drop(sources, OVAL.replace("oval", "square"))
    assert grown == count + 1
    assert other == edited
    assert len(list((sources.parent / "cache" / "kernels").iterdir())) == 3


def test_the_hash_sees_every_source(tmp_path, monkeypatch):
    package = tmp_path / "tdbsim"
    (package / "effects").mkdir(parents=True)
    (package / "cache.py").write_text("a")
    (package / "effects" / "b.py").write_text("b")
    monkeypatch.setattr(cache, "__file__", str(package / "cache.py"))
    found = set()
    for change in (None, ("effects/b.py", "c"), ("effects/d.py", ""), ("cache.py", "e")):
        if change:
            (package / change[0]).write_text(change[1])
        found.add(cache.source_hash.__wrapped__())
    assert len(found) == 4


def test_a_copy_elsewhere_or_written_later_has_kernels_of_its_own(tmp_path, monkeypatch):
    """numba loads none that was compiled from another place or an earlier file, so none may seem to be there."""
    found = set()
    for folder in ("one", "other"):
        (tmp_path / folder / "tdbsim").mkdir(parents=True)
        source = tmp_path / folder / "tdbsim" / "cache.py"
        source.write_text("a")
        monkeypatch.setattr(cache, "__file__", str(source))
        for written in (1e9, 2e9):
            os.utime(source, (written, written))
            found.add(cache.kernel_key.__wrapped__())
    assert len(found) == 4


def test_kernels_lie_in_the_users_cache_and_old_ones_go(tmp_path, monkeypatch):
    monkeypatch.setenv("TDBMON_CACHE", str(tmp_path))
    old = tmp_path / "kernels" / "0123456789abcdef"
    young = tmp_path / "kernels" / "fedcba9876543210"
    old.mkdir(parents=True)
    young.mkdir()
    os.utime(old, (0, 0))
    folder = cache.kernel_folder.__wrapped__()
    assert folder == tmp_path / "kernels" / cache.kernel_key()
    assert folder.is_dir() and young.is_dir() and not old.exists()


def test_a_cache_that_cannot_be_written_is_done_without(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setenv("TDBMON_CACHE", str(blocked))
    assert cache.kernel_folder.__wrapped__().is_dir()


def test_other_libraries_keep_their_cache():
    import numba

    before = numba.config.CACHE_DIR
    cache.compiled(lambda x: x)
    assert before == numba.config.CACHE_DIR
