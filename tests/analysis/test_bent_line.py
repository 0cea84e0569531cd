"""The rigid line through the probes against a shaft that bends: what intervals must allow for it."""

from __future__ import annotations

import numpy as np
import pytest
from tdbsim.machine import load_machine
from tdbsim.rotor import build_rotor, static_loads
from tdbsim.sensors import ProbeChain, SensorChain
from tdbsim.simulate import DropPlan, simulate

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.axes import to_planes
from tdbmon.analysis.bent_line import line_beyond, relative_load
from tdbmon.analysis.rest import rest_travel
from tdbmon.record.assign import assign
from tdbmon.shipped import shipped


@pytest.fixture(scope="module")
def template():
    return load_machine(shipped("machines/template.toml"))


def with_probes_at(machine, *positions):
    probes = [
        probe.model_copy(update={"position": position})
        for probe, position in zip(machine.probes, positions, strict=True)
    ]
    return machine.model_copy(update={"probes": tuple(probes)})


def drop(machine, seconds=0.6):
    sensors = SensorChain(probe=ProbeChain(noise=0.25e-6, hum=0.1e-6), speed_noise_hz=0.05)
    return simulate(machine, DropPlan(100.0, seconds, levitated=0.1, sampling=10e3, sensors=sensors, bending=8))


@pytest.mark.parametrize("positions", [(0.15, 0.15, 1.07, 1.07), (0.3, 0.3, 0.95, 0.95), (0.03, 0.03, 1.2, 1.2)])
def test_the_deepest_place_lies_in_its_interval_wherever_the_probes_stand(template, positions):
    """The line through probes 190 mm inboard of the bearings goes 23 um deeper than the shaft, outboard 11 um less deep."""
    machine = with_probes_at(template, *positions)
    record = drop(machine)
    found = analyse(record, machine)
    for end in machine.ends:
        deepest = found.ends[end].deepest
        true = np.hypot(record.rotor_x.sel(end=end), record.rotor_y.sel(end=end)).values.max()
        assert deepest.low - 1e-6 <= true <= deepest.high + 1e-6


def test_probes_in_the_bearing_planes_see_no_bending(template):
    rotor = build_rotor(template)
    loads = static_loads(template, rotor)
    bearings = [template.bearing(probe.end).position for probe in template.probes]
    beyond = {}
    for positions in (bearings, [0.15, 0.15, 1.07, 1.07], [0.03, 0.03, 1.2, 1.2]):
        machine = with_probes_at(template, *positions)
        planes = to_planes(assign(drop(machine, 0.02), machine), machine)
        beyond[positions[0]] = line_beyond(planes, machine, rotor, loads)
    at, inboard, outboard = beyond.values()
    assert max(map(abs, at.values())) < 1e-12
    assert all(0.5e-6 < each < 2e-6 for each in inboard.values())
    assert all(-3e-6 < each < -0.5e-6 for each in outboard.values())


def test_the_load_of_a_travel_is_that_which_makes_it(template):
    bearing = template.touchdown_bearings[0]
    assert relative_load(bearing, 450.0, rest_travel(bearing, 9.0 * 450.0).total) == pytest.approx(9.0, rel=1e-6)
