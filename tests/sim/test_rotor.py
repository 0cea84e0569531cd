"""The beam model against closed forms: inertias of cylinders, deflection of beams, the order of convergence."""

import math
from pathlib import Path

import numpy as np
import pytest
from both_planes import BothPlanes
from hypothesis import given, settings
from hypothesis import strategies as st
from tdbsim.errors import InputError
from tdbsim.machine import Disk, Rotor, load_machine
from tdbsim.rotor import build_rotor, end_mass, spring_positions, static_loads
from tdbsim.timoshenko import shear_coefficient

MACHINE = load_machine(Path(__file__).parents[2] / "datasets" / "coastdown" / "machine.toml")
E, RHO, NU = 2e11, 7850.0, 0.3


def shaft(sections, disks=(), supports=(0.25, 0.75), probes=None):
    """Return the shipped machine with another shaft; supports and probes are given as parts of its length."""
    rotor = Rotor(
        sections=[dict(zip(("length", "outer_diameter", "inner_diameter"), s, strict=False)) for s in sections],
        disks=disks,
        elastic_modulus=E,
        density=RHO,
        poisson_ratio=NU,
    )
    bearings = [
        b.model_copy(update={"position": x * rotor.length})
        for b, x in zip(MACHINE.touchdown_bearings, supports, strict=True)
    ]
    seen = [
        p.model_copy(update={"position": x * rotor.length}) for p, x in zip(MACHINE.probes, probes or (), strict=False)
    ]
    return MACHINE.model_copy(
        update={"rotor": rotor, "touchdown_bearings": tuple(bearings), "probes": tuple(seen), "magnetic_bearings": ()}
    )


def cylinder(length, outer, inner=0.0):
    """Return mass, polar and central diametral inertia of a hollow cylinder."""
    mass = RHO * math.pi / 4 * (outer**2 - inner**2) * length
    return mass, mass / 8 * (outer**2 + inner**2), mass * ((outer**2 + inner**2) / 16 + length**2 / 12)


def wheel(position, mass=12.0, polar=0.08, diametral=0.05):
    return Disk(name="wheel", position=position, mass=mass, polar_inertia=polar, diametral_inertia=diametral)


def static_deflection(machine, model, stiffness):
    """Return the coordinates (2m,) of one plane of the rotor at rest under its weight on springs at its touchdown bearings."""
    held = model.plane_stiffness.copy()
    for position, value in spring_positions(machine, stiffness):
        row = model.plane_rows(position)
        held += value * row.T @ row
    return np.linalg.solve(held, -machine.gravity * model.plane_mass @ np.tile([1.0, 0.0], len(model.nodes)))


@settings(max_examples=30, deadline=None)
@given(
    st.lists(st.tuples(st.floats(0.02, 0.5), st.floats(0.02, 0.2), st.floats(0.0, 0.9)), min_size=1, max_size=5),
    st.floats(0, 1),
    st.floats(0.1, 50),
)
def test_inertias_are_those_of_the_cylinders_and_wheels(parts, place, mass):
    sections = [(length, outer, ratio * outer) for length, outer, ratio in parts]
    total = math.fsum(s[0] for s in sections)
    model = build_rotor(shaft(sections, [wheel(place * total, mass=mass)]))

    bodies, start = [(mass, 0.08, 0.05, place * total)], 0.0
    for section in sections:
        bodies.append((*cylinder(*section), start + section[0] / 2))
        start += section[0]
    masses, polars, diametrals, centres = np.array(bodies).T
    centre = masses @ centres / masses.sum()
    assert model.total_mass == pytest.approx(masses.sum(), rel=1e-9)
    assert model.centre_of_mass == pytest.approx(centre, abs=1e-9 * total)
    assert model.polar_inertia == pytest.approx(polars.sum(), rel=1e-9)
    assert model.diametral_inertia == pytest.approx(np.sum(diametrals + masses * (centres - centre) ** 2), rel=1e-8)


def test_matrices_are_symmetric_and_the_gyroscopic_one_skew_and_rigid_motion_is_free():
    model = build_rotor(MACHINE)
    both = BothPlanes(model)
    for matrix in (both.mass, both.stiffness):
        np.testing.assert_allclose(matrix, matrix.T, rtol=1e-12, atol=1e-14 * np.abs(matrix).max())
    np.testing.assert_allclose(both.gyroscopic, -both.gyroscopic.T, rtol=1e-12, atol=1e-16)
    assert np.linalg.eigvalsh(both.mass).min() > 0
    rigid = np.zeros((4, 4 * len(model.nodes)))
    rigid[0, 0::4] = 1  # x
    rigid[1, 1::4] = 1  # y
    rigid[2, 1::4], rigid[2, 2::4] = -model.nodes, 1  # about +x: y = -theta_x z
    rigid[3, 0::4], rigid[3, 3::4] = model.nodes, 1  # about +y: x = theta_y z
    scale = np.abs(both.stiffness).max()
    np.testing.assert_allclose(both.stiffness @ rigid.T, 0, atol=1e-9 * scale)
    # turning about +y at omega, the spin's momentum moves towards -x: the moment needed about +x is I_p omega theta_y'
    couple = rigid @ both.gyroscopic @ rigid.T
    assert couple[2, 3] == pytest.approx(model.polar_inertia, rel=1e-9)
    assert couple[3, 2] == pytest.approx(-model.polar_inertia, rel=1e-9)
    np.testing.assert_allclose(couple[:2], 0, atol=1e-9)


