"""Probes that misread for much of a drop: their peaks are cut off, or they read where no rotor gets to."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import xarray as xr
from tdbsim.machine import Machine, Probe

from tdbmon.record.finding import Check
from tdbmon.record.lost_samples import without_flat_tops

FEW = 0.005  # of the samples: more move the circle that is fitted to the rest
_FAR = 3.0  # radial gaps from the centre: no rotor gets there


def limits(probe: Probe, gap: float) -> tuple[float, float]:
    """Return what a probe can read at a radial gap, m: its range by the machine file, or a few gaps."""
    return probe.range if probe.range is not None else (-_FAR * gap, _FAR * gap)


def misread(ds: xr.Dataset, machine: Machine, start: float, checks: Iterable[Check]) -> dict[str, str]:
    """Return the probes that misread in more than a few samples from an instant on (s), and the failed check that says how."""
    found: dict[str, str] = {}
    suspected = {entry.channel for entry in checks if not entry.passed and entry.check in ("clipping", "range")}
    probes = [probe for probe in machine.probes if probe.name in ds and probe.name in suspected]
    uncut = without_flat_tops(ds, machine) if probes else ds
    for probe in probes:
        after = ds[ds[probe.name].dims[0]].values >= start
        values = ds[probe.name].values[after]
        low, high = limits(probe, machine.bearing(probe.end).radial_gap.nominal)
        outside = (values < low) | (values > high)
        cut = np.isfinite(values) & ~np.isfinite(uncut[probe.name].values[after])
        for mask, check in ((cut, "clipping"), (outside, "range")):
            if mask.size and mask.mean() > FEW:
                found[probe.name] = check
    return found
