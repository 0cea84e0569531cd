"""The file formats that can be read, in the order in which they are tried; adding one adds a file and a line here."""

from __future__ import annotations

from tdbmon.record.format import Format
from tdbmon.record.formats.netcdf import NetCDF

FORMATS: tuple[Format, ...] = (NetCDF(),)
