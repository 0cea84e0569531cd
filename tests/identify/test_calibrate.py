"""Values come back from drops of the same model (so no test of the model), and what cannot be fitted is said."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from tdbsim import state_layout
from tdbsim.errors import InputError
from tdbsim.machine import Tolerant, load_machine
from tdbsim.stated_effects import parse

from tdbmon.identify.calibrate import _at_bound, _undetermined, estimates, fit_drops, standing_remarks
from tdbmon.identify.crew import Crew
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.parameters import machine_parameters
from tdbmon.identify.problem import build_problem
from tdbmon.identify.stages import Stages
from tdbmon.record.finding import Check
from tdbmon.shipped import shipped
from tests.identify import drops

HORIZON = (0.012,)


def sigma(estimate):
    return (estimate.high - estimate.low) / 3.92


def test_values_come_back(calibration):
    for name, truth in drops.TRUTH.items():
        found = calibration.values[name]
        assert abs(found.value - truth) < 5 * sigma(found), name
        assert found.value == pytest.approx(truth, rel=0.02), name


def test_what_is_left_is_noise(calibration):
    assert calibration.misfit == pytest.approx(1.0, abs=0.1)
    assert not calibration.at_bound
    assert not calibration.remarks


def test_effects_of_the_machine_file_are_told(calibration):
    assert standing_remarks(calibration.problem) == ()
    known = replace(calibration.problem, standing=(parse("oval_clearance:end=DE,amplitude=20 um"),))
    (told,) = standing_remarks(known)
    assert "amplitude 20 um" in told and " at DE " in told


def test_release_state_comes_back(calibration, same_model):
    _, records = same_model
    for k, (fit, record) in enumerate(zip(calibration.drops, records, strict=True)):
        true = record.attrs["release_time_s"]
        assert fit.release.value == pytest.approx(true, abs=1e-4)
        # what counts is where it is at one instant: release and velocity make up for each other
        at = int(np.searchsorted(record.time, true))
        found = calibration.problem.simulated(calibration.point, k, calibration.horizon).prediction
        motion, n = found.motion, found.motion.model.n
        state, shapes = motion.state[at - found.path.first], motion.model.arrays.at_end
        assert shapes @ state[state_layout.modes_x(n)] == pytest.approx(record.rotor_x.to_numpy()[:, at], abs=1e-6)
        assert shapes @ state[state_layout.modes_y(n)] == pytest.approx(record.rotor_y.to_numpy()[:, at], abs=1e-6)


def test_calibrated_machine_holds_the_values(calibration):
    bearing = calibration.calibrated.bearing("DE")
    assert bearing.radial_gap.nominal == calibration.values["DE.radial_gap"].value
    assert bearing.friction.nominal == calibration.values["DE.friction"].value
    assert calibration.machine.bearing("DE").radial_gap.nominal == 250e-6


def narrowed(machine, end, field, low, high):
    """A machine whose tolerance of one value excludes the truth."""
    value = Tolerant(nominal=(low + high) / 2, low=low, high=high)
    bearings = [b.model_copy(update={field: value}) if b.name == end else b for b in machine.touchdown_bearings]
    return machine.model_copy(update={"touchdown_bearings": tuple(bearings)})


def test_tolerance_that_excludes_the_truth_is_reported(same_model):
    machine, records = same_model
    wrong = narrowed(machine, "NDE", "support_stiffness", 1.4e8, 1.6e8)
    found = fit_drops(wrong, records[:1], horizons=HORIZON)
    assert "NDE.support_stiffness" in found.at_bound
    low = next(p.low for p in machine_parameters(wrong) if p.name == "NDE.support_stiffness")
    assert found.values["NDE.support_stiffness"].value == pytest.approx(low)


def test_a_model_that_does_not_explain_the_drop_is_remarked(same_model):
    machine, records = same_model
    record = records[0].copy()
    record["NDE_B"] = 1.3 * record["NDE_B"]
    found = fit_drops(machine, [record], horizons=HORIZON)
    assert found.misfit > 4
    assert any(f"is {found.misfit:.2f} times the noise" in remark for remark in found.remarks)
    assert not found.explains


def test_a_model_that_fails_on_a_record_with_faults_sends_to_the_checks_first(same_model):
    machine, records = same_model
    record = records[0].copy()
    record["NDE_A"] = -records[0]["NDE_A"]
    found = fit_drops(machine, [record], horizons=HORIZON)
    (remark,) = [remark for remark in found.remarks if "times the noise" in remark]
    assert not found.explains and "first correct what the records' checks found" in remark


def test_value_that_the_drop_cannot_tell_is_reported(same_model):
    machine, records = same_model
    # in the first 12 ms the drag of 15 mN m on the ring is nothing beside the friction of some 10 N m
    vague = narrowed(machine, "DE", "inner_ring_drag", 5e-3, 25e-3)
    found = fit_drops(vague, records[:1], horizons=HORIZON)
    unknown = {each.name: each for each in found.undetermined}
    assert "DE.inner_ring_drag" in unknown
    assert unknown["DE.inner_ring_drag"].share > 0.9
    assert found.values["DE.inner_ring_drag"].value == pytest.approx(15e-3, abs=2e-3)


@pytest.mark.parametrize(
    ("along", "across", "told"),
    [(1.0, 0.2, {"along": "amount", "across": "phase"}), (0.3, -1.0, {"along": "phase", "across": "amount"})],
)
def test_an_unbalance_at_its_bound_or_untold_is_named_as_its_values_are(along, across, told):
    """It moves along and across its nominal phase; reports and machine files know amount and phase alone.

    Of a plane turned little from its nominal phase, and of one turned by most of a right angle; one part of the first plane
    is at its bound, and of the second one is no surer than beforehand, the other goes with it.
    """
    machine = load_machine(shipped("short/machine.toml"))
    first, second = (
        plane.model_copy(update={"phase": Tolerant(nominal=0.4, low=0.4 - np.pi / 2, high=0.4 + np.pi / 2)})
        for plane in machine.rotor.unbalance
    )
    machine = machine.model_copy(update={"rotor": machine.rotor.model_copy(update={"unbalance": (first, second)})})
    with Crew() as crew:
        problem = build_problem(machine, (measured_drop(drops.drop(), machine),), crew)
    at = {p.name: k for k, p in enumerate(problem.shared)}
    size, point = 25e-6, problem.start
    for plane in (first, second):
        for field, share in (("along", along), ("across", across)):
            p = problem.shared[at[f"{plane.name}.{field}"]]
            point[at[p.name]] = (share * size - p.nominal) / p.scale
    edge = problem.high if along == 1.0 else problem.low
    point[at["generator.along"]] = edge[at["generator.along"]]
    covariance = 0.01 * np.eye(len(point))
    pair = np.ix_([at["impeller.along"], at["impeller.across"]], [at["impeller.along"], at["impeller.across"]])
    covariance[pair] = [[1.0, 0.08], [0.08, 0.01]]
    values = estimates(problem, point, covariance)
    (bound,) = _at_bound(problem, point)
    assert bound == f"generator.{told['along']}"
    (loose,) = _undetermined(problem, point, covariance)
    assert loose.name == f"impeller.{told['along']}"
    assert [name for name, _ in loose.partners] == [f"impeller.{told['across']}"]
    assert {bound, loose.name} <= set(values)


def test_a_damping_of_the_balls_that_has_a_tolerance_is_found():
    """Catalogues tell it to a factor of ten."""
    known, ends = drops.machine(), []
    for bearing in known.touchdown_bearings:
        unsure = Tolerant(nominal=400.0, low=40.0, high=1200.0)
        ends.append(bearing.model_copy(update={"ball_damping": unsure}))
    truth = {"NDE.ball_damping": 900.0, "DE.ball_damping": 250.0}
    record = drops.drop({**drops.TRUTH, **truth})
    known = known.model_copy(update={"touchdown_bearings": tuple(ends)})
    found = fit_drops(known, [record], horizons=Stages().calibration[:9])
    assert found.misfit < 1.1
    for name, value in truth.items():
        assert found.values[name].low < value < found.values[name].high
        assert found.values[name].value == pytest.approx(value, rel=0.15)


def test_dead_probe_is_left_out_and_said(same_model):
    machine, records = same_model
    record = records[0].copy()
    record["NDE_B"] = xr.full_like(record["NDE_B"], 3e-6)
    found = fit_drops(machine, [record], horizons=HORIZON)
    assert any(each.endswith("without probe 'NDE_B', which is dead") for each in found.remarks)
    assert set(found.drops[0].residuals[0].rms) == {"NDE_A", "DE_A", "DE_B"}
    assert found.values["DE.radial_gap"].value == pytest.approx(drops.TRUTH["DE.radial_gap"], rel=0.02)


def test_samples_that_dropped_out_take_no_part_in_the_fit_and_are_said(same_model):
    machine, records = same_model
    record = records[0].copy(deep=True)
    first = int(np.searchsorted(record.time, record.attrs["release_time_s"] + 0.008))
    for name in ("NDE_A", "NDE_B", "DE_A"):
        record[name][first : first + 40] = record[name][first].item()
    record["DE_B"][:30] = record["DE_B"][0].item()  # a logger that begins late
    drop = measured_drop(record, machine)
    assert [probe.name for probe in drop.probes] == ["NDE_A", "NDE_B", "DE_A", "DE_B"]
    (remark,) = drop.remarks
    assert (
        "missing or cut off are not used in the fit: 40 of 'NDE_A', 40 of 'NDE_B', 40 of 'DE_A', 30 of 'DE_B'"
        in remark
    )
    found, whole = (fit_drops(machine, [each], horizons=HORIZON) for each in (record, records[0]))
    assert found.misfit == pytest.approx(1.0, abs=0.15)
    for name, truth in drops.TRUTH.items():
        assert abs(found.values[name].value - truth) < 5 * sigma(found.values[name]), name
    # less was measured
    assert sigma(found.values["NDE.radial_gap"]) > sigma(whole.values["NDE.radial_gap"])


def test_a_drop_whose_peaks_are_cut_off_is_fitted_to_the_rest(same_model):
    machine, records = same_model
    record = records[0].copy(deep=True)
    for probe in machine.probes:
        values = record[probe.name].values
        record[probe.name] = record[probe.name].copy(data=np.clip(values, -0.8 * np.abs(values).max(), None))
    drop = measured_drop(record, machine)
    lost = np.isnan(drop.reading).mean(axis=1)
    assert (lost > 0.01).sum() >= 2
    found = fit_drops(machine, [record], horizons=HORIZON)
    assert found.misfit == pytest.approx(1.0, abs=0.15)
    for name in ("NDE.support_stiffness", "DE.support_stiffness"):
        assert abs(found.values[name].value - drops.TRUTH[name]) < 5 * sigma(found.values[name]), name


def test_a_probe_without_most_of_its_samples_is_left_out_and_said(same_model):
    machine, records = same_model
    record = records[0].copy(deep=True)
    first = int(np.searchsorted(record.time, record.attrs["release_time_s"] + 0.008))
    count = int(0.045 / float(record.time[1] - record.time[0]))
    record["NDE_B"][first : first + count] = np.nan
    drop = measured_drop(record, machine)
    assert [probe.name for probe in drop.probes] == ["NDE_A", "DE_A", "DE_B"]
    assert any(f"without probe 'NDE_B', since {count} of its samples are missing" in remark for remark in drop.remarks)
    for name in ("NDE_A", "DE_A"):
        record[name][first : first + count] = np.nan
    with pytest.raises(InputError, match=f"1 usable probes.*{count} samples of 'DE_A' are missing"):
        measured_drop(record, machine)


def test_what_else_the_checks_of_the_channels_found_goes_with_the_drop(same_model):
    machine, records = same_model
    assert measured_drop(records[0], machine).faults == ()
    record = records[0].copy()
    record["NDE_A"], record["NDE_B"] = records[0]["NDE_B"], records[0]["NDE_A"]
    faults = measured_drop(record, machine).faults
    assert any("NDE: " in fault and "two probes may be swapped" in fault for fault in faults)


def test_two_probes_are_too_few(same_model):
    machine, records = same_model
    record = records[0].drop_vars(["NDE_A", "DE_A"])
    with pytest.raises(InputError, match="2 usable probes"):
        measured_drop(record, machine)


def test_drop_of_another_machine_is_named(same_model):
    machine, records = same_model
    other = drops.drop({**drops.TRUTH, "NDE.radial_gap": 220e-6, "DE.radial_gap": 280e-6}, speed=120.0, seed=3)
    found = fit_drops(machine, [*records, other], horizons=HORIZON)
    assert any("drop_120.nc" in remark and "another machine" in remark for remark in found.remarks)


def test_rotor_that_never_touches(same_model):
    machine, records = same_model
    release = records[0].attrs["release_time_s"]
    caught = records[0].sel(time=slice(0, release + 0.004))  # levitation fails for 4 ms, then carries it again
    hung = records[0].isel(time=slice(len(caught.time), None))
    held = {
        name: ("time", np.full(len(hung.time), float(caught[name][-1]))) for name in ("NDE_A", "NDE_B", "DE_A", "DE_B")
    }
    noise = np.random.default_rng(0)
    held = {name: (d, v + 0.25e-6 * noise.standard_normal(len(v))) for name, (d, v) in held.items()}
    record = xr.concat([caught[list(held)], xr.Dataset(held, {"time": hung.time})], "time")
    for name in ("keyphasor", "speed"):
        record[name] = records[0][name]
    for name in record:
        record[name].attrs.update(records[0][name].attrs)
    with pytest.raises(InputError, match="never reaches the touchdown bearing"):
        measured_drop(record, machine)


def test_release_cut_off(same_model):
    machine, records = same_model
    late = records[0].sel(time=slice(records[0].attrs["release_time_s"] + 0.002, None))
    with pytest.raises(InputError, match="starts after the release"):
        measured_drop(late, machine)


def test_record_too_short(same_model):
    machine, records = same_model
    short = records[0].sel(time=slice(0, records[0].attrs["release_time_s"] + 0.015))
    with pytest.raises(InputError, match="before the first contacts"):
        measured_drop(short, machine)


def test_without_speed_and_keyphasor(same_model):
    machine, records = same_model
    with pytest.raises(InputError, match="neither keyphasor nor speed"):
        measured_drop(records[0].drop_vars(["speed", "keyphasor"]), machine)


def test_no_record(same_model):
    with pytest.raises(InputError, match="no record given"):
        fit_drops(same_model[0], [])


def test_levitated_shaft_that_reaches_the_ring_of_the_file(same_model):
    machine, records = same_model
    record = records[0].copy()
    for name in ("NDE_A", "NDE_B", "DE_A", "DE_B"):  # a zero far off: the shaft seems to levitate beyond the gap
        record[name] = record[name] + 220e-6
        record[name].attrs.update(records[0][name].attrs)
    with pytest.raises(InputError, match=r"drop_97.nc: cannot be simulated.*reaches the gap"):
        fit_drops(machine, [record], horizons=HORIZON)


def test_friction_that_falls_with_the_load_is_found_where_the_fit_fails_without():
    """The machine file states none; the fit leaves noise alone with it, says so, and carries it into the machine."""
    falling = {f"{end}.friction_load_exponent": 0.08 for end in ("NDE", "DE")}
    records = [
        drops.drop({**drops.TRUTH, **falling}, speed=speed, seed=seed) for speed, seed in ((97.0, 1), (140.0, 2))
    ]
    found = fit_drops(drops.machine(), records, horizons=Stages().calibration[:6])
    assert found.misfit < 1.15
    assert any("friction_load_exponent" in remark for remark in found.remarks)
    for end, bearing in zip(("NDE", "DE"), found.calibrated.touchdown_bearings, strict=True):
        assert found.values[f"{end}.friction_load_exponent"].value == pytest.approx(0.08, abs=0.03)
        assert bearing.friction_load_exponent == pytest.approx(0.08, abs=0.03)
    assert not any("exponent" in each.name for each in found.undetermined)


@pytest.mark.parametrize(("larger", "refuted"), [(1.0, True), (1.15, False)])
def test_a_model_that_follows_a_drop_refutes_what_the_fall_says_of_its_scales(same_model, monkeypatch, larger, refuted):
    """Whatever made the fall look too fast, a drop that gravity explains to the noise is on no wrong scale."""
    machine, (record, _) = same_model
    accused = Check("free fall", "NDE", False, "falls with 14.9 m/s2")
    monkeypatch.setattr("tdbmon.identify.drop.check_free_fall", lambda *_: [accused])
    read = record.assign({p.name: record[p.name] * larger for p in machine.probes})
    found = fit_drops(machine, [read], HORIZON)
    assert any("14.9 m/s2" in remark for remark in found.remarks) == (not refuted)
    assert any("do not hold" in remark for remark in found.remarks) == refuted
