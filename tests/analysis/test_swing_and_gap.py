"""Swing and clearance circle, against rotors that swing by an independent integration of the pendulum's own equations."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from tdbsim.machine import Machine, load_machine, parse_machine
from tdbsim.modes import supported
from tdbsim.rotor import RotorModel, build_rotor, static_loads

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.expected_lines import expected_lines
from tdbmon.analysis.gap import NoCircle, fit_gap, settled_from
from tdbmon.analysis.rest import RestTravel, path_radius, total_travel
from tdbmon.analysis.settled_arc import Cells
from tdbmon.analysis.summary import summary_lines
from tdbmon.analysis.swing import _peak, _track, carried_shares, find_swing, predicted_swing, predicted_ways
from tdbmon.estimate import Estimate
from tdbmon.history.extract import features_of
from tdbmon.record.read import read
from tdbmon.report.sections.findings import rotor_findings
from tdbmon.shipped import shipped
from tests.analysis.planes import G, planes_of
from tests.identify import drops

RATE = 4000.0
MACHINES = Path(__file__).parent.parent / "machines"


@cache
def pendulum(machine_rotor, radii, seconds, amplitude, damping):
    """Angles and their rates of two coupled pendulums: the rigid rotor's mass on two paths, by Lagrange's equations.

    Kinetic energy holds the paths' full velocity, so the period grows with the amplitude as a pendulum's does.
    """
    machine, rotor = machine_rotor
    a, b = (machine.bearing(end).position - rotor.centre_of_mass for end in machine.ends)
    turn = np.linalg.inv(np.array([[1.0, a], [1.0, b]]))
    mass = turn.T @ np.diag([rotor.total_mass, rotor.diametral_inertia]) @ turn
    rings = np.array([t.inner_ring_inertia / t.journal_radius**2 for t in machine.touchdown_bearings])
    weight = G * mass.sum(axis=1)
    r = np.array(radii)

    def motion(_, q):
        # x = r sin, y = -r cos at each end; the mass couples both directions
        s, c, rate = np.sin(q[:2]), np.cos(q[:2]), q[2:]
        m = mass * np.outer(r, r) * (np.outer(c, c) + np.outer(s, s)) + np.diag(rings * r**2)
        spin = mass * np.outer(r, r) * (np.outer(c, -s) + np.outer(s, c))
        force = -weight * r * s - spin @ rate**2 - 2 * damping * np.diag(m) * rate
        return np.concatenate([rate, np.linalg.solve(m, force)])

    time = np.arange(int(seconds * RATE)) / RATE
    start = np.array([*amplitude, 0.0, 0.0])
    solved = solve_ivp(motion, (0, seconds), start, "DOP853", time, rtol=1e-8, atol=1e-9)
    return time, solved.y[:2], solved.y[2:]


@dataclass(frozen=True, eq=False)
class Case:
    """A machine with its rotor, hashable by identity."""

    machine: Machine
    rotor: RotorModel

    def __iter__(self):
        return iter((self.machine, self.rotor))


def swing(case, radii, seconds, amplitude, *, seed=0, noise=0.3e-6, centre=(0.0, 0.0), compliance=0.0, damping=0.15):
    """What the ends' centres do; `compliance` (m for a load of one weight) lengthens the radius with the load.

    The load is the normal force on the rigid rotor: weight less mass times acceleration, of both ends and along the radius too.
    """
    time, angles, _ = pendulum(case, radii, seconds, amplitude, damping)
    rng = np.random.default_rng(seed)
    carried = np.array([list(shares.values()) for shares in carried_shares(*case).values()])
    outward = np.stack([np.sin(angles), -np.cos(angles)], axis=-1)  # (end, n, axis)
    radius = np.array(radii)[:, None] * np.ones_like(angles)
    for _ in range(4 if compliance else 0):  # the radius follows a load that depends on how it moves
        moved = np.einsum("ij,jna->ina", carried, radius[..., None] * outward)
        pushed = np.gradient(np.gradient(moved, axis=1), axis=1) * RATE**2
        radius = np.array(radii)[:, None] + compliance * (np.cos(angles) - (pushed * outward).sum(axis=-1) / G - 1)
    paths = dict(zip(case.machine.ends, radius[..., None] * outward + np.array(centre), strict=True))
    return planes_of(time, {end: path + noise * rng.standard_normal(path.shape) for end, path in paths.items()})


def _stiffened(machine):
    """A rotor with forty times its stiffness: the pendulum equations above know no bending."""
    harder = machine.rotor.model_copy(update={"elastic_modulus": machine.rotor.elastic_modulus * 40})
    machine = machine.model_copy(update={"rotor": harder})
    return Case(machine, build_rotor(machine))


@pytest.fixture(scope="module")
def stiff():
    return _stiffened(load_machine(shipped("coastdown/machine.toml")))


@pytest.mark.parametrize("radii", [(290e-6, 310e-6), (320e-6, 280e-6)])
def test_both_radii_come_back_from_the_swing(stiff, radii):
    machine, rotor = stiff
    found = find_swing(swing(stiff, radii, 12.0, (0.25, 0.18)), machine, rotor, 0.0)
    assert all(each.known for each in found.frequencies)
    for end, truth in zip(machine.ends, radii, strict=True):
        assert found.gap[end].low <= truth <= found.gap[end].high
        assert found.gap[end].value == pytest.approx(truth, rel=0.004)


def test_a_wide_swing_is_slower_and_the_radius_is_not_mistaken(stiff):
    """At 0.4 rad the second-order term is 1 % of the frequency: left out, the radius would be 2 % too large."""
    machine, rotor = stiff
    wide = find_swing(swing(stiff, (300e-6, 300e-6), 12.0, (0.40, 0.40), damping=0.0), machine, rotor, 0.0)
    assert wide.gap["NDE"].value == pytest.approx(300e-6, rel=0.004)


def test_frequency_intervals_hold_the_truth(stiff):
    """40 noise seeds; a small swing, so that the linear pendulum is the truth."""
    machine, rotor = stiff
    clean = find_swing(swing(stiff, (300e-6, 290e-6), 8.0, (0.05, 0.04), noise=1e-12), machine, rotor, 0.0)
    truth = clean.frequencies[0].value
    noisy = [
        find_swing(swing(stiff, (300e-6, 290e-6), 8.0, (0.05, 0.04), seed=s), machine, rotor, 0.0) for s in range(40)
    ]
    inside = [n.frequencies[0].low <= truth <= n.frequencies[0].high for n in noisy]
    assert np.mean(inside) >= 0.9


def test_no_swing_is_invented_from_noise(machine, rotor):
    rng = np.random.default_rng(0)
    time = np.arange(int(12 * RATE)) / RATE
    still = {end: [0, -300e-6] + 0.3e-6 * rng.standard_normal((len(time), 2)) for end in machine.ends}
    assert find_swing(planes_of(time, still), machine, rotor, 0.0) is None


def test_too_short_a_stretch_gives_no_swing(stiff):
    machine, rotor = stiff
    assert find_swing(swing(stiff, (300e-6, 300e-6), 2.0, (0.2, 0.2)), machine, rotor, 0.0) is None


TRAVEL = RestTravel(1e-6, 16e-6, 3e-6, 1e-6, 9e-6)


def test_circle_intervals_hold_centre_and_radius(stiff):
    """60 swings that die down, with a compliance within the prior's spread about the machine file's value."""
    machine, rotor = stiff
    shares = carried_shares(machine, rotor)["NDE"]
    inside = []
    for seed in range(60):
        rng = np.random.default_rng(1000 + seed)
        centre = tuple(rng.uniform(-20e-6, 20e-6, 2))
        compliance = TRAVEL.per_load * (1 + 0.35 * rng.standard_normal())
        planes = swing(
            stiff, (300e-6, 290e-6), 1.5, (0.6, 0.5), seed=seed, centre=centre, compliance=compliance, damping=0.8
        )
        gap = fit_gap(planes, "NDE", machine, TRAVEL, 0.0, shares=shares)
        truth = (*centre, 300e-6)
        inside.append([e.low <= t <= e.high for e, t in zip((*gap.centre, gap.radius), truth, strict=True)])
    assert (np.mean(inside, axis=0) >= 0.9).all()


def test_the_last_digit_of_a_clock_changes_no_interval(stiff):
    """A rate of 19999.99998 Hz is one of 20 kHz: neighbours and blocks are counted alike."""
    machine, rotor = stiff
    time = np.arange(40_000) / 20e3
    slow = swing(stiff, (300e-6, 290e-6), 2.0, (0.6, 0.5), noise=0.0, compliance=9e-6)
    rng = np.random.default_rng(3)
    paths = {
        end: np.column_stack([np.interp(time, slow.time.to_numpy(), row) for row in slow.displacement.sel(end=end)])
        + 0.3e-6 * rng.standard_normal((time.size, 2))
        for end in machine.ends
    }
    shares = carried_shares(machine, rotor)["NDE"]
    found = [
        fit_gap(planes_of(time * clock, paths), "NDE", machine, TRAVEL, 0.0, shares=shares).radius
        for clock in (1.0, 1 - 1e-9, 1 + 1e-9)
    ]
    for each in found[1:]:
        assert (each.value, each.low, each.high) == pytest.approx(
            (found[0].value, found[0].low, found[0].high), abs=1e-9
        )


def test_three_blocks_that_happen_to_agree_make_no_sure_bin():
    """Its own scatter, taken for its error, gave a bin at the end of an arc the weight of a thousand others."""
    rng = np.random.default_rng(0)
    seen = np.array([20] * 12 + [3, 2])  # blocks of each bin
    bins = np.repeat(np.arange(len(seen)), seen)
    radius = 300e-6 + 0.5e-6 * rng.standard_normal(len(bins))
    radius[bins == 12] = 299e-6
    means = np.column_stack([np.deg2rad(3.0 * bins), radius, np.ones(len(bins))])
    arc = Cells(np.zeros(2), 0.5, bins, np.arange(len(bins)), means).arc()
    assert len(arc.angle) == 13
    assert np.median(arc.sigma[:12]) == pytest.approx(0.5e-6 / np.sqrt(20), rel=0.3)
    assert arc.sigma[12] > 2.5 * np.median(arc.sigma[:12])


@pytest.mark.parametrize(("end", "radius"), [("NDE", 300e-6), ("DE", 290e-6)])
def test_ends_that_swing_against_each_other_tell_the_radius_all_the_same(stiff, end, radius):
    """The rotor's mass couples them: the load of an end that swings alone made the arc 14 to 17 um too small, +- 7."""
    machine, rotor = stiff
    planes = swing(stiff, (300e-6, 290e-6), 10.0, (0.5, -0.2), compliance=9e-6)
    from_swing = find_swing(planes, machine, rotor, 0.0).gap[end]
    found = fit_gap(planes, end, machine, TRAVEL, 0.0, from_swing, carried_shares(machine, rotor)[end])
    assert found.from_arc.value == pytest.approx(radius, abs=3e-6)
    assert found.from_arc.low <= radius <= found.from_arc.high
    assert found.agrees


