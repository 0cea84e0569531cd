"""Modes against closed forms, the exact solution of the continuous Timoshenko shaft, and ROSS."""

import math
import warnings
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from both_planes import BothPlanes
from scipy.linalg import expm
from scipy.optimize import brentq
from tdbsim.errors import InputError
from tdbsim.machine import Disk, Rotor, load_machine
from tdbsim.modes import Spring, free_free, supported, whirl_modes
from tdbsim.rotor import build_rotor
from tdbsim.timoshenko import shear_coefficient
from truncation_error import compliance, truncation_error

MACHINE = load_machine(Path(__file__).parents[2] / "datasets" / "coastdown" / "machine.toml")
STIFFNESS = {"NDE": 1.31e8, "DE": 4.03e8}
SPRINGS = [Spring(b.position, STIFFNESS[b.name], STIFFNESS[b.name]) for b in MACHINE.touchdown_bearings]
E, RHO, NU = 2e11, 7850.0, 0.3


def bar(sections, disks=(), density=RHO, damping=0.0, modulus=E):
    """Return the shipped machine with another bare shaft, its bearings at the ends."""
    rotor = Rotor(
        sections=[dict(zip(("length", "outer_diameter", "inner_diameter"), s, strict=False)) for s in sections],
        disks=disks,
        elastic_modulus=modulus,
        density=density,
        poisson_ratio=NU,
        modal_damping_ratio=damping,
    )
    first, second = MACHINE.touchdown_bearings
    bearings = (
        first.model_copy(update={"position": 0.0}),
        second.model_copy(update={"position": rotor.length}),
    )
    rotor_only = {"rotor": rotor, "probes": (), "magnetic_bearings": (), "touchdown_bearings": bearings}
    return MACHINE.model_copy(update=rotor_only)


def undamped(machine):
    return machine.model_copy(update={"rotor": machine.rotor.model_copy(update={"modal_damping_ratio": 0.0})})


def section_constants(outer, inner):
    area, moment = math.pi / 4 * (outer**2 - inner**2), math.pi / 64 * (outer**4 - inner**4)
    return area, moment, float(shear_coefficient(inner / outer, NU)) * E / (2 * (1 + NU)) * area


def exact_determinant(machine, springs, speed_hz, frequency_hz):
    """Boundary determinant of the continuous Timoshenko shaft whirling at a signed frequency (x + i y turning with it).

    State (v, psi, M, Q) along z; M' = -Q - (I w^2 - J Omega w) psi, with Q = kGA (v' - psi), M = E I psi'.
    Wheels and springs are jumps of M and Q.  At a natural frequency M and Q vanish at both free ends.
    """
    w, omega = 2 * math.pi * frequency_hz, 2 * math.pi * speed_hz
    jumps = [(s.position, s.stiffness_x, 0.0) for s in springs]
    jumps += [
        (d.position, -d.mass * w**2, d.diametral_inertia * w**2 - d.polar_inertia * omega * w)
        for d in machine.rotor.disks
    ]
    state, start = np.eye(4)[:, :2], 0.0
    length = machine.rotor.length
    for section in machine.rotor.sections:
        area, moment, shearing = section_constants(section.outer_diameter, section.inner_diameter)
        field = np.zeros((4, 4))
        field[0, 1], field[0, 3], field[1, 2] = 1, 1 / shearing, 1 / (E * moment)
        field[2, 1], field[2, 3] = -RHO * moment * (w**2 - 2 * omega * w), -1
        field[3, 0] = -RHO * area * w**2
        end = start + section.length
        here = sorted(jump for jump in jumps if start <= jump[0] < end or (jump[0] == end == length))
        for position, force, moment_of in here:
            state = expm(field * (position - start)) @ state
            state[3] += force * state[0]
            state[2] -= moment_of * state[1]
            start = position
        state = expm(field * (end - start)) @ state
        start = end
    return np.linalg.det(state[2:] / np.array([[1e6], [1e8]]))


