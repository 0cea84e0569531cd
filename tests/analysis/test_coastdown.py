"""The whole analysis of the shipped coast-downs against what the rig program used (synthetic, other code)."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from tdbsim.machine import EffectSetting, load_machine
from tdbsim.modes import supported
from tdbsim.quantity import Tolerant
from tdbsim.rotor import static_loads

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.contract import analysis_json
from tdbmon.analysis.rest import rest_travel
from tdbmon.analysis.summary import summary_lines
from tdbmon.analysis.vibration_zone import zone
from tdbmon.history.extract import features_of
from tdbmon.record.read import read
from tdbmon.report import build_report
from tdbmon.shipped import shipped
from tests.shipped_drops import analysed, recorded


@pytest.fixture(scope="module", params=["drop_100", "drop_150"])
def result(request, coastdown, machine):
    if request.param == "drop_100":
        return coastdown
    return analyse(read(shipped("coastdown/drop_150.nc")), machine)


def true_bearing(machine, answer, end):
    """The machine's bearing with the values that the rig program used."""
    bearing, truth = machine.bearing(end), answer["ends"][end]
    exact = {
        "radial_gap": truth["radial_gap_m"],
        "support_stiffness": truth["support_stiffness_y_n_per_m"],
        "support_damping": truth["support_damping_n_s_per_m"],
    }
    parts = {
        name: getattr(bearing, name).model_copy(update={"nominal": v, "low": v, "high": v}) for name, v in exact.items()
    }
    clearance = bearing.balls.diametral_clearance.model_copy(update={"nominal": truth["ball_clearance_m"]})
    return bearing.model_copy(
        update={**parts, "balls": bearing.balls.model_copy(update={"diametral_clearance": clearance})}
    )


def test_release_is_found_within_a_fifth_of_a_millisecond(result, coastdown_answer):
    found, truth = result.release.time, coastdown_answer["release_time_s"]
    assert found.value == pytest.approx(truth, abs=2e-4)
    assert found.low <= truth <= found.high
    assert not result.release.force_decay.known


def test_gaps_hold_the_truth(result, machine, rotor, coastdown_answer):
    for end, found in result.ends.items():
        bearing = true_bearing(machine, coastdown_answer, end)
        gap = bearing.radial_gap.nominal
        at_rest = gap + rest_travel(bearing, static_loads(machine, rotor)[end]).total
        assert found.air_gap.low <= gap <= found.air_gap.high
        assert found.air_gap.high - found.air_gap.low < 10e-6
        for radius in (found.gap.radius, found.gap_from_swing):
            assert radius.low <= at_rest <= radius.high
        assert found.gap.lower.low <= at_rest <= found.gap.upper.high
        assert found.gap.agrees


def test_decay_time_within_a_percent_and_the_constant_drag_found(result, coastdown_answer):
    rundown = result.rundown
    assert rundown.decay_time.value == pytest.approx(coastdown_answer["speed_decay_time_s"], rel=0.01)
    chosen = [model for model in rundown.models if model.chosen]
    assert [model.name for model in chosen] == ["exponential + constant"]
    assert rundown.drag_torque.low > 0


def with_rings(machine, rotor, answer):
    """Decay time of the rotor and the rings that roll on it, each more slowly by the clearance."""
    rings = sum(
        bearing.inner_ring_inertia / (1 + answer["ends"][bearing.name]["radial_gap_m"] / bearing.journal_radius) ** 2
        for bearing in machine.touchdown_bearings
    )
    return answer["speed_decay_time_s"] * (1 + rings / rotor.polar_inertia)


def test_the_interval_of_the_decay_time_holds_the_truth(result, machine, rotor, coastdown_answer):
    """The rig's bearings drag otherwise than by the law, which its fit does not show: the signal's noise leaves 1e-5."""
    found = result.rundown.decay_time
    assert found.low <= with_rings(machine, rotor, coastdown_answer) <= found.high
    assert found.high - found.low < 0.01 * found.value


@pytest.mark.parametrize("name", ["drop_060", "drop_100"])
def test_the_interval_of_a_short_record_holds_what_slipping_rings_hide(name, rotor):
    machine, answer = load_machine(shipped("short/machine.toml")), json.loads(shipped("short/answer.json").read_text())
    found = analysed(f"short/{name}").rundown.decay_time
    assert found.low <= with_rings(machine, rotor, answer["true"]) <= found.high
    assert found.high - found.low < 0.06 * found.value


