"""Gravity as a scale: records whose times or lengths are wrong fall too fast or too slowly, and are told so."""

from __future__ import annotations

import re
from functools import cache

import pytest
from tdbsim.machine import load_machine
from tdbsim.sensors import ProbeChain, SensorChain
from tdbsim.simulate import DropPlan, simulate

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.axes import to_planes
from tdbmon.analysis.free_fall import check_free_fall, check_probe_scales, probe_ratio, undated
from tdbmon.analysis.release import find_release
from tdbmon.analysis.summary import summary_lines
from tdbmon.record.assign import assign
from tdbmon.record.read import read
from tdbmon.shipped import shipped
from tests.analysis.test_release import drop
from tests.diagnosis.simulated import record
from tests.shipped_drops import analysed, recorded
from tests.sim.changed_machine import changed

NAMES = ("coastdown/drop_100", "short/drop_060", "short/drop_100", "short/drop_150", "short/drop_210", "loose/drop_060")


@cache
def planes_of(name):
    """The first 0.3 s of a shipped record at the bearing planes."""
    machine = load_machine(shipped(f"{name.partition('/')[0]}/machine.toml"))
    return to_planes(assign(recorded(name), machine), machine).sel(time=slice(0, 0.3))


def fallen(name, machine, *, longer=1.0, larger=1.0):
    """Checks of a shipped record with times and lengths read so many times too long."""
    planes = planes_of(name)
    changed = planes.assign_coords(time=planes.time.values * longer)
    changed["displacement"] = changed.displacement * larger
    changed.attrs["sampling_hz"] = planes.attrs["sampling_hz"] / longer
    return check_free_fall(find_release(changed, machine, float(name[-3:]) * 0.95, [305.4]), machine)


@pytest.mark.parametrize("name", NAMES)
def test_a_true_record_falls_with_gravity(name, machine):
    checks = fallen(name, machine)
    assert [check.channel for check in checks] == ["NDE", "DE"]
    assert all(check.passed for check in checks)
    shares = [float(check.detail.split(", ")[1].split()[0]) for check in checks]
    assert shares == pytest.approx([1.0, 1.0], abs=0.1)  # unbalance and bending have a share in it


@pytest.fixture(scope="module")
def overhung(machine):
    """A healthy machine with a wheel of 35 kg beyond the drive end's bearing, and its probes at the shaft's ends."""
    (wheel,) = machine.rotor.disks
    heavy = wheel.model_copy(update={"mass": 35.0, "polar_inertia": 0.5, "diametral_inertia": 0.28})
    far = {"NDE": 0.02, "DE": 1.225}
    probes = tuple(probe.model_copy(update={"position": far[probe.end]}) for probe in machine.probes)
    return changed(machine, rotor={"disks": (heavy,)}, probes=probes)


@pytest.mark.parametrize(("speed", "seed"), [(300.0, 3), (300.0, 4)])
def test_once_per_revolution_in_the_fall_accuses_neither_scales_nor_probes(speed, seed, overhung):
    """A wheel that bends the shaft: it turns on in the fall with micrometres, which look like a half of gravity."""
    sensors = SensorChain(probe=ProbeChain(noise=0.25e-6, hum=0.1e-6), speed_noise_hz=0.05, keyphasor_width=0.1)
    drop_ = simulate(overhung, DropPlan(speed, 0.12, levitated=0.1, sensors=sensors, seed=seed), bending=16)
    found = analyse(drop_, overhung)
    shares = [-fall.acceleration[1] / 9.80665 for fall in found.release.falls.values()]
    assert max(shares) > 1.15  # or the case tests nothing
    assert not [check for check in found.checks if check.check in ("free fall", "probe scales") and not check.passed]
    halved = simulate(overhung, DropPlan(60.0, 0.12, levitated=0.1, sensors=sensors, seed=seed), bending=16)
    for probe in overhung.probes:
        halved[probe.name] = halved[probe.name] * 0.5
    checks = [check for check in analyse(halved, overhung).checks if check.check == "free fall"]
    assert len(checks) == 2 and not any(check.passed for check in checks)  # at 60 Hz nothing is excused


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(("longer", "larger"), [(2.0, 1.0), (0.5, 1.0), (1.0, 2.0), (1.0, 0.5)])
def test_a_wrong_time_base_or_sensitivity_is_seen_in_the_fall(name, longer, larger, machine):
    for check in fallen(name, machine, longer=longer, larger=larger):
        assert not check.passed
        share = float(check.detail.split(", ")[1].split()[0])
        assert share == pytest.approx(larger / longer**2, rel=0.35)
        assert "sampling rate" in check.detail
        assert "sensitivity" in check.detail


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(("longer", "larger"), [(1.0, 1.25), (0.9, 1.0), (1.0, 1 / 1.6), (1.3, 1.0)])
def test_a_scale_that_is_wrong_by_a_quarter_does_not_pass(name, longer, larger, machine):
    assert not all(check.passed for check in fallen(name, machine, longer=longer, larger=larger))


