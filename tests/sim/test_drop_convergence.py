"""Drops through contacts: order of the integrators, an independent integration, how fast neighbours part."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from changed_machine import at_ends, changed, exactly
from plain_drop import BENDING, PlainDrop
from scipy.integrate import solve_ivp
from tdbsim import state_layout
from tdbsim.drop_model import build_model
from tdbsim.drop_record import drop_record
from tdbsim.integration import error_scale
from tdbsim.machine import Section
from tdbsim.simulate import DropPlan, initial_state, run
from tdbsim.stated_effects import parse
from tdbsim.usual_step import usual_step


def _pressed_start(model):
    """A state in the middle of a contact at both ends, moving in."""
    start = initial_state(model, DropPlan(150.0))
    n, at = model.n, model.arrays.at_end
    deep = np.array([-model.arrays.end[0, 0] - 3e-5, -model.arrays.end[1, 0] - 3e-5])
    start[state_layout.modes_y(n)][:2] += np.linalg.solve(at[:, :2], deep)
    start[state_layout.mode_rates_y(n)][:2] += np.linalg.solve(at[:, :2], [-0.05, -0.05])
    for end in range(2):
        start[state_layout.bodies(n, end) + 1] -= 1e-5
    return start


def _through_contact(model):
    """Return start, finish and exact finish of 80 us within one contact of both ends."""
    from tdbsim import dormand_prince
    from tdbsim.observe import ENERGIES, FORCES, observe

    start, times = _pressed_start(model), np.linspace(0, 8e-5, 41)[1:]
    exact = np.empty((40, len(start)))
    dormand_prince.integrate(model.arrays, start.copy(), 0.0, 1e-7, 1e-5, 1e-13, error_scale(model.n), times, exact)
    forces = np.zeros((2, len(FORCES), 40))
    observe(model.arrays, exact, forces, np.zeros((2, 11, 40)), np.zeros((len(ENERGIES), 40)))
    assert forces[:, FORCES.index("depth")].min() > 0
    assert forces[:, FORCES.index("normal_force")].max() > 3000
    return start, times[-1:], exact[-1]


def test_peak_forces_are_those_of_an_independent_integrator(machine):
    """Of its fine samples; the stages of a splitting's steps lie off the path and press harder, a per cent in all drops."""
    model, rng, ratios = build_model(machine), np.random.default_rng(1), []
    for _ in range(6):
        thrown = tuple(map(tuple, rng.normal(0, 5e-3, (2, 2))))
        plan = DropPlan(float(rng.uniform(60, 210)), 0.025, shaft_angle=float(rng.uniform(0, 6.28)), velocity=thrown)
        plans = plan, replace(plan, method="dormand_prince", sampling=200e3)
        told, fine = (drop_record(run(model, each))["peak_normal_force"].values for each in plans)
        assert fine.min() > 1000
        ratios.append(told / fine)
    assert np.median(ratios) == pytest.approx(1.0, abs=0.003)
    assert np.min(ratios) > 0.98
    assert np.max(ratios) < 1.005


def test_order_of_the_splitting_during_contact(machine):
    """Within a contact the error falls as the step to the fourth power, down to 0.1 nm, where steps resolve all modes."""
    from tdbsim import splitting

    model = build_model(machine, bending=BENDING)
    start, finish, exact = _through_contact(model)
    ring_y, errors = state_layout.bodies(model.n, 0) + 1, []
    for count in (1, 2, 4):
        out = np.empty((1, len(start)))
        step, first = finish[0] / count * (1 + 1e-9), np.array(splitting.START)
        splitting.integrate(model.arrays, start.copy(), 0.0, step, finish, out, np.zeros(2), first)
        errors.append(abs(out[0, ring_y] - exact[ring_y]))
    assert math.log2(errors[0] / errors[1]) > 3.7
    assert math.log2(errors[1] / errors[2]) > 3.7
    assert errors[2] < 1e-10


def test_order_of_dormand_prince_during_contact(machine):
    """With equal steps the error falls as the step to the fifth power."""
    from tdbsim import dormand_prince

    model = build_model(machine)
    start, finish, exact = _through_contact(model)
    ring_y, errors = state_layout.bodies(model.n, 0) + 1, []
    for count in (20, 40, 80):
        out, step = np.empty((1, len(start))), finish[0] / count
        dormand_prince.integrate(model.arrays, start.copy(), 0.0, step, step, 1e9, error_scale(model.n), finish, out)
        errors.append(abs(out[0, ring_y] - exact[ring_y]))
    assert math.log2(errors[0] / errors[1]) > 4.5
    assert math.log2(errors[1] / errors[2]) > 4.5


