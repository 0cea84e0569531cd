"""Hint at a wrong radial gap in the machine file if all probes of an end contradict it alike, instead of wrong units."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import xarray as xr
from tdbsim.machine import Machine

from tdbmon.record.finding import Check, um

_ALIKE = 4.0  # largest ratio between the motions of an end's probes: in a drop they move between 0.5 and 2 gaps


def with_suspect_gap(found: list[Check], ds: xr.Dataset, machine: Machine) -> list[Check]:
    """Return the checks, with the radial gap added as a possible cause of failed unit checks if all probes of an end agree."""
    failed = {each.channel for each in found if each.check == "unit" and not each.passed}
    ends = [end for end in machine.ends if _alike(end, failed, ds, machine)]
    who = "all probes of both ends" if len(ends) == len(machine.ends) else "all probes of {}"
    about = {
        probe.name: f", or radial_gap of {end} in the machine file, {um(machine.bearing(end).radial_gap.nominal)},"
        f" since {who.format(end)} deviate by a similar factor"
        for end in ends
        for probe in machine.probes_at(end)
    }
    return [
        replace(each, detail=each.detail + about.get(each.channel, "")) if each.check == "unit" else each
        for each in found
    ]


def _alike(end: str, failed: set[str], ds: xr.Dataset, machine: Machine) -> bool:
    """Tell whether all probes of an end in the record, at least two, fail the unit check by about the same factor."""
    names = [probe.name for probe in machine.probes_at(end) if probe.name in ds]
    if len(names) < 2 or not failed.issuperset(names):
        return False
    moved = [float(np.ptp(np.nanquantile(ds[name].values, (0.001, 0.999)))) for name in names]
    return max(moved) < _ALIKE * min(moved)
