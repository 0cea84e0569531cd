"""netCDF and HDF5: packed values, several rates, groups, labels, and what is written."""

from __future__ import annotations

from pathlib import Path

import h5py
import netCDF4
import numpy as np
import pytest
import record_samples as samples
import xarray as xr
from tdbsim.errors import InputError
from tdbsim.machine import load_machine

from tdbmon.record.assign import assign
from tdbmon.record.inspect import inspect
from tdbmon.record.read import read, write
from tdbmon.shipped import shipped

DATASETS = Path(__file__).parents[2] / "datasets"


def test_packed_netcdf_has_its_full_scale_and_every_code_is_a_value(tmp_path: Path) -> None:
    codes = np.linspace(-32768, 32767, 50).astype(np.int16)
    codes[3] = -32767  # netCDF's default fill value, and a code like any other
    with samples.open_netcdf(tmp_path / "a.nc") as file:
        variable = file.createVariable("A", "i2", ("time",))
        variable.set_auto_maskandscale(False)
        variable.units, variable.scale_factor, variable.add_offset = "um", 0.25, 3.0
        variable[:] = codes
    array = read(tmp_path / "a.nc")["A"]
    np.testing.assert_allclose(array.values, (codes * 0.25 + 3.0) * 1e-6, rtol=1e-15)
    np.testing.assert_allclose(array.attrs["full_scale"], [-8189e-6, 8194.75e-6], rtol=1e-14)


@pytest.mark.parametrize("fill", [False, True])
def test_unsigned_codes_have_their_full_scale_with_missing_ones_too(fill: bool, tmp_path: Path) -> None:
    codes = np.linspace(0, 65534, 50).astype(np.uint16)
    with samples.open_netcdf(tmp_path / "a.nc") as file:
        variable = file.createVariable("A", "i2", ("time",), fill_value=-1)
        variable.set_auto_maskandscale(False)
        variable._Unsigned, variable.units, variable.scale_factor = "true", "um", 0.25
        if fill:
            codes[5] = 65535
        variable[:] = codes.view(np.int16)
    array = read(tmp_path / "a.nc")["A"]
    assert np.flatnonzero(np.isnan(array.values)).tolist() == [5] * fill
    np.testing.assert_allclose(array.attrs["full_scale"], [0.0, 65535 * 0.25e-6], rtol=1e-14)


def test_declared_fill_values_are_missing(tmp_path: Path) -> None:
    with samples.open_netcdf(tmp_path / "a.nc") as file:
        variable = file.createVariable("A", "i2", ("time",), fill_value=-999)
        variable.set_auto_maskandscale(False)
        variable[:] = np.where(np.arange(50) == 7, -999, np.arange(50))
        variable.scale_factor = 0.5
        real = file.createVariable("B", "f4", ("time",))
        real.missing_value = np.float32(-1.0)
        real[:] = np.where(np.arange(50) == 9, -1.0, 2.0)
    record = read(tmp_path / "a.nc")
    assert np.flatnonzero(np.isnan(record["A"].values)).tolist() == [7]
    assert record["A"].values[8] == 4.0
    assert np.flatnonzero(np.isnan(record["B"].values)).tolist() == [9]


@pytest.mark.parametrize(
    ("units", "first", "dropped"),
    [
        ("milliseconds since 2026-03-10 09:00:00", 250.0, "2026-03-10T09:00:00.250000"),
        ("seconds since 1970-01-01", 1773133200.5, "2026-03-10T09:00:00.500000"),
        ("seconds since 2000-01-01 00:00:00", 0.0, ""),  # an epoch, no time of a drop
        ("seconds since 1970-01-01 01:00:00", 0.5, ""),
        ("seconds since the release", 0.5, ""),
        ("s", 0.5, ""),
    ],
)
def test_a_time_that_counts_from_an_epoch_dates_the_drop(
    units: str, first: float, dropped: str, tmp_path: Path
) -> None:
    path = tmp_path / "epoch.nc"
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("time", 3)
        time = file.createVariable("time", "f8", ("time",))
        time.units = units
        time[:] = first + np.arange(3.0)
        file.createVariable("A", "f8", ("time",))[:] = 1.0
    assert read(path).attrs["drop_time"] == dropped


