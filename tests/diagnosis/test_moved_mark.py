"""A keyphasor mark that moved, in drops of the blind generator; and drops whose mark stayed."""

import math
import re
from dataclasses import replace

import pytest
from tdbsim.machine import load_machine

from tdbmon.diagnosis.moved_mark import moved_mark
from tdbmon.identify.drop import measured_drop
from tdbmon.record.read import read
from tdbmon.shipped import shipped
from tests.blind.case import draw_case, simulate, write_drops

SEED = 75


def prepared(case, folder):
    machine_file, records = write_drops(case, simulate(case), folder)
    machine = load_machine(machine_file)
    return [measured_drop(read(path), machine) for path in records]


@pytest.fixture(scope="module")
def moved(tmp_path_factory):
    case = draw_case(SEED)
    (hidden,) = case.hidden
    assert hidden.name == "x_moved_mark"
    return prepared(case, tmp_path_factory.mktemp("moved")), hidden.parameters["step_rad"]


def test_a_mark_that_moved_is_told_with_its_angles(moved):
    drops, step = moved
    said = moved_mark(drops)
    turned = [float(each) for each in re.findall(r"([+-]\d+) deg in", said)]
    for k, found in enumerate(turned, start=1):
        assert math.remainder(math.radians(found) - k * step, math.pi) == pytest.approx(0, abs=math.radians(3))
    assert len(turned) == len(drops) - 1


def test_a_mark_that_stays_is_not(tmp_path):
    assert moved_mark(prepared(draw_case(SEED, kind="none"), tmp_path)) is None


def test_surfaces_that_differ_from_drop_to_drop_are_no_moved_mark():
    machine = load_machine(shipped("short/machine.toml"))
    drops = [measured_drop(read(path), machine) for path in sorted(shipped("short").glob("drop_*.nc"))]
    assert len(drops) == 4
    assert moved_mark(drops) is None


def test_two_drops_or_no_keyphasor_tell_nothing(moved):
    drops, _ = moved
    assert moved_mark(drops[:2]) is None
    assert moved_mark([*drops[:3], replace(drops[3], angle_sigma=math.inf)]) is None
