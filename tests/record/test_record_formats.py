"""Every format: what its own library writes is read back, whatever the file is called."""

from __future__ import annotations

import shutil
import struct
import sys
from importlib.util import find_spec
from pathlib import Path

import h5py
import numpy as np
import pytest
import record_samples as samples
from scipy.io import savemat
from tdbsim.errors import InputError
from tdbsim.machine import load_machine

from tdbmon.record.assign import assign
from tdbmon.record.inspect import inspect
from tdbmon.record.read import read
from tdbmon.shipped import shipped


@pytest.mark.parametrize("kind", samples.WRITERS)
def test_a_record_is_read_back_exactly(kind: str, tmp_path: Path) -> None:
    reader, writer = samples.WRITERS[kind]
    path = tmp_path / "record.dat"  # a suffix that says nothing
    data = samples.signals()
    writer(path, data)
    record = read(path)
    assert record.attrs["reader"] == reader
    assert record.attrs["source_file"] == "record.dat"
    assert len(record.attrs["sha256"]) == 64
    names = (
        dict(zip(data, ("ch1", "ch2", "ch3", "ch4", "ch5", "ch6"), strict=True))
        if kind == "wav"
        else {n: n for n in data}
    )
    assert set(record.data_vars) == set(names.values())
    bare = kind in ("wav", "mat5_plain")
    for name, values in data.items():
        array = record[names[name]]
        assert array.dims == ("time",)
        assert array.dtype == np.float64
        factor = 1e-6 if samples.UNITS[name] == "um" and not bare else 1.0
        if kind == "uff":  # twelve digits in the file
            np.testing.assert_allclose(array.values, values * factor, rtol=1e-11, atol=1e-17)
        else:
            np.testing.assert_array_equal(array.values, values * factor)
        expected = {"wav": "1", "mat5_plain": ""}.get(kind, {"um": "m"}.get(samples.UNITS[name], samples.UNITS[name]))
        assert array.attrs["units"] == expected
    np.testing.assert_allclose(record["time"].values, np.arange(2000) / samples.RATE, rtol=0, atol=1e-12)
    if kind not in ("wav", "mat5_plain"):
        assert record.attrs["drop_time"].startswith("2026-03-10")


def _with_texts(kind: str, path: Path, texts: dict[str, str]) -> None:
    """Write ten samples of a channel with texts beside it."""
    values = np.arange(10.0)
    if kind == "netCDF":
        with samples.open_netcdf(path, n=10) as file:
            file.createVariable("A", "f8", ("time",))[:] = values
            file.setncatts(texts)
    elif kind == "HDF5":
        with h5py.File(path, "w") as file:
            file["A"] = values
            file.attrs.update({"dt": 1e-3, **texts})
    elif kind == "MAT":
        savemat(path, {"t": values * 1e-3, "A": values, **texts})
    elif kind == "CSV":
        above = "".join(f"# {key}: {text}\n" for key, text in texts.items())
        path.write_text(above + "time [s],A [um]\n" + "".join(f"{x * 1e-3},{x}\n" for x in values), encoding="utf-8")
    elif kind == "Parquet":
        pa = pytest.importorskip("pyarrow")
        schema = pa.schema([("time", pa.float64()), ("A", pa.float64())], metadata=texts)
        pytest.importorskip("pyarrow.parquet").write_table(pa.table([values * 1e-3, values], schema=schema), path)
    elif kind == "TDMS":
        nptdms = pytest.importorskip("nptdms")
        channels = [nptdms.ChannelObject("drop", "A", values, {"wf_increment": 1e-3})]
        with nptdms.TdmsWriter(path) as file:
            file.write_segment([nptdms.RootObject(texts), *channels])