def test_rigid_motion_is_reproduced_at_any_position():
    model = build_rotor(MACHINE)
    both = BothPlanes(model)
    q = np.zeros(4 * len(model.nodes))
    q[0::4], q[1::4] = 1e-4 + 3e-4 * model.nodes, 2e-4 - 5e-4 * model.nodes
    q[2::4], q[3::4] = 5e-4, 3e-4
    for position in (0.0, 0.0123, 0.15, 0.777, model.length):
        row = model.plane_rows(position)
        place = [(lay(row) @ q)[0] for lay in (both.in_plane_x, both.in_plane_y)]
        np.testing.assert_allclose(place, [1e-4 + 3e-4 * position, 2e-4 - 5e-4 * position])


def test_all_named_positions_are_nodes():
    model = build_rotor(MACHINE)
    for part in (*MACHINE.probes, *MACHINE.touchdown_bearings, *MACHINE.magnetic_bearings, *MACHINE.rotor.unbalance):
        assert np.abs(model.nodes - part.position).min() < 1e-12
    assert np.diff(build_rotor(MACHINE, max_element=0.02).nodes).max() <= 0.02 * (1 + 1e-9)


def test_static_loads_by_the_lever_rule():
    machine = shaft([(1.0, 0.1)], [wheel(1.0, mass=10.0)], supports=(0.1, 0.8))
    model = build_rotor(machine)
    mass = cylinder(1.0, 0.1)[0]
    second = (mass * 0.4 + 10.0 * 0.9) / 0.7
    assert end_mass(machine, model) == pytest.approx({"NDE": mass + 10 - second, "DE": second}, rel=1e-9)
    assert static_loads(machine, model)["DE"] == pytest.approx(second * machine.gravity, rel=1e-9)


def test_a_rotor_that_would_tip_is_refused():
    machine = shaft([(1.0, 0.1)], supports=(0.1, 0.4))
    with pytest.raises(InputError, match=r"centre of mass, at 500\.0 mm"):
        static_loads(machine, build_rotor(machine))


@pytest.mark.parametrize("inner", [0.0, 0.05])
def test_deflection_under_its_own_weight_is_that_of_a_timoshenko_beam(inner):
    length, outer = 1.0, 0.08
    machine = shaft([(length, outer, inner)], supports=(0.0, 1.0), probes=(0.5, 0.2))  # where nodes stand
    model = build_rotor(machine)
    area, moment = math.pi / 4 * (outer**2 - inner**2), math.pi / 64 * (outer**4 - inner**4)
    shearing = float(shear_coefficient(inner / outer, NU)) * E / (2 * (1 + NU)) * area
    load = RHO * area * machine.gravity

    def sag(z):  # simply supported, uniform load: bending and shear
        bending = load * z * (length**3 - 2 * length * z**2 + z**3) / (24 * E * moment)
        return bending + load * z * (length - z) / (2 * shearing)

    stiffness = {"NDE": 1e7, "DE": 4e7}
    rest = static_deflection(machine, model, stiffness)
    settle = [-load * length / 2 / stiffness[end] for end in ("NDE", "DE")]
    for z in (0.0, 0.2, 0.5, 1.0):
        expected = settle[0] + (settle[1] - settle[0]) * z - sag(z)
        assert float((model.plane_rows(z) @ rest)[0]) == pytest.approx(expected, rel=1e-6)


def test_an_overhung_point_load_bends_as_a_cantilever():
    """A wheel of great mass on a light shaft: between its supports and beyond, end slope by the beam formulas."""
    mass, diameter, load = 500.0, 0.05, 500.0 * MACHINE.gravity
    machine = shaft([(1.0, diameter)], [wheel(1.0, mass=mass)], supports=(0.0, 0.6))
    counterweight = wheel(0.0, mass=mass).model_copy(update={"name": "other"})
    machine = machine.model_copy(
        update={
            "rotor": machine.rotor.model_copy(update={"density": 1e-6, "disks": (*machine.rotor.disks, counterweight)})
        }
    )
    model = build_rotor(machine)
    moment = math.pi / 64 * diameter**4
    shearing = float(shear_coefficient(0.0, NU)) * E / (2 * (1 + NU)) * math.pi / 4 * diameter**2
    span, arm = 0.6, 0.4
    bent = load * arm**2 * (span + arm) / (3 * E * moment)
    sheared = load * arm / shearing + load * arm / span * arm / shearing
    rest = static_deflection(machine, model, {"NDE": 1e9, "DE": 1e9})
    first, second, tip = model.plane_rows([0.0, span, span + arm]) @ rest
    above_line = tip - first - (second - first) * (span + arm) / span  # through the supports
    assert above_line == pytest.approx(-(bent + sheared), rel=1e-6)


@pytest.mark.parametrize(
    ("stiffness", "words"),
    [({"NDE": 1e8}, "DE"), ({"NDE": 1e8, "DE": 0.0}, "not positive"), ({"NDE": 1e8, "DEE": 1e8}, "did you mean 'DE'")],
)
def test_stiffness_of_every_end_is_needed(stiffness, words):
    with pytest.raises(InputError, match=words):
        spring_positions(MACHINE, stiffness)


def test_positions_and_element_lengths_are_checked():
    with pytest.raises(InputError, match=r"2000 mm lies outside the shaft \(0 to 1240 mm\)"):
        build_rotor(MACHINE).plane_rows(2.0)
    with pytest.raises(InputError, match="not positive"):
        build_rotor(MACHINE, max_element=0.0)
