"""Probes that measure wrongly in a drop: clipped, out of the possible range, or with missing samples at the contacts."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import xarray as xr
from tdbsim.machine import Machine, Probe

from tdbmon.record.finding import Check
from tdbmon.record.lost_samples import without_flat_tops
from tdbmon.record.samples import times_of

FEW = 0.005  # of the samples: more would bias the circle fitted to the others
_FAR = 3.0  # radial gaps from the centre: beyond the reach of any rotor
_CONTACTS_S = 0.05  # after the release: the first contacts, not evaluated where samples are missing
_HIDDEN = 0.1  # of the samples in this time: a longer gap hides a contact, which lasts about 2 ms, and its surroundings
_CHECKS = ("dropout", "nan", "clipping", "range")


def limits(probe: Probe, gap: float) -> tuple[float, float]:
    """Return the plausible range of a probe's readings, m: that of the machine file, or plus and minus a few radial gaps."""
    return probe.range if probe.range is not None else (-_FAR * gap, _FAR * gap)


def misread(ds: xr.Dataset, machine: Machine, start: float, checks: Iterable[Check]) -> dict[str, str]:
    """Return the probes that are wrong in more than a few samples after time `start` (s), with the name of the failed check.

    Missing samples count only during the first contacts, as a fraction of the samples there, so that the result does not
    depend on the record's length; later ones affect only a small part of the record.
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