@pytest.fixture(scope="module")
def independent(machine, exact_drop):
    """The same drop integrated by scipy from equations written a second time: centres at the ends (2, k), complex."""
    plain = PlainDrop(machine, 150.0)
    start = plain.from_state(exact_drop.state[0])
    found = solve_ivp(plain, (0, 0.05), start, method="DOP853", rtol=1e-10, atol=1e-13, t_eval=exact_drop.time)
    return plain.at_ends(found.y)


def test_first_50_ms_against_an_independent_integration(exact_drop, independent):
    depth = drop_record(exact_drop)["depth"]
    assert float(depth.max()) > 1e-6
    assert np.abs(at_ends(exact_drop).T - independent).max() < 1e-9


def test_splitting_against_an_independent_integration(machine, independent):
    fine = run(build_model(machine, bending=BENDING), DropPlan(150.0, 0.05, step=25e-6))
    assert np.abs(at_ends(fine).T - independent).max() < 1e-7


@pytest.mark.parametrize(
    ("law", "exponents"), [("contact_exponent", (1.3, 1.0)), ("friction_load_exponent", (0.2, -0.1))]
)
def test_laws_of_other_exponents_against_an_independent_integration(machine, law, exponents):
    ends = tuple(
        bearing.model_copy(update={law: exponent})
        for bearing, exponent in zip(machine.touchdown_bearings, exponents, strict=True)
    )
    other = machine.model_copy(update={"touchdown_bearings": ends})
    model = build_model(other, bending=BENDING)
    drop = run(model, DropPlan(150.0, 0.02, method="dormand_prince", tolerance=1e-11))
    plain = PlainDrop(other, 150.0)
    start = plain.from_state(drop.state[0])
    found = solve_ivp(plain, (0, 0.02), start, method="DOP853", rtol=1e-10, atol=1e-13, t_eval=drop.time)
    assert float(drop_record(drop)["depth"].max("time").min()) > 1e-6
    assert np.abs(at_ends(drop).T - plain.at_ends(found.y)).max() < 1e-9
    plan = DropPlan(150.0, 0.02, method="dormand_prince", tolerance=1e-11)
    usual = run(build_model(machine, bending=BENDING), plan)
    assert np.abs(at_ends(drop) - at_ends(usual)).max() > 1e-6
    split = run(model, DropPlan(150.0, 0.02, step=25e-6))
    assert np.abs(at_ends(drop) - at_ends(split)).max() < 1e-7


@pytest.mark.parametrize(("bending", "apart"), [(4, 1e-9), (16, 5e-9)])
def test_touch_down_anywhere_in_a_step(machine, bending, apart):
    """Where in a step the first contacts begin and end costs no accuracy: some nm through them, wherever they fall."""
    model = build_model(machine, bending=bending)
    for k in range(10):
        plan = DropPlan(150.0, 0.01, shaft_angle=0.6 * k, set_point=((0.0, k * 1e-6), (0.0, 0.0)))
        exact = run(model, replace(plan, method="dormand_prince", tolerance=1e-11))
        caught = run(model, plan)
        assert caught.peak_normal.min() > 100
        assert np.abs(at_ends(caught) - at_ends(exact)).max() < apart


def test_a_light_ring_takes_shorter_steps(machine):
    """The shipped machine takes 25 us; with rings of a fifth of their mass that is too long, and not taken."""
    assert usual_step(build_model(machine)) == 25e-6
    rings = [bearing.inner_ring_mass / 5 for bearing in machine.touchdown_bearings]
    ends = tuple(
        bearing.model_copy(update={"inner_ring_mass": mass})
        for bearing, mass in zip(machine.touchdown_bearings, rings, strict=True)
    )
    light = machine.model_copy(update={"touchdown_bearings": ends})
    assert usual_step(build_model(light)) < 15e-6
    plan, model = DropPlan(150.0, 0.012), build_model(light)
    exact = at_ends(run(model, replace(plan, method="dormand_prince", tolerance=1e-11)))
    usual, long = (np.abs(at_ends(run(model, each)) - exact).max() for each in (plan, replace(plan, step=25e-6)))
    assert run(model, plan).peak_normal.min() > 100
    assert usual < 1e-8
    assert long > 5 * usual


def _first_forces(model, plan):
    caught = run(model, plan)
    assert caught.peak_normal.min() > 10
    return caught.peak_normal