@pytest.mark.parametrize(("end", "other", "radius"), [("NDE", "DE", 300e-6), ("DE", "NDE", 290e-6)])
def test_an_end_seen_alone_tells_its_circle_no_better_than_the_other_may_have_moved_it(stiff, end, other, radius):
    """The same swing without the other end: the intervals left out what it does to the load."""
    machine, rotor = stiff
    planes = swing(stiff, (300e-6, 290e-6), 10.0, (0.5, -0.2), compliance=9e-6)
    planes["plane"] = ("end", ["probe" if each == end else "none" for each in machine.ends])
    planes.displacement.loc[{"end": other}] = np.nan
    found = fit_gap(planes, end, machine, TRAVEL, 0.0, shares=carried_shares(machine, rotor)[end])
    assert found.from_arc.value < radius - 10e-6
    for told, truth in zip((*found.centre, found.radius, found.from_arc), (0.0, 0.0, radius, radius), strict=True):
        assert told.low <= truth <= told.high
    assert found.radius.apart == found.radius  # drops that show the other end do not share it
    assert found.alone == pytest.approx(17e-6)


def test_a_probe_lost_at_one_end_leaves_the_other_an_air_gap_that_holds():
    """It was 259 um (252 to 265), and a fit of the same drop was said to exclude it."""
    machine = drops.machine()
    record = drops.drop(speed=97.0, levitated=0.1, seconds=6.0).drop_vars(machine.channel_in_file("DE_B"))
    found = analyse(record, machine)
    gap = found.ends["NDE"].air_gap
    assert gap.low <= drops.TRUTH["NDE.radial_gap"] <= gap.high
    said = next(c for c in found.checks if c.check == "load on the ring")
    assert said.passed
    assert said.channel == "NDE"
    assert "may be wrong by 17.7 um" in said.detail


