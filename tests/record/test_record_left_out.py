"""A channel whose samples have no time is told of, with the reason: it does not vanish."""

from __future__ import annotations

from pathlib import Path

import h5py
import netCDF4
import numpy as np
import pytest
import record_samples as samples
from record_machine import machine
from tdbsim.errors import InputError

from tdbmon.record.assign import assign
from tdbmon.record.inspect import inspect
from tdbmon.record.quality import check
from tdbmon.record.read import read


def _mat(path: Path, lengths: dict[str, int], **entries: object) -> Path:
    from scipy.io import savemat

    savemat(path, {name: np.arange(float(n)) for name, n in lengths.items()} | entries)
    return path


def test_what_is_no_channel_is_told_beside_them(tmp_path: Path) -> None:
    """Of a simulated drop a peak force along the ends was said to have no time, and its forces along ends and time not at all."""
    path = tmp_path / "a.nc"
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("time", 100)
        file.createDimension("end", 2)
        file.createVariable("time", "f8", ("time",))[...] = np.arange(100) / 1e3
        file.createVariable("end", str, ("end",))[...] = np.array(["NDE", "DE"], dtype=object)
        file.createVariable("NDE_A", "f8", ("time",))[...] = 0.0
        file.createVariable("peak_force", "f8", ("end",))[...] = 1.0
        file.createVariable("normal_force", "f8", ("end", "time"))[...] = 1.0
    found = inspect(path)
    assert found.left_out == {}
    assert found.beside == {"peak_force": "end", "normal_force": "end, time"}
    assert "not channels over time, so not analysed: peak_force (end), normal_force (end, time)" in found.lines()
    assert found.to_json()["beside"] == found.beside


@pytest.mark.parametrize("n", [70, 99, 101])
def test_a_channel_of_another_length_than_the_time_is_left_out_and_told(n: int, tmp_path: Path) -> None:
    path = _mat(tmp_path / "a.mat", {"t": 100, "NDE_A": 100, "NDE_B": n})
    record = read(path)
    assert set(record.data_vars) == {"NDE_A"}
    assert f"it has {n} samples, but the time vector beside it has 100" in record.attrs["left_out"]["NDE_B"]
    assert any(line.startswith(f"left out: NDE_B: it has {n} samples") for line in inspect(path).lines())


def test_a_channel_shorter_than_those_of_the_rate_is_left_out_and_told(tmp_path: Path) -> None:
    record = read(_mat(tmp_path / "a.mat", {"NDE_A": 100, "NDE_B": 70}, fs=10e3))
    assert set(record.data_vars) == {"NDE_A"}
    assert "it has 70 samples, but others have 100" in record.attrs["left_out"]["NDE_B"]


def test_a_channel_left_out_is_not_said_to_be_absent(tmp_path: Path) -> None:
    data = samples.signals(300)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["time"] = np.arange(300) / samples.RATE
        for name, values in data.items():
            file[name] = values[:-1] if name == "NDE_B" else values
            file[name].attrs["unit"] = samples.UNITS[name]
    found = {
        (each.check, each.channel): each.detail for each in check(assign(read(tmp_path / "a.h5"), machine()), machine())
    }
    told = found["present", "NDE_B"]
    assert "is in the file, but left out" in told
    assert "it has 299 samples, but the time vector beside it has 300" in told
    assert "not in the file" not in told


def test_a_long_list_is_cut_short(tmp_path: Path) -> None:
    path = _mat(tmp_path / "a.mat", {"t": 100, "A": 100} | {f"table_{k}": 5 for k in range(15)})
    lines = [line for line in inspect(path).lines() if line.startswith("left out")]
    assert len(lines) == 11
    assert lines[-1] == "left out: 5 more"


def test_netcdf_variables_without_a_time_are_told(tmp_path: Path) -> None:
    with netCDF4.Dataset(tmp_path / "a.nc", "w") as file:
        file.createDimension("time", 5)
        file.createDimension("other", 3)
        file.createVariable("time", "f8", ("time",))[:] = np.arange(5.0)
        file.createVariable("A", "f8", ("time",))[:] = 1.0
        file.createVariable("B", "f8", ("other",))[:] = 1.0
    record = read(tmp_path / "a.nc")
    assert list(record.data_vars) == ["A"]
    assert record.attrs["left_out"] == {"B": "its sampling times are not given"}


def test_tdms_channels_without_samples_or_interval_are_told(tmp_path: Path) -> None:
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as file:
        file.write_segment([
            nptdms.ChannelObject("g", "A", np.arange(5.0), properties={"wf_increment": 0.1}),
            nptdms.ChannelObject("g", "B", np.arange(5.0)),
            nptdms.ChannelObject("g", "C", np.empty(0), properties={"wf_increment": 0.1}),
        ])  # fmt: skip
    record = read(tmp_path / "a.tdms")
    assert list(record.data_vars) == ["A"]
    assert "wf_increment" in record.attrs["left_out"]["B"]
    assert record.attrs["left_out"]["C"] == "it has no samples"


def test_a_file_of_nothing_else_is_refused_with_the_reason(tmp_path: Path) -> None:
    with netCDF4.Dataset(tmp_path / "a.nc", "w") as file:
        file.createDimension("other", 3)
        file.createVariable("B", "f8", ("other",))[:] = 1.0
    with pytest.raises(InputError, match="no channel over time \\('B': its sampling times"):
        read(tmp_path / "a.nc")