def test_netcdf_with_several_rates_scalars_texts_and_groups(tmp_path: Path) -> None:
    with samples.open_netcdf(tmp_path / "a.nc") as file:
        file.createVariable("fast", "f8", ("time",))[:] = np.arange(50.0)
        file.createDimension("slow_time", 5)
        file.createVariable("slow_time", "f8", ("slow_time",))[:] = 100 + 10 * np.arange(5)
        file["slow_time"].units = "ms"
        file.createVariable("slow", "f8", ("slow_time",))[:] = np.arange(5.0)
        file.createVariable("serial_number", "i4", ())[...] = 7
        file.createDimension("letters", 4)
        file.createVariable("comment", "S1", ("letters",))[:] = np.array(list("text"), dtype="S1")
        file.createVariable("calibration", "f8", ("letters",))[:] = 1.0
        inner = file.createGroup("more")
        inner.createVariable("inner", "f8", ("time",))[:] = 3.0
    record = read(tmp_path / "a.nc")
    assert set(record.data_vars) == {"fast", "slow", "more/inner"}
    assert record["fast"].dims == ("time",)
    assert record["slow"].dims == ("time_2",)
    np.testing.assert_allclose(record["time_2"].values, [0.1, 0.11, 0.12, 0.13, 0.14])
    assert record["fast"].size == 50  # nothing was resampled


def test_written_records_are_read_back_identically_and_packed(tmp_path: Path) -> None:
    source = DATASETS / "short" / "drop_100.nc"
    record = read(source)
    write(record, tmp_path / "copy.nc")
    again = read(tmp_path / "copy.nc")
    for name in record.variables:
        np.testing.assert_array_equal(again[name].values, record[name].values)
        assert again[name].attrs.get("units") == record[name].attrs.get("units")
        assert again[name].attrs.get("full_scale") == record[name].attrs.get("full_scale")
    assert again.attrs["title"] == record.attrs["title"]
    assert again.attrs["drop_time"] == record.attrs["drop_time"]
    with netCDF4.Dataset(tmp_path / "copy.nc") as file:
        assert file["NDE_A"].dtype == np.int16
        assert file["keyphasor"].dtype == np.int8
        assert file["speed"].dtype == np.float32
        assert file["NDE_A"].filters()["zlib"]
    assert (tmp_path / "copy.nc").stat().st_size < 1.5 * source.stat().st_size


def test_what_cannot_be_packed_exactly_is_written_in_full(tmp_path: Path) -> None:
    time = ("time", np.arange(4) / 10.0)
    ds = xr.Dataset({"A": ("time", np.array([0.1, np.nan, 1 / 3, -np.inf]))}, coords={"time": time})
    ds["A"].attrs["units"] = "m"
    ds["A"].encoding = {"dtype": np.dtype(np.int16), "scale_factor": 0.1, "add_offset": 0.0}
    ds["B"] = ("time", np.array([1e300, 0.0, 0.0, 0.0]))
    write(ds, tmp_path / "a.nc")
    again = read(tmp_path / "a.nc")
    np.testing.assert_array_equal(again["A"].values, ds["A"].values)
    np.testing.assert_array_equal(again["B"].values, ds["B"].values)


def test_a_record_is_written_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record = read(DATASETS / "short" / "drop_060.nc")
    target = tmp_path / "kept.nc"
    target.write_bytes(b"the earlier file")

    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", fail)
    with pytest.raises(InputError, match=r"kept\.nc: cannot be written \(No space left"):
        write(record, target)
    assert target.read_bytes() == b"the earlier file"
    assert [path.name for path in tmp_path.iterdir()] == ["kept.nc"]
    with pytest.raises(InputError, match="cannot be written"):
        write(record, tmp_path / "no such folder" / "a.nc")


