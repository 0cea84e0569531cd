"""Small synthetic records, written in every format by the format's own library."""

from __future__ import annotations

import datetime
from collections.abc import Callable
from pathlib import Path

import netCDF4
import numpy as np
import xarray as xr

from tdbmon.record.read import read

RATE = 10_000.0
NAMES = ("NDE_A", "NDE_B", "DE_A", "DE_B")


def read_table(tmp_path: Path, text: str | bytes) -> xr.Dataset:
    path = tmp_path / "table.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8"))
    return read(path)


def signals(n: int = 2000, seed: int = 1) -> dict[str, np.ndarray]:
    """Return displacements in um (exact in float32), a speed in Hz and keyphasor pulses at 100 Hz."""
    random = np.random.default_rng(seed)
    time = np.arange(n) / RATE
    out = {}
    for k, name in enumerate(NAMES):
        wave = 50 * np.sin(2 * np.pi * 100 * time + k) + 10 * k + random.normal(0, 1, n)
        out[name] = wave.astype(np.float32).astype(np.float64)
    out["speed"] = (100 * np.exp(-time / 14)).astype(np.float32).astype(np.float64)
    out["keyphasor"] = ((100 * time + 0.3) % 1.0 < 0.05).astype(np.float64)
    return out


UNITS = {name: "um" for name in NAMES} | {"speed": "Hz", "keyphasor": "1"}


def open_netcdf(path: Path, rate: float = 1000.0, n: int = 50) -> netCDF4.Dataset:
    file = netCDF4.Dataset(path, "w")
    file.createDimension("time", n)
    file.createVariable("time", "f8", ("time",))[:] = np.arange(n) / rate
    return file


def write_netcdf(path: Path, data: dict[str, np.ndarray]) -> None:
    with netCDF4.Dataset(path, "w") as file:
        n = len(next(iter(data.values())))
        file.createDimension("time", n)
        file.createVariable("time", "f8", ("time",))[:] = np.arange(n) / RATE
        file["time"].units = "s"
        for name, values in data.items():
            file.createVariable(name, "f8", ("time",))[:] = values
            file[name].units = UNITS[name]
        file.date = "2026-03-10T09:00:00Z"
        file.title = "synthetic"


def write_netcdf_classic(path: Path, data: dict[str, np.ndarray]) -> None:
    from scipy.io import netcdf_file

    with netcdf_file(path, "w") as file:
        n = len(next(iter(data.values())))
        file.createDimension("time", n)
        file.createVariable("time", "d", ("time",))[:] = np.arange(n) / RATE
        for name, values in data.items():
            variable = file.createVariable(name, "d", ("time",))
            variable[:] = values
            variable.units = UNITS[name]
        file.date = "2026-03-10T09:00:00Z"


def write_hdf5_flat(path: Path, data: dict[str, np.ndarray]) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        file.attrs["date"] = "2026-03-10T09:00:00Z"
        file["operator"] = "nobody"
        file["drop_number"] = 3
        for name, values in data.items():
            file[name] = values
            file[name].attrs["units"] = UNITS[name]
            file[name].attrs["dt"] = 1 / RATE


def write_hdf5_time(path: Path, data: dict[str, np.ndarray]) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        file.attrs["start_time"] = "2026-03-10T09:00:00Z"
        group = file.create_group("measurement")
        group["Time"] = np.arange(len(data["speed"])) / RATE * 1e3
        group["Time"].attrs["unit"] = "ms"
        for name, values in data.items():
            group[name] = values
            group[name].attrs["unit"] = UNITS[name]


def write_hdf5_nested(path: Path, data: dict[str, np.ndarray]) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        file.attrs["date"] = "2026-03-10T09:00:00Z"
        for name, values in data.items():
            group = file.create_group(f"run/{name}")
            group["values"] = values
            group["values"].attrs["units"] = UNITS[name]
            group.attrs["sampling_rate"] = RATE