def test_left_out_the_load_would_shift_the_centre(stiff):
    """The circle of a loaded swing, fitted with the right compliance and with none: the second is far off."""
    machine, _ = stiff
    planes = swing(stiff, (300e-6, 290e-6), 2.0, (0.5, 0.4), compliance=9e-6, damping=0.5)
    right = fit_gap(planes, "NDE", machine, TRAVEL, 0.0)
    assert right.centre[1].value == pytest.approx(0, abs=3e-6)
    rigid = RestTravel(1e-6, 16e-6, 3e-6, 1e-6, 1e-9)
    wrong = fit_gap(planes, "NDE", machine, rigid, 0.0)
    assert wrong.centre[1].value < -10e-6


def test_the_swing_settles_the_circle_where_both_agree(stiff):
    machine, rotor = stiff
    planes = swing(stiff, (300e-6, 290e-6), 10.0, (0.3, 0.25), compliance=9e-6)
    found = find_swing(planes, machine, rotor, 0.0)
    alone = fit_gap(planes, "NDE", machine, TRAVEL, 0.0)
    both = fit_gap(planes, "NDE", machine, TRAVEL, 0.0, found.gap["NDE"])
    assert both.agrees
    assert both.radius.high - both.radius.low < alone.radius.high - alone.radius.low
    assert both.radius.low <= 300e-6 <= both.radius.high