def exact_frequency(machine, springs, speed_hz, near_hz):
    """Return the natural frequency (signed: negative whirls backward) nearest to a guess, Hz."""
    low, high = sorted((0.995 * near_hz, 1.005 * near_hz))
    return brentq(lambda f: exact_determinant(machine, springs, speed_hz, f), low, high, xtol=1e-9, rtol=1e-13)


def signed(found):
    return found.frequencies * np.sign(found.whirl)


def test_slender_free_bar_is_euler_and_bernoulli():
    length, diameter = 2.0, 0.001
    model = build_rotor(bar([(length, diameter)]), max_element=length / 60)
    roots = np.array(
        [brentq(lambda b: math.cos(b) * math.cosh(b) - 1, r - 0.1, r + 0.1) for r in (4.73, 7.853, 10.996, 14.137)]
    )
    area, moment, _ = section_constants(diameter, 0.0)
    expected = (roots / length) ** 2 * math.sqrt(E * moment / (RHO * area)) / (2 * math.pi)
    modes = free_free(model, 4)
    np.testing.assert_array_equal(modes.frequencies[:2], 0)
    np.testing.assert_allclose(modes.frequencies[2:], expected, rtol=2e-5)
    # a free bar's ends swing with twice the rms of the mode: 2/sqrt(m)
    np.testing.assert_allclose(np.abs(modes.at(0.0)[2:]), 2 / math.sqrt(model.total_mass), rtol=1e-4)


@pytest.mark.parametrize("sections", [[(1.0, 0.2)], [(1.0, 0.2, 0.15)], [(0.3, 0.1), (0.4, 0.2, 0.05), (0.3, 0.08)]])
def test_stubby_free_bar_is_timoshenko(sections):
    machine = bar(sections)
    coarse, fine = (free_free(build_rotor(machine, max_element=h), 4).frequencies[2:] for h in (0.02, 0.01))
    for at_2h, at_h in zip(coarse, fine, strict=True):
        # error of the second order: extrapolated to vanishing elements
        assert at_h + (at_h - at_2h) / 3 == pytest.approx(exact_frequency(machine, [], 0.0, at_h), rel=2e-6)


@pytest.mark.parametrize(
    "sections", [[(1.0, 0.02)], [(1.0, 0.1)], [(1.0, 0.2)], [(0.4, 0.03), (0.2, 0.3), (0.4, 0.05)]]
)
def test_default_elements_are_within_a_thousandth(sections):
    machine = bar(sections)
    for frequency in free_free(build_rotor(machine), 4).frequencies[2:]:
        assert frequency == pytest.approx(exact_frequency(machine, [], 0.0, frequency), rel=1e-3)


@pytest.mark.parametrize(("diameter", "order"), [(0.002, 4), (0.15, 2)])
def test_order_of_convergence_with_element_length(diameter, order):
    machine = bar([(1.0, diameter)])
    errors = []
    for elements in (16, 32, 64):
        frequency = free_free(build_rotor(machine, max_element=1.0 / elements), 2).frequencies[3]
        errors.append(frequency / exact_frequency(machine, [], 0.0, frequency) - 1)
    assert min(errors) > 0  # a conforming element is too stiff
    for coarse, fine in pairwise(errors):
        assert math.log2(coarse / fine) == pytest.approx(order, abs=0.2)


