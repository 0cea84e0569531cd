"""Times that count from 1970: as floats they would lose the digits that tell samples apart."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import h5py
import netCDF4
import numpy as np
import pytest

from tdbmon.record.read import read

_FIRST, _N = 1773219600123456789, 200  # ns
_STAMPS = _FIRST + 50_000 * np.arange(_N)  # 20 kHz


def _csv(path: Path, stamps: np.ndarray, unit: str) -> None:
    name = f"timestamp [{unit}]" if unit else "timestamp"
    path.write_text(f"{name},A [um]\n" + "".join(f"{stamp},{k}\n" for k, stamp in enumerate(stamps.tolist())))


def _hdf5(path: Path, stamps: np.ndarray, unit: str) -> None:
    with h5py.File(path, "w") as file:
        file["run/timestamp"], file["run/A"] = stamps, np.arange(_N)
        if unit:
            file["run/timestamp"].attrs["units"] = unit


def _netcdf(path: Path, stamps: np.ndarray, unit: str) -> None:
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("sample", _N)
        file.createVariable("timestamp", "i8", ("sample",))[:] = stamps
        file.createVariable("A", "f8", ("sample",))[:] = np.arange(_N)
        if unit:
            file["timestamp"].units = f"{unit} since 1970-01-01"


@pytest.mark.parametrize("write", [_csv, _hdf5, _netcdf])
@pytest.mark.parametrize(("tick", "unit"), [(1, "ns"), (1, ""), (1000, "us"), (1000, "")])
def test_ticks_keep_their_digits_and_their_size_tells_an_unstated_unit(
    write: Callable[[Path, np.ndarray, str], None], tick: int, unit: str, tmp_path: Path
) -> None:
    """Samples at 20 kHz were up to 0.3 us off, or 50000 s apart where no unit was stated."""
    write(tmp_path / "a", _STAMPS // tick, unit)
    np.testing.assert_allclose(read(tmp_path / "a")["time"].values, 50e-6 * np.arange(_N), rtol=0, atol=1e-15)


def test_file_times_of_windows_count_from_1601(tmp_path: Path) -> None:
    _hdf5(tmp_path / "a", _STAMPS // 100 + 116444736 * 10**9, "")
    np.testing.assert_allclose(read(tmp_path / "a")["time"].values, 50e-6 * np.arange(_N), rtol=0, atol=1e-15)


def test_milliseconds_with_decimals_are_told_by_their_size(tmp_path: Path) -> None:
    _csv(tmp_path / "a", _STAMPS / 1e6, "")
    np.testing.assert_allclose(read(tmp_path / "a")["time"].values, 50e-6 * np.arange(_N), rtol=0, atol=3e-7)


def test_ticks_of_several_clocks_count_from_the_first_of_all(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["fast/time"], file["fast/A"] = _STAMPS, np.arange(_N)
        file["slow/time"], file["slow/B"] = _FIRST // 1000 + 2000 + 1000 * np.arange(5), np.arange(5)
    record = read(tmp_path / "a.h5")
    np.testing.assert_allclose(record[record["A"].dims[0]].values, 50e-6 * np.arange(_N), atol=1e-15)
    np.testing.assert_allclose(record[record["B"].dims[0]].values, 2e-3 + 1e-3 * np.arange(5), atol=1e-6)


@pytest.mark.parametrize("unit", ["ns", "us"])
def test_ticks_from_the_start_are_read_as_they_are(unit: str, tmp_path: Path) -> None:
    ticks = 50_000 * np.arange(_N)
    _hdf5(tmp_path / "a", ticks, unit)
    np.testing.assert_array_equal(read(tmp_path / "a")["time"].values, ticks * {"ns": 1e-9, "us": 1e-6}[unit])
