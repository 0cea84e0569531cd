"""Shipped records, read once, and what an analysis finds in them as they are, made once for all tests that compare with it."""

from __future__ import annotations

from functools import cache

import xarray as xr
from tdbsim.machine import load_machine

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.result import Analysis
from tdbmon.record.read import read
from tdbmon.shipped import shipped


def recorded(name: str) -> xr.Dataset:
    """Return the raw record of a shipped drop, as "short/drop_100", which may be changed."""
    return _read(name).copy(deep=True)


@cache
def _read(name: str) -> xr.Dataset:
    return read(shipped(f"{name}.nc"))


@cache
def analysed(name: str) -> Analysis:
    """Return the analysis of a shipped drop with the machine file beside it; look at it only."""
    return analyse(recorded(name), load_machine(shipped(f"{name.partition('/')[0]}/machine.toml")))