@pytest.mark.parametrize(("longer", "said"), [(2.0, "2 times too low"), (0.5, "2 times too high")])
def test_fall_and_speed_signal_together_prove_the_time_axis(longer, said, machine):
    """Two messages, each with causes of its own, stood apart."""
    record = read(shipped("short/drop_100.nc"))
    found = analyse(record.assign_coords(time=record.time * longer), machine)
    fall = [check.detail for check in found.checks if check.check == "free fall"]
    assert len(fall) == 2
    assert all(f"together they show that the stated sampling rate is {said}" in detail for detail in fall)


def test_the_suspects_are_told_by_how_much(machine):
    slow = fallen("short/drop_100", machine, longer=2.0)[0].detail
    times, lengths = (float(number) for number in re.findall(r"read about ([\d.]+) times too", slow))
    assert times == pytest.approx(2.0, rel=0.15)
    assert lengths == pytest.approx(4.0, rel=0.3)
    assert "'NDE_A', 'NDE_B'" in slow


def test_an_end_that_falls_slowly_while_the_other_falls_fast_is_let_go_later(machine):
    """A magnet that lets go late tips the shaft about its end: scales alone were suspected, of both ends."""
    planes = planes_of("short/drop_060")
    tipped = planes.copy(deep=True)
    tipped["displacement"].loc[{"end": "NDE"}] *= 0.55
    tipped["displacement"].loc[{"end": "DE"}] *= 1.25
    checks = check_free_fall(find_release(tipped, machine, 57.0, [305.4]), machine)
    failed = [check for check in checks if not check.passed]
    assert failed
    assert all("or the magnet of NDE releases later than that of DE, which tilts the shaft" in c.detail for c in failed)
    assert not any("releases later" in check.detail for check in fallen("short/drop_100", machine, longer=2.0))


def test_a_bent_shaft_does_not_make_a_record_wrong(machine):
    """It turns about its inertia axis in the fall, by 15 m/s2 where it is bent by 40 um at 97 Hz."""
    shares = []
    for phase in range(0, 360, 60):
        bent = record(machine, 97.0, 1, f"shaft_bow:bow=40 um,phase={phase} deg")
        release = find_release(to_planes(assign(bent, machine), machine), machine, 97.0, [305.4])
        for check in check_free_fall(release, machine):
            shares.append(float(check.detail.split(", ")[1].split()[0]))
            assert check.passed
            if abs(shares[-1] - 1) > 0.4:
                assert "proves little" in check.detail
        assert all(check.passed for check in check_probe_scales(release, machine))
    assert max(shares) > 1.5 or min(shares) < 0.6


def scaled(name, machine, **scales):
    """Checks of probes against each other on a shipped record, some of its probes on a wrong scale."""
    channels = assign(recorded(name), machine)
    channels = channels.isel({channels.NDE_A.dims[0]: channels[channels.NDE_A.dims[0]] < 0.3})
    changed = channels.assign({probe: channels[probe] * scale for probe, scale in scales.items()})
    return check_probe_scales(
        find_release(to_planes(changed, machine), machine, float(name[-3:]) * 0.95, [305.4]), machine
    )


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("scales", [{}, {"NDE_A": 1.03, "DE_A": 1.1, "DE_B": 1.1}])
def test_probes_of_an_end_see_the_same_fall(name, scales, machine):
    checks = scaled(name, machine, **scales)
    assert all(check.passed for check in checks)

    assert [check.channel for check in checks] == ["NDE", "DE"]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(("probe", "scale"), [("NDE_A", 1.2), ("DE_B", 0.8)])
def test_a_probe_on_a_wrong_scale_tilts_the_fall_and_is_named(name, probe, scale, machine):
    wrong = [check for check in scaled(name, machine, **{probe: scale}) if not check.passed]
    assert [check.channel for check in wrong] == [probe[:-2]]
    _, low, high = (float(number) for number in re.findall(r"\d\.\d\d", wrong[0].detail)[:3])
    assert low < max(scale, 1 / scale) < high
    assert f"'{probe}' reads" in wrong[0].detail


@pytest.mark.parametrize("share", [0.9, 1.1, 5.0])
def test_a_rotor_that_bends_at_another_frequency_makes_no_probe_wrong(share, machine):
    for speed in (60.0, 97.0, 150.0):
        planes = to_planes(assign(record(machine, speed, 1), machine), machine)
        release = find_release(planes, machine, speed, [305.4 * share])
        assert all(check.passed for check in check_probe_scales(release, machine))


