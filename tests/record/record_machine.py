"""A machine for the tests, variations of its file and of a record, and the checks that fail."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from tdbsim.machine import Machine, parse_machine

from tdbmon.record.quality import check

FILE = Path(__file__).with_name("machine.toml")


def machine(**changes: Any) -> Machine:
    """Return the machine of the file beside this one, top-level tables replaced."""
    data = tomllib.loads(FILE.read_text(encoding="utf-8"))
    return parse_machine({**data, **changes})


def with_probe(name: str, **changes: Any) -> Machine:
    """Return the machine with one probe changed."""
    data = tomllib.loads(FILE.read_text(encoding="utf-8"))
    data["probe"] = [{**probe, **changes} if probe["name"] == name else probe for probe in data["probe"]]
    return parse_machine(data)


def changed(ds: xr.Dataset, name: str, values: np.ndarray, **attrs: object) -> xr.Dataset:
    """Return a record with other values of a channel."""
    out = ds.copy()
    out[name] = (ds[name].dims, values, {**ds[name].attrs, **attrs})
    return out


def failures(ds: xr.Dataset, where: Machine | None = None) -> dict[tuple[str, str], str]:
    """Return the details of failed checks, by check and channel."""
    return {(found.check, found.channel): found.detail for found in check(ds, where or machine()) if not found.passed}