def test_a_bounce_ends_before_settling_begins():
    time = np.arange(4000) / RATE
    y = np.full(len(time), -300e-6)
    y[400:600] += 100e-6  # one bounce
    planes = planes_of(time, {"NDE": np.column_stack([0 * y, y])})
    assert settled_from(planes, "NDE", 250e-6) == pytest.approx(time[600])


def test_a_rotor_that_keeps_bouncing_never_settles():
    time = np.arange(4000) / RATE
    y = -300e-6 + 200e-6 * np.abs(np.sin(2 * np.pi * 20 * time))
    planes = planes_of(time, {"NDE": np.column_stack([0 * y, y])})
    found = settled_from(planes, "NDE", 250e-6)
    assert isinstance(found, NoCircle)
    assert "still lifts off by more than 25 um at 0.99" in found.why


def test_a_record_that_ends_in_the_first_contact_is_said_to_fall_and_not_to_bounce():
    time = np.arange(900) / RATE  # 0.12 s after it touches
    y = -np.minimum(0.5 * 9.81 * np.maximum(time - 0.1, 0) ** 2, 290e-6)
    found = settled_from(planes_of(time, {"NDE": np.column_stack([0 * y, y])}), "NDE", 250e-6, start=0.1)
    assert isinstance(found, NoCircle)
    assert "the shaft still falls at 0.107" in found.why and "lifts off" not in found.why


