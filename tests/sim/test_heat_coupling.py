"""Drops integrated together with the temperatures of their touchdown bearings."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from changed_machine import changed, exactly
from tdbsim import state_layout
from tdbsim.columns import GAP, HALF_CLEARANCE, RING_DRAG
from tdbsim.drop_model import build_model
from tdbsim.drop_record import drop_record
from tdbsim.errors import InputError
from tdbsim.heat_coupling import warm_bearings
from tdbsim.heat_exchange import exchange
from tdbsim.integration import Integration
from tdbsim.machine import parse_machine
from tdbsim.simulate import DropPlan, run, simulate
from tdbsim.state_layout import LEDGER
from tdbsim.stated_effects import parse
from warm_machine import HEAT, STEEL, with_heat

PLAN = DropPlan(150.0, 0.1)
STIFF = STEEL | {"expansion": 0.0}
SLIPPERY = {"load_factor": 0.0, "speed_factor": 0.0}
TWO_ROWS = 2 * math.cos(math.radians(25))  # radial load over the load of one ball
SPINNING = {"spin_friction": 0.05, "balls": {"rows": 2, "contact_angle": math.radians(25)}}


@pytest.fixture(scope="module")
def warm(machine):
    return run(build_model(with_heat(machine, **SPINNING)), PLAN)


@pytest.fixture(scope="module")
def record(warm):
    return drop_record(warm)


def test_without_expansion_and_torque_it_is_the_plain_drop_to_the_last_bit(machine):
    effects = [parse("race_waviness:where=NDE,amplitude=2 um,order=3"), parse("thermal_growth:where=DE,growth=20 nm/J")]
    plan = replace(PLAN, levitated=0.0101, sampling=7e3)  # intervals and samples of other lengths than the steps
    idle = with_heat(machine, race=STIFF, ball=STIFF, **SLIPPERY)
    plain, found = (run(build_model(each, effects), plan) for each in (machine, idle))
    np.testing.assert_array_equal(found.state, plain.state)
    np.testing.assert_array_equal(found.peak_normal, plain.peak_normal)
    seen, expected = drop_record(found), drop_record(plain)
    for name in expected.data_vars:
        np.testing.assert_array_equal(seen[name].values, expected[name].values)
    assert float(seen["temperature_rise"].max()) > 0.5  # it did warm


def test_a_bearing_without_heat_is_left_out(machine):
    seen = simulate(with_heat(machine, "DE"), replace(PLAN, seconds=0.02))
    assert list(seen["heat_end"].values) == ["DE"]
    assert "temperature_rise" not in simulate(machine, replace(PLAN, seconds=0.02))


def test_energy_of_drop_and_network_is_closed(machine, record):
    """The network gets the work of all friction and of the drag at both ends, and keeps it or gives it to the air."""
    lost = record["work"].sel(work_kind=["friction_0", "friction_1", "ring_drag"]).sum("work_kind").values
    supplied = record["heat_supplied"].sum("heat_end").values
    assert supplied[-1] > 200
    assert supplied[-1] == pytest.approx(lost[-1], rel=1e-12)
    at = np.arange(0, len(lost), 20)  # instants of exchange
    np.testing.assert_allclose(supplied[at], lost[at], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(
        record["heat_stored"] + record["heat_lost"], record["heat_supplied"], rtol=1e-9, atol=1e-9
    )
    assert float(record["heat_lost"].min()) >= 0


def test_energy_of_the_drop_is_closed_with_the_work_of_growth(machine):
    """As in a cold drop (`test_drop`); with growth so strong that what it puts into the contacts would be missed."""
    strong = STEEL | {"expansion": "4e-4 1/K"}
    plan = DropPlan(150.0, 0.05, method="dormand_prince", tolerance=1e-10)
    drop = simulate(with_heat(machine, race=strong, ball=STEEL), plan)
    total = drop["energy"].sum("energy_kind").values - drop["work"].sel(work_kind="external").values
    total = (
        total + drop["work"].sel(work_kind=[k for k in LEDGER if k[:4] not in ("heat", "exte")]).sum("work_kind").values
    )
    weight = drop["energy"].sel(energy_kind="weight").values
    fall = weight[0] - weight.min()
    supplied = drop["work"].sel(work_kind="external").values[-1]
    plain = simulate(with_heat(machine, race=STIFF, ball=STIFF), plan)["work"].sel(work_kind="external").values[-1]
    assert abs(supplied - plain) > 1e-3 * fall
    assert np.abs(total - total[0]).max() < 1e-4 * fall


def test_what_acts_is_what_the_record_says(warm, record):
    """From an exchange to the next a cold machine with that gap, clearance and drag goes the same way, and no other does."""
    warmth, model = warm.warmth, build_model(warm.model.machine)  # an `Integration` of it stays cold
    velocities = np.r_[state_layout.mode_rates_x(model.n), state_layout.mode_rates_y(model.n)]

    def onward(i, acting):
        here, there = warmth.sample[i], warmth.sample[i + 1]
        model.arrays.end[:, [GAP, HALF_CLEARANCE, RING_DRAG]] = acting
        integration = Integration(model, PLAN, warm.state[here], np.zeros(2))
        integration.time = warm.time[here]
        out = np.empty((there - here, warm.state.shape[1]))
        integration.through(warm.time[here + 1 : there + 1], out)
        return float(np.abs(out - warm.state[here + 1 : there + 1])[:, velocities].max())

    touching = (record["normal_force"] > 0).any("end").values
    ends = warmth.sample
    rubbing = [i for i in range(20, len(ends) - 1) if touching[ends[i] : ends[i + 1] + 1].all()]
    assert len(rubbing) > 5
    for i in rubbing[::5]:
        # a first call begins with a usual step, where the drop may have gone on with a long one
        assert onward(i, warmth.acting[i]) < 1e-5
        assert onward(i, warmth.acting[0]) > 1e-4


def test_the_plain_exchange_is_the_compiled_one(machine, warm):
    model = build_model(with_heat(machine, **SPINNING), [parse("race_waviness:where=DE,amplitude=2 um,order=3")])
    first, last = warm.warmth.sample[60], warm.warmth.sample[61]
    found = []
    for function in (exchange, exchange.py_func):
        arrays, y, course = model.copy().arrays, warm.state[last].copy(), warm.warmth.course[:, 60].copy()
        arrays.end[:, RING_DRAG] = warm.warmth.acting[60, :, 2]
        function(arrays, warm_bearings(model), warm.state[first], warm.state[first + 1 : last + 1], 1e-3, y, course)
        found.append(np.concatenate([course[1], course[0], *arrays.end, y]))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-10)
    assert found[0][:3].min() > 0 and found[0][4] > warm.warmth.course[1, 60, 4]


def test_depth_and_ball_loads_are_those_of_the_warm_bearing(record):
    for end in ("NDE", "DE"):
        at = record.sel(end=end, heat_end=end)
        apart = np.hypot(at["rotor_x"] - at["ring_x"], at["rotor_y"] - at["ring_y"])
        np.testing.assert_allclose(at["depth"], apart - at["warm_gap"], atol=1e-15)
        azimuth = at["cage_angle"].values + 2 * np.pi * np.arange(11)[:, None] / 11
        ex, ey = (at["ring_x"] - at["support_x"]).values, (at["ring_y"] - at["support_y"]).values
        press = ex * np.cos(azimuth) + ey * np.sin(azimuth) - at["warm_clearance"].values / 2
        loads = 1.06e10 * np.maximum(press, 0) ** 1.5 / TWO_ROWS
        assert loads.max() > 300
        np.testing.assert_allclose(at["ball_load"], loads, atol=1e-6)


def test_gap_and_clearance_follow_the_growths(record):
    """A bore grows away from the shaft; inner race and balls take clearance away, the outer race gives it."""
    grown = {part: record["growth"].sel(part=part) for part in record["part"].values}
    np.testing.assert_allclose(record["warm_gap"], 250e-6 + grown["bore"] - grown["shaft"], atol=1e-15)
    pressing = grown["inner_race"] + 2 * grown["ball"] / math.cos(math.radians(25)) - grown["outer_race"]
    np.testing.assert_allclose(record["warm_clearance"], 18e-6 - 2 * pressing, atol=1e-15)
    last = record.isel(time=-1)
    assert np.all(last["warm_gap"] > 250.2e-6)  # of rubbing the light ring gets warmer than the shaft
    assert np.all(last["warm_clearance"] < 17.5e-6)


def test_a_warm_shaft_in_a_cold_ring_closes_the_gap(machine):
    """The shorter the piece of shaft that takes part, the warmer it gets, until it outgrows the ring."""
    model = build_model(with_heat(machine, shaft_length="0.2 mm"))
    drop = drop_record(run(model, PLAN))
    assert np.all(drop["warm_gap"].values[:, -1] < 249.9e-6)


def test_growth_onto_the_shaft_is_said(machine):
    with pytest.raises(InputError, match=r"growth has closed the gap 0\.0\d+ s after the release"):
        simulate(with_heat(machine, shaft_length="1e-3 mm", race=STEEL | {"expansion": "1e-3 1/K"}), PLAN)


def test_the_torque_is_palmgrens_of_load_and_speed(record):
    """f1 P d_m and M_v of the mean load and speed of the samples of the interval before."""
    at = record.sel(end="DE", heat_end="DE")
    azimuth = at["cage_angle"].values + 2 * np.pi * np.arange(11)[:, None] / 11
    loads = at["ball_load"].values * TWO_ROWS
    resultant = np.hypot(np.sum(loads * np.cos(azimuth), axis=0), np.sum(loads * np.sin(azimuth), axis=0))
    for k in (800, 1200, 1980):
        before = slice(k - 19, k + 1)
        assert float(at["load_torque"][k + 1]) == pytest.approx(5e-4 * 0.09 * resultant[before].mean(), rel=1e-9)
        product = 15 * 60 * at["ring_speed"].values[before].mean()  # cSt rpm
        assert product > 2000
        assert float(at["speed_torque"][k + 1]) == pytest.approx(1e-10 * product ** (2 / 3) * 90**3, rel=1e-9)
    assert float(at["spin_torque"].max()) > 1e-3


def test_a_ring_in_flight_slows_by_its_torque(machine):
    """J d omega/dt = -(M + 15 mN m), without contact: the ring turns on from a first rub while the rotor is aloft."""
    drop = simulate(with_heat(machine, load_factor=0.0, speed_factor=50.0), PLAN)
    at = drop.sel(end="DE", heat_end="DE")
    free = at["normal_force"].values == 0
    edges = np.flatnonzero(np.diff(free.astype(int)))
    aloft = max(
        (slice(a + 1, b + 1) for a, b in pairwise(edges) if free[a + 1]),
        key=lambda each: each.stop - each.start,
    )
    ring, time = 2 * math.pi * at["ring_speed"].values[aloft], at["time"].values[aloft]
    assert ring[0] > 20 and len(ring) > 40
    drag = (at["speed_torque"].values + 0.015)[aloft]
    expected = ring[0] - np.concatenate([[0], np.cumsum(drag[1:] * np.diff(time))]) / 0.00075
    assert ring[0] - ring[-1] > 0.5
    np.testing.assert_allclose(ring, expected, atol=1e-4 * ring[0])


@pytest.fixture(scope="module")
def by_interval(machine):
    """The first contacts, before paths part, by the interval of exchange."""
    model = build_model(with_heat(machine, **SPINNING))
    plan = DropPlan(150.0, 0.024, sampling=16e3)
    return {each: run(model, replace(plan, heat_interval=each)) for each in (4e-3, 1e-3, 0.25e-3, 0.0625e-3)}


def errors(by_interval, quantity):
    """Greatest errors with intervals of 4, 1 and 0.25 ms, as shares of the greatest value."""
    fine = quantity(by_interval[0.0625e-3])
    return [np.abs(quantity(by_interval[each]) - fine).max() / np.abs(fine).max() for each in (4e-3, 1e-3, 0.25e-3)]


@pytest.mark.parametrize(
    ("quantity", "share"),
    [
        (lambda drop: drop.state[-1, state_layout.ring_speeds(drop.model.n)], 2e-3),
        (lambda drop: drop.warmth.rise[:, [0, 2, 4, 6, 7], -1], 1e-3),  # temperatures where there is mass
    ],
    ids=["speed", "temperature"],
)
def test_shorter_intervals_converge_and_the_usual_one_is_short(by_interval, quantity, share):
    found = errors(by_interval, quantity)
    assert found[0] > found[1] > found[2] > 0
    assert found[0] > 3 * found[2]  # with 16 times the interval; what comes of a lag hangs on when contacts begin, too
    assert found[1] < share


def test_growth_hardly_depends_on_the_interval(by_interval):
    """At the contacts of the balls, without mass, the temperature follows each interval's heat: that stays as a scatter."""
    assert errors(by_interval, lambda drop: drop.warmth.acting[-1, :, 0] - 250e-6)[1] < 0.01
    assert errors(by_interval, lambda drop: drop.warmth.acting[-1, :, 1] - 9e-6)[1] < 0.01


