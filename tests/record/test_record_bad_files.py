"""Files that are none, or were damaged: one line that names the file, never anything else."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import h5py
import numpy as np
import pytest
import record_samples as samples
import xarray as xr
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tdbsim.errors import InputError

from tdbmon.record.formats import FORMATS
from tdbmon.record.formats.mat5_structure import check_structure
from tdbmon.record.read import read
from tdbmon.shipped import shipped

FUZZ = settings(
    max_examples=40, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def _refused(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read(path)
    message = str(caught.value)
    assert "\n" not in message
    assert path.name in message
    return message


def test_no_file_a_folder_and_an_empty_file(tmp_path: Path) -> None:
    assert "no such file" in _refused(tmp_path / "absent.nc")
    assert "is a folder" in _refused(tmp_path)
    (tmp_path / "empty.nc").write_bytes(b"")
    assert "0 bytes" in _refused(tmp_path / "empty.nc")


@pytest.mark.parametrize("name", ["short/machine.toml", "coastdown/machine.toml", "machines/template.toml"])
def test_a_machine_file_is_told_as_one(name: str) -> None:
    """It was told as text without a table, by the line that comes nearest to one."""
    assert "is a machine file, not a record; give a record here" in _refused(shipped(name))


def test_unknown_content_names_the_formats(tmp_path: Path) -> None:
    (tmp_path / "a.nc").write_bytes(bytes(range(256)) * 8)
    message = _refused(tmp_path / "a.nc")
    assert all(known.name in message for known in FORMATS)


MAT5_HEAD = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
MAGIC = [b"", b"CDF\x01", b"CDF\x05", b"\x89HDF\r\n\x1a\n", MAT5_HEAD, b"TDSm\x0e\x00\x00\x00",
         b"RIFF\x24\x00\x00\x00WAVE", b"MDF     4.10    ", b"PAR1", b"    -1\n    58\n",
         b"time,A\n", b"\xff\xfe", b"\xef\xbb\xbf"]  # fmt: skip


@FUZZ
@given(st.sampled_from(MAGIC), st.binary(max_size=600))
def test_random_bytes_are_refused(tmp_path: Path, magic: bytes, rest: bytes) -> None:
    path = tmp_path / "random.dat"
    path.write_bytes(magic + rest)
    try:
        record = read(path)
    except InputError as error:
        assert "random.dat" in str(error)
        assert "\n" not in str(error)
    else:  # a few digits may make a table
        assert len(record.data_vars) > 0


@cache
def _whole(kind: str) -> tuple[bytes, xr.Dataset]:
    """Return a sound file's bytes and the record in it."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / kind
        samples.WRITERS[kind][1](path, samples.signals(300))
        return path.read_bytes(), read(path)


@pytest.mark.parametrize("kind", samples.WRITERS)
@settings(FUZZ, max_examples=25)
@given(share=st.floats(0, 1, exclude_max=True))
def test_truncated_files_are_refused_or_told(kind: str, tmp_path: Path, share: float) -> None:
    raw, complete = _whole(kind)
    path = tmp_path / "cut.dat"
    path.write_bytes(raw[: int(share * len(raw))])
    try:
        record = read(path)
    except InputError as error:
        assert "cut.dat" in str(error)
        assert "\n" not in str(error)
        return
    if "incomplete" in record.attrs:
        return
    # what is read without a remark is right: a table that ends after a whole row, a file without its padding
    for name in record.data_vars:
        n = record[name].size
        end = n - 1 if kind.startswith("csv") else n  # whether the last number of a table is whole, nothing tells
        np.testing.assert_array_equal(record[name].values[:end], complete[name].values[:end])
    if not kind.startswith("csv"):
        assert record.sizes == complete.sizes


@pytest.mark.parametrize("kind", samples.WRITERS)
@settings(FUZZ, max_examples=25)
@given(damage=st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.integers(0, 255)), min_size=1, max_size=6))
def test_damaged_bytes_end_in_a_record_or_in_one_line(
    kind: str, tmp_path: Path, damage: list[tuple[float, int]]
) -> None:
    raw = bytearray(_whole(kind)[0])
    for share, byte in damage:
        raw[int(share * len(raw))] = byte
    path = tmp_path / "damaged.dat"
    path.write_bytes(raw)
    try:
        record = read(path)
    except InputError as error:
        assert "damaged.dat" in str(error)
        assert "\n" not in str(error)
    else:  # values without a checksum cannot tell
        assert all(np.all(np.diff(record[dimension].values) > 0) for dimension in record.sizes)


def test_a_mat_file_that_would_end_the_interpreter_is_refused(tmp_path: Path) -> None:
    """The complex flag of a real array makes scipy look a type up outside its table."""
    path = tmp_path / "a.mat"
    samples.write_mat5_plain(path, samples.signals(300))
    check_structure(path)
    raw = bytearray(path.read_bytes())
    flags = raw.index(b"\x06\x00\x00\x00\x08\x00\x00\x00", 200) + 8
    raw[flags + 1] |= 0x08
    path.write_bytes(raw)
    assert "with parts" in _refused(path)


def test_a_header_that_promises_too_much_is_refused(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("A", (10**11,), "f8", chunks=(10**6,))
        file["A"].attrs["fs"] = 1000.0
    assert "its header states" in _refused(tmp_path / "a.h5")


def test_a_file_with_no_series_is_refused(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["note"] = "nothing was measured"
        file["number"] = 3.0
    assert "no channel over time" in _refused(tmp_path / "a.h5")


@pytest.mark.parametrize(
    ("time", "message"),
    [([0.0, 0.1, 0.1, 0.2], "repeats"), ([0.0, 0.2, 0.1, 0.3], "goes back"), ([0.0, np.nan, 0.2, 0.3], "not a number")],
)
def test_time_that_does_not_increase_is_refused(time: list[float], message: str, tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["time"], file["A"] = time, np.arange(4.0)
    assert message in _refused(tmp_path / "a.h5")


@pytest.mark.parametrize("rate", [0.0, -5.0, np.nan, np.inf])
def test_an_impossible_rate_is_no_rate(rate: float, tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["A"] = np.arange(4.0)
        file["A"].attrs["fs"] = rate
    assert "the sampling times of" in _refused(tmp_path / "a.h5")


@pytest.mark.parametrize(
    ("start", "says"),
    [(b"PK\x03\x04", "save the sheet as CSV"), (b"\x1f\x8b\x08\x00", "unpack it"), (b"\xd0\xcf\x11\xe0", "as CSV")],
)
def test_a_packed_record_is_to_be_unpacked(start, says, tmp_path):
    path = tmp_path / "record.bin"
    path.write_bytes(start + bytes(range(256)))
    with pytest.raises(InputError, match=says):
        read(path)