def test_stubby_pinned_shaft_has_the_closed_form():
    """sin(k z) satisfies the pinned shaft at all speeds: with it the equations leave a quartic for each k."""
    length, diameter, speed = 1.0, 0.2, 300.0
    model = build_rotor(bar([(length, diameter)]), max_element=0.005)
    area, moment, shearing = section_constants(diameter, 0.0)
    stiff = [Spring(0.0, 1e14, 1e14), Spring(length, 1e14, 1e14)]
    expected = []
    for k in math.pi / length * np.arange(1, 4):
        # (kGA k^2 - rho A w^2) (E I k^2 + kGA - rho I w^2 + 2 rho I Omega w) = (kGA k)^2
        left = np.poly1d([-RHO * area, 0, shearing * k**2])
        right = np.poly1d([-RHO * moment, 2 * RHO * moment * 2 * math.pi * speed, E * moment * k**2 + shearing])
        roots = (left * right - (shearing * k) ** 2).roots / (2 * math.pi)
        expected += [min(roots[roots > 0]), max(roots[roots < 0])]
    found = whirl_modes(model, stiff, speed, 6)
    np.testing.assert_allclose(sorted(signed(found)), sorted(expected), rtol=5e-5)


@pytest.mark.parametrize("speed", [0.0, 90.0, -90.0, 400.0])
def test_rigid_rotor_on_two_springs_splits_into_its_conical_whirls(speed):
    stiffness, half = 1e5, 0.2
    model = build_rotor(bar([(0.4, 0.15, 0.05)], modulus=1e3 * E))
    found = whirl_modes(model, [Spring(0.0, stiffness, stiffness), Spring(2 * half, stiffness, stiffness)], speed, 4)
    translation = math.sqrt(2 * stiffness / model.total_mass)
    spin, tilting = model.polar_inertia * 2 * math.pi * abs(speed), 2 * stiffness * half**2
    split = math.sqrt(spin**2 + 4 * model.diametral_inertia * tilting)
    conical = [(split + spin) / (2 * model.diametral_inertia), (split - spin) / (2 * model.diametral_inertia)]
    expected = np.array([translation, -translation, conical[0], -conical[1]]) / (2 * math.pi)
    np.testing.assert_allclose(sorted(signed(found)), sorted(expected), rtol=1e-4)
    np.testing.assert_allclose(np.abs(found.whirl), 1, rtol=1e-9)


def test_jeffcott_rotor():
    """A wheel in the middle of a massless shaft on rigid bearings."""
    length, diameter, mass = 0.8, 0.03, 20.0
    disk = Disk(name="wheel", position=length / 2, mass=mass, polar_inertia=0.1, diametral_inertia=0.05)
    model = build_rotor(bar([(length, diameter)], [disk], density=1e-3))
    _, moment, shearing = section_constants(diameter, 0.0)
    compliance = length**3 / (48 * E * moment) + length / (4 * shearing)
    found = whirl_modes(model, [Spring(0.0, 1e12, 1e12), Spring(length, 1e12, 1e12)], 50.0, 2)
    np.testing.assert_allclose(found.frequencies, 1 / (2 * math.pi * math.sqrt(compliance * mass)), rtol=1e-4)


@pytest.mark.parametrize("speed", [0.0, 150.0])
def test_shipped_machine_on_springs_is_the_exact_continuous_shaft(speed):
    """Stepped shaft, wheel at its end, springs and gyroscopic moments, forward and backward."""
    machine = undamped(MACHINE)
    found = supported(machine, build_rotor(machine), STIFFNESS, speed, 6)
    for frequency in signed(found):
        assert frequency == pytest.approx(exact_frequency(machine, SPRINGS, speed, frequency), rel=1e-4)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_shipped_machine_on_springs_is_what_ross_finds():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import ross
    machine = undamped(MACHINE)
    model = build_rotor(machine, max_element=0.1)  # the same elements for both
    steel = ross.Material(name="steel", rho=RHO, E=E, Poisson=NU)
    ends = np.cumsum([section.length for section in machine.rotor.sections])
    elements = []
    for left, right in pairwise(model.nodes):
        section = machine.rotor.sections[int(np.searchsorted(ends, (left + right) / 2))]
        elements.append(ross.ShaftElement(L=right - left, idl=0.0, odl=section.outer_diameter, material=steel))

    def node(position):
        return int(np.argmin(np.abs(model.nodes - position)))

    disks = [
        ross.DiskElement(n=node(d.position), m=d.mass, Ip=d.polar_inertia, Id=d.diametral_inertia)
        for d in machine.rotor.disks
    ]
    bearings = [ross.BearingElement(n=node(s.position), kxx=s.stiffness_x, kyy=s.stiffness_y, cxx=0.0) for s in SPRINGS]
    rotor = ross.Rotor(elements, disks, bearings)
    for speed in (0.0, 200.0):
        ours = supported(machine, model, STIFFNESS, speed, 6)
        modal = rotor.run_modal(2 * math.pi * speed, num_modes=20)
        lateral = [k for k, shape in enumerate(modal.shapes) if shape.whirl in ("Forward", "Backward")][:6]
        np.testing.assert_allclose(ours.frequencies, modal.wn[lateral] / (2 * math.pi), rtol=1e-4)
        if speed:
            assert [modal.shapes[k].whirl == "Forward" for k in lateral] == list(ours.forward)