def test_a_magnetic_force_that_dies_away_leaves_the_fall_straight(machine):
    for decay in (1.0, 2.3):
        held = record(machine, 60.0, 0, f"residual_magnetic_force:decay_time={decay} ms")
        release = find_release(to_planes(assign(held, machine), machine), machine, 60.0, [305.4])
        assert release.force_decay.value == pytest.approx(decay * 1e-3, rel=0.2)
        assert all(check.passed for check in check_probe_scales(release, machine))


def test_a_magnetic_force_that_dies_away_is_named_before_the_scales(machine):
    """It makes the fall soft; a time base that is a fifth off may look the same, so that the row does not pass."""
    held = record(machine, 60.0, 0, "residual_magnetic_force:decay_time=4 ms")
    release = find_release(to_planes(assign(held, machine), machine), machine, 60.0, [305.4])
    checks = check_free_fall(release, machine)
    assert [check.channel for check in checks] == ["NDE", "DE"]
    for check in checks:
        assert not check.passed
        assert re.search(
            r"of gravity, before it touches: a magnetic force that decays in [34]\.?\d* ms", check.detail
        )


@pytest.mark.parametrize("longer", [2.0, 1.5, 0.5])
def test_times_on_a_wrong_scale_tell_neither_release_nor_contact(longer):
    channels = read(shipped("years/drop_03.nc")).sel(time=slice(0, 1.0))
    machine = load_machine(shipped("years/machine.toml"))
    scaled = channels.assign_coords(time=channels.time.values * longer)
    found = analyse(scaled, machine)
    assert any(check.check == "free fall" and not check.passed for check in found.checks)
    lines = summary_lines(found)
    circled = [end for end in found.ends.values() if end.gap is not None]
    assert circled
    for quantity in (found.release.time, found.release.force_decay, *(end.stiffness for end in circled)):
        assert "times gravity (see free fall)" in quantity.why
    for end in circled:
        assert end.contacts.first is None and "see free fall" in end.no_contact
    assert not any("ms after the release" in line or "magnetic force" in line for line in lines)
    assert all(levitated.x.known for levitated in found.levitation.values())  # about when it ended is known


@pytest.mark.parametrize("name", ["short/drop_060", "short/drop_100", "loose/drop_100", "short/drop_210"])
def test_no_force_that_decays_in_tens_of_milliseconds_is_made_of_a_wrong_rate(name, machine):
    channels = read(shipped(f"{name}.nc"))
    release = analyse(channels.assign_coords(time=2 * channels.time.values), machine).release
    assert not release.time.known and not release.force_decay.known


def test_a_slow_fall_under_a_force_that_dies_away_dates_its_release(machine):
    planes, truth = drop(0, decay=8e-3, rate=10000.0, fall=0.012)
    release = find_release(planes, machine, 97.0)
    assert not all(check.passed for check in check_free_fall(release, machine))
    assert release.time.low <= truth <= release.time.high
    assert undated(release, machine) == ""


def test_a_fall_upwards_dates_no_release(machine):
    channels = assign(read(shipped("short/drop_100.nc")), machine)
    inverted = channels.assign({probe.name: -channels[probe.name] for probe in machine.probes})
    result = analyse(inverted, machine)
    assert not any(check.passed for check in result.checks if check.check == "free fall")
    assert not result.release.time.known
    assert not result.release.force_decay.known
    assert "falls upwards" in result.release.time.why


def test_a_machine_on_end_does_not_fall_across_its_bearings(machine):
    release = find_release(drop(3)[0], machine, 97.0)
    assert len(check_free_fall(release, machine)) == 2
    assert check_free_fall(release, machine.model_copy(update={"gravity": 0.0})) == []


def test_an_analysis_carries_the_check():
    found = [check for check in analysed("short/drop_100").checks if check.check == "free fall"]
    assert len(found) == 2
    assert all(check.passed for check in found)


def test_the_ratio_of_an_ends_probes_follows_the_gain_of_one(machine):
    off = recorded("short/drop_150")
    off["NDE_A"] = (1.1 * off["NDE_A"]).assign_attrs(off["NDE_A"].attrs)
    before, after = (
        {end: probe_ratio(each.release, machine, end) for end in machine.ends}
        for each in (analysed("short/drop_150"), analyse(off, machine))
    )
    for end in machine.ends:
        assert before[end].low < 1.0 < before[end].high
        assert before[end].high - before[end].low < 0.1
    # the whirl that is taken off the fall is read a tenth too large as well
    assert after["NDE"].value == pytest.approx(1.1 * before["NDE"].value, rel=0.01)
    assert after["DE"].value == pytest.approx(before["DE"].value, rel=0.005)


def test_an_end_with_one_probe_has_no_ratio(machine):
    found = probe_ratio(analyse(read(shipped("short/drop_150.nc")).drop_vars("DE_B"), machine).release, machine, "DE")
    assert found.value is None and "fewer than two probes" in found.why