def test_both_methods_agree(machine):
    warm = with_heat(machine, **SPINNING)
    plan = DropPlan(150.0, 0.03)
    fast = simulate(warm, replace(plan, step=10e-6))
    slow = simulate(warm, replace(plan, method="dormand_prince", tolerance=1e-9))
    assert float(np.abs(fast["rotor_y"] - slow["rotor_y"]).max()) < 2e-8
    np.testing.assert_allclose(fast["temperature_rise"][:, :, -1], slow["temperature_rise"][:, :, -1], rtol=2e-3)
    np.testing.assert_allclose(fast["warm_gap"][:, -1], slow["warm_gap"][:, -1], atol=1e-9)


def test_the_sense_of_rotation_does_not_matter_to_heat(machine):
    """The mirror image of a drop warms as the drop does."""
    still = changed(with_heat(machine), rotor={"unbalance": ()})
    plan = replace(PLAN, seconds=0.03, method="dormand_prince", tolerance=1e-9, cage_angle=(math.pi / 2, math.pi / 2))
    left, right = (simulate(still.model_copy(update={"rotation": sense}), plan) for sense in ("ccw", "cw"))
    assert float(left["heat_supplied"][0, -1]) > 20
    np.testing.assert_allclose(left["temperature_rise"], right["temperature_rise"], rtol=1e-3, atol=1e-6)


