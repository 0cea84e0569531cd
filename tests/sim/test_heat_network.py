"""The heat network: energy, closed forms, growth; and a drop's heat."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tdbsim.bearing_heat import heat_drop
from tdbsim.bearing_torque import TorqueLaw
from tdbsim.errors import InputError
from tdbsim.heat_network import NODES, BearingBody, ThermalMaterial, growth, temperatures
from tdbsim.hertz import BearingGeometry
from tdbsim.machine import load_machine
from tdbsim.simulate import DropPlan, simulate

from tdbmon.shipped import shipped

STEEL = ThermalMaterial(70.0, 7800.0, 510.0, 11.8e-6, 0.3)
CERAMIC = ThermalMaterial(35.0, 3200.0, 673.0, 3.2e-6, 0.26)
BODY = BearingBody(
    34.75e-3, 35e-3, 39e-3, 50e-3, 55e-3, 60e-3, 32e-3, 50e-3, 100e-3, 9.525e-3, 85e-3, 46, STEEL, CERAMIC
)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_energy_is_closed(seed):
    rng = np.random.default_rng(seed)
    time = np.cumsum(10 ** rng.uniform(-5, 2, 40))
    power = rng.exponential(size=(3, 39)) * 10 ** rng.uniform(0, 4, 39)
    found = temperatures(BODY, time, power, rng.uniform(0, 300, 40), rng.uniform(0, 300, 40))
    np.testing.assert_allclose(found.stored + found.lost, found.supplied, rtol=1e-9)
    assert found.lost[-1] > 0
    assert np.all(found.rise > -1e-9)


def test_without_heat_nothing_warms():
    found = temperatures(BODY, np.linspace(0, 1, 5), np.zeros((3, 4)), 100.0, 100.0)
    np.testing.assert_array_equal(found.rise, 0)


def test_steady_heat_flows_as_the_resistances_say():
    """At rest only housing and balls give heat to the air: drops of temperature are power times resistance."""
    time = 1e7 * np.arange(41.0)  # so long that each step is a steady state, with the convection of the one before
    found = temperatures(BODY, time, np.outer([30.0, 10.0, 5.0], np.ones(40)), 0.0, 0.0)
    rise, resistance = dict(zip(NODES, found.rise[:, -1], strict=True)), BODY.conduction
    air = BODY.to_ambient(0.0, 0.0, rise["housing"])
    through_housing, through_balls = air[7] * rise["housing"], air[4] * rise["balls"]
    assert through_housing + through_balls == pytest.approx(45.0, rel=1e-6)
    assert rise["shaft"] == pytest.approx(rise["rub"], rel=1e-9)
    assert rise["rub"] - rise["inner_ring"] == pytest.approx(30 * resistance[3], rel=1e-6)
    assert rise["inner_contact"] - rise["balls"] == pytest.approx(40 * resistance[5], rel=1e-6)
    assert rise["outer_ring"] - rise["housing"] == pytest.approx(through_housing * resistance[8], rel=1e-6)


def test_a_burst_warms_shaft_and_ring_as_their_capacities_and_resistances_share_it():
    """All flows R/C are slow against a millisecond: R3 + R2 share the burst like two resistors to still bodies."""
    found = temperatures(BODY, np.linspace(0, 1e-3, 11), np.outer([2e4, 0, 0], np.ones(10)), 0.0, 0.0)
    resistance, capacity = BODY.conduction, BODY.capacity
    share = resistance[2] / (resistance[2] + resistance[3])
    assert found.of("inner_ring")[-1] == pytest.approx(20 * share / capacity[2], rel=0.02)
    assert found.of("shaft")[-1] == pytest.approx(20 * (1 - share) / capacity[0], rel=0.02)
    assert found.of("housing")[-1] < 1e-6


def test_finer_steps_converge_to_first_order():
    power = np.array([2000.0, 50.0, 60.0])

    def last(steps):
        return temperatures(BODY, np.linspace(0, 3, steps + 1), np.outer(power, np.ones(steps)), 150.0, 150.0).rise[
            :, -1
        ]

    fine = last(1600)
    errors = [np.abs(last(steps) - fine).max() for steps in (100, 200)]
    assert 1.8 < errors[0] / errors[1] < 2.5
    assert errors[1] < 0.01 * fine.max()


def test_speed_and_warmth_raise_convection():
    slow, fast = BODY.to_ambient(10.0, 10.0, 1.0), BODY.to_ambient(80.0, 80.0, 16.0)
    assert fast[0] / slow[0] == pytest.approx(4.0)  # 8^(2/3)
    assert fast[7] / slow[7] == pytest.approx(2.0)  # 16^(1/4)
    assert fast[4] > slow[4] > 0


def test_growth_of_a_uniform_warmth():
    """Both temperatures equal: alpha (1 + nu) r dT at the near radius; balls alpha r dT."""
    found = temperatures(BODY, [0.0, 1.0], np.zeros((3, 1)), 0.0, 0.0)
    warm = growth(BODY, replace(found, rise=np.full_like(found.rise, 10.0)))
    np.testing.assert_allclose(warm.inner, 11.8e-6 * 1.3 * 35e-3 * 10)
    np.testing.assert_allclose(warm.outer, 11.8e-6 * 1.3 * 50e-3 * 10)
    np.testing.assert_allclose(warm.ball, 3.2e-6 * 9.525e-3 / 2 * 10)


def test_a_drop_heats_its_bearing():
    machine = load_machine(shipped("short/machine.toml"))
    drop = simulate(machine, DropPlan(speed=100.0, seconds=0.1, sampling=5e3))
    geometry = BearingGeometry(12.303e-3, 90e-3)
    body = BearingBody(
        35e-3, 35.25e-3, 39e-3, 51e-3, 55e-3, 60e-3, 20e-3, 30e-3, 60e-3, 12.303e-3, 90e-3, 11, STEEL, STEEL
    )
    law = TorqueLaw(90e-3, 5e-4, 1.0, 15e-6)
    heat = heat_drop(drop, "DE", body, geometry, law, 0.05)
    rubbed = drop["work"].sel(work_kind="friction_1").values
    assert rubbed[-1] > 100  # J: it did rub
    between = np.trapezoid(heat["inner_race_heat"] + heat["outer_race_heat"], heat["time"])
    assert float(heat["heat_supplied"][-1]) == pytest.approx(rubbed[-1] + between, rel=1e-9)
    np.testing.assert_allclose(heat["heat_stored"] + heat["heat_lost"], heat["heat_supplied"], rtol=1e-9, atol=1e-9)
    rise = heat["temperature_rise"]
    before = drop["time"].values < 5e-3
    assert float(np.abs(rise.values[:, before]).max()) == 0  # it falls
    last = rise.isel(time=-1)
    assert float(last.sel(node="inner_ring")) > float(last.sel(node="shaft")) > float(last.sel(node="housing"))
    assert float(heat["inner_growth"][-1]) > 0
    assert float(heat["rub_heat"].min()) >= 0
    assert float(heat["load_torque"].max()) == pytest.approx(
        5e-4 * 0.09 * float(np.hypot(*_resultant(drop, "DE")).max()), rel=1e-9
    )
    fine = heat_drop(drop, "DE", body, geometry, law, 0.05, step=1e-9)["temperature_rise"]  # every sample
    bodies = ["shaft", "inner_ring", "balls", "outer_ring", "housing"]
    np.testing.assert_allclose(rise.sel(node=bodies).isel(time=-1), fine.sel(node=bodies).isel(time=-1), rtol=0.02)
    with pytest.raises(InputError, match="not positive"):
        heat_drop(drop, "DE", body, geometry, law, 0.05, step=0.0)
    with pytest.raises(InputError, match="'de' is no end"):
        heat_drop(drop, "de", body, geometry, law, 0.05)


def _resultant(drop, end):
    at = drop.sel(end=end)
    azimuth = at["cage_angle"].values + 2 * math.pi * np.arange(11)[:, None] / 11
    loads = at["ball_load"].values
    return np.sum(loads * np.cos(azimuth), axis=0), np.sum(loads * np.sin(azimuth), axis=0)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: replace(BODY, bore_radius=34e-3), "bore_radius 34 mm must be greater"),
        (lambda: replace(BODY, width=0.0), "width 0"),
        (lambda: temperatures(BODY, [0, 1.0], np.zeros((3, 2)), 0.0, 0.0), "does not fit"),
        (lambda: temperatures(BODY, [0, 0.0], np.zeros((3, 1)), 0.0, 0.0), "must rise"),
    ],
)
def test_what_is_no_bearing_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()