def test_stiffness_holds_bearing_and_support_in_series(result, machine, rotor, coastdown_answer):
    """The static stiffness of the series with the true values; the interval carries the single-mass model's error."""
    for end, found in result.ends.items():
        load = static_loads(machine, rotor)[end]
        series = load / rest_travel(true_bearing(machine, coastdown_answer, end), load).per_load
        assert found.stiffness.low <= series <= found.stiffness.high


def test_lines_are_those_of_swing_modes_mains_and_rotation(result, machine, rotor, coastdown_answer):
    lines = {line.name: line for line in result.lines}
    assert {"swing 1", "swing 2", "2 x swing 1", "1X", "mains"} <= set(lines)
    assert lines["1X"].kind == "order"
    assert lines["mains"].frequency.low <= 50.0 <= lines["mains"].frequency.high
    # the shaft as a whole on bearings and supports with the true values, linear about the static load
    loads = static_loads(machine, rotor)
    stiffness = {
        e: loads[e] / rest_travel(true_bearing(machine, coastdown_answer, e), loads[e]).per_load for e in machine.ends
    }
    bounce, conical = supported(machine, rotor, stiffness, 0.0, 4).frequencies[::2]
    assert lines["bounce"].kind == lines["conical"].kind == "constant"
    assert lines["bounce"].frequency.value == pytest.approx(bounce, rel=0.05)
    assert lines["conical"].frequency.value == pytest.approx(conical, rel=0.05)
    assert not any(name.startswith("bending") for name in lines)  # the free shaft bends from 305 Hz on


def test_the_swing_is_quiet_about_whirl(result):
    assert not any(whirl.full for whirl in result.whirl.values())


def test_every_check_passes_on_a_sound_record(result):
    assert all(check.passed for check in result.checks), [c for c in result.checks if not c.passed]


def test_phases_follow_each_other(result):
    # the rotor of this generator creeps on for ever: it comes to no rest that the record could show
    assert [phase.name for phase in result.phases] == ["levitated", "fall", "contacts", "run-down"]
    assert not result.rundown.standstill_time.known


def test_the_json_is_plain(result):
    text = json.dumps(analysis_json(result), allow_nan=False)
    assert "NaN" not in text


def test_results_are_frozen(result):
    with pytest.raises(dataclasses.FrozenInstanceError):
        result.release.time = None


def test_a_record_with_speed_alone_gets_the_speed_analysis(coastdown_record, machine):
    alone = analyse(coastdown_record[["speed"]], machine)
    assert alone.planes is None
    assert alone.ends == {}
    assert alone.rundown.decay_time.known
    assert any(not c.passed for c in alone.checks)


def test_a_record_with_displacement_alone_gets_the_rest(machine):
    record = read(shipped("short/drop_100.nc")).drop_vars(["speed", "keyphasor"])
    alone = analyse(record, machine)
    assert alone.rundown is None
    assert alone.release.time.value == pytest.approx(0.1, abs=2e-4)
    assert alone.ends["DE"].gap is not None
    assert alone.lines == ()


def test_keyphasor_alone_gives_the_speed(coastdown, coastdown_record, machine):
    alone = analyse(coastdown_record.drop_vars("speed"), machine)
    assert alone.rundown.decay_time.value == pytest.approx(11.74, rel=0.01)
    assert alone.rundown.source == "keyphasor pulses"
    both = coastdown.rundown
    for quantity in ("initial", "lost_speed"):
        known, counted = getattr(both, quantity), getattr(alone.rundown, quantity)
        assert counted.low <= known.value <= counted.high, quantity
    assert not alone.rundown.standstill_time.known  # the last mark comes long before


def test_speed_lost_in_contacts_is_no_surer_than_the_law_that_it_is_told_from(machine):
    """Of a record of half a second the keyphasor alone tells the decay from 8 to 17 s, and what was lost no better."""
    known = analysed("short/drop_100").rundown.lost_speed.value
    counted = analyse(recorded("short/drop_100").drop_vars("speed"), machine).rundown
    assert counted.decay_time.low <= 11.742 <= counted.decay_time.high
    assert counted.lost_speed.low <= known <= counted.lost_speed.high