def test_hdf5_values_that_are_packed_as_in_netcdf_are_unpacked(tmp_path: Path) -> None:
    codes = np.array([-32768, -5, 0, 7, 32767], dtype=np.int16)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["NDE_A"], file["whole"] = codes, codes
        file["NDE_A"].attrs.update({"units": "um", "scale_factor": 0.02, "add_offset": 3.0})
        file["whole"].attrs["units"] = "um"
        file.attrs["sampling_rate"] = 1000.0
    record = read(tmp_path / "a.h5")
    np.testing.assert_allclose(record["NDE_A"].values, (codes * 0.02 + 3.0) * 1e-6, rtol=1e-12)
    np.testing.assert_allclose(record["NDE_A"].attrs["full_scale"], [-652.36e-6, 658.34e-6], rtol=1e-9)
    np.testing.assert_allclose(record["whole"].values, codes * 1e-6, rtol=1e-12)


def test_a_channel_that_starts_at_nought_does_not_start_where_others_do(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.attrs.update({"dt": 1e-3, "t0": 0.25})
        file["NDE_A"], file["NDE_B"] = np.arange(5.0), np.arange(5.0)
        file["NDE_A"].attrs["t0"] = 0.0
    record = read(tmp_path / "a.h5")
    first = {name: float(record[name][record[name].dims[0]].values[0]) for name in ("NDE_A", "NDE_B")}
    assert first == {"NDE_A": 0.0, "NDE_B": 0.25}


def _labelled(path: Path) -> Path:
    """Two groups of arrays, of which labels name the first two; the third bears the name of the second in another group."""
    with h5py.File(path, "w") as file:
        file.attrs["dt"] = 1e-4
        for number, (name, label) in enumerate((("A/AI0", "NDE_A"), ("A/AI1", "NDE_B"), ("B/AI1", "DE_A"))):
            file[name] = np.arange(5.0) + number
            file[name].attrs.update({"label": label, "unit": "um"})
    return path


@pytest.mark.parametrize("asked", ["NDE_A", "AI0", "A/AI0", "A/NDE_A"])
def test_a_channel_goes_by_its_label_and_by_its_own_name(asked: str, tmp_path: Path) -> None:
    machine = load_machine(shipped("short/machine.toml"))
    record = read(_labelled(tmp_path / "a.h5"))
    found = assign(record, machine.model_copy(update={"channels": {"NDE_B": "A/AI1", "NDE_A": asked, "DE_A": "AI1"}}))
    assert float(found["NDE_A"][0]) == 0.0
    assert float(found["NDE_B"][0]) == pytest.approx(1e-6)
    assert "DE_A" in found.attrs["missing"]  # two are called AI1
    shown = inspect(tmp_path / "a.h5")
    assert [each.stored for each in shown.channels] == ["A/AI0", "A/AI1", "B/AI1"]
    assert "NDE_A (A/AI0)" in "\n".join(shown.lines())


def test_hdf5_matrix_with_names_and_foreign_things(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["data"] = np.arange(30.0).reshape(10, 3)
        file["data"].attrs["channel_names"] = ["A", "B", "C"]
        file["data"].attrs["units"] = ["um", "V", "rpm"]
        file.attrs["sampling_rate"] = "5 kHz"
        file["picture"] = np.zeros((4, 5, 6))
        file["gains"] = np.ones(3)
        file["empty"] = np.empty(0)
        file["nothing"] = h5py.Empty("f8")
        file["complex"] = np.ones(10, dtype=complex)
        file["outside"] = h5py.ExternalLink("elsewhere.h5", "/x")
        file["round"] = h5py.SoftLink("/")
    record = read(tmp_path / "a.h5")
    assert set(record.data_vars) == {"A", "B", "C"}
    np.testing.assert_array_equal(record["A"].values, np.arange(0, 30, 3) * 1e-6)
    assert record["C"].attrs["units"] == "Hz"
    np.testing.assert_allclose(np.diff(record["time"].values), 2e-4)


def test_the_columns_of_a_table_in_hdf5_are_channels(tmp_path: Path) -> None:
    rows = np.zeros(10, dtype=[("time", "f8"), ("A", "f4"), ("B", "i2"), ("remark", "S4")])
    rows["time"], rows["A"], rows["B"] = np.arange(10) / 100, np.arange(10) / 2, np.arange(10)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["table"] = rows
    record = read(tmp_path / "a.h5")
    assert set(record.data_vars) == {"A", "B"}
    np.testing.assert_array_equal(record["A"].values, rows["A"])
    np.testing.assert_allclose(record["time"].values, rows["time"])
