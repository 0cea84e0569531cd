"""Whether a probe misreads does not depend on how long the record goes on."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from record_machine import machine

from tdbmon.record.finding import Check
from tdbmon.record.misread import misread

RELEASE_S = 0.1


def _record(seconds: float, blank_s: float) -> xr.Dataset:
    """Return a probe at 10 kHz that has no value from the release on, for as long as is given."""
    time = np.arange(0.0, seconds, 1e-4)
    values = 100e-6 * np.sin(2 * np.pi * 40.0 * time)
    values[(time >= RELEASE_S) & (time < RELEASE_S + blank_s)] = np.nan
    return xr.Dataset({"NDE_A": ("time", values, {"units": "m"})}, {"time": time})


@pytest.mark.parametrize("failed", ["nan", "dropout"])
@pytest.mark.parametrize("seconds", [0.3, 1.1, 12.0])
@pytest.mark.parametrize(("blank_s", "hides"), [(0.05, True), (0.01, True), (0.003, False)])
def test_a_probe_blank_at_the_first_contacts(seconds: float, failed: str, blank_s: float, hides: bool) -> None:
    checks = [Check(failed, "NDE_A", False, "")]
    found = misread(_record(seconds, blank_s), machine(), RELEASE_S, checks)
    assert found == ({"NDE_A": failed} if hides else {})


def test_what_is_blank_after_the_first_contacts_does_not_count() -> None:
    ds = _record(1.0, 0.0)
    ds["NDE_A"].values[ds.time.values > RELEASE_S + 0.06] = np.nan
    assert misread(ds, machine(), RELEASE_S, [Check("nan", "NDE_A", False, "")]) == {}
