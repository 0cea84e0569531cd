"""Probes to machine axes and to the bearing planes: a rigid line must come back exactly."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from tdbsim.errors import InputError
from tdbsim.machine import Machine

from tdbmon.analysis.axes import to_planes

TIME = np.arange(50) * 1e-4


def with_probes(machine, **angles):
    """The machine with other probe angles, rad."""
    probes = tuple(p.model_copy(update={"angle": angles.get(p.name, p.angle)}) for p in machine.probes)
    return machine.model_copy(update={"probes": probes})


def readings(machine: Machine, offset, tilt) -> xr.Dataset:
    """What the probes read of a rigid line x(z) = offset + tilt z, growing with time."""
    data = {}
    for p in machine.probes:
        x, y = offset[0] + tilt[0] * p.position, offset[1] + tilt[1] * p.position
        data[p.name] = ("time", (x * np.cos(p.angle) + y * np.sin(p.angle)) * (1 + TIME))
    return xr.Dataset(data, coords={"time": TIME})


small = st.floats(-3e-4, 3e-4)


@settings(max_examples=40, deadline=None)
@given(small, small, small, small, st.floats(0, 6.28), st.floats(0.5, 2.6))
def test_a_rigid_line_comes_back_at_the_bearing_planes(machine, x, y, tx, ty, first, between):
    turned = with_probes(machine, NDE_A=first, NDE_B=first + between)
    planes = to_planes(readings(turned, (x, y), (tx, ty)), turned)
    for end in machine.ends:
        z = machine.bearing(end).position
        expected = np.outer([x + tx * z, y + ty * z], 1 + TIME)
        np.testing.assert_allclose(planes.displacement.sel(end=end), expected, atol=1e-12)
    assert list(planes.plane.values) == ["bearing", "bearing"]


def test_three_probes_leave_the_complete_end_at_its_own_plane(machine):
    record = readings(machine, (1e-4, -2e-4), (0, 0)).drop_vars("DE_B")
    planes = to_planes(record, machine)
    assert list(planes.plane.values) == ["probe", "none"]
    np.testing.assert_allclose(planes.displacement.sel(end="NDE")[:, 0], [1e-4, -2e-4], atol=1e-12)
    assert np.isnan(planes.displacement.sel(end="DE")).all()


def test_missing_samples_stay_missing_and_only_there(machine):
    record = readings(machine, (1e-4, 0), (0, 0))
    record["NDE_A"][7] = np.nan
    displacement = to_planes(record, machine).displacement
    assert np.isnan(displacement.sel(end="NDE")[:, 7]).all()
    assert np.isfinite(displacement.sel(end="NDE")[:, 8:]).all()


def test_of_probes_in_the_bearing_planes_one_end_does_not_blank_the_other(machine):
    at = {p.name: machine.bearing(p.end).position for p in machine.probes}
    probes = tuple(p.model_copy(update={"position": at[p.name]}) for p in machine.probes)
    beside = machine.model_copy(update={"probes": probes})
    record = readings(beside, (1e-4, -5e-5), (1e-5, 2e-5))
    whole = to_planes(record, beside).displacement
    record["NDE_A"][7:20] = np.nan
    found = to_planes(record, beside)
    assert list(found.plane.values) == ["bearing", "bearing"]
    assert np.isnan(found.displacement.sel(end="NDE")[:, 7:20]).all()
    np.testing.assert_allclose(found.displacement.sel(end="DE"), whole.sel(end="DE"), atol=1e-15)


def test_one_probe_alone_is_refused(machine):
    with pytest.raises(InputError, match="two usable probes"):
        to_planes(readings(machine, (0, 0), (0, 0))[["NDE_A"]], machine)


def test_probes_on_two_time_bases_are_refused(machine):
    record = readings(machine, (0, 0), (0, 0))
    other = record[["DE_A"]].rename(time="time_2")
    with pytest.raises(InputError, match="one rate"):
        to_planes(xr.merge([record.drop_vars("DE_A"), other]), machine)


def test_a_hole_in_time_does_not_change_the_sampling_rate(machine):
    record = readings(machine, (1e-4, 0), (0, 0)).isel(time=np.r_[:10, 30:50])
    assert to_planes(record, machine).attrs["sampling_hz"] == pytest.approx(1e4, rel=1e-9)
