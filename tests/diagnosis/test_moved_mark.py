"""A keyphasor mark that moved, in drops of the blind generator; and drops whose mark stayed."""

import math
import re
from dataclasses import replace

import numpy as np
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


def test_three_drops_or_no_keyphasor_tell_nothing(moved):
    drops, _ = moved
    assert moved_mark(drops[:3]) is None
    assert moved_mark([*drops[:3], replace(drops[3], angle_sigma=math.inf)]) is None


def test_drops_that_no_probe_has_in_common_tell_nothing(moved):
    drops, _ = moved
    lame = [
        replace(
            drop, probes=drop.probes[:k] + drop.probes[k + 1 :], noise=drop.noise[:k] + drop.noise[k + 1 :]
        )
        for k, drop in enumerate(drops)
    ]  # fmt: skip
    assert moved_mark(lame) is None


def _made_up(drops, rng, *, step, smooth):
    """The drops with a runout `smooth` times the noise of all phasors together, and a mark that moves by a step per drop."""
    sigma = drops[0].noise[0].order_sigma
    surface = rng.standard_normal(4) + 1j * rng.standard_normal(4)
    surface *= smooth * sigma * 2 / np.linalg.norm(surface)  # noise of all four probes: twice the sigma of one
    made = []
    for k, drop in enumerate(drops):
        chance = sigma * (rng.standard_normal(4) + 1j * rng.standard_normal(4))
        seen = (surface * np.exp(2j * k * step) + chance) * np.exp(2j * drop.angle)
        noise = tuple(
            replace(each, order_sigma=sigma, orders=np.array([0, value, 0]))
            for each, value in zip(drop.noise, seen, strict=True)
        )
        made.append(replace(drop, noise=noise))
    return made


@pytest.mark.parametrize("smooth", [3.0, 6.0, 10.0, 30.0])
def test_noise_alone_moves_no_mark_and_hides_few_that_moved(moved, smooth):
    drops, _ = moved
    rng = np.random.default_rng(int(smooth))
    still = [moved_mark(_made_up(drops, rng, step=0.0, smooth=smooth)) is not None for _ in range(400)]
    gone = [moved_mark(_made_up(drops, rng, step=0.5, smooth=smooth)) is not None for _ in range(400)]
    assert np.mean(still) < 0.01
    if smooth >= 6.0:
        assert np.mean(gone) > 0.9


def test_ends_that_turn_each_by_itself_hardly_look_like_a_moved_mark(moved):
    """Of 48 choices of three out of four drops of the rig (synthetic), with such runout, one looked turned alike."""
    drops, _ = moved
    rng = np.random.default_rng(5)
    told = [moved_mark(_ends_turned(drops, rng)) is not None for _ in range(2000)]
    assert np.mean(told) < 0.005


def _ends_turned(drops, rng):
    """The drops with runout of one size at both ends, at another angle at each end in every drop."""
    made = []
    for drop in drops:
        at = {end: np.exp(1j * rng.uniform(0, 2 * math.pi)) for end in ("NDE", "DE")}
        noise = tuple(
            replace(each, orders=np.array([0, 0.2e-6 * at[probe.end], 0]))
            for probe, each in zip(drop.probes, drop.noise, strict=True)
        )
        made.append(replace(drop, noise=noise))
    return made