def test_drag_of_both_kinds_heats_the_races(machine):
    """Without a torque law the machine's own drag does, at the end where it is."""
    braked = changed(with_heat(machine, "NDE", **SLIPPERY), ends={"inner_ring_drag": exactly(0.5)})
    drop = simulate(braked, PLAN)
    at = drop.sel(end="NDE", heat_end="NDE")
    turned = np.abs(np.diff(at["ring_angle"].values)).sum()
    races = np.trapezoid((at["inner_race_heat"] + at["outer_race_heat"]).values, at["time"].values)
    assert races > 5
    assert races == pytest.approx(0.5 * turned, rel=0.01)


@pytest.mark.parametrize("interval", [0.0, -1e-3, math.nan])
def test_an_impossible_interval_is_refused(interval):
    with pytest.raises(InputError, match="heat_interval"):
        DropPlan(100.0, heat_interval=interval)


def table(machine, heat):
    """The machine parsed anew, with a heat table at its first touchdown bearing."""
    data = machine.model_dump(by_alias=True, exclude_unset=True)
    for bearing in data["touchdown_bearing"]:
        for key, value in bearing.items():
            if isinstance(value, dict) and "low" in value:
                bearing[key] = value["nominal"]
        bearing["balls"]["diametral_clearance"] = bearing["balls"]["diametral_clearance"]["nominal"]
    data = {key: data[key] for key in ("name", "touchdown_bearing", "rotor")}
    for plane in data["rotor"].get("unbalance", ()):
        plane["amount"], plane["phase"] = plane["amount"]["nominal"], plane["phase"]["nominal"]
    data["rotor"]["speed_decay_time"] = 14.0
    data["touchdown_bearing"][0]["heat"] = heat
    return parse_machine(data, "machine.toml")