def test_bending_modes_are_orthonormal_and_carry_the_gyroscopic_inertia():
    model = build_rotor(MACHINE)
    modes = free_free(model, 5, attach=(0.11, 1.11))
    assert modes.n == 9
    assert modes.names[:3] == ("translation", "rotation", "bending 1")
    np.testing.assert_allclose(modes.vectors.T @ model.plane_mass @ modes.vectors, np.eye(9), atol=1e-9)
    squares = (2 * math.pi * modes.frequencies) ** 2
    reduced = modes.vectors.T @ model.plane_stiffness @ modes.vectors
    np.testing.assert_allclose(reduced, np.diag(squares), atol=1e-9 * squares.max())
    assert modes.gyro[1, 1] == pytest.approx(model.polar_inertia / model.diametral_inertia)
    np.testing.assert_allclose(modes.gyro[0], 0, atol=1e-12)  # translation does not tilt
    np.testing.assert_allclose(modes.damping[2:], 2 * 0.004 * 2 * math.pi * modes.frequencies[2:])


def test_rigid_modes_at_positions():
    model = build_rotor(MACHINE)
    modes = free_free(model, 0)
    at = modes.at([0.0, 0.5, 1.24])
    np.testing.assert_allclose(at[:, 0], 1 / math.sqrt(model.total_mass))
    np.testing.assert_allclose(
        at[:, 1], ([0.0, 0.5, 1.24] - np.array(model.centre_of_mass)) / math.sqrt(model.diametral_inertia)
    )


def test_compliance_of_a_free_bar_end_is_the_closed_form():
    """A load at the end of a slender free bar, carried by its inertia, deflects it there by F L^3 / (105 E I)."""
    length, diameter = 2.0, 0.005
    model = build_rotor(bar([(length, diameter)]))
    modes = free_free(model, 1, attach=(0.0,))
    moment = section_constants(diameter, 0.0)[1]
    assert compliance(modes, 0.0)[0, 0] == pytest.approx(length**3 / (105 * E * moment), rel=1e-4)


def test_attachment_modes_hold_the_exact_compliance_where_they_are_attached():
    model = build_rotor(MACHINE)
    places = np.array([0.11, 0.15, 1.11])
    modes = free_free(model, 2, attach=places)
    # loads in balance need no inertia: their work is that of the free, statically loaded rotor
    loads = np.linalg.svd(np.vstack([np.ones(3), places]))[2][2]
    rows = model.plane_rows(places)
    still = np.linalg.lstsq(model.plane_stiffness, rows.T @ loads, rcond=1e-13)[0]
    assert loads @ compliance(modes, places) @ loads == pytest.approx(loads @ rows @ still, rel=1e-8)
    few = free_free(model, 2)
    assert loads @ compliance(few, places) @ loads < 0.9 * loads @ rows @ still