def test_what_a_probe_held_while_it_dropped_out_is_not_taken_for_measured(machine):
    """A channel that stands still through the lift-off gives what one without these samples gives."""
    record = read(shipped("short/drop_060.nc"))
    held, lost = record.copy(deep=True), record.copy(deep=True)
    held["NDE_A"][2180:2250] = held["NDE_A"][2180]
    lost["NDE_A"][2180:2250] = np.nan
    frozen, missing = (analyse(each, machine) for each in (held, lost))
    assert np.isnan(frozen.planes.displacement.sel(end="NDE").values[..., 2200]).all()
    np.testing.assert_array_equal(frozen.planes.displacement.values, missing.planes.displacement.values)
    assert summary_lines(frozen)[-14:] == summary_lines(missing)[-14:]


@pytest.mark.parametrize(
    ("begin", "why"),
    [
        (0.097, ""),  # 3 ms of levitation: too little to tell the release, but the first contact is seen
        (0.109, "begins during a contact at NDE"),
        (0.115, "begins after the release, and perhaps after the first contact"),
        (0.250, "begins during a contact at NDE"),
    ],
)
def test_a_record_that_begins_late_calls_no_later_contact_the_first(machine, begin, why):
    record = read(shipped("short/drop_060.nc"))
    result = analyse(record.sel(time=slice(begin, None)), machine)
    assert result.release is None
    assert any(not c.passed and c.check == "levitated stretch" for c in result.checks)
    end = result.ends["NDE"]
    assert end.gap is not None and end.contacts.events
    if not why:
        whole = analysed("short/drop_060").ends["NDE"]
        assert end.contacts.first.duration.value == pytest.approx(whole.contacts.first.duration.value, abs=1e-4)
        return
    assert end.contacts.first is None
    assert why in end.no_contact and why in end.stiffness.why and why in end.deepest.why
    said = "\n".join(summary_lines(result))
    assert f"first contact           not estimated (the record {why}" in said
    features = {f.key: f.estimate for f in features_of(result)}
    for name in ("stiffness_n_per_m", "first_contact_duration_ms", "rebound_um", "contacts", "deepest_um"):
        assert why in features[name, "NDE"].why


def test_one_end_alone_is_analysed_at_its_probes(machine):
    record = read(shipped("short/drop_100.nc")).drop_vars(["DE_A", "DE_B"])
    result = analyse(record, machine)
    assert result.ends["NDE"].plane == "probe"
    assert result.ends["NDE"].gap is not None
    assert result.ends["DE"].plane == "none"
    assert not result.ends["DE"].air_gap.known


def test_a_missing_swing_says_what_it_lacks(machine, coastdown_record):
    """20 s hold hundreds of cycles of it: what is missing is an end, or one end at rest."""
    long = coastdown_record.sel(time=slice(0, 20))
    assert analyse(long, machine).swing is not None
    alone = analyse(long.drop_vars(["DE_A", "DE_B"]), machine)
    assert alone.no_swing == alone.ends["NDE"].gap_from_swing.why == "the swing needs both ends, but DE is not seen"
    features = {f.name: f.estimate for f in features_of(alone)}
    assert features["swing_1_hz"].why == alone.no_swing
    bouncing = analysed("short/drop_150")
    assert "needs both ends at rest, but NDE is not" in bouncing.no_swing
    assert "still lifts off" in bouncing.ends["NDE"].air_gap.why
    offset = [machine.channel_in_file(name) for name in ("NDE_A", "NDE_B")]
    shifted = long.assign({name: long[name] + 1.5e-3 for name in offset})
    shifted = shifted.assign({name: shifted[name].assign_attrs(long[name].attrs) for name in offset})
    assert analyse(shifted, machine).no_swing.endswith("DE is seen in its probe plane only")


def test_terminal_and_report_state_a_number_alike(coastdown):
    from tdbmon.quantity import words
    from tdbmon.report.sections.findings import FIRST_TOUCH, end_findings, rotor_findings

    found = [each for end in coastdown.ends.values() for each in end_findings(coastdown, end)]
    found += rotor_findings(coastdown)
    lines = summary_lines(coastdown)
    assert any("mN m" in line for line in lines) and any("MN/m" in line for line in lines)
    for label, name in (
        ("first contact", FIRST_TOUCH), ("duration", "First contact, duration"), ("rebound", "Rebound"),
        ("single-mass stiffness", "Single-mass stiffness"), ("air gap", "Air gap"), ("constant drag", "Torque of constant drag"),
        ("release", "Release, from the record's first sample"),
    ):  # fmt: skip
        told = [line.strip().removeprefix(label).strip() for line in lines if line.strip().startswith(f"{label} ")]
        same = [words(each.estimate, each.unit).replace("µ", "u") for each in found if each.name == name]
        assert told and all(t.startswith(s) for t, s in zip(told, same, strict=True))
    touch = coastdown.ends["NDE"].contacts.first.touch.value
    assert any("first contact" in line and f"after the release [{touch:.5f} s]" in line for line in lines)


