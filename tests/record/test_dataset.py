"""Datasets that `read` did not make: by units and times of their own, the same record; or an error that says what to change."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from tdbsim.errors import InputError
from tdbsim.machine import load_machine

import tdbmon.accessor  # noqa: F401  registers ds.tdb
from tdbmon.record.assign import assign
from tdbmon.record.read import read
from tdbmon.shipped import shipped

DROP = shipped("short/drop_100.nc")


@pytest.fixture(scope="module")
def machine():
    return load_machine(shipped("short/machine.toml"))


@pytest.fixture(scope="module")
def laid(machine):
    return assign(read(DROP), machine)


def opened() -> xr.Dataset:
    return xr.open_dataset(DROP).load()


def in_mil(ds: xr.Dataset) -> xr.Dataset:
    mil = {name: ds[name] / 25.4 for name in ("NDE_A", "NDE_B", "DE_A", "DE_B")}
    return ds.assign({name: array.assign_attrs(units="mil") for name, array in mil.items()})


def dated(ds: xr.Dataset) -> xr.Dataset:
    since = (ds.time.values * 1e9).round().astype("timedelta64[ns]")
    return ds.assign_coords(time=np.datetime64("2026-03-11T09:00:00", "ns") + since)


def lasting(ds: xr.Dataset) -> xr.Dataset:
    return ds.assign_coords(time=(ds.time.values * 1e9).round().astype("timedelta64[ns]"))


def in_ms(ds: xr.Dataset) -> xr.Dataset:
    return ds.assign_coords(time=("time", ds.time.values * 1e3, {"units": "ms"}))


def since_1970(ds: xr.Dataset) -> xr.Dataset:
    """As floats the times would lose 0.2 us."""
    return ds.assign_coords(time=("time", dated(ds).time.values.astype(np.int64), {"units": "ns"}))


@pytest.mark.parametrize("change", [lambda ds: ds, in_mil, dated, lasting, in_ms, since_1970])
def test_a_dataset_in_hand_is_the_record_that_its_file_is(change, laid, machine):
    found = assign(change(opened()), machine)
    assert set(found.data_vars) == set(laid.data_vars)
    np.testing.assert_allclose(found.time, laid.time, atol=1e-12)
    for name, array in laid.data_vars.items():
        np.testing.assert_allclose(found[name], array, rtol=1e-9, atol=1e-15, err_msg=name)
        assert found[name].attrs["units"] == array.attrs["units"]
    if change is not in_mil:  # arithmetic drops what xarray knows of the converter
        np.testing.assert_allclose(found.NDE_A.attrs["full_scale"], laid.NDE_A.attrs["full_scale"])
        assert found.NDE_A.attrs["source_units"] == "um"


def test_the_accessor_analyses_what_xarray_opens(machine):
    found, wanted = (ds.tdb.analyse(machine).result for ds in (dated(in_mil(opened())), read(DROP)))
    assert found.release.time.value == pytest.approx(wanted.release.time.value, abs=1e-7)
    for end, there in wanted.ends.items():
        assert found.ends[end].air_gap.value == pytest.approx(there.air_gap.value, abs=1e-8)


def test_what_is_in_the_form_of_a_record_stays(laid, machine):
    record = read(DROP)
    assert assign(record, machine).NDE_A.encoding == record.NDE_A.encoding != {}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda ds: ds.drop_vars("time"), "has no coordinate; give it the times of the samples"),
        (lambda ds: ds.assign_coords(time=("time", ds.time.values, {"units": "mm"})), "'time' is in 'mm'"),
        (lambda ds: ds.assign_coords(time=[f"s{k}" for k in range(ds.sizes["time"])]), "'time' is of type"),
        (lambda ds: ds.isel(time=slice(None, None, -1)), "does not increase after sample 1 "),
        (
            lambda ds: ds.assign(DE_A=ds.DE_A.expand_dims(run=2)),
            "'DE_A' of type float64 with dimensions ('run', 'time')",
        ),
        (
            lambda ds: ds.assign(DE_A=ds.DE_A.assign_attrs(units="rpm")),
            "is a speed or frequency (rpm), but a displacement",
        ),
        (lambda ds: ds.assign(DE_A=ds.DE_A.assign_attrs(units="um pp")), "give the unit alone: 'um'"),
    ],
)
def test_what_cannot_be_a_record_is_told_with_its_cure(change, says, machine):
    with pytest.raises(InputError) as error:
        change(opened()).tdb.analyse(machine)
    assert says in str(error.value)
