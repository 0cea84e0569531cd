"""Whole drops: closed forms, conservation, symmetry, an independent rig."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from changed_machine import ADAPTIVE, at_ends, changed, exactly
from scipy.optimize import brentq
from tdbsim import state_layout
from tdbsim.drop_model import build_model
from tdbsim.drop_record import drop_record
from tdbsim.simulate import DropPlan, initial_state, pieces, run, simulate
from tdbsim.state_layout import LEDGER
from tdbsim.stated_effects import parse
from tdbsim.support import spring_force
from warm_machine import with_heat

MODES = pytest.mark.parametrize("bending", [4, 12, 16])  # few; those of fits; those of a simulation
DISSIPATED = [kind for kind in LEDGER if not kind.startswith("heat") and kind != "external"]


@pytest.fixture(scope="module")
def balanced(machine):
    return changed(machine, rotor={"unbalance": ()})


@pytest.mark.parametrize("method", ["splitting", "dormand_prince"])
def test_free_fall(balanced, method):
    plan = DropPlan(100.0, 0.006, method=method, tolerance=1e-11)
    drop = simulate(balanced, plan)
    assert float(drop["depth"].max()) < 0
    model = build_model(balanced)
    state = run(model, plan).state
    centre = state[:, model.n] / math.sqrt(model.modes.model.total_mass)
    expected = -0.5 * balanced.gravity * drop["time"].values ** 2
    assert np.abs(centre - centre[0] - expected).max() < 1e-11
    # the shaft, bent by its weight on the magnets, straightens on the way, so its ends are off by little
    fallen = (drop["rotor_y"] - drop["rotor_y"].isel(time=0)).values
    assert np.abs(fallen - expected).max() < 0.03 * np.abs(expected).max()


def test_levitated_whirl_is_a_solution_of_the_full_rotor(machine):
    """Unbalance response in levitation against the unreduced finite element model, solved on its own."""
    from tdbsim.rotor import build_rotor

    drop = simulate(machine, DropPlan(150.0, 0.001, levitated=0.06, shaft_angle=0.3), bending=10)
    rotor = build_rotor(machine)
    omega = 2 * np.pi * 150.0
    polar, mass, stiffness = rotor.plane_polar, rotor.plane_mass, rotor.plane_stiffness.astype(complex)
    load = np.zeros(len(mass), dtype=complex)
    for magnet in machine.magnetic_bearings:
        row = rotor.plane_rows(magnet.position)
        stiffness += (magnet.stiffness.nominal + 1j * omega * magnet.damping.nominal) * row.T @ row
    for plane in machine.rotor.unbalance:
        row = rotor.plane_rows(plane.position)[0]
        load += omega**2 * plane.amount.nominal * np.exp(1j * plane.phase.nominal) * row
    whirl = np.linalg.solve(stiffness - omega**2 * (mass - polar), load)
    held = drop.isel(time=drop["time"] < 0.06 - 1e-9)  # nine revolutions
    turning = np.exp(1j * held["shaft_angle"].values)
    for probe in machine.probes:
        at = held.sel(probe=probe.name)
        seen = at["shaft_x"].values + 1j * at["shaft_y"].values
        expected = complex((rotor.plane_rows(probe.position) @ whirl)[0])
        found = np.mean((seen - seen.mean()) / turning)
        assert abs(found - expected) < 0.01 * abs(expected)
        assert np.abs(seen - seen.mean() - found * turning).max() < 1e-3 * abs(expected)


def test_levitation_passes_into_the_drop_without_a_jump(machine):
    drop = simulate(machine, DropPlan(150.0, 0.003, levitated=0.01, sampling=100e3))
    for name in ("rotor_x", "rotor_y"):
        bends = np.abs(np.diff(drop[name].values, 2))
        assert bends.max() < 1e-8  # at 10 us a jump of 10 nm or of 1 mm/s would show; 100 m/s^2 are allowed


def test_set_point_is_where_the_shaft_stands(machine):
    places = ((3e-5, -2e-5), (-1e-5, 4e-5))
    drop = simulate(changed(machine, rotor={"unbalance": ()}), DropPlan(100.0, 0.001, levitated=0.02, set_point=places))
    held = drop.isel(time=slice(0, 300))
    for end, (x, y) in zip(machine.ends, places, strict=True):
        assert held["rotor_x"].sel(end=end).values == pytest.approx(x, abs=1e-12)
        assert held["rotor_y"].sel(end=end).values == pytest.approx(y, abs=1e-12)


def _deflection(bearing, load, gravity=9.80665):
    """How far the shaft stands below the middle under a static load, ball 1 below: contact, ring, balls, support."""
    depth = (load / bearing.contact_stiffness) ** 0.9
    azimuth = -math.pi / 2 + 2 * math.pi * np.arange(bearing.balls.count) / bearing.balls.count
    below = load + bearing.inner_ring_mass * gravity

    def carried(u):
        press = np.maximum(-u * np.sin(azimuth) - bearing.balls.diametral_clearance.nominal / 2, 0)
        return float(-np.sum(bearing.ball_stiffness * press**1.5 * np.sin(azimuth)))

    ring = brentq(lambda u: carried(u) - below, 0, 1e-3)
    return bearing.radial_gap.nominal + depth + ring + below / bearing.support_stiffness.nominal


@MODES
def test_rest_on_the_touchdown_bearings(balanced, bending):
    """After a drop at standstill the shaft rests where statics puts it: share of the weight on contact, balls, support."""
    from tdbsim.rotor import static_loads

    # a ball exactly below, so that the equilibrium is in the plane; strong friction and dampers, so that it comes soon
    soft = changed(balanced, ends={"friction": exactly(0.3), "support_damping": exactly(5e4)})
    plan = DropPlan(0.0, 4.0, sampling=2e3, cage_angle=(-math.pi / 2, -math.pi / 2))
    drop = simulate(soft, plan, bending=bending).isel(time=slice(-2000, None))
    loads = static_loads(soft, build_model(soft).modes.model)
    for bearing in soft.touchdown_bearings:
        rest = drop.sel(end=bearing.name)
        assert float(rest["normal_force"].mean()) == pytest.approx(loads[bearing.name], rel=1e-3)
        assert float(rest["rotor_y"].mean()) == pytest.approx(-_deflection(bearing, loads[bearing.name]), abs=2e-8)


@MODES
def test_swing_in_the_clearance(balanced, bending):
    """The rotor rolls to and fro in the gap like a pendulum; an inner ring that it turns adds to its mass.

    Where friction sticks, the rate of the centre is that of the ring's surface less the shaft's: a force F turns both
    against their inertias, so m = 1/(r^2/I_p + r_i^2/(2 J)) is added (J/r^2 a ring for a heavy shaft), and the swing has
    the square of its angular frequency M g / ((M + m) c), with c the distance of the centres.
    """
    inertia = 0.05
    stuck = changed(
        balanced,
        rotor={"speed_decay_time": None},
        ends={
            "friction": exactly(50.0), "inner_ring_drag": exactly(0.0), "contact_damping": exactly(5.0),
            "inner_ring_inertia": inertia, "ball_damping": exactly(4e4), "contact_stiffness": 1e10,
            "balls": balanced.touchdown_bearings[0].balls.model_copy(update={"diametral_clearance": exactly(-4e-6)}),
        },
    )  # fmt: skip
    model = build_model(stuck, bending=bending)
    places = tuple((12e-6, -(each.radial_gap.nominal - 4e-6)) for each in stuck.touchdown_bearings)
    drop = run(model, DropPlan(0.0, 1.0, sampling=5e3, set_point=places))
    late = drop.time > 0.3
    x = drop.state[late, 0]
    spectrum = np.abs(np.fft.rfft((x - x.mean()) * np.hanning(len(x)), 32 * len(x)))
    frequency = np.fft.rfftfreq(32 * len(x), 1 / 5e3)
    found = frequency[5:][np.argmax(spectrum[5:])]

    rotor, bearing = model.modes.model, stuck.touchdown_bearings[0]
    added = 1 / (
        bearing.journal_radius**2 / rotor.polar_inertia
        + (bearing.journal_radius + bearing.radial_gap.nominal) ** 2 / (2 * inertia)
    )
    assert added > 0.4 * rotor.total_mass
    distance = bearing.radial_gap.nominal
    expected = math.sqrt(rotor.total_mass * stuck.gravity / ((rotor.total_mass + added) * distance)) / (2 * math.pi)
    assert found == pytest.approx(expected, rel=0.03)


def test_ring_spin_up_follows_the_momentum(machine):
    """What a ring gains of angular momentum, friction gave it; it comes from the shaft in the ratio of the radii."""
    free = changed(machine, rotor={"speed_decay_time": None}, ends={"inner_ring_drag": exactly(0.0)})
    model = build_model(free)
    state = run(model, replace(ADAPTIVE, seconds=0.1)).state
    omega, rings = state[:, state_layout.omega(model.n)], state[:, state_layout.ring_speeds(model.n)]
    bearings = free.touchdown_bearings
    passed = sum(
        each.inner_ring_inertia * rings[-1, k] * each.journal_radius / (each.journal_radius + each.radial_gap.nominal)
        for k, each in enumerate(bearings)
    )
    assert rings[-1].min() > 50.0
    assert model.modes.model.polar_inertia * (omega[0] - omega[-1]) == pytest.approx(passed, rel=1e-6)


@pytest.mark.parametrize("method", ["splitting", "dormand_prince"])
def test_speed_decays_exponentially(machine, method):
    smooth = changed(machine, ends={"friction": exactly(0.0), "inner_ring_drag": exactly(0.0)})
    drop = simulate(smooth, DropPlan(100.0, 0.1, method=method))
    assert float(drop["normal_force"].max()) > 100
    expected = 100.0 * np.exp(-drop["time"].values / 14.0)
    assert drop["rotor_speed"].values == pytest.approx(expected, rel=1e-9)


@MODES
@pytest.mark.parametrize(("method", "step", "closed"), [("dormand_prince", 50e-6, 1e-4), ("splitting", 5e-6, 1e-3)])
def test_energy_balance_with_contacts(machine, method, step, closed, bending):
    """Energy lost is energy dissipated, less what unbalance supplied, within 1e-4 of the energy of the fall.

    The spin holds half a million times that energy, so the spin's own balance is in it.
    """
    drop = simulate(machine, replace(ADAPTIVE, method=method, step=step), bending=bending)
    assert float(drop["normal_force"].max()) > 1000
    total = drop["energy"].sum("energy_kind") + drop["work"].sel(work_kind=DISSIPATED).sum("work_kind")
    total = total - drop["work"].sel(work_kind="external")
    weight = drop["energy"].sel(energy_kind="weight")
    fall = float(weight[0] - weight.min())
    assert fall > 0.2
    assert float(np.abs(total - total[0]).max()) < closed * fall


def test_dissipation_is_never_negative(exact_drop):
    drop = drop_record(exact_drop)
    lost = drop["work"].sel(work_kind=DISSIPATED)
    assert float(lost.diff("time").min()) > -1e-9
    for kind in DISSIPATED:
        assert float(lost.sel(work_kind=kind)[-1]) > 0


def test_rotational_symmetry(machine):
    """Without gravity, everything turned by an angle - one ball pitch at the most - gives the same drop, turned."""
    light = changed(machine, gravity=0.0)
    angle = 0.77
    turn = np.exp(1j * angle)
    places, speeds = np.array([4e-5 + 1e-5j, -2e-5j]), np.array([0.1 - 0.05j, 0.08 + 0.02j])

    def plan(factor, turned):
        def pairs(values):
            return tuple((float(v.real), float(v.imag)) for v in values * factor)

        return replace(
            ADAPTIVE, seconds=0.03, set_point=pairs(places), velocity=pairs(speeds), shaft_angle=0.2 + turned,
            cage_angle=(0.1 + turned, 0.3 + turned), ring_angle=(turned, turned),
        )  # fmt: skip

    first, second = (run(build_model(light), plan(f, a)) for f, a in ((1.0, 0.0), (turn, angle)))
    assert np.abs(at_ends(first)).max() > 2.5e-4
    assert np.abs(at_ends(second) - turn * at_ends(first)).max() < 2e-9


def test_mirror_symmetry(machine):
    """A machine that turns the other way, mirrored, drops in the mirror."""
    other = changed(
        machine,
        rotation="cw",
        rotor={
            "unbalance": tuple(
                each.model_copy(update={"phase": exactly(-each.phase.nominal)}) for each in machine.rotor.unbalance
            )
        },
    )
    plan = replace(ADAPTIVE, set_point=((1e-5, 2e-5), (-3e-5, 0.0)), shaft_angle=0.4, cage_angle=(0.1, 0.2))
    mirrored = replace(
        plan, set_point=((-1e-5, 2e-5), (3e-5, 0.0)), shaft_angle=math.pi - 0.4,
        cage_angle=(math.pi - 0.1, math.pi - 0.2),
    )  # fmt: skip
    # in the mirror x -> -x a phase phi on a shaft at angle a stands at pi - a - phi
    first, second = run(build_model(machine), plan), run(build_model(other), mirrored)
    assert np.abs(at_ends(first)[:, 0]).max() > 2.5e-4
    assert np.abs(at_ends(second) + at_ends(first).conj()).max() < 2e-9


def test_first_contacts_of_the_independent_rig(coastdown_answer):
    """Against a record of another program with the true values known: first contact and first rebound, both ends."""
    import tomllib

    import xarray as xr
    from tdbsim.machine import parse_machine

    from tdbmon.shipped import shipped

    data = tomllib.loads(shipped("coastdown/machine.toml").read_text())
    truth = coastdown_answer
    for plane in data["rotor"]["unbalance"]:
        plane["amount"], plane["phase"] = truth["unbalance_kg_m"][plane["name"]]
    data["rotor"]["speed_decay_time"] = truth["speed_decay_time_s"]
    for bearing in data["touchdown_bearing"]:
        end = truth["ends"][bearing["name"]]
        bearing |= {
            "radial_gap": end["radial_gap_m"], "support_stiffness": end["support_stiffness_y_n_per_m"],
            "support_damping": end["support_damping_n_s_per_m"], "inner_ring_drag": end["inner_ring_drag_n_m"],
            "friction": truth["friction_sliding"], "contact_damping": truth["contact_damping_s_per_m"],
        }  # fmt: skip
        bearing["balls"]["diametral_clearance"] = end["ball_clearance_m"]
    true_machine = parse_machine(data)
    with xr.open_dataset(shipped("coastdown/drop_150.nc")) as file:
        record = file.isel(time=slice(0, 1250)).load()
    time = record["time"].values
    held = time < truth["release_time_s"] - 1e-6
    pulse = np.flatnonzero(np.diff(record["keyphasor"].values.astype(float)) > 0.5) + 1
    instants = time[pulse][time[pulse] < truth["release_time_s"]] - 0.5e-4
    turns, first = np.polyfit(instants, np.arange(len(instants)), 1)
    places = {}
    for end in true_machine.ends:
        probes = true_machine.probes_at(end)
        axes = [[math.cos(probe.angle), math.sin(probe.angle)] for probe in probes]
        means = [float(record[probe.name].values[held].mean()) * 1e-6 for probe in probes]
        places[end] = (probes[0].position, np.linalg.solve(axes, means))
    (z0, p0), (z1, p1) = places.values()
    set_point = tuple(
        tuple(p0 + (p1 - p0) * (bearing.position - z0) / (z1 - z0)) for bearing in true_machine.touchdown_bearings
    )
    drop = simulate(
        true_machine,
        DropPlan(
            turns, 0.02, levitated=truth["release_time_s"], sampling=10e3, set_point=set_point,
            shaft_angle=2 * math.pi * (turns * truth["release_time_s"] + first),
        ),
        bending=8,
    )  # fmt: skip
    count = drop.sizes["time"]
    for probe in true_machine.probes:
        miss = drop[probe.name].values - record[probe.name].values[:count] * 1e-6
        early = np.abs(miss[(time[:count] > 0.1) & (time[:count] < 0.112)])  # the fall and the first contact
        assert early.max() < 5e-6
        assert np.sqrt(np.mean(early**2)) < 2e-6
        assert np.sqrt(np.mean(miss[time[:count] > 0.112] ** 2)) < 8e-6  # the cages' angles are not known
    assert float(drop["normal_force"].max()) > 1000
    assert json.dumps(drop.attrs["effects"]) == '""'


def test_pieces_are_the_whole_drop(machine):
    model, plan = build_model(machine), DropPlan(150.0, 0.02, levitated=0.01)
    whole = run(model, plan)
    parts = list(pieces(model, plan, whole.time, 80))
    assert [len(part.time) for part in parts] == [80, 80, 40, 80, 80, 80, 80, 80, 1]  # the release begins one anew
    np.testing.assert_array_equal(np.concatenate([part.time for part in parts]), whole.time)
    state, held = np.concatenate([part.state for part in parts]), whole.time < plan.levitated - 1e-9
    np.testing.assert_array_equal(state[held], whole.state[held])
    assert np.abs(state - whole.state)[:, : state_layout.shaft_angle(model.n)].max() < 1e-9
    assert whole.peak_normal.max() > 1000
    np.testing.assert_allclose(parts[-1].peak_normal, whole.peak_normal, rtol=1e-3)
    assert all(part.warmth is None for part in parts)


def test_the_last_piece_tells_what_heat_did(machine):
    """Exchanges of heat count from the beginning of a piece, so the fall is one here."""
    model, plan = build_model(with_heat(machine)), DropPlan(150.0, 0.02, levitated=0.01)
    whole = run(model, plan)
    held, fallen = pieces(model, plan, whole.time, 401)
    assert len(held.time) == 200 and held.warmth is None
    np.testing.assert_array_equal(np.concatenate([held.state, fallen.state]), whole.state)
    np.testing.assert_array_equal(fallen.warmth.course, whole.warmth.course)
    np.testing.assert_array_equal(fallen.warmth.sample, whole.warmth.sample)
    assert whole.warmth.rise.max() > 0


def test_a_record_says_how_many_modes_its_model_has(machine):
    """That of a model built with nine said four, the plan's."""
    assert drop_record(run(build_model(machine, bending=9), DropPlan(150.0, 0.001))).attrs["bending_modes"] == 9
    assert simulate(machine, DropPlan(150.0, 0.001), bending=2, attachment=False).attrs["bending_modes"] == 2