def test_a_table_is_read_in_its_units(machine):
    heat = table(machine, HEAT).touchdown_bearings[0].heat
    assert heat.outer_radius == 0.055
    assert heat.viscosity == pytest.approx(15e-6)
    assert heat.race.expansion == pytest.approx(11.8e-6)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"outer_radus": "55 mm"}, "did you mean 'outer_radius'"),
        ({"race": STEEL | {"expantion": 1e-5}}, "did you mean 'expansion'"),
        ({"race": STEEL | {"conductivity": "70 W/m"}}, "'W/m' is not a unit"),
        ({"race": STEEL | {"specific_heat": 0.0}}, "greater than 0"),
        ({"race": STEEL | {"expansion": -1e-6}}, "greater than or equal to 0"),
        ({"inner_race_radius": "34 mm"}, "inner_race_radius 34 mm must be greater than bore_radius 35.25 mm"),
        ({"width": "0 mm"}, "greater than 0"),
        ({"viscosity": "15 Pa s"}, "'Pa s' is not a unit"),
        ({"load_factor": -1e-4}, "greater than or equal to 0"),
        ({"spin_friction": {"nominal": 0.05, "tolerance": 0.01}}, "takes no tolerance"),
    ],
)
def test_mistakes_in_a_table_are_said_with_their_place(machine, change, says):
    with pytest.raises(InputError, match="machine.toml: .*touchdown_bearing]? 'NDE'.*heat") as error:
        table(machine, HEAT | change)
    assert says in str(error.value)


def test_what_is_missing_in_a_table_is_named(machine):
    with pytest.raises(InputError, match="'load_factor' is missing"):
        table(machine, {key: value for key, value in HEAT.items() if key != "load_factor"})
