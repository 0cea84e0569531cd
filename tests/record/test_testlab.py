"""MATLAB files as Simcenter Testlab and DEWESoft write them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
from scipy.io import savemat

from tdbmon.record.read import read

_N = 50
_TRANSFORMATION = {"factor": 1.0, "offset": 0.0, "log_reference": 1.0}


def _cell(texts: list[str]) -> np.ndarray:
    cell = np.empty((1, len(texts)), dtype=object)
    cell[0, :] = texts
    return cell


def _signal(names: str | list[str], measured: np.ndarray, unit: str, axis: str = "s", **x: Any) -> dict[str, Any]:
    x = x or {"start_value": 0.5, "increment": 1e-4, "number_of_values": float(len(measured))}
    names, made = (
        (names, "2026/03/10 15:00:00")
        if isinstance(names, str)
        else (_cell(names), _cell(["2026/03/10 15:00:00"] * len(names)))
    )
    return {
        "x_values": {**x, "quantity": {"label": axis, "unit_transformation": _TRANSFORMATION, "info": ""}},
        "y_values": {
            "values": measured,
            "quantity": {"label": unit, "unit_transformation": _TRANSFORMATION, "info": ""},
        },
        "function_record": {"name": names, "creation_time": made, "type": "Signal"},
    }


def test_signals_of_testlab_alone_and_in_a_group(tmp_path: Path) -> None:
    """They were refused: axis and values are structs of their own."""
    probes = np.arange(2.0 * _N).reshape(_N, 2)
    signals = {
        "Signal": _signal(["NDE:A", "NDE:B"], probes, "um"),
        "Signal_0": _signal("speed", 60 * probes[:, :1], "rpm"),
    }
    savemat(tmp_path / "a.mat", {**signals, "FRF": _signal("FRF", probes[:, :1], "um/N", axis="Hz")})
    record = read(tmp_path / "a.mat")
    assert set(record.data_vars) == {"NDE:A", "NDE:B", "speed"}
    np.testing.assert_allclose(record["NDE:B"].values, probes[:, 1] * 1e-6)
    np.testing.assert_allclose(record["speed"].values, probes[:, 0])
    assert record["speed"].dims == record["NDE:A"].dims == ("time",)
    np.testing.assert_allclose(record["time"].values, 1e-4 * np.arange(_N), atol=1e-12)
    assert set(record.attrs["left_out"]) == {"FRF"}
    assert record.attrs["drop_time"] == "2026-03-10T15:00:00"


def test_signals_of_testlab_with_times_of_their_own(tmp_path: Path) -> None:
    times = np.cumsum(np.linspace(1, 2, _N))
    values = np.arange(float(_N))[:, None]
    late = _signal("slow", values, "um", start_value=1.0, increment=1e-3, number_of_values=float(_N))
    savemat(tmp_path / "a.mat", {"Signal_0": _signal("A", values, "um", axis="ms", values=times), "Signal_1": late})
    record = read(tmp_path / "a.mat")
    np.testing.assert_allclose(record[record["A"].dims[0]].values, (times - times[0]) * 1e-3, atol=1e-12)
    np.testing.assert_allclose(record[record["slow"].dims[0]].values, 1 - 1e-3 + 1e-3 * np.arange(_N), atol=1e-12)


def test_signals_of_testlab_in_version_73(tmp_path: Path) -> None:
    def store(group: h5py.Group, content: dict[str, Any]) -> None:
        for key, value in content.items():
            if isinstance(value, dict):
                store(group.create_group(key), value)
            elif isinstance(value, str):
                group[key] = np.array([[ord(letter)] for letter in value or " "], dtype=np.uint16)
                group[key].attrs["MATLAB_class"] = np.bytes_("char")
            else:
                group[key] = np.atleast_2d(value).T

    with h5py.File(tmp_path / "a.mat", "w", userblock_size=512) as file:
        store(file, {"Signal_0": _signal("NDE_A", np.arange(float(_N))[:, None], "um")})
    raw, head = (tmp_path / "a.mat").read_bytes(), b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM"
    (tmp_path / "a.mat").write_bytes(head + raw[len(head) :])
    record = read(tmp_path / "a.mat")
    np.testing.assert_allclose(record["NDE_A"].values, 1e-6 * np.arange(_N))
    np.testing.assert_allclose(np.diff(record["time"].values), 1e-4)


def test_times_of_dewesoft_are_no_channels(tmp_path: Path) -> None:
    fast, slow = 1e-4 * np.arange(_N), 1e-3 * np.arange(5)
    savemat(tmp_path / "a.mat", {
        "Data1_NDE_A": np.arange(float(_N)), "Data1_time_NDE_A": fast, "Data1_T": np.arange(5.0), "Data1_time_T": slow,
        "Sample_rate": 1e4, "Start_time": "10.3.2026 15:00:00",
    }, oned_as="column")  # fmt: skip
    record = read(tmp_path / "a.mat")
    assert set(record.data_vars) == {"Data1_NDE_A", "Data1_T"}
    np.testing.assert_allclose(record[record["Data1_T"].dims[0]].values, slow)
    assert record.attrs["drop_time"] == "2026-03-10T15:00:00"