def test_a_gap_outside_its_tolerance_is_told_on_the_terminal(machine):
    said = "\n".join(summary_lines(analysed("short/drop_100")))
    assert "outside the tolerance" not in said
    record = recorded("short/drop_100")
    for probe in machine.probes:
        record[probe.name] = 1.3 * record[probe.name]
    said = "\n".join(summary_lines(analyse(record, machine)))
    low, high = machine.bearing("NDE").radial_gap.low * 1e6, machine.bearing("NDE").radial_gap.high * 1e6
    assert f"outside the tolerance ({low:g} to {high:g} um): worn, or" in said
    assert "diametral" not in said


@pytest.mark.parametrize(("last", "told"), [(0.13, True), (0.5, False)])
def test_where_no_circle_is_found_the_terminal_says_what_tells_the_first_contact(machine, last, told):
    found = analyse(recorded("short/drop_100").sel(time=slice(0, last)), machine)
    assert any("--forces" in line for line in summary_lines(found)) == told
    assert not any("--forces" in line for line in summary_lines(found, fitted=True))


def test_a_record_cut_before_the_release_tells_how_the_shaft_levitates(machine):
    record = read(shipped("short/drop_100.nc"))
    whole, cut = analysed("short/drop_100"), analyse(record.sel(time=slice(0, 0.095)), machine)
    assert [each.check for each in cut.checks if not each.passed] == ["drop"]
    assert cut.release is None and [phase.name for phase in cut.phases] == ["levitated"]
    for end, known in whole.levitation.items():
        found = cut.levitation[end]
        for name in ("x", "y", "once", "noise"):
            told, wide = getattr(found, name), getattr(known, name)
            assert told.low - 1e-8 <= wide.value <= told.high + 1e-8
        assert zone(found.share) == "A" and "probes' zero" in found.reach.why
        assert "does not fall" in cut.ends[end].air_gap.why
    assert cut.rundown.initial.value == pytest.approx(whole.rundown.initial.value, rel=1e-3)
    assert "does not fall" in cut.rundown.decay_time.why and not cut.rundown.models
    lines = summary_lines(cut)
    assert any(line.startswith("speed at the record's end") for line in lines)
    assert any("zone A" in line for line in lines)
    assert not any("usable" in line or "decay" in line or "standstill" in line for line in lines)
    words = str(build_report(cut))
    assert "no usable displacement" not in words and "first-contacts" not in words
    analysis_json(cut)
    assert any(feature.name == "initial_hz" and feature.estimate.known for feature in features_of(cut))


def test_a_drop_in_a_wrong_unit_is_no_levitation(machine):
    record = read(shipped("short/drop_100.nc"))
    for probe in machine.probes:
        record[probe.name] = record[probe.name].copy(data=1e-3 * record[probe.name].values)
    found = analyse(record, machine)
    assert not found.falls
    assert all("leaves its initial orbit" in each.x.why for each in found.levitation.values())


def test_a_gap_narrower_than_its_tolerance_is_not_called_worn(machine):
    wide = Tolerant(nominal=500e-6, low=480e-6, high=520e-6)
    bearings = tuple(b.model_copy(update={"radial_gap": wide}) for b in machine.touchdown_bearings)
    drawn = machine.model_copy(update={"touchdown_bearings": bearings})
    said = "\n".join(summary_lines(analyse(read(shipped("short/drop_100.nc")), drawn)))
    assert "outside the tolerance (480 to 520 um): wrong gap in the machine file" in said
    assert "radial_gap is half of the diametral clearance" in said
    assert "worn" not in said


def test_effects_of_the_machine_file_are_said_to_be_in_the_simulation_alone():
    machine = load_machine(shipped("short/machine.toml"))
    oval = EffectSetting(name="oval_clearance", where="NDE", amplitude="20 um")
    carried = machine.model_copy(update={"effects": (oval,)})
    bare, carrying = analysed("short/drop_100"), analyse(recorded("short/drop_100"), carried)
    (row,) = [each for each in carrying.checks if each not in bare.checks]
    assert row.passed
    assert row.detail.startswith("oval_clearance at NDE: the simulation includes it")
    assert carrying.ends["NDE"].gap.radius == bare.ends["NDE"].gap.radius
