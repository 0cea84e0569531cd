"""Probes that are dead, stuck, clipped, in a wrong unit or out of range, by their own signals."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from record_machine import changed, failures, machine, with_probe
from tdbsim.machine import Machine, Tolerant, load_machine

from tdbmon.analysis.analyse import analyse
from tdbmon.record.assign import assign
from tdbmon.record.lost_samples import without_lost_samples
from tdbmon.record.probe_checks import probe_checks
from tdbmon.record.quality import check, left_out, repair_gaps
from tdbmon.record.read import read
from tdbmon.shipped import shipped

DATASETS = Path(__file__).parents[2] / "datasets"


def test_a_dead_probe(sound: xr.Dataset) -> None:
    still = 1e-7 * np.random.default_rng(1).standard_normal(sound["DE_A"].size)
    ds = changed(sound, "DE_A", still)
    failed = failures(ds)
    assert "in a gap of 250 um" in failed["dead", "DE_A"]
    assert set(left_out(ds, machine(), check(ds, machine()))) == {"DE_A"}


@pytest.mark.parametrize("value", [np.nan, 3.0])
def test_a_constant_or_empty_probe(value: float, sound: xr.Dataset) -> None:
    ds = changed(sound, "NDE_B", np.full(sound["NDE_B"].size, value))
    assert ("dead", "NDE_B") in failures(ds)
    assert "NDE_B" in left_out(ds, machine(), check(ds, machine()))


@pytest.mark.parametrize("factor", [1000.0, 1e-3, 25.4, 1 / 25.4, 1e6])
def test_a_wrong_unit_is_named(factor: float, sound: xr.Dataset) -> None:
    ds = changed(sound, "NDE_A", sound["NDE_A"].values * factor)
    failed = failures(ds)
    said = failed["unit", "NDE_A"]
    assert f"a factor {factor:g} " in said and ("e+" not in said or factor == 1e6)
    stated = sound["NDE_A"].attrs["source_units"]
    assert f"check '{stated}' in the file (a unit in the machine file is used only if the file states none)" in said
    assert ("range", "NDE_A") not in failed  # said once
    assert "NDE_A" in left_out(ds, machine(), check(ds, machine()))


@pytest.mark.parametrize(("factor", "cause"), [(1000.0, "mm written as um"), (25.4, "mil written as um")])
def test_a_unit_that_makes_all_probes_read_too_little_is_named(factor: float, cause: str, sound: xr.Dataset) -> None:
    """No probe seems to move then: the shaft was said not to fall, without the factor with which it does."""
    ds = sound
    for name in ("NDE_A", "NDE_B", "DE_A", "DE_B"):
        ds = changed(ds, name, sound[name].values / factor)
    failed = failures(ds)
    assert list(failed) == [("drop", "")]  # told once
    detail = failed["drop", ""]
    assert f"multiplied by {factor:g} it would be 473.4 um" in detail and f"{cause}?" in detail
    levitated = sound.isel(time=slice(0, 1900))
    small = levitated.assign(
        {n: levitated[n] * (10e-6 / float(np.ptp(levitated[n].values))) for n in ("NDE_A", "NDE_B", "DE_A", "DE_B")}
    )
    assert "written as" not in failures(small)["drop", ""]


def _of_gaps(**gaps: float) -> Machine:
    """The machine with other radial gaps, m, at the ends named."""
    bearings = [
        bearing.model_copy(update={"radial_gap": Tolerant(nominal=gap, low=gap, high=gap)})
        for bearing in machine().touchdown_bearings
        for gap in (gaps.get(bearing.name, bearing.radial_gap.nominal),)
    ]
    return machine().model_copy(update={"touchdown_bearings": tuple(bearings)})


def test_a_gap_that_all_probes_contradict_is_a_suspect(sound: xr.Dataset) -> None:
    """A gap of 25 um for 250 um was said of every probe to be "um written as mil", and nothing of the gap."""
    names = ("NDE_A", "NDE_B", "DE_A", "DE_B")
    failed = failures(sound, _of_gaps(NDE=25e-6, DE=20e-6))
    for name in names:
        gap = (
            "radial_gap of NDE in the machine file, 25 um"
            if name[0] == "N"
            else "radial_gap of DE in the machine file, 20 um"
        )
        assert f"or {gap}, since all probes of both ends deviate by a similar factor" in failed["unit", name]
    failed = failures(sound, _of_gaps(DE=20e-6))
    assert {name for check, name in failed if check == "unit"} == {"DE_A", "DE_B"}
    assert all("or radial_gap of DE in the machine file" in failed["unit", name] for name in names[2:])
    for factors in ((1000.0, 1.0), (1000.0, 25.4)):
        ds = sound
        for name, factor in zip(names, factors, strict=False):
            ds = changed(ds, name, sound[name].values * factor)
        failed = failures(ds)
        assert ("unit", "NDE_A") in failed and not any("radial_gap" in each for each in failed.values())


def test_how_far_a_probe_moves_is_told_in_full(sound: xr.Dataset) -> None:
    """Also where nearly all of the record is levitation, and the fall less than a thousandth of its samples."""
    fall = sound["NDE_A"].values[:4000]
    for values in (fall, np.concatenate([np.resize(fall[:1000], 6 * fall.size), fall])):
        ds = sound[["NDE_A"]].isel(time=np.arange(values.size) % sound.sizes["time"])
        ds = ds.assign_coords(time=np.arange(values.size) * 5e-5)
        ds["NDE_A"] = ("time", values, sound["NDE_A"].attrs)
        told = [each.detail for each in check(ds, machine()) if each.check in ("dead", "unit")]
        assert len(told) == 2
        assert all(f"moves by {np.ptp(fall) * 1e6:.4g} um pk-pk" in each for each in told)


def test_a_probe_without_any_value_is_dead_and_ends_nothing(sound: xr.Dataset) -> None:
    ds = changed(sound, "DE_A", np.full(sound["DE_A"].size, np.nan))
    assert list(failures(ds)) == [("dead", "DE_A")]
    assert np.isnan(repair_gaps(ds)["DE_A"].values).all()
    full = load_machine(shipped("short/drop_100.nc").parent / "machine.toml")
    raw = read(shipped("short/drop_100.nc"))
    raw["DE_A"].values[:] = np.nan
    assert analyse(raw, full).planes is not None


@pytest.mark.parametrize("noise", [0.0, 0.3e-6])
def test_a_dead_probe_is_in_no_wrong_unit(noise: float, sound: xr.Dataset) -> None:
    still = noise * np.random.default_rng(1).standard_normal(sound["NDE_A"].size)
    assert list(failures(changed(sound, "NDE_A", still))) == [("dead", "NDE_A")]


def test_probes_that_all_stand_still_are_told_once(sound: xr.Dataset) -> None:
    ds = sound
    for name in ("NDE_A", "NDE_B", "DE_A", "DE_B"):
        ds = changed(ds, name, np.zeros(sound[name].size))
    assert list(failures(ds)) == [("drop", "")]


@pytest.mark.parametrize("side", [1, -1])
def test_clipping_at_a_limit_that_no_one_states(side: int, sound: xr.Dataset) -> None:
    values = side * sound["NDE_B"].values
    limit = np.quantile(values, 0.995)
    ds = changed(sound, "NDE_B", side * np.minimum(values, limit))
    assert "flat top" in failures(ds)["clipping", "NDE_B"]


def test_clipping_at_full_scale(sound: xr.Dataset) -> None:
    values = np.maximum(sound["DE_B"].values, -200e-6)
    ds = changed(sound, "DE_B", values, full_scale=[-200e-6, 200e-6])
    assert "-200 um" in failures(ds)["clipping", "DE_B"]


def test_missing_samples(sound: xr.Dataset) -> None:
    values = sound["DE_A"].values.copy()
    values[100:103] = np.nan
    values[5000] = np.inf
    ds = changed(sound, "DE_A", values)
    assert "4 samples" in failures(ds)["nan", "DE_A"]
    assert "2 runs, the longest 3 samples, between 0.005 s and 0.25 s" in failures(ds)["nan", "DE_A"]
    assert "DE_A" not in left_out(ds, machine(), check(ds, machine()))
    values[: values.size // 2 + 10] = np.nan
    ds = changed(sound, "DE_A", values)
    assert "DE_A" in left_out(ds, machine(), check(ds, machine()))


def test_a_frozen_stretch(sound: xr.Dataset) -> None:
    values = sound["NDE_A"].values.copy()
    values[4000:4060] = values[3999]
    assert "61 samples" in failures(changed(sound, "NDE_A", values))["dropout", "NDE_A"]


@pytest.mark.parametrize("level", [None, 0.0, -1.2e-3])
def test_what_dropped_out_is_missing_afterwards(level: float | None, sound: xr.Dataset) -> None:
    """Held, at zero, or at the voltage of a cable that came off: the record given keeps its samples."""
    values = sound["NDE_B"].values.copy()
    values[2100:2160] = values[2100] if level is None else level
    ds = changed(sound, "NDE_B", values)
    failed = failures(ds)
    assert "one stretch of up to 60 samples" in failed["dropout", "NDE_B"]
    assert "taken as missing" in failed["dropout", "NDE_B"]
    assert list(failed) == [("dropout", "NDE_B")]  # said once: its ends are no jumps, its level no flat top
    out = without_lost_samples(ds, machine())
    assert np.flatnonzero(np.isnan(out["NDE_B"].values)).tolist() == list(range(2100, 2160))
    np.testing.assert_array_equal(ds["NDE_B"].values, values)
    np.testing.assert_array_equal(out["NDE_A"].values, sound["NDE_A"].values)


@pytest.mark.parametrize("fill", [-9999e-6, 1e30])
def test_what_a_logger_writes_for_nothing_has_no_unit(fill: float, sound: xr.Dataset) -> None:
    values = sound["NDE_B"].values.copy()
    values[4000:4020] = fill
    ds = changed(sound, "NDE_B", values)
    assert list(failures(ds)) == [("dropout", "NDE_B")]
    assert not left_out(ds, machine(), check(ds, machine()))


def test_a_stuck_probe_is_in_no_wrong_unit(sound: xr.Dataset) -> None:
    values = sound["NDE_B"].values.copy()
    values[2000:] = values[2000]  # from the release on
    failed = failures(changed(sound, "NDE_B", values))
    assert ("dead", "NDE_B") in failed and ("unit", "NDE_B") not in failed


def test_a_peak_that_is_cut_off_is_no_dropout(sound: xr.Dataset) -> None:
    ds = changed(sound, "NDE_B", np.maximum(sound["NDE_B"].values, np.quantile(sound["NDE_B"].values, 0.05)))
    assert ("clipping", "NDE_B") in failures(ds) and ("dropout", "NDE_B") not in failures(ds)
    assert np.isfinite(without_lost_samples(ds, machine())["NDE_B"].values).all()


@pytest.mark.parametrize("name", ["short/drop_100.nc", "coastdown/drop_100.nc"])
@pytest.mark.parametrize("quantum", [0.5e-6, 1e-6, 2e-6])
def test_a_swing_that_turns_in_coarse_steps_is_not_frozen(name: str, quantum: float) -> None:
    """A converter of few bits shows the same value for a while where the shaft turns round."""
    path = shipped(name)
    full = load_machine(path.parent / "machine.toml")
    record = read(path)
    for probe in full.probes:
        record[probe.name].values[:] = np.round(record[probe.name].values / quantum) * quantum
    laid = assign(record, full)
    found = [each for probe in full.probes for each in probe_checks(laid, full, probe) if each.check == "dropout"]
    assert [each.passed for each in found] == [True] * len(full.probes)


@pytest.mark.parametrize("start", [0.105, 0.114, 0.115, 0.12])
def test_no_probe_is_accused_where_the_record_begins_between_bounces(start: float) -> None:
    path = shipped("short/drop_100.nc")
    full = load_machine(path.parent / "machine.toml")
    late = assign(read(path).sel(time=slice(start, None)), full)
    assert not [each for each in check(late, full) if not each.passed and each.check == "fall"]
    whole = [each for each in check(assign(read(path), full), full) if each.check == "fall"]
    assert len(whole) == 2
    assert all(each.passed for each in whole)


@pytest.mark.parametrize("size", [80e-6, -200e-6])
def test_a_step_and_a_spike(size: float, sound: xr.Dataset) -> None:
    n = sound["NDE_A"].size
    stepped = changed(sound, "NDE_A", sound["NDE_A"].values + size * (np.arange(n) >= 7000))
    assert "1 steps" in failures(stepped)["jumps", "NDE_A"]
    assert "0.35 s" in failures(stepped)["jumps", "NDE_A"]
    spiked = changed(sound, "NDE_A", sound["NDE_A"].values + size * (np.arange(n) == 7000))
    assert "1 spikes" in failures(spiked)["jumps", "NDE_A"]
    wide = changed(sound, "NDE_A", sound["NDE_A"].values + size * ((np.arange(n) >= 7000) & (np.arange(n) < 7003)))
    assert "1 spikes" in failures(wide)["jumps", "NDE_A"]


def test_the_range_of_the_probe(sound: xr.Dataset) -> None:
    where = with_probe("NDE_A", range=["-100 um", "100 um"])
    assert "the probe's range (-100 um to 100 um)" in failures(sound, where)["range", "NDE_A"]
    far = changed(sound, "NDE_A", sound["NDE_A"].values + 2e-3)
    assert "3 radial gaps" in failures(far)["range", "NDE_A"]


@pytest.mark.parametrize("farthest", [900, -900])
def test_the_farthest_reading_out_of_range_has_its_sign(farthest: int, sound: xr.Dataset) -> None:
    values = sound["NDE_A"].values
    values = farthest * 1e-6 * values / values[np.argmax(np.abs(values))]
    where = with_probe("NDE_A", range=["-500 um", "500 um"])
    assert f"up to {farthest} um" in failures(changed(sound, "NDE_A", values), where)["range", "NDE_A"]


def test_a_record_of_levitation_alone_is_told_as_such(sound: xr.Dataset) -> None:
    before = sound.isel(time=slice(0, 1900))
    failed = failures(before)
    assert list(failed) == [("drop", "")]
    assert "the shaft does not fall in this record" in failed["drop", ""]
    assert not left_out(before, machine(), check(before, machine()))


@pytest.mark.parametrize(
    ("after", "where"),
    [(4.0, "while the shaft is still falling"), (10.0, "during its first contacts"), (18.0, "first contacts")],
)
def test_a_record_cut_in_the_fall_accuses_no_probe_across_it(after: float, where: str) -> None:
    """Two probes lie level: they have moved by some micrometres where the upright ones have seen the fall."""
    drawn = load_machine(shipped("years/machine.toml"))
    whole = assign(read(shipped("years/drop_03.nc")), drawn)
    row = {c.check: c for c in check(whole.sel(time=slice(0, 0.1 + after * 1e-3)), drawn) if not c.passed}
    assert list(row) == ["length"]
    told = re.match(r"the record ends ([\d.]+) ms after the release", row["length"].detail)
    assert told is not None and float(told.group(1)) == pytest.approx(after, abs=1.0)
    assert where in row["length"].detail
    assert "length" not in {c.check for c in check(whole, drawn)}


def test_identical_channels(sound: xr.Dataset) -> None:
    ds = changed(sound, "DE_B", sound["DE_A"].values)
    failed = failures(ds)
    assert ("identical", "DE_A") in failed
    assert (
        sum(found.check == "identical" for found in check(changed(ds, "NDE_A", sound["DE_A"].values), machine())) == 3
    )
    assert ("identical", "DE_B") in failed
    assert set(left_out(ds, machine(), check(ds, machine()))) == {"DE_A", "DE_B"}


@pytest.mark.parametrize("size", [5e-3, -150e-6])
def test_spikes_are_no_wrong_unit_and_are_missing_afterwards(size: float, sound: xr.Dataset) -> None:
    where = np.array([0, 150, 1500, 4000, 4001, 4002, 7777, sound["NDE_A"].size - 1])
    values = sound["NDE_A"].values.copy()
    values[where] += size
    ds = changed(sound, "NDE_A", values)
    assert {check for check, _ in failures(ds)} == {"jumps"}
    assert "6 spikes" in failures(ds)["jumps", "NDE_A"]
    out = without_lost_samples(ds, machine())
    assert np.flatnonzero(np.isnan(out["NDE_A"].values)).tolist() == where.tolist()
    assert without_lost_samples(sound, machine()).identical(sound)
