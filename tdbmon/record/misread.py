"""Probes that misread in a drop: their peaks are cut off, they read where no rotor gets to, or nothing at the contacts."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import xarray as xr
from tdbsim.machine import Machine, Probe

from tdbmon.record.finding import Check
from tdbmon.record.lost_samples import without_flat_tops
from tdbmon.record.samples import times_of

FEW = 0.005  # of the samples: more move the circle that is fitted to the rest
_FAR = 3.0  # radial gaps from the centre: no rotor gets there
_CONTACTS_S = 0.05  # from the release: the first contacts, of which no value is told where samples are missing
_HIDDEN = 0.1  # of these contacts' samples: what is blank longer hides a contact, which lasts some 2 ms, with what is about it
_CHECKS = ("dropout", "nan", "clipping", "range")


def limits(probe: Probe, gap: float) -> tuple[float, float]:
    """Return what a probe can read at a radial gap, m: its range by the machine file, or a few gaps."""
    return probe.range if probe.range is not None else (-_FAR * gap, _FAR * gap)


def misread(ds: xr.Dataset, machine: Machine, start: float, checks: Iterable[Check]) -> dict[str, str]:
    """Return the probes that misread in more than a few samples from an instant on (s), and the failed check that says how.

    Missing samples count where they hide the first contacts, as a share of those alone, so that it does not matter how long
    the record goes on: those that come later blank a little of the record only.
    """
    found: dict[str, str] = {}
    failed = {(entry.channel, entry.check) for entry in checks if not entry.passed}
    probes = [p for p in machine.probes if p.name in ds and any((p.name, check) in failed for check in _CHECKS)]
    uncut = without_flat_tops(ds, machine) if probes else ds
    for probe in probes:
        time = times_of(ds[probe.name])
        after = time >= start
        values = ds[probe.name].values[after]
        low, high = limits(probe, machine.bearing(probe.end).radial_gap.nominal)
        outside = (values < low) | (values > high)
        cut = np.isfinite(values) & ~np.isfinite(uncut[probe.name].values[after])
        hidden = np.isnan(values[time[after] < start + _CONTACTS_S])
        judged = ((hidden, _HIDDEN), (hidden, _HIDDEN), (cut, FEW), (outside, FEW))
        for (mask, most), check in zip(judged, _CHECKS, strict=True):
            if (probe.name, check) in failed and mask.size and mask.mean() > most:
                found[probe.name] = check
    return found
