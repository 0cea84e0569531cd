"""Fixtures shared by all tests: the shipped synthetic records and their analyses, made once."""

from __future__ import annotations

import json
import os

import pytest
from hypothesis import settings
from tdbsim.machine import load_machine
from tdbsim.rotor import build_rotor

from tdbmon.record.read import read
from tdbmon.shipped import shipped

# the same examples in every run; HYPOTHESIS_PROFILE=default draws new ones
settings.register_profile("fixed", derandomize=True, deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "fixed"))

# each test process keeps to a core of its own, so that commands start no further processes beside it (tests of `Crew` do)
if (worker := os.environ.get("PYTEST_XDIST_WORKER")) and hasattr(os, "sched_setaffinity"):
    cores = sorted(os.sched_getaffinity(0))
    os.sched_setaffinity(0, {cores[int(worker.removeprefix("gw")) % len(cores)]})


@pytest.fixture(scope="session")
def machine():
    return load_machine(shipped("coastdown/machine.toml"))


@pytest.fixture(scope="session")
def rotor(machine):
    return build_rotor(machine)


@pytest.fixture(scope="session")
def coastdown_answer():
    return json.loads(shipped("coastdown/answer.json").read_text())["true"]


@pytest.fixture(scope="session")
def coastdown_record():
    """The raw record of the drop from 100 Hz, 85 s."""
    return read(shipped("coastdown/drop_100.nc"))


@pytest.fixture(scope="session")
def coastdown(coastdown_record, machine):
    """The analysis of the drop from 100 Hz."""
    from tdbmon.analysis.analyse import analyse

    return analyse(coastdown_record, machine)
