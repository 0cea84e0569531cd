"""A sound record for the tests of its checks."""

from __future__ import annotations

import pytest
import xarray as xr
from record_machine import machine

from tdbmon.record.assign import assign
from tdbmon.record.read import read
from tdbmon.shipped import shipped


@pytest.fixture(scope="module")
def sound() -> xr.Dataset:
    """Return the drop from 100 Hz laid over the machine of the tests."""
    return assign(read(shipped("short/drop_100.nc")), machine())