def test_a_run_leaves_the_model_as_it_was(machine):
    model = build_model(machine)
    before = model.copy()
    run(model, DropPlan(150.0, 0.01, shaft_angle=1.0, ring_angle=(0.1, 0.2), cage_angle=(0.3, 0.4)))
    for name, array in before.arrays._asdict().items():
        np.testing.assert_array_equal(getattr(model.arrays, name), array, err_msg=name)


def test_attachment_modes_give_the_local_compliance(machine):
    """Few modes completed at the bearings come nearer to many modes than twice as many without."""
    plan = DropPlan(150.0, 0.03)
    full = at_ends(run(build_model(machine, bending=20), plan))

    def off(bending, attachment):
        return np.abs(at_ends(run(build_model(machine, bending=bending, attachment=attachment), plan)) - full).max()

    assert off(4, True) < 0.5 * off(8, False)
    assert off(8, True) < 1e-6


@pytest.mark.parametrize(("method", "says"), [("splitting", "of all steps"), ("dormand_prince", "of the samples")])
def test_a_peak_says_of_what_it_is(machine, method, says):
    """The adaptive method keeps no peaks: its greatest of the samples was called that of all steps."""
    drop = simulate(machine, DropPlan(100.0, 0.012, method=method))
    sampled = drop["normal_force"].max("time").values
    assert (sampled > 0).all()
    assert drop["peak_normal_force"].attrs["long_name"] == says
    assert (drop["peak_normal_force"].values >= sampled).all()
    assert method == "splitting" or (drop["peak_normal_force"].values == sampled).all()


