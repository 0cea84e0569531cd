"""What may move, how far, and that a model gets what a machine would give it."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tdbsim.drop_model import build_model, with_effects
from tdbsim.errors import InputError
from tdbsim.machine import Tolerant, load_machine
from tdbsim.stated_effects import parse

from tdbmon.identify.parameters import (
    calibrated_machine,
    drop_parameters,
    machine_parameters,
    restated_machine,
    stated_parameters,
    with_values,
)
from tdbmon.machine_file import write_machine
from tdbmon.shipped import shipped
from tests.identify import drops
from tests.test_machine_file import tolerances


@pytest.fixture(scope="module")
def full():
    return load_machine(shipped("short/machine.toml"))


@pytest.fixture(scope="module")
def model(full):
    return build_model(full)


def test_every_tolerant_value_is_there_with_its_bounds(full):
    found = {p.name: p for p in machine_parameters(full)}
    assert len(found) == sum(not each.is_exact for each in tolerances(full).values())
    gap = found["NDE.radial_gap"]
    assert (gap.nominal, gap.low, gap.high) == pytest.approx((250e-6, 200e-6, 300e-6))
    assert gap.sigma == pytest.approx(25e-6)  # the tolerance is two of them
    along, across = found["generator.along"], found["generator.across"]
    assert along.nominal == pytest.approx(40e-6)
    assert across.high == pytest.approx(60e-6 * math.sin(math.radians(20)))


def test_a_restated_value_may_go_to_both_sides_of_it(full):
    wanted = {"NDE.support_stiffness": 3e7, "DE.contact_stiffness": 4e8}
    found = restated_machine(full, wanted)
    soft = next(p for p in machine_parameters(found) if p.name == "NDE.support_stiffness")
    assert (soft.nominal, soft.low, soft.high) == pytest.approx((3e7, 1.5e7, 4.5e7))
    assert next(each for each in found.touchdown_bearings if each.name == "DE").contact_stiffness == 4e8
    others = [p for p in machine_parameters(full) if p.name not in wanted]
    assert [p for p in machine_parameters(found) if p.name not in wanted] == others


@pytest.mark.parametrize("phase", range(-180, 180, 30))
def test_an_unbalance_of_unknown_phase_may_lie_anywhere(full, phase):
    """Cut to the half-plane about the nominal phase, 120 g mm at 150 deg came out as 24 at 90 deg."""
    amount = Tolerant(nominal=40e-6, low=20e-6, high=60e-6)
    plane = full.rotor.unbalance[0].model_copy(
        update={"amount": amount, "phase": Tolerant(nominal=0.0, low=-math.pi, high=math.pi)}
    )
    rotor = full.rotor.model_copy(update={"unbalance": (plane,)})
    found = {p.name: p for p in machine_parameters(full.model_copy(update={"rotor": rotor}))}
    along, across = found[f"{plane.name}.along"], found[f"{plane.name}.across"]
    where = 55e-6 * complex(math.cos(math.radians(phase)), math.sin(math.radians(phase)))
    away = []
    for each, value in ((along, where.real), (across, where.imag)):
        assert each.low <= value <= each.high
        away.append((value - each.nominal) / each.sigma)
    assert math.hypot(*away) < 2  # known to be no more than an amount that has its tolerance


def test_no_unbalance_has_no_phase_to_fit(full):
    nothing = Tolerant(nominal=0.0, low=0.0, high=0.0)
    turned = Tolerant(nominal=0.0, low=-math.pi, high=math.pi)
    plane = full.rotor.unbalance[0].model_copy(update={"amount": nothing, "phase": turned})
    rotor = full.rotor.model_copy(update={"unbalance": (plane,)})
    names = {p.name for p in machine_parameters(full.model_copy(update={"rotor": rotor}))}
    assert not any(name.startswith(plane.name) for name in names)


def test_exact_values_do_not_move():
    names = {p.name for p in machine_parameters(drops.machine())}
    assert names == set(drops.TRUTH)


@settings(max_examples=25, deadline=None)
@given(data=st.data())
def test_fast_path_is_the_machine_built_anew(full, model, data):
    parameters = machine_parameters(full)
    values = {p.name: data.draw(st.floats(p.low, p.high)) for p in parameters}
    quick, anew = with_values(model, values), build_model(calibrated_machine(full, values))
    for name, a, b in zip(quick.arrays._fields, quick.arrays, anew.arrays, strict=True):
        assert a == pytest.approx(b, rel=1e-9, abs=1e-15), name


@pytest.mark.parametrize("given", [(), ("contact_stiffness",), ("contact_exponent",)])
def test_fast_path_of_a_contact_that_is_no_line_is_the_machine_built_anew(full, given):
    point = 1.3
    bearings = tuple(b.model_copy(update={"contact_exponent": point}) for b in full.touchdown_bearings)
    other = full.model_copy(update={"touchdown_bearings": bearings})
    moved = {"contact_stiffness": 1.65e9, "contact_exponent": 1.25}
    values = {f"{b.name}.{field}": moved[field] for b in bearings for field in given}
    quick, anew = with_values(build_model(other), values), build_model(calibrated_machine(other, values))
    for name, a, b in zip(quick.arrays._fields, quick.arrays, anew.arrays, strict=True):
        assert a == pytest.approx(b, rel=1e-9, abs=1e-15), name


def test_fast_path_of_stated_values_is_the_machine_built_anew(full, model):
    """The elastic modulus too, though it makes the modes anew."""
    values = {
        p.name: p.nominal + shift * p.sigma
        for p, shift in zip(stated_parameters(full), itertools.cycle((1, -2)), strict=False)
    }
    quick, anew = with_values(model, values), build_model(calibrated_machine(full, values))
    for name, a, b in zip(quick.arrays._fields, quick.arrays, anew.arrays, strict=True):
        size = max(float(np.abs(b).max(initial=0.0)), 1e-30)
        assert a / size == pytest.approx(b / size, abs=1e-9), name
    assert not np.allclose(quick.arrays.square, model.arrays.square, rtol=1e-4)
    assert not np.allclose(quick.arrays.end, model.arrays.end, rtol=1e-4)


def test_fast_path_leaves_the_model_as_it_was(full, model):
    before = [array.copy() for array in model.arrays]
    with_values(model, {p.name: p.high for p in machine_parameters(full)})
    assert all(np.array_equal(a, b) for a, b in zip(before, model.arrays, strict=True))


def test_effects_act_on_the_moved_values(full, model):
    effect = parse("unbalance:where=impeller,amount=30 g mm")
    values = {"generator.along": 55e-6, "NDE.radial_gap": 260e-6}
    moved = with_effects(with_values(model, values), [effect])
    anew = build_model(calibrated_machine(full, values), [effect])
    assert moved.arrays.unbalance == pytest.approx(anew.arrays.unbalance)
    assert not np.allclose(moved.arrays.unbalance, with_values(model, values).arrays.unbalance)


def test_effects_do_not_go_onto_effects(model):
    effect = parse("unbalance:where=impeller,amount=30 g mm")
    with pytest.raises(InputError, match="already has effects"):
        with_effects(with_effects(model, [effect]), [effect])


def test_a_turn_of_the_unbalance_keeps_its_amount(full):
    values = {"impeller.along": 20e-6 * math.cos(0.3), "impeller.across": 20e-6 * math.sin(0.3)}
    plane = calibrated_machine(full, values).rotor.unbalance[1]
    assert plane.amount.nominal == pytest.approx(20e-6)
    assert plane.phase.nominal == pytest.approx(0.3)


def test_values_beyond_the_tolerance_widen_it(full):
    gap = calibrated_machine(full, {"DE.radial_gap": 320e-6}).bearing("DE").radial_gap
    assert (gap.low, gap.nominal, gap.high) == pytest.approx((200e-6, 320e-6, 320e-6))


def test_unknown_shaft_angle_may_be_any(full):
    own = {p.name: p for p in drop_parameters(full, np.zeros((2, 2)), 1.0, math.inf)}
    assert own["shaft_angle"].high - own["shaft_angle"].low == pytest.approx(2 * math.pi)
    assert math.isfinite(own["shaft_angle"].scale)


def test_stated_values_are_written_and_read_again(full, tmp_path):
    moved = calibrated_machine(full, {p.name: p.nominal + p.sigma for p in stated_parameters(full)})
    path = tmp_path / "machine.toml"
    write_machine(moved, path)
    back = load_machine(path)
    for name in ("contact_exponent", "contact_stiffness", "inner_ring_mass", "support_mass"):
        assert getattr(back.touchdown_bearings[1], name) == pytest.approx(getattr(moved.touchdown_bearings[1], name))
        assert getattr(back.touchdown_bearings[1], name) != getattr(full.touchdown_bearings[1], name)
    assert back.rotor.elastic_modulus == pytest.approx(1.004 * full.rotor.elastic_modulus)


def test_stated_values_go_no_further_than_is_known_of_them(full):
    """An exponent free up to that of a point contact (1.5) took up the waves of a race."""
    for p in stated_parameters(full):
        assert p.low <= p.nominal <= p.high
        assert max(p.nominal - p.low, p.high - p.nominal) <= 3.0 * p.sigma * (1 + 1e-9)
        assert p.high > p.nominal + 2.0 * p.sigma
    exponent = next(p for p in stated_parameters(full) if p.name.endswith("contact_exponent"))
    assert exponent.low >= 1.0  # flat on flat