def test_an_arc_too_short_for_a_circle_gives_none(machine):
    time = np.arange(4000) / RATE
    rng = np.random.default_rng(0)
    still = [0, -300e-6] + 0.3e-6 * rng.standard_normal((len(time), 2))
    found = fit_gap(planes_of(time, {"NDE": still}), "NDE", machine, TRAVEL, 0.0)
    assert isinstance(found, NoCircle)
    assert "too short to fit a circle" in found.why


def test_an_arc_that_tells_the_radius_badly_says_how_badly(machine):
    """It settles soon and for long: what is wrong is not that."""
    time = np.arange(12000) / RATE
    rng = np.random.default_rng(0)
    angle = 0.25 * np.sin(2 * np.pi * 9 * time)
    radius = 300e-6 + 30e-6 * np.repeat(rng.standard_normal(60), 200)
    path = np.column_stack([radius * np.sin(angle), -radius * np.cos(angle)])
    found = fit_gap(planes_of(time, {"NDE": path}), "NDE", machine, TRAVEL, 0.0)
    assert isinstance(found, NoCircle)
    assert "determines the radius at rest only to ±" in found.why
    assert "settles at 0 s" in found.why


@pytest.mark.parametrize(
    ("narrow_deg", "with_swing", "said"),
    [
        (1.0, False, "depends on one part of that time alone"),
        (1.0, True, "depends on one part of that time alone"),
        (3.5, False, "determines the radius"),
    ],
)
def test_an_arc_that_a_part_of_the_time_alone_is_wide_enough_for_tells_no_circle(machine, narrow_deg, with_swing, said):
    """What the circle rests on was never left out: a radius to 7 um was told, whatever bent the arc in that part."""
    time = np.arange(4800) / RATE
    rng = np.random.default_rng(0)
    angle = np.deg2rad(np.where(time < 0.2, 25.0, narrow_deg)) * np.sin(2 * np.pi * 30 * time)
    radius = 300e-6 + 0.3e-6 * rng.standard_normal(time.size)
    path = np.column_stack([radius * np.sin(angle), -radius * np.cos(angle)])
    swung = Estimate.from_sigma(300e-6, 1e-6, "um", "swing") if with_swing else None
    found = fit_gap(planes_of(time, {"NDE": path}), "NDE", machine, TRAVEL, 0.0, swung)
    assert isinstance(found, NoCircle)
    assert said in found.why


def test_an_end_without_samples_says_so(machine):
    time = np.arange(4000) / RATE
    planes = planes_of(time, {"NDE": np.full((len(time), 2), np.nan)})
    lost = settled_from(planes, "NDE", 250e-6), fit_gap(planes, "NDE", machine, TRAVEL, 0.1)
    assert all(isinstance(found, NoCircle) and "has a value" in found.why for found in lost)


def test_a_line_beyond_half_the_sampling_rate_is_not_found():
    assert _peak(np.ones((2, 1000)), rate=20.0, near=45.0) is None


def test_a_hum_makes_no_ellipse_of_a_round_clearance(machine):
    """It shifts the arc from one part of the time to the next; 61 (42 to 80) um had been told of a round ring (synthetic)."""
    record = read(shipped("short/drop_100.nc"))
    for k, probe in enumerate(machine.probes):
        record[probe.name] = record[probe.name] + 5e-6 * np.sin(2 * np.pi * 60 * record.time.values + k)
    oval = analyse(record, machine).ends["NDE"].gap.oval
    assert oval.low == 0.0
    assert oval.high > oval.value


def lacking(planes, lost):
    """The same with some samples missing at both ends."""
    found = planes.copy(deep=True)
    found.displacement.values[:, :, lost] = np.nan
    return found


@pytest.fixture(scope="module")
def steady(stiff):
    """Twelve seconds of a swing that does not die down."""
    return swing(stiff, (290e-6, 310e-6), 12.0, (0.25, 0.18), damping=0.0)


