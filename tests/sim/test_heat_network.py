"""The heat network: energy, closed forms, growth."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tdbsim.errors import InputError
from tdbsim.heat_network import (
    BALLS,
    GROWTHS,
    HOUSING,
    INNER_CONTACT,
    INNER_RING,
    NODES,
    OUTER_RING,
    RUB,
    SHAFT,
    BearingBody,
    ThermalMaterial,
    air_conductance,
    warm,
)

STEEL = ThermalMaterial(70.0, 7800.0, 510.0, 11.8e-6, 0.3)
CERAMIC = ThermalMaterial(35.0, 3200.0, 673.0, 3.2e-6, 0.26)
BODY = BearingBody(
    34.75e-3, 35e-3, 39e-3, 50e-3, 55e-3, 60e-3, 32e-3, 50e-3, 100e-3, 9.525e-3, 85e-3, 46, STEEL, CERAMIC
)
COMPILED_AND_PLAIN = pytest.mark.parametrize("step_of", [warm, warm.py_func], ids=["compiled", "plain"])


def heated(steps, power, speed=0.0, step_of=warm):
    """Temperatures after steps of given lengths, s, with a power (3,), W, at the three places."""
    rise = np.zeros(len(NODES))
    lost = sum(step_of(BODY.network, rise, step, *(np.asarray(power) * step), speed, speed) for step in steps)
    return rise, lost


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_energy_is_closed(seed):
    rng = np.random.default_rng(seed)
    rise, supplied, lost = np.zeros(len(NODES)), 0.0, 0.0
    for step in 10 ** rng.uniform(-5, 2, 40):
        heat = rng.exponential(size=3) * 10 ** rng.uniform(0, 4) * step
        supplied += heat.sum()
        lost += warm(BODY.network, rise, step, *heat, *rng.uniform(-300, 300, 2))
        assert BODY.capacity @ rise + lost == pytest.approx(supplied, rel=1e-9)
    assert lost > 0
    assert np.all(rise > -1e-9)


def test_without_heat_nothing_warms():
    rise, lost = heated([0.1] * 5, [0.0, 0.0, 0.0], 100.0)
    np.testing.assert_array_equal(rise, 0)
    assert lost == 0


@COMPILED_AND_PLAIN
def test_a_step_solves_the_balance_of_every_node(step_of):
    """What each node keeps and gives to neighbours and air is what is made in it: the full matrix, put up node by node."""
    rise, step = np.linspace(1.0, 8.0, 8), 0.02
    before = rise.copy()
    step_of(BODY.network, rise, step, 30.0, 4.0, 5.0, 150.0, 140.0)
    resistance = BODY.conduction
    flow = np.array([(rise[i] - rise[i + 1]) / resistance[r] for i, r in enumerate((2, 3, 4, 5, 5, 7, 8))])
    air = np.zeros(8)
    air[[SHAFT, BALLS, HOUSING]] = air_conductance.py_func(BODY.to_air, 150.0, 140.0, before[HOUSING])
    made = np.array([0, 30.0, 0, 4.0, 0, 5.0, 0, 0]) / step
    kept = BODY.capacity * (rise - before) / step
    balance = kept + air * rise + np.append(flow, 0) - np.append(0, flow) - made
    np.testing.assert_allclose(balance, 0, atol=1e-8)


def test_steady_heat_flows_as_the_resistances_say():
    """At rest only housing and balls give heat to the air: drops of temperature are power times resistance."""
    # steps so long that each is a steady state, with the convection of the one before
    rise, _ = heated([1e7] * 40, [30.0, 10.0, 5.0])
    resistance = BODY.conduction
    _, balls, housing = air_conductance.py_func(BODY.to_air, 0.0, 0.0, rise[HOUSING])
    through_housing, through_balls = housing * rise[HOUSING], balls * rise[BALLS]
    assert through_housing + through_balls == pytest.approx(45.0, rel=1e-6)
    assert rise[SHAFT] == pytest.approx(rise[RUB], rel=1e-6)
    assert rise[RUB] - rise[INNER_RING] == pytest.approx(30 * resistance[3], rel=1e-6)
    assert rise[INNER_CONTACT] - rise[BALLS] == pytest.approx(40 * resistance[5], rel=1e-6)
    assert rise[OUTER_RING] - rise[HOUSING] == pytest.approx(through_housing * resistance[8], rel=1e-6)


def test_a_burst_warms_shaft_and_ring_as_their_capacities_and_resistances_share_it():
    """All flows R/C are slow against a millisecond: R3 + R2 share the burst like two resistors to still bodies."""
    rise, _ = heated([1e-4] * 10, [2e4, 0.0, 0.0])
    resistance, capacity = BODY.conduction, BODY.capacity
    share = resistance[2] / (resistance[2] + resistance[3])
    assert rise[INNER_RING] == pytest.approx(20 * share / capacity[INNER_RING], rel=0.02)
    assert rise[SHAFT] == pytest.approx(20 * (1 - share) / capacity[SHAFT], rel=0.02)
    assert rise[HOUSING] < 1e-6


def test_finer_steps_converge_to_first_order():
    def last(steps):
        return heated([3 / steps] * steps, [2000.0, 50.0, 60.0], 150.0)[0]

    fine = last(1600)
    errors = [np.abs(last(steps) - fine).max() for steps in (100, 200)]
    assert 1.8 < errors[0] / errors[1] < 2.5
    assert errors[1] < 0.01 * fine.max()


def test_speed_and_warmth_raise_convection():
    slow, fast = (air_conductance.py_func(BODY.to_air, *at) for at in ((10.0, 10.0, 1.0), (-80.0, -80.0, 16.0)))
    assert fast[0] / slow[0] == pytest.approx(4.0)  # 8^(2/3)
    assert fast[2] / slow[2] == pytest.approx(2.0)  # 16^(1/4)
    assert fast[1] > slow[1] > 0


def test_convection_has_the_published_nusselt_numbers():
    """Becker: Nu = 0.133 Re^(2/3) Pr^(1/3) of the shaft; Ranz and Marshall: Nu = 2 + 0.6 Re^(1/2) Pr^(1/3) of a ball."""
    body = replace(BODY, contact_angle=math.radians(25))
    shaft, balls, housing = air_conductance.py_func(body.to_air, 100.0, 100.0, 1.0)
    surface, reynolds = math.pi * 69.5e-3 * 0.1, math.pi * 100 * 69.5e-3**2 / 1.5e-5
    assert shaft == pytest.approx(0.133 * reynolds ** (2 / 3) * 0.71 ** (1 / 3) * 0.026 / 69.5e-3 * surface)
    cage = 100 * (1 - 9.525 * math.cos(math.radians(25)) / 85) / 2  # Hz
    reynolds = math.pi * 85e-3 * cage * 9.525e-3 / 1.5e-5
    nusselt = 2 + 0.6 * math.sqrt(reynolds) * 0.71 ** (1 / 3)
    assert balls == pytest.approx(nusselt * 0.026 / 9.525e-3 * math.pi * 9.525e-3**2 * 46)
    assert housing == pytest.approx(23 * 2 * math.pi * 0.06 * 0.05)


def test_growth_of_a_uniform_warmth():
    """Everything in proportion to its radius, rings and shaft in plane strain: alpha (1 + nu) r dT; balls alpha r dT."""
    grown = dict(zip(GROWTHS, BODY.growth @ np.full(len(NODES), 10.0), strict=True))
    for part, radius in (("shaft", 34.75e-3), ("bore", 35e-3), ("inner_race", 39e-3), ("outer_race", 50e-3)):
        assert grown[part] == pytest.approx(11.8e-6 * 1.3 * radius * 10)
    assert grown["ball"] == pytest.approx(3.2e-6 * 9.525e-3 / 2 * 10)


def test_rings_grow_as_thick_walled_cylinders():
    """Timoshenko and Goodier: u = 2 alpha (1 + nu) r/(b^2 - a^2) times the integral of T r dr, at r = a and r = b."""
    rise = np.zeros(len(NODES))
    rise[INNER_RING], rise[INNER_CONTACT] = 4.0, 1.0
    r = np.linspace(35e-3, 39e-3, 20001)
    mean = np.trapezoid((4.0 - 3.0 * (r - 35e-3) / 4e-3) * r, r)
    grown = dict(zip(GROWTHS, BODY.growth @ rise, strict=True))
    for part, radius in (("bore", 35e-3), ("inner_race", 39e-3)):
        expected = 2 * 11.8e-6 * 1.3 * radius / (39e-3**2 - 35e-3**2) * mean
        assert grown[part] == pytest.approx(expected, rel=1e-7)
    assert grown["shaft"] == grown["outer_race"] == grown["ball"] == 0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"bore_radius": 34e-3}, "bore_radius 34 mm must be greater than shaft_radius"),
        ({"outer_race_radius": 38e-3}, "outer_race_radius 38 mm must be greater than inner_race_radius"),
        ({"width": 0.0}, "width 0"),
    ],
)
def test_what_is_no_bearing_is_refused(change, words):
    with pytest.raises(InputError, match=words):
        replace(BODY, **change)
