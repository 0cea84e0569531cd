"""Faults of cabling put into a shipped record must be named."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from tdbmon.analysis.axes import to_planes
from tdbmon.analysis.orientation import check_orientation
from tdbmon.record.assign import assign
from tdbmon.record.quality import check
from tdbmon.record.read import read
from tdbmon.shipped import shipped


@pytest.fixture(scope="module")
def record(machine):
    return assign(read(shipped("short/drop_100.nc")), machine).load()


def rows(record, machine):
    return {row.channel: row for row in check_orientation(to_planes(record, machine), record, machine, 0.1, {})}


def test_a_sound_record_rests_at_the_bottom(record, machine):
    assert all(row.passed for row in rows(record, machine).values())


@pytest.mark.parametrize("probe", ["NDE_A", "NDE_B", "DE_A", "DE_B"])
def test_an_inverted_probe_is_named(record, machine, probe):
    faulty = record.copy()
    faulty[probe] = -record[probe]
    # seen at the probes' own planes: along the rigid line one wrong probe turns the other end too
    row = rows(faulty, machine)[probe.split("_")[0]]
    assert not row.passed
    assert f"'{probe}' is inverted" in row.detail
    assert f"add 180 deg to the angle of '{probe}'" in row.detail
    turned = [p.model_copy(update={"angle": p.angle + np.pi}) if p.name == probe else p for p in machine.probes]
    assert rows(faulty, machine.model_copy(update={"probes": tuple(turned)}))[probe.split("_")[0]].passed


@pytest.mark.parametrize("offset", [-300e-6, 300e-6, 600e-6])
def test_an_offset_is_no_inverted_probe(record, machine, offset):
    faulty = record.copy()
    faulty["NDE_A"] = record["NDE_A"] + offset
    row = rows(faulty, machine)["NDE"]
    assert not row.passed
    assert "the zero of a probe is wrong" in row.detail
    assert "inverted" not in row.detail


def test_a_long_levitated_stretch_is_no_rest(record, machine):
    """A tenth of the whole record would reach back into the levitation, and put the rest position in between."""
    time = record[record["NDE_A"].dims[0]].values
    step = time[1] - time[0]
    lead = record.sel(time=slice(0, 0.09))
    held = xr.concat([lead] * 100 + [record], "time")
    held["time"] = step * np.arange(held.sizes["time"])
    planes = to_planes(held, machine)
    found = {row.channel: row for row in check_orientation(planes, held, machine, held.sizes["time"] * step - 0.4, {})}
    for end, row in rows(record, machine).items():
        assert row.passed
        assert found[end].detail == row.detail


def test_a_shaft_that_goes_about_the_probes_zero_as_the_record_ends_is_not_judged(record, machine):
    """Its mean place is a few micrometres from there, in a direction that tells nothing."""
    gap = machine.bearing("NDE").radial_gap.nominal
    time = record["NDE_A"][record["NDE_A"].dims[0]].values
    place = 5e-6j + gap * np.sin(2 * np.pi * 90.0 * time) * np.exp(2j * np.pi * 20.0 * time)
    moving = record.copy()
    for probe in machine.probes_at("NDE"):
        moving[probe.name] = record[probe.name].copy(
            data=np.where(time > 0.3, (place * np.exp(-1j * probe.angle)).real, record[probe.name].values)
        )
    planes = to_planes(moving, machine, [probe.name for probe in machine.probes])
    found = {row.channel: row for row in check_orientation(planes, moving, machine, 0.1, {})}
    assert "NDE" not in found


def test_a_zero_set_where_the_shaft_rests_is_still_told(record, machine):
    faulty = record.copy()
    for probe, off in zip(machine.probes_at("NDE"), (3e-6, 5e-6), strict=True):
        faulty[probe.name] = record[probe.name] - record[probe.name].values[-800:].mean() + off
    row = rows(faulty, machine)["NDE"]
    assert not row.passed and "the zero of a probe is wrong" in row.detail


def test_an_end_with_a_probe_out_of_range_is_not_accused(record, machine):
    faulty = record.copy()
    faulty["NDE_A"] = record["NDE_A"] + 2e-3
    checks = check(faulty, machine)
    assert any(found.check == "range" and not found.passed for found in checks)
    found = check_orientation(to_planes(faulty, machine), faulty, machine, 0.1, {}, checks)
    assert {row.channel for row in found} == {"DE"}


def test_probes_turned_by_ninety_degrees_are_seen(record, machine):
    turned = [p.model_copy(update={"angle": p.angle + np.pi / 2}) for p in machine.probes]
    row = rows(record, machine.model_copy(update={"probes": tuple(turned)}))["DE"]
    assert not row.passed
    assert "inverted" in row.detail or "deg off" in row.detail


def test_a_record_that_ends_while_the_shaft_bounces_is_not_judged(record, machine):
    assert rows(record.sel(time=slice(0, 0.3)), machine) == {}