def test_truncation_error_falls_with_modes_and_vanishes_at_attached_places():
    model = build_rotor(MACHINE)
    stiff = [Spring(s.position, 1e9, 1e9) for s in SPRINGS]
    worst = [truncation_error(free_free(model, n), stiff).frequencies.max() for n in (2, 4, 8, 16)]
    assert np.all(np.diff(worst) < 0)
    attached = truncation_error(free_free(model, 4, attach=[s.position for s in stiff]), stiff)
    np.testing.assert_allclose(attached.compliance, 0, atol=1e-9)
    assert attached.frequencies.min() > -1e-9
    assert attached.frequencies.max() < worst[2]  # six coordinates better than eight bending modes
    whole = truncation_error(free_free(model, len(model.plane_mass) - 2), stiff)
    np.testing.assert_allclose(whole.frequencies, 0, atol=1e-9)


def test_supports_of_two_stiffnesses_whirl_in_their_planes_at_standstill():
    model = build_rotor(MACHINE)
    soft, hard = {"NDE": 1e8, "DE": 1e8}, {"NDE": 3e8, "DE": 3e8}
    found = supported(MACHINE, model, {"NDE": (1e8, 3e8), "DE": (1e8, 3e8)}, 0.0, 6)
    expected = np.sort(np.concatenate([supported(MACHINE, model, k, 0.0, 8).frequencies[::2] for k in (soft, hard)]))
    np.testing.assert_allclose(found.frequencies, expected[:6], rtol=1e-8)
    np.testing.assert_allclose(found.whirl, 0, atol=1e-6)


def test_nearly_round_supports_are_as_round_ones():
    model = build_rotor(MACHINE)
    round_ = supported(MACHINE, model, STIFFNESS, 150.0, 6)
    nearly = supported(MACHINE, model, {"NDE": (1.31e8, 1.31e8 * (1 + 1e-9)), "DE": 4.03e8}, 150.0, 6)
    np.testing.assert_allclose(nearly.frequencies, round_.frequencies, rtol=1e-7)
    np.testing.assert_allclose(nearly.damping_ratio, round_.damping_ratio, rtol=1e-5)
    np.testing.assert_allclose(nearly.whirl, round_.whirl, atol=1e-5)


@pytest.mark.parametrize("stiffness", [STIFFNESS, {"NDE": (1e8, 2e8), "DE": (4e8, 3e8)}])
def test_whirl_modes_satisfy_the_full_equations_of_motion(stiffness):
    """Put back into all coordinates of the model: nothing of the reduction is left over, nor of the plane signs."""
    machine = undamped(MACHINE)
    model = build_rotor(machine)
    both = BothPlanes(model)
    found = supported(machine, model, stiffness, 120.0, 4)
    held = both.stiffness.copy()
    for end in machine.ends:
        x, y = np.broadcast_to(stiffness[end], 2)
        row = model.plane_rows(machine.bearing(end).position)
        held += x * both.in_plane_x(row).T @ both.in_plane_x(row)
        held += y * both.in_plane_y(row).T @ both.in_plane_y(row)
    omega = 2 * math.pi * 120.0
    for k, frequency in enumerate(found.frequencies):
        x, y = (found.modes.vectors @ part[:, k] for part in (found.amplitude_x, found.amplitude_y))
        shape = sum(
            both.in_plane_x(getattr(x, part)) * unit + both.in_plane_y(getattr(y, part)) * unit
            for part, unit in (("real", 1.0), ("imag", 1j))
        )
        lam = 2j * math.pi * frequency
        inertia = lam**2 * both.mass @ shape
        residual = inertia + lam * omega * both.gyroscopic @ shape + held @ shape
        flexible = np.linalg.solve(held, residual)  # as a displacement: forces at stiff coordinates weigh little
        assert np.linalg.norm(flexible[0::4]) + np.linalg.norm(flexible[1::4]) < 1e-4 * np.linalg.norm(shape)


