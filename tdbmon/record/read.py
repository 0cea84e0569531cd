"""Reading of records from files of any supported format, and writing as netCDF."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import xarray as xr
from tdbsim.errors import InputError

from tdbmon.record.channel import to_dataset
from tdbmon.record.format import Format
from tdbmon.record.formats import FORMATS
from tdbmon.record.formats.netcdf import write_netcdf

_HEAD = 4096
_MACHINE_FILE = re.compile(
    rb"^\s*(\[rotor\]|\[\[(rotor\.sections|magnetic_bearing|touchdown_bearing)\]\])", re.MULTILINE
)
# containers in which records are often sent, by their first bytes
_PACKED = {
    b"PK\x03\x04": "a zip archive or an Excel workbook; unpack it, or save the sheet as CSV, and give that file",
    b"\xd0\xcf\x11\xe0": "an Excel workbook; save its sheet as CSV and give that file",
    b"\x1f\x8b": "a compressed file (gzip); unpack it and give the file in it",
    b"7z\xbc\xaf": "a compressed file (7-Zip); unpack it and give the file in it",
}


def read(path: str | Path) -> xr.Dataset:
    """Read a record from a file, whose format is recognised from its content, not its suffix.

    Parameters
    ----------
    path : str or pathlib.Path
        A netCDF, HDF5, MAT, CSV or WAV file; TDMS, UFF58, MDF4 and Parquet with the optional dependencies installed.

    Returns
    -------
    xarray.Dataset
        Every channel at its own sampling, float64 and in SI where its unit is known; the form is described in
        `tdbmon.record`.  A record from a truncated but otherwise intact file has the attribute ``incomplete``.

    Raises
    ------
    InputError
        If the file is missing, empty, damaged, of an unknown format, or contains no channel with a usable time.
    """
    path = Path(path)
    found = recognise(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # from third-party libraries; the formats raise errors for relevant ones
            content = found.read(path)
    except InputError:
        raise
    except MemoryError:
        raise InputError(
            f"{path}: does not fit into memory, or its header is damaged; export a shorter record"
        ) from None
    except Exception as error:  # third-party readers raise anything on damaged files
        raise InputError(
            f"{path}: is in {found.name} format but cannot be read ({_first_line(error)});"
            " it is damaged or cut off: export it again"
        ) from error
    return to_dataset(content, path, found.name)


def recognise(path: Path) -> Format:
    """Return the format of a file, recognised from its content.

    Raises
    ------
    InputError
        If the file cannot be opened, is empty, is a machine file, or is of no known format.
    """
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; give the file of a record") from None
    except IsADirectoryError:
        raise InputError(f"{path}: is a folder; give the file of a record in it") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if not head:
        raise InputError(f"{path}: is empty (0 bytes); export it again")
    if _MACHINE_FILE.search(head):
        raise InputError(
            f"{path}: is a machine file, not a record; give a record here, and the machine file as MACHINE to analyse,"
            " simulate, diagnose or identifiability, which report errors in it"
        )
    for candidate in FORMATS:
        if candidate.recognises(head, path):
            return candidate
    for start, what in _PACKED.items():
        if head.startswith(start):
            raise InputError(f"{path}: is {what}")
    known = ", ".join(candidate.name for candidate in FORMATS)
    raise InputError(f"{path}: is in no format that can be read; known: {known}")


def write(record: xr.Dataset, path: str | Path) -> None:
    """Write a record as netCDF so that `read` returns identical values.

    Channels whose ``encoding`` has a ``scale_factor`` that reproduces their values exactly are packed (16-bit
    records stay 16 bit), the others are float32 if that is exact and float64 if not; all are compressed.
    Writing is atomic: the file appears complete or not at all.

    Raises
    ------
    InputError
        If the path cannot be written.
    """
    write_netcdf(record, Path(path))


def _first_line(error: Exception) -> str:
    lines = str(error).strip().splitlines()
    return (lines[0][:200] if lines else "") or type(error).__name__