def test_a_pause_does_not_slow_the_swing(stiff, steady):
    """0.45 s of 12 s: at the mean rate over all it would swing at 27.5 instead of 28.5 Hz, on a radius of 313 um."""
    machine, rotor = stiff
    time = steady.time.to_numpy()
    whole = find_swing(steady, machine, rotor, 0.0)
    found = find_swing(steady.isel(time=(time < 3.0) | (time >= 3.45)), machine, rotor, 0.0)
    assert found.frequencies[0].value == pytest.approx(whole.frequencies[0].value, rel=1e-4)
    assert found.gap["NDE"].value == pytest.approx(290e-6, rel=0.004)


@pytest.mark.parametrize("share", [0.005, 0.019, 0.05])
def test_peaks_cut_off_do_not_quicken_the_swing(stiff, steady, share):
    """What is left must not be joined: with 1.9 % cut off it would swing 1.9 % faster, on a radius of 279 um."""
    machine, rotor = stiff
    x = np.abs(steady.displacement.sel(end="NDE", axis="x").to_numpy())
    whole = find_swing(steady, machine, rotor, 0.0)
    found = find_swing(lacking(steady, x > np.quantile(x, 1 - share)), machine, rotor, 0.0)
    assert found.frequencies[0].value == pytest.approx(whole.frequencies[0].value, rel=2e-4)
    assert found.gap["NDE"].value == pytest.approx(290e-6, rel=0.004)


def test_dropouts_do_not_quicken_the_swing(stiff, steady):
    machine, rotor = stiff
    whole = find_swing(steady, machine, rotor, 0.0)
    found = find_swing(lacking(steady, (10 * steady.time.to_numpy()) % 1 < 0.02), machine, rotor, 0.0)
    assert found.frequencies[0].value == pytest.approx(whole.frequencies[0].value, rel=2e-4)
    assert found.gap["NDE"].value == pytest.approx(290e-6, rel=0.004)


def test_windows_that_lack_a_tenth_of_their_samples_tell_no_swing(stiff, steady):
    machine, rotor = stiff
    assert find_swing(lacking(steady, (2 * steady.time.to_numpy()) % 1 < 0.12), machine, rotor, 0.0) is None


@pytest.mark.parametrize("missing", ["pause", "dropouts"])
def test_no_velocity_reaches_across_what_is_missing(stiff, missing):
    """A jump over half a swing would be a load of several weights, which shifts the centre."""
    machine, _ = stiff
    planes = swing(stiff, (300e-6, 290e-6), 2.0, (0.5, 0.4), compliance=9e-6, damping=0.5)
    time = planes.time.to_numpy()
    lost = (10 * time) % 1 < 0.2  # 20 ms ten times a second
    cut = planes.isel(time=~lost) if missing == "pause" else lacking(planes, lost)
    whole, found = (fit_gap(each, "NDE", machine, TRAVEL, 0.0) for each in (planes, cut))
    assert found.radius.low <= 300e-6 <= found.radius.high
    assert found.from_arc.value == pytest.approx(whole.from_arc.value, abs=3e-6)
    assert found.centre[1].value == pytest.approx(whole.centre[1].value, abs=3e-6)


def test_two_swings_near_each_other_are_not_taken_from_one_line():
    """The expander's swings are 5 % apart: the highest line within 20 % of either was one, twice, and stopped the analysis."""
    machine = load_machine(MACHINES / "expander_4kg.toml")
    case = Case(machine, build_rotor(machine))
    radii = (103e-6, 103e-6)
    found = find_swing(swing(case, radii, 10.0, (0.3, 0.0), noise=0.1e-6), *case, 0.0)
    low, high = sorted(each.value for each in found.frequencies)
    assert high / low == pytest.approx(1.05, abs=0.02)
    for end, radius in zip(machine.ends, radii, strict=True):
        assert found.gap[end].low <= radius <= found.gap[end].high


@pytest.fixture(scope="module")
def dumbbell():
    """A stiff rotor with a heavy wheel outside each bearing: its moment of inertia makes the conical swing the slower one."""
    data = tomllib.loads(shipped("machines/template.toml").read_text())
    wheel = {"mass": "90 kg", "polar_inertia": "1.5 kg m^2", "diametral_inertia": "0.8 kg m^2"}
    wheels = data["rotor"]["disks"]
    wheels[:] = [each for each in wheels if each["name"] != "impeller"]
    wheels += [{"name": "impeller", "position": "1240 mm", **wheel}, {"name": "turbine", "position": "0 mm", **wheel}]
    return _stiffened(parse_machine(data))


