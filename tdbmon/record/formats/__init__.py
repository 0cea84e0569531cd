"""The supported file formats, in the order in which they are tried; a new one needs a module and a line here."""

from __future__ import annotations

from tdbmon.record.format import Format
from tdbmon.record.formats.csv import CSV
from tdbmon.record.formats.hdf5 import HDF5
from tdbmon.record.formats.mat import MAT
from tdbmon.record.formats.mdf import MDF
from tdbmon.record.formats.netcdf import NetCDF
from tdbmon.record.formats.parquet import Parquet
from tdbmon.record.formats.tdms import TDMS
from tdbmon.record.formats.uff import UFF58
from tdbmon.record.formats.wav import WAV

# MAT 7.3 and netCDF 4 are based on HDF5 and must precede it; any text may be CSV, which therefore comes last
FORMATS: tuple[Format, ...] = (
    MAT(), NetCDF(), HDF5(), WAV(), TDMS(), MDF(), Parquet(), UFF58(), CSV(),
)  # fmt: skip