def test_clockwise_rotation_mirrors_the_whirls():
    model = build_rotor(MACHINE)
    other = MACHINE.model_copy(update={"rotation": "cw"})
    ccw, cw = (supported(m, model, STIFFNESS, 150.0, 4) for m in (MACHINE, other))
    np.testing.assert_allclose(cw.frequencies, ccw.frequencies, rtol=1e-9)
    np.testing.assert_allclose(cw.whirl, ccw.whirl, atol=1e-9)
    x, y = ccw.at(0.5)
    np.testing.assert_allclose(np.sign(-np.imag(x.conj() * y)), np.where(ccw.forward, 1, -1))
    x, y = cw.at(0.5)
    np.testing.assert_allclose(np.sign(-np.imag(x.conj() * y)), np.where(cw.forward, -1, 1))


def test_damping_of_supports_and_of_the_rotor():
    stiffness, damper = 1e5, 60.0
    machine = bar([(0.4, 0.15)], damping=0.02)
    model = build_rotor(machine)
    found = supported(
        machine, model, dict.fromkeys(("NDE", "DE"), stiffness), 0.0, 2, dict.fromkeys(("NDE", "DE"), damper)
    )
    ratio = 2 * damper / (2 * math.sqrt(2 * stiffness * model.total_mass))
    np.testing.assert_allclose(found.damping_ratio, ratio, rtol=1e-3)
    undamped_hz = math.sqrt(2 * stiffness / model.total_mass) / (2 * math.pi)
    np.testing.assert_allclose(found.frequencies, undamped_hz * math.sqrt(1 - ratio**2), rtol=1e-4)
    # nearly free: the bending mode keeps the ratio of the rotor's own damping
    bending = supported(machine, model, dict.fromkeys(("NDE", "DE"), 1.0), 0.0, 6)
    assert bending.damping_ratio[-1] == pytest.approx(0.02, rel=1e-4)


def test_frequencies_over_support_stiffness_run_from_rigid_to_pinned():
    machine = undamped(MACHINE)
    model = build_rotor(machine)
    places = [bearing.position for bearing in machine.touchdown_bearings]
    stiffnesses = np.logspace(4, 12, 9)
    found = np.array(
        [supported(machine, model, dict.fromkeys(machine.ends, k), 0.0, 6).frequencies[::2] for k in stiffnesses]
    )
    assert np.all(np.diff(found, axis=0) > 0)  # stiffer supports raise every frequency
    rigid = free_free(model, 0)
    soft = np.linalg.eigvalsh(1e4 * rigid.at(places).T @ rigid.at(places))
    np.testing.assert_allclose(found[0, :2], np.sqrt(soft) / (2 * math.pi), rtol=1e-3)
    assert found[0, 2] == pytest.approx(free_free(model, 1).frequencies[2], rel=1e-3)
    for row in (4, 8):  # 1e8 N/m, and as good as pinned
        springs = [Spring(place, stiffnesses[row], stiffnesses[row]) for place in places]
        for frequency in found[row]:
            assert frequency == pytest.approx(exact_frequency(machine, springs, 0.0, frequency), rel=1e-4)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda model: free_free(model, 500), "elastic modes per plane"),
        (lambda model: free_free(model, -1), "bending modes"),
        (lambda model: free_free(model, 2, attach=(0.1, 0.1)), "the same"),
        (lambda model: free_free(model, 2, attach=(3.0,)), "outside the shaft"),
        (lambda model: supported(MACHINE, model, {"NDE": 1e8}), "end 'DE'"),
        (lambda model: supported(MACHINE, model, {"NDE": 1e8, "DE": -1.0}), "not positive"),
        (lambda model: whirl_modes(model, SPRINGS, 0.0, 0), "at least one"),
    ],
)
def test_what_cannot_be_computed_is_refused(call, words):
    with pytest.raises(InputError, match=words):
        call(build_rotor(MACHINE))