@pytest.mark.parametrize("kind", ["netCDF", "HDF5", "MAT", "CSV", "Parquet", "TDMS"])
def test_a_record_keeps_its_date_and_title_in_every_format(kind: str, tmp_path: Path) -> None:
    texts = {"date": "last Tuesday", "test_date": "2026-03-10T09:00:00", "description": "third of four"}
    _with_texts(kind, tmp_path / "a", texts)
    attrs = read(tmp_path / "a").attrs
    assert (attrs["reader"], attrs["drop_time"], attrs["title"]) == (kind, texts["test_date"], texts["description"])


@pytest.mark.parametrize("kind", samples.WRITERS)
@pytest.mark.parametrize("suffix", [".csv", ".nc", ".wav", ""])
def test_a_misleading_suffix_does_not_matter(kind: str, suffix: str, tmp_path: Path) -> None:
    reader, writer = samples.WRITERS[kind]
    path = tmp_path / "plain.dat"
    writer(path, samples.signals(200))
    other = shutil.move(path, tmp_path / f"misleading{suffix}")
    assert read(other).attrs["reader"] == reader


@pytest.mark.parametrize(
    ("name", "rate"), [("fs [kS/s]", 5), ("fs [kS/s]", "5"), ("fs (S/s)", 5000.0), ("Sample rate [kHz]", 5)]
)
def test_a_rate_in_numbers_has_the_unit_of_its_name(name: str, rate: float | str, tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["A"] = np.arange(10.0)
        file.attrs[name] = rate
    np.testing.assert_allclose(read(tmp_path / "a.h5")["time"].values, np.arange(10) / 5000)


def test_mat_struct_array_names_its_channels(tmp_path: Path) -> None:
    from scipy.io import savemat

    kinds = [("name", object), ("data", object), ("unit", object), ("fs", object)]
    channels = np.array([("A", np.arange(5.0), "um", 100.0), ("B", np.arange(10.0), "V", 200.0)], dtype=kinds)
    savemat(tmp_path / "a.mat", {"channels": channels}, do_compression=True)
    record = read(tmp_path / "a.mat")
    np.testing.assert_array_equal(record["A"].values, np.arange(5.0) * 1e-6)
    assert record["B"].dims == ("time_2",)
    np.testing.assert_allclose(record["time_2"].values, np.arange(10) / 200)


def test_an_array_of_structs_in_a_mat73_file_is_read_with_the_structs_in_it(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        parts, fields = file.create_group("#refs#"), {"data": [], "beside": []}
        for k in range(2):
            parts[f"data{k}"] = np.arange(5.0 * (k + 1)).reshape(1, -1)
            parts[f"beside{k}/B"] = np.arange(5.0 * (k + 1)).reshape(1, -1)
            for key, references in fields.items():
                references.append(parts[f"{key}{k}"].ref)
        for key, references in fields.items():
            file.create_dataset(f"channels/{key}", data=references, dtype=h5py.ref_dtype)
        file["fs"] = np.array([[50.0]])
    samples.write_mat73_head(path)
    sizes = {name: array.size for name, array in read(path).data_vars.items()}
    assert sizes == {
        "channels_1": 5,
        "channels_2": 10,
        "channels/channels_1/beside/B": 5,
        "channels/channels_2/beside/B": 10,
    }


@pytest.mark.parametrize(
    ("dtype", "scale", "offset"), [(np.uint8, 2.0**-7, -1.0), (np.int16, 2.0**-15, 0.0), (np.int32, 2.0**-31, 0.0)]
)
def test_wav_integers_become_shares_of_full_scale(dtype: type, scale: float, offset: float, tmp_path: Path) -> None:
    from scipy.io import wavfile

    limits = np.iinfo(dtype)
    codes = np.linspace(limits.min, limits.max, 11).astype(dtype)
    wavfile.write(tmp_path / "a.wav", 1000, codes)
    array = read(tmp_path / "a.wav")["ch1"]
    np.testing.assert_array_equal(array.values, codes * scale + offset)
    np.testing.assert_allclose(array.attrs["full_scale"], [-1.0, 1.0 - scale])
    assert array.attrs["units"] == "1"


def test_tdms_keeps_rates_start_times_groups_and_time_channels(tmp_path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    def waveform(group: str, name: str, values: np.ndarray, dt: float, began: str) -> ChannelObject:
        properties = {
            "wf_increment": dt,
            "wf_start_time": np.datetime64(began),
            "wf_start_offset": 0.0,
            "unit_string": "Volts",
        }
        return ChannelObject(group, name, values, properties=properties)

    with TdmsWriter(tmp_path / "a.tdms") as file:
        file.write_segment([
            waveform("fast", "A", np.arange(100.0), 1e-3, "2026-03-10T09:00:00"),
            waveform("slow", "A", np.arange(10.0), 1e-2, "2026-03-10T09:00:00.5"),
            ChannelObject("table", "Time", np.array([0.0, 0.1, 0.3])),
            ChannelObject("table", "T1", np.array([20.0, 21.0, 22.0]), properties={"unit_string": "degC"}),
            ChannelObject("table", "remark", ["a", "b", "c"]),
        ])  # fmt: skip
    record = read(tmp_path / "a.tdms")
    assert set(record.data_vars) == {"fast/A", "slow/A", "T1"}
    assert record["slow/A"].dims == ("time_2",)
    np.testing.assert_allclose(record["time_2"].values[0], 0.5)
    assert record["fast/A"].attrs["units"] == "V"
    assert record["T1"].attrs["units"] == "degC"
    np.testing.assert_allclose(record["time_3"].values, [0.0, 0.1, 0.3])


@pytest.mark.parametrize("name", ["Vib_X", "Ai0/Vib_X"])
def test_a_channel_is_found_with_its_group_and_without(name: str, tmp_path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    machine = load_machine(shipped("short/machine.toml")).model_copy(update={"channels": {"NDE_A": name}})
    drop = read(shipped("short/drop_100.nc"))
    shown = ChannelObject("Ai0", "Vib_X", drop.NDE_A.values * 1e6, {"wf_increment": 5e-5, "unit_string": "um"})
    with TdmsWriter(tmp_path / "a.tdms") as file:
        file.write_segment([shown])
    laid = assign(read(tmp_path / "a.tdms"), machine)
    np.testing.assert_allclose(laid.NDE_A, drop.NDE_A, atol=1e-12)
    assert laid.attrs["unused"] == []
    with pytest.raises(InputError, match="none of the machine's channels"):
        assign(read(tmp_path / "a.tdms"), machine.model_copy(update={"channels": {"NDE_A": "Ai1/Vib_X"}}))


def test_mdf_groups_keep_their_rates(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        file.append([Signal(np.arange(50.0), np.arange(50) / 1000, unit="mm", name="A")])
        file.append([Signal(np.arange(5, dtype=np.int16), 1 + np.arange(5) / 10, unit="", name="A")])
        file.save(tmp_path / "a.mf4")
    record = read(tmp_path / "a.mf4")
    assert set(record.data_vars) == {"group_1/A", "group_2/A"}
    np.testing.assert_allclose(record["group_1/A"].values, np.arange(50) * 1e-3)
    np.testing.assert_allclose(record["time_2"].values, 1 + np.arange(5) / 10)


def test_the_time_in_the_header_of_an_mdf_file_is_said_to_be_that(tmp_path: Path) -> None:
    """A program that converts a record writes the time at which it does."""
    samples.write_mdf(tmp_path / "a.mf4", samples.signals())
    found = inspect(tmp_path / "a.mf4")
    assert found.drop_time.startswith("2026-03-10T09:00:00")
    line = next(line for line in found.lines() if line.startswith("drop: "))
    assert "(start of measurement in the file's header" in line
    assert line.endswith(": check)")
    samples.write_netcdf(tmp_path / "a.nc", samples.signals())
    assert "drop: 2026-03-10T09:00:00Z" in inspect(tmp_path / "a.nc").lines()


# the library's writer opens a binary file twice and closes it once
@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
def test_binary_uff_is_read(tmp_path: Path) -> None:
    import pyuff

    path = tmp_path / "ascii.uff"
    samples.write_uff(path, {"speed": samples.signals(64)["speed"]})
    entry = pyuff.UFF(str(path)).read_sets(0)
    entry["binary"] = 1
    pyuff.UFF(str(tmp_path / "binary.uff")).write_sets(entry, mode="add")
    np.testing.assert_allclose(
        read(tmp_path / "binary.uff").to_array().values[0], samples.signals(64)["speed"], rtol=1e-11
    )


@pytest.mark.parametrize(
    ("kind", "module", "extra"),
    [("tdms", "nptdms", "tdms"), ("uff", "pyuff", "uff"), ("mdf", "asammdf", "mdf"), ("parquet", "pyarrow", "parquet")],
)
def test_a_missing_library_is_named(
    kind: str, module: str, extra: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.dat"
    samples.WRITERS[kind][1](path, samples.signals(20))
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(InputError, match=rf"a\.dat: .*pip install 'tdbmon\[{extra}\]'"):
        read(path)


def test_sensor_clocks_that_jitter_are_kept_and_told(tmp_path: Path) -> None:
    random = np.random.default_rng(2)
    time = np.arange(1000) / 1000 + random.normal(0, 2e-5, 1000)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["time"], file["A"] = time, np.arange(1000.0)
    record = read(tmp_path / "a.h5")
    np.testing.assert_allclose(record["time"].values, time - time[0], atol=1e-15)
    assert record["time"].attrs["jitter"] == pytest.approx(2e-5 * np.sqrt(2), rel=0.1)


def test_inspection_tells_what_is_in_a_file(tmp_path: Path) -> None:
    data = samples.signals(500)
    data["NDE_B"][5:8] = np.nan
    samples.write_netcdf(tmp_path / "a.nc", data)
    found = inspect(tmp_path / "a.nc")
    rows = {row.name: row for row in found.channels}
    assert {name: row.kind for name, row in rows.items()} == {
        "NDE_A": "displacement", "NDE_B": "displacement", "DE_A": "displacement", "DE_B": "displacement",
        "speed": "speed", "keyphasor": "keyphasor",
    }  # fmt: skip
    row = rows["NDE_B"]
    assert (row.samples, row.nan, row.gaps, row.unit, row.source_unit) == (500, 3, 0, "m", "um")
    assert row.rate_hz == pytest.approx(samples.RATE)
    assert row.duration_s == pytest.approx(0.0499)
    assert row.mean == pytest.approx(np.nanmean(data["NDE_B"]) * 1e-6)
    assert found.to_json()["channels"][0]["name"] == "NDE_A"
    assert found.size == (tmp_path / "a.nc").stat().st_size
    text = "\n".join(found.lines())
    assert "2026-03-10T09:00:00Z" in text
    assert "10000 Hz" in text


def _shipped(package: str, pattern: str) -> list[Path]:
    spec = find_spec(package)
    if spec is None or spec.origin is None:
        return []
    return sorted(Path(spec.origin).parent.glob(pattern))


@pytest.mark.parametrize(
    ("package", "pattern"),
    [
        ("scipy", "io/tests/data/*.wav"),
        ("scipy", "io/tests/data/*.nc"),
        ("scipy", "io/matlab/tests/data/*.mat"),
        ("nptdms", "test/data/*.tdms"),
        ("pyarrow", "tests/data/parquet/*.parquet"),
        ("xarray", "tests/data/*.nc"),
        ("h5py", "tests/data_files/*.h5"),
    ],
)
def test_files_of_other_projects_are_read_or_refused_in_one_line(package: str, pattern: str) -> None:
    files = _shipped(package, pattern)
    if not files:
        pytest.skip(f"{package} ships no {pattern} here")
    for path in files:
        try:
            record = read(path)
        except InputError as error:
            assert "\n" not in str(error)
            assert path.name in str(error)
        else:
            assert all(np.all(np.diff(record[dimension].values) > 0) for dimension in record.sizes)


def test_a_wav_file_of_another_project_has_its_channels() -> None:
    files = _shipped("scipy", "io/tests/data/test-44100Hz-2ch-32bit-float-le.wav")
    if not files:
        pytest.skip("scipy ships no sample here")
    record = read(files[0])
    assert list(record.data_vars) == ["ch1", "ch2"]
    np.testing.assert_allclose(np.diff(record["time"].values), 1 / 44100)


@pytest.mark.parametrize("unstated", ["1904-01-01", "1904-01-01T00:00:00.000001"])
def test_a_tdms_start_of_1904_is_none(unstated: str, tmp_path: Path) -> None:
    """The channel was 122 years before the others, or the drop was dated 1904."""
    from nptdms import ChannelObject, TdmsWriter

    def waveform(name: str, began: str) -> ChannelObject:
        return ChannelObject("g", name, np.arange(9.0), {"wf_increment": 1e-3, "wf_start_time": np.datetime64(began)})

    with TdmsWriter(tmp_path / "a.tdms") as file:
        file.write_segment([waveform("A", unstated), waveform("B", "2026-03-10T09:00:00")])
    record = read(tmp_path / "a.tdms")
    assert record["A"].dims == record["B"].dims
    assert record.attrs["drop_time"] == "2026-03-10T09:00:00.000Z"
    with TdmsWriter(tmp_path / "a.tdms") as file:
        file.write_segment([waveform("A", unstated), waveform("B", unstated)])
    assert read(tmp_path / "a.tdms").attrs["drop_time"] == ""


@pytest.mark.parametrize("kind", ["waveform", "moments"])
def test_moments_of_a_tdms_group_count_from_the_first_start_of_the_file(kind: str, tmp_path: Path) -> None:
    """A slow group that began 0.2 s after the fast one was put at the time of that."""
    from nptdms import ChannelObject, TdmsWriter

    began = np.datetime64("2026-03-10T09:00:00.000000")
    fast = began + np.arange(100) * np.timedelta64(1, "ms")
    slow = began + (200 + 10 * np.arange(5)) * np.timedelta64(1, "ms")
    waveform = {"wf_increment": 1e-3, "wf_start_time": began}
    with TdmsWriter(tmp_path / "a.tdms") as file:
        file.write_segment([
            *([ChannelObject("fast", "Time", fast)] if kind == "moments" else []),
            ChannelObject("fast", "A", np.arange(100.0), waveform if kind == "waveform" else {}),
            ChannelObject("slow", "Time", slow),
            ChannelObject("slow", "B", np.arange(5.0)),
        ])  # fmt: skip
    record = read(tmp_path / "a.tdms")
    np.testing.assert_allclose(record[record["A"].dims[0]].values, 1e-3 * np.arange(100))
    np.testing.assert_allclose(record[record["B"].dims[0]].values, 0.2 + 0.01 * np.arange(5))


@pytest.mark.parametrize("beside", [{}, {"A": np.arange(9.0)}])
def test_a_timetable_of_matlab_is_named_with_the_cure(beside: dict[str, np.ndarray], tmp_path: Path) -> None:
    from scipy.io import savemat

    def element(kind: int, raw: bytes) -> bytes:
        return struct.pack("<II", kind, len(raw)) + raw + b"\0" * (-len(raw) % 8)

    reference = np.array([0xDD000000, 2, 1, 1, 1, 1], dtype="<u4").tobytes()
    parts = [(6, struct.pack("<II", 13, 0)), (5, struct.pack("<ii", 6, 1)), (1, b""), (6, reference)]
    held = element(14, b"".join(element(*part) for part in parts))
    names = b"".join(element(1, text) for text in (b"T", b"MCOS", b"timetable"))
    savemat(tmp_path / "a.mat", beside)
    with (tmp_path / "a.mat").open("ab") as file:
        file.write(element(14, element(6, struct.pack("<II", 17, 0)) + names + held))
    with pytest.raises(InputError, match=r"'T'.* is a MATLAB timetable.*seconds\(T\.Time\)"):
        read(tmp_path / "a.mat")
    savemat(tmp_path / "b.mat", beside)
    with h5py.File(tmp_path / "b.mat", "w", userblock_size=512) as file:
        file["T"] = np.array([[0xDD000000, 2, 1, 1, 1, 1]], dtype="u4")
        file["T"].attrs["MATLAB_class"] = np.bytes_(b"timetable")
        file["T"].attrs["MATLAB_object_decode"] = np.int32(3)
        for name, values in beside.items():
            file[name] = values
    raw, head = (tmp_path / "b.mat").read_bytes(), b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM"
    (tmp_path / "b.mat").write_bytes(head + raw[len(head) :])
    with pytest.raises(InputError, match=r"'T'.* is a MATLAB timetable"):
        read(tmp_path / "b.mat")


@pytest.mark.parametrize(
    ("stated", "read_as"),
    [("11-MAR-26 09:00:00", "2026-03-11T09:00:00"), ("11-Mar-2026", "2026-03-11"), ("31-Dec-99", "1999-12-31")],
)
def test_the_date_of_a_uff_data_set_begins_with_the_day(stated: str, read_as: str, tmp_path: Path) -> None:
    samples.write_uff(tmp_path / "a.uff", samples.signals(20))
    text = (tmp_path / "a.uff").read_text()
    assert "2026-03-10T09:00:00Z" in text
    (tmp_path / "a.uff").write_text(text.replace("2026-03-10T09:00:00Z", stated.ljust(20)))
    assert read(tmp_path / "a.uff").attrs["drop_time"] == read_as


def test_times_of_a_parquet_table_are_durations_or_count_from_the_first_moment(tmp_path: Path) -> None:
    import pyarrow
    import pyarrow.parquet

    ms = np.timedelta64(1, "ms")
    began = np.datetime64("2026-03-10T09:00:00", "ns")
    table = {"zeit": np.arange(5) * ms, "A": np.arange(5.0)}
    pyarrow.parquet.write_table(pyarrow.table(table), tmp_path / "a.parquet")
    np.testing.assert_allclose(read(tmp_path / "a.parquet")["time"].values, np.arange(5) / 1000)
    table = {"Time_1": began + np.arange(5) * ms, "A": np.arange(5.0), "Time_2": began + (np.arange(5) + 200) * ms}
    pyarrow.parquet.write_table(pyarrow.table({**table, "B": np.arange(5.0)}), tmp_path / "a.parquet")
    record = read(tmp_path / "a.parquet")
    np.testing.assert_allclose(record[record["B"].dims[0]].values, 0.2 + np.arange(5) / 1000)


def test_the_axis_of_a_waveform_has_its_unit(tmp_path: Path) -> None:
    """Times in ms were read as s, and a spectrum as a record."""
    from nptdms import ChannelObject, TdmsWriter

    def waveform(name: str, step: float, unit: str) -> ChannelObject:
        axis = {"wf_increment": step, "wf_start_offset": 0.0, "wf_xunit_string": unit}
        return ChannelObject("g", name, np.arange(9.0), axis)

    with TdmsWriter(tmp_path / "a.tdms") as file:
        file.write_segment([waveform("A", 0.5, "ms"), waveform("B", 5e-4, "s"), waveform("C", 2.0, "Hz")])
    record = read(tmp_path / "a.tdms")
    assert set(record.data_vars) == {"A", "B"}
    assert record["A"].dims == record["B"].dims
    assert record.attrs["left_out"] == {"C": "its axis is in Hz, not time"}
    samples.write_uff(tmp_path / "a.uff", samples.signals(20))
    text = (tmp_path / "a.uff").read_text()
    (tmp_path / "a.uff").write_text(text.replace("NONE                 s  ", "NONE                 ms "))
    np.testing.assert_allclose(read(tmp_path / "a.uff")["time"].values, 1e-3 * np.arange(20) / samples.RATE, atol=1e-12)