@pytest.mark.parametrize(
    "ends",
    [
        {"support_stiffness": exactly(1e12), "support_mass": 2.0},
        {"balls": {"stated_stiffness": 1e15}},
        {"balls": {"stated_stiffness": 5e12, "diametral_clearance": exactly(-2e-4)}},
        {"support_damping": exactly(1e8)},
        {"ball_damping": exactly(3e5)},
        {"contact_damping": exactly(100.0)},
    ],
    ids=["support", "balls", "preloaded balls", "support's damper", "balls' damper", "contact's damper"],
)
def test_what_is_as_stiff_as_if_it_were_rigid_takes_shorter_steps(machine, ends):
    """Twenty-five microseconds are beyond what is stable there: forces of hundreds of kN, or nothing finite.

    So they are with strong dampers, which in kicks that go back in time give what they took.
    """
    balls = ends.get("balls", {})
    stiff = changed(
        machine,
        touchdown_bearings=tuple(
            each.model_copy(update=ends | {"balls": each.balls.model_copy(update=balls)})
            for each in machine.touchdown_bearings
        ),
    )
    model, plan = build_model(stiff), DropPlan(150.0, 0.012)
    exact = _first_forces(model, replace(plan, step=usual_step(model) / 6))
    assert _first_forces(model, plan) == pytest.approx(exact, rel=1e-2)


def test_a_stiff_foundation_takes_shorter_steps(machine):
    model = build_model(machine, [parse("foundation_mode:where=both,stiffness=1e12 N/m,mass=2 kg,damping=0 N s/m")])
    rigid, plan = build_model(machine), DropPlan(150.0, 0.012)
    assert usual_step(rigid) == 25e-6
    assert _first_forces(model, plan) == pytest.approx(_first_forces(rigid, plan), rel=5e-3)


def test_a_light_shaft_takes_shorter_steps(machine):
    """A spindle of 0.7 kg on the rings of a machine of 107 kg: a step that the rings alone allow doubles its first force."""
    length = 0.3

    def placed(parts, at):
        return tuple(
            each.model_copy(update={"position": each_at * length}) for each, each_at in zip(parts, at, strict=True)
        )

    light = changed(
        machine,
        rotor={"sections": (Section(length=length, outer_diameter=0.02),), "disks": (), "unbalance": ()},
        magnetic_bearings=placed(machine.magnetic_bearings, (0.2, 0.8)),
        touchdown_bearings=placed(machine.touchdown_bearings, (0.1, 0.9)),
        probes=placed(machine.probes, (0.15, 0.15, 0.85, 0.85)),
    )
    model, plan = build_model(light), DropPlan(150.0, 0.012)
    exact = _first_forces(model, replace(plan, step=1e-6))
    assert _first_forces(model, plan) == pytest.approx(exact, rel=5e-3)
    assert _first_forces(model, replace(plan, step=25e-6)).max() > 1.5 * exact.max()


def test_waves_reach_across_the_contact_angle(machine):
    """A wave presses the balls along the contact: across the axis it reaches further, by 1/cos(angle), as steps must know."""
    steep = tuple(
        each.model_copy(update={"balls": each.balls.model_copy(update={"contact_angle": math.radians(60)})})
        for each in machine.touchdown_bearings
    )
    waves = [parse(f"race_waviness:where={end},amplitude=20 um,order=5") for end in machine.ends]
    model = build_model(changed(machine, touchdown_bearings=steep), waves, bending=BENDING)
    plan = DropPlan(150.0, 0.012)
    exact = at_ends(run(model, replace(plan, method="dormand_prince", tolerance=1e-9)))
    assert np.abs(at_ends(run(model, plan)) - exact).max() < 2e-8


@pytest.mark.parametrize("exponent", [1.0, 1.3, 1.5])
def test_a_contact_of_another_exponent_is_as_stiff_at_its_depth(machine, exponent):
    """The exponent bends the contact's curve about 10 um and hardly changes its slope at some: nor the step."""
    ends = tuple(each.model_copy(update={"inner_ring_mass": 0.1}) for each in machine.touchdown_bearings)
    light = machine.model_copy(update={"touchdown_bearings": ends})
    ends = tuple(each.model_copy(update={"contact_exponent": exponent}) for each in ends)
    bent = light.model_copy(update={"touchdown_bearings": ends})
    assert usual_step(build_model(bent)) == pytest.approx(usual_step(build_model(light)), rel=0.05)
    plan, model = DropPlan(150.0, 0.012), build_model(bent)
    exact = at_ends(run(model, replace(plan, method="dormand_prince", tolerance=1e-11)))
    caught = run(model, plan)
    assert caught.peak_normal.min() > 100
    assert np.abs(at_ends(caught) - exact).max() < 2e-8


def test_neighbouring_trajectories_part(machine):
    """A picometre grows by contacts, and by no more than thousandfold within 0.1 s: trajectories compare early only."""
    model = build_model(machine)
    plan = DropPlan(150.0, 0.1, step=10e-6)
    near = replace(plan, set_point=((1e-12, 0.0), (0.0, 0.0)))
    apart = np.abs(at_ends(run(model, near)) - at_ends(run(model, plan))).max(axis=1)
    before = apart[: int(0.006 * 20e3)].max()
    assert before < 3e-12
    rate = math.log(apart[-200:].max() / before) / 0.09
    assert 10 < rate < 120