@pytest.mark.parametrize(
    ("mass", "stiffness", "effects"),
    [
        (
            0.166,
            1.08e8,
            ["loose_support:where=NDE,play=10.128 um,stiffness_ratio=0.001816",
             "support_anisotropy:where=NDE,ratio=0.05976,direction=-43.94 deg"],
        ),
        (
            4.958,
            1.3814891892e7,
            ["loose_support:where=NDE,play=172.095 um,stiffness_ratio=0.008233",
             "support_anisotropy:where=NDE,ratio=5.684,direction=-124.275 deg"],
        ),
    ],
)  # fmt: skip
def test_rest_on_a_support_that_is_loose_and_softer_one_way(machine, mass, stiffness, effects):
    """Newton steps alone jump to and fro between the play and the seat, and a machine that can be was refused."""
    ends = {"inner_ring_mass": mass, "support_stiffness": exactly(stiffness)}
    model = build_model(changed(machine, ends=ends), [parse(each) for each in effects])
    start, at = initial_state(model, DropPlan(0.0)), state_layout.bodies(model.n, 0) + 2
    force = spring_force(model.arrays.end, model.arrays.effect, 0, *start[at : at + 2])
    assert force == pytest.approx((0.0, mass * machine.gravity), abs=1e-6)


def test_rest_of_a_light_ring_that_stiff_balls_hold(machine):
    """Its weight of 20 mN is lost in the rounding of the balls' loads of 100 kN: no reason to refuse it."""
    balls = machine.touchdown_bearings[0].balls.model_copy(update={"stated_stiffness": 6.5e12, "count": 23})
    ends = {"inner_ring_mass": 0.002, "balls": balls}
    model = build_model(changed(machine, ends=ends), [parse("off_sized_ball:where=NDE,deviation=41 um,ball=19")])
    start, at = initial_state(model, DropPlan(0.0)), state_layout.bodies(model.n, 0)
    assert np.hypot(*(start[at : at + 2] - start[at + 2 : at + 4])) < 5e-5