def write_csv(path: Path, data: dict[str, np.ndarray]) -> None:
    rows = ["# date: 2026-03-10T09:00:00Z", ",".join(["time [s]", *(f"{name} [{UNITS[name]}]" for name in data)])]
    columns = [np.arange(len(data["speed"])) / RATE, *data.values()]
    rows += [",".join(repr(float(x)) for x in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")


def write_csv_german(path: Path, data: dict[str, np.ndarray]) -> None:
    rows = [
        "Datum;10.03.2026",
        "Zeit;" + ";".join(data),
        "s;" + ";".join(UNITS[name].replace("u", "µ") for name in data),
    ]
    columns = [np.arange(len(data["speed"])) / RATE, *data.values()]
    rows += [";".join(repr(float(x)).replace(".", ",") for x in row) for row in zip(*columns, strict=True)]
    path.write_bytes(("\r\n".join(rows) + "\r\n").encode("cp1252"))


def write_mat5(path: Path, data: dict[str, np.ndarray]) -> None:
    from scipy.io import savemat

    channels = {name: {"data": values, "unit": UNITS[name], "fs": RATE} for name, values in data.items()}
    savemat(path, {"record": channels, "date": "2026-03-10T09:00:00Z"})


def write_mat5_plain(path: Path, data: dict[str, np.ndarray]) -> None:
    from scipy.io import savemat

    savemat(path, {"t": np.arange(len(data["speed"])) / RATE, **data, "note": "no units"}, oned_as="column")


def write_mat73(path: Path, data: dict[str, np.ndarray]) -> None:
    """Write what MATLAB's ``save -v7.3`` writes of a struct of channels: HDF5 behind a text of 512 bytes."""
    import h5py

    def text(group: h5py.Group, key: str, value: str) -> None:
        group[key] = np.array([[ord(letter)] for letter in value], dtype=np.uint16)
        group[key].attrs["MATLAB_class"] = np.bytes_("char")

    with h5py.File(path, "w", userblock_size=512) as file:
        record = file.create_group("record")
        text(file, "date", "2026-03-10T09:00:00Z")
        for name, values in data.items():
            channel = record.create_group(name)
            channel.attrs["MATLAB_class"] = np.bytes_("struct")
            channel["data"] = values.reshape(1, -1)
            channel["fs"] = np.array([[RATE]])
            text(channel, "unit", UNITS[name])
    write_mat73_head(path)


def write_mat73_head(path: Path) -> None:
    """Write the text before the HDF5 of a file with room for it."""
    with path.open("r+b") as raw:
        raw.write(
            b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Tue Mar 10 09:00:00 2026 HDF5 schema 1.00 .".ljust(
                124
            )
        )
        raw.write(b"\x00\x02IM")


def write_wav(path: Path, data: dict[str, np.ndarray]) -> None:
    from scipy.io import wavfile

    wavfile.write(path, int(RATE), np.column_stack(list(data.values())).astype(np.float32))


def write_tdms(path: Path, data: dict[str, np.ndarray]) -> None:
    from nptdms import ChannelObject, TdmsWriter

    began = np.datetime64("2026-03-10T09:00:00")
    with TdmsWriter(path) as file:
        file.write_segment([
            ChannelObject("drop", name, values, properties={
                "unit_string": UNITS[name], "wf_increment": 1 / RATE, "wf_start_time": began, "wf_start_offset": 0.0,
            })
            for name, values in data.items()
        ])  # fmt: skip


def write_uff(path: Path, data: dict[str, np.ndarray]) -> None:
    import pyuff

    file = pyuff.UFF(str(path))
    for number, (name, values) in enumerate(data.items()):
        entry = pyuff.prepare_58(
            binary=0, id1=name, id2="synthetic", id3="2026-03-10T09:00:00Z", id4="NONE", id5="NONE", func_type=1, ver_num=0,
            load_case_id=0, rsp_ent_name="NONE", rsp_node=number, rsp_dir=1, ref_ent_name="NONE", ref_node=0, ref_dir=0,
            ord_data_type=4, num_pts=len(values), abscissa_spacing=1, abscissa_min=0.0, abscissa_inc=1 / RATE,
            z_axis_value=0.0, abscissa_spec_data_type=17, abscissa_axis_units_lab="s", ordinate_spec_data_type=8,
            ordinate_axis_units_lab=UNITS[name], orddenom_spec_data_type=0, z_axis_spec_data_type=0,
            data=values, x=np.arange(len(values)) / RATE,
        )  # fmt: skip
        file.write_sets(entry, mode="add")


def write_mdf(path: Path, data: dict[str, np.ndarray]) -> None:
    from asammdf import MDF, Signal

    time = np.arange(len(data["speed"])) / RATE
    with MDF(version="4.10") as file:
        file.header.start_time = datetime.datetime(2026, 3, 10, 9, tzinfo=datetime.UTC)
        file.append([Signal(values, time, unit=UNITS[name], name=name) for name, values in data.items()])
        saved = file.save(path.with_suffix(".mf4"), overwrite=True)
    Path(saved).replace(path)


def write_parquet(path: Path, data: dict[str, np.ndarray]) -> None:
    import pyarrow as pa
    import pyarrow.parquet

    time = np.arange(len(data["speed"])) / RATE
    fields = [pa.field("time", pa.float64(), metadata={"unit": "s"})]
    fields += [pa.field(name, pa.float64(), metadata={"unit": UNITS[name]}) for name in data]
    schema = pa.schema(fields, metadata={"date": "2026-03-10T09:00:00Z"})
    pyarrow.parquet.write_table(pa.table([time, *data.values()], schema=schema), path)


WRITERS: dict[str, tuple[str, Callable[[Path, dict[str, np.ndarray]], None]]] = {
    "netcdf": ("netCDF", write_netcdf),
    "netcdf_classic": ("netCDF", write_netcdf_classic),
    "hdf5_flat": ("HDF5", write_hdf5_flat),
    "hdf5_time": ("HDF5", write_hdf5_time),
    "hdf5_nested": ("HDF5", write_hdf5_nested),
    "csv": ("CSV", write_csv),
    "csv_german": ("CSV", write_csv_german),
    "mat5": ("MAT", write_mat5),
    "mat5_plain": ("MAT", write_mat5_plain),
    "mat73": ("MAT", write_mat73),
    "wav": ("WAV", write_wav),
    "tdms": ("TDMS", write_tdms),
    "uff": ("UFF58", write_uff),
    "mdf": ("MDF4", write_mdf),
    "parquet": ("Parquet", write_parquet),
}