def test_swings_are_named_by_their_shape_and_not_by_their_order(stiff, dumbbell):
    radii = tuple(b.radial_gap.nominal * 1.1 for b in dumbbell.machine.touchdown_bearings)
    found = find_swing(swing(dumbbell, radii, 14.0, (0.2, 0.05)), *dumbbell, 0.0)
    assert found.frequencies[0].value < found.frequencies[1].value
    (a, b), (c, d) = (shape.values() for shape in found.shapes)
    assert a * b < 0 < c * d
    assert found.ways == predicted_ways(*dumbbell) == ("conical", "parallel")
    assert [each.method.split()[0] for each in found.frequencies] == ["conical", "parallel"]
    assert predicted_ways(*stiff) == ("parallel", "conical")


def test_a_slender_rotor_is_expected_to_swing_as_slowly_as_it_bends():
    """Of a compressor of 1.9 t (synthetic) the swing was expected at 26.2 Hz, and the line at 21.8 Hz had no name."""
    machine = load_machine(shipped("coastdown/machine.toml"))
    softer = machine.rotor.model_copy(update={"elastic_modulus": 0.03 * machine.rotor.elastic_modulus})
    slender = machine.model_copy(update={"rotor": softer})
    rotor = build_rotor(slender)
    loads = static_loads(slender, rotor)
    radii = {b.name: path_radius(b, total_travel(b, loads[b.name])) for b in slender.touchdown_bearings}
    on_springs = supported(slender, rotor, {end: loads[end] / radii[end] for end in slender.ends})
    expected = predicted_swing(slender, rotor)
    # rings that roll along make it slower by less
    assert expected == pytest.approx(on_springs.frequencies[::2][:2], rel=0.03)
    assert expected[0] < 0.9 * predicted_swing(machine, build_rotor(machine))[0]
    band = expected_lines(slender, rotor, None)[0]
    assert band.low < on_springs.frequencies[0] < band.high


def test_a_higher_swing_that_is_told_alone_stays_the_higher_one(stiff, coastdown, monkeypatch):
    """It was told as swing 1 of 47 Hz, in a history of 30, and its band was named so."""
    planes = swing(stiff, (300e-6, 290e-6), 12.0, (0.25, 0.05))
    both = find_swing(planes, *stiff, 0.0)

    def two_off(*of):  # too few of the windows agree on the lower one
        lower, higher = _track(*of)
        lower = lower[:5]
        lower[:2, 0] *= 1.01
        return [lower, higher]

    monkeypatch.setattr("tdbmon.analysis.swing._track", two_off)
    alone = find_swing(planes, *stiff, 0.0)
    lower, higher = alone.frequencies
    assert not lower.known and "only the other swing" in lower.why
    assert higher.value == pytest.approx(both.frequencies[1].value, rel=1e-6)
    assert alone.shapes[0] is None and alone.ways == ("", both.ways[1])
    bands = {band.name: (band.low + band.high) / 2 for band in expected_lines(*stiff, alone) if band.swing}
    assert bands["swing 1"] == pytest.approx(both.frequencies[0].value, rel=0.1)
    assert bands["swing 2"] == pytest.approx(higher.value)
    analysis = replace(coastdown, swing=alone)
    told = [line.split()[:2] for line in summary_lines(analysis) if line.startswith("swing")]
    assert told == [["swing", "2,"]]
    features = {feature.name: feature.estimate for feature in features_of(analysis)}
    assert not features["swing_1_hz"].known and features["swing_2_hz"].value == higher.value
    (first, second) = (each for each in rotor_findings(analysis) if "swing in the clearance" in each.name)
    assert not first.estimate.known and second.estimate.value == higher.value
