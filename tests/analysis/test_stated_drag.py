"""The drag of the inner rings that a machine file states, beside the constant drag of the run-down."""

from __future__ import annotations

import pytest
from tdbsim.machine import STANDARD_GRAVITY, EffectSetting, Tolerant
from tdbsim.rotor import build_rotor
from tdbsim.sensors import SensorChain
from tdbsim.simulate import DropPlan, simulate

from tdbmon.analysis.rundown import fit_rundown
from tdbmon.analysis.stated_drag import against_stated, drag_on_rotor, load_torque, stated_ring_drag
from tdbmon.estimate import Estimate
from tdbmon.report.sections import rundown

LOAD = 37.0  # N m, the weight at the radius of the bores


def test_the_rings_of_all_bearings_add_up_with_their_tolerances(machine):
    stated = stated_ring_drag(machine)
    assert (stated.nominal, stated.low, stated.high) == pytest.approx((30e-3, 15e-3, 45e-3))


def test_effects_of_the_machine_file_count(machine):
    dry = tuple(EffectSetting(name="ring_drag", where=end, torque="10 mN m") for end in machine.ends)
    stated = stated_ring_drag(machine.model_copy(update={"effects": dry}))
    assert (stated.nominal, stated.low, stated.high) == pytest.approx((50e-3, 35e-3, 65e-3))


@pytest.mark.parametrize(
    ("low", "high", "says"),
    [(85, 87, "above"), (5, 10, "below"), (20, 40, "within"), (40, 50, "across"), (10, 50, "across")],
)
def test_an_interval_is_above_below_within_or_not_decided(machine, low, high, says):
    measured = Estimate((low + high) / 2e3, low / 1e3, high / 1e3, "N m")
    assert against_stated(measured, stated_ring_drag(machine), False, LOAD).startswith(says)


def test_a_rotor_shows_less_than_the_drag_of_the_rings_it_rolls_in(machine):
    """Told at +-1 %, it was "below", as the rings' inertia and the wider bore were left out: 1.4 % on a simulated drop."""
    drag = Tolerant(nominal=1.0, low=0.99, high=1.01)
    rings = [ring.model_copy(update={"inner_ring_drag": drag}) for ring in machine.touchdown_bearings]
    turned = machine.model_copy(update={"touchdown_bearings": tuple(rings)})
    inertia = build_rotor(turned).polar_inertia
    plan = DropPlan(
        speed=60.0, seconds=6.0, levitated=0.1, sampling=5e3, sensors=SensorChain(speed_noise_hz=0.02), seed=1
    )
    record = simulate(turned, plan)
    run = fit_rundown(record.time.values, record.speed.values, release_time=0.1, polar_inertia=inertia)
    on_rotor = drag_on_rotor(turned, inertia)
    assert run.drag_torque.value == pytest.approx(on_rotor.nominal, rel=3e-3)
    assert on_rotor.nominal == pytest.approx(2.0 * 0.98772, rel=1e-4)
    assert against_stated(run.drag_torque, stated_ring_drag(turned), False, LOAD).startswith("below")
    assert against_stated(run.drag_torque, on_rotor, False, LOAD).startswith("within")


def test_a_drag_above_is_the_friction_of_a_whirl_where_there_was_one(machine):
    measured = Estimate(17.0, 16.0, 18.0, "N m")
    assert "whirled around its clearance" in against_stated(measured, stated_ring_drag(machine), True, LOAD)


def test_the_report_of_the_shipped_coast_down_says_that_its_drag_is_above(coastdown):
    rows = {row.cells[0]: row.cells[1] for row in rundown.section(coastdown).blocks[0].rows}
    said = rows["Drag of all inner rings, by the machine file"]
    assert said.startswith("30 mN m (tolerance: 15 mN m to 45 mN m); the measured constant drag lies above")
    assert "not only those of the rings" in said


def test_what_is_beyond_the_stated_drag_is_told_as_a_share_of_the_load(machine, coastdown):
    """86 mN m instead of 30 were "harder than the file says"; bearings under load take what is between."""
    rotor = build_rotor(machine)
    load = load_torque(machine, rotor)
    assert load == pytest.approx(
        rotor.total_mass * STANDARD_GRAVITY * (35e-3 + 250e-6)
    )  # all journals and gaps are alike
    stated = stated_ring_drag(machine)
    more = {share: Estimate(x, x, x, "N m") for share in (1e-4, 1.5e-3, 0.01) for x in [stated.high + share * load]}
    told = {share: against_stated(each, stated, False, load) for share, each in more.items()}
    assert "is 0.0019 of the weight, at the radius of the bores" in told[1.5e-3]
    rows = {row.cells[0]: row.cells[1] for row in rundown.section(coastdown).blocks[0].rows}
    assert "is 0.0015 of the weight" in rows["Drag of all inner rings, by the machine file"]
    assert [("of the weight" in told[share]) for share in (1e-4, 0.01)] == [False, False]
