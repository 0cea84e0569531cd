"""Displacement at the bearing planes, without clipped samples and unaffected by faulty probes of the other end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import xarray as xr
from tdbsim.errors import InputError
from tdbsim.machine import Machine

from tdbmon.analysis.axes import at_own_probes, differ, to_planes
from tdbmon.record.finding import Check
from tdbmon.record.lost_samples import without_flat_tops
from tdbmon.record.sensor_effects import freed

_LEAST_HZ = 500.0  # sampling rate of probes: below, a contact lasts no longer than a sample


def bearing_planes(record: xr.Dataset, machine: Machine, use: Sequence[str]) -> xr.Dataset:
    """Return the displacement at the bearing planes (`to_planes`) from the probes named in `use`, m.

    It is NaN where a probe is clipped, which the mask `cut_off` (end, time) marks.

    Raises
    ------
    InputError
        If no orbit is visible, or the sampling rate is too low to resolve a contact.
    """
    whole = to_planes(*freed(record, machine), use)
    time = whole.time.to_numpy()
    # mean rate including gaps: a record that consists mostly of gaps has a damaged clock
    rate = (len(time) - 1) / (time[-1] - time[0])
    if rate < _LEAST_HZ:
        raise InputError(
            f"the probes are sampled at {rate:.3g} Hz, too slow for contacts of some 2 ms; record at"
            " 2 kHz or more, or correct the sampling interval or the times in the file"
        )
    seen = to_planes(*freed(without_flat_tops(record, machine), machine), use)
    return seen.assign(cut_off=_cut_off(seen, whole))


def apart_from_misread(
    planes: xr.Dataset, record: xr.Dataset, machine: Machine, wrong: Mapping[str, str], checks: list[Check]
) -> xr.Dataset:
    """Evaluate an end with sound probes at its own probe plane if faulty probes elsewhere corrupt the rigid line.

    `wrong` maps the probes that misread to the failed check; an entry in `checks` reports the change of plane.
    """
    used = [str(name) for name in planes.probe.values]
    along = [end for end in machine.ends if str(planes.plane.sel(end=end).item()) == "bearing"]
    faulty = [name for name in used if name in wrong]
    own = {end: [probe for probe in machine.probes_at(end) if probe.name in used] for end in along}
    sound = [
        end
        for end, probes in own.items()
        if not any(probe.name in faulty for probe in probes) and differ([probe.angle for probe in probes])
    ]
    if not faulty or not sound:
        return planes
    for end in sound:
        why = " and ".join(f"{name} (see {wrong[name]})" for name in faulty)
        told = f"evaluated at its own probes' plane: readings of {why} would corrupt it at the bearing"
        checks.append(Check("orbit", end, True, told))
    planes = at_own_probes(planes, *freed(without_flat_tops(record, machine), machine), used, sound)
    whole = at_own_probes(planes, *freed(record, machine), used, sound)
    return planes.assign(cut_off=planes.cut_off.where(~planes.end.isin(sound), _cut_off(planes, whole)))


def _cut_off(planes: xr.Dataset, whole: xr.Dataset) -> xr.DataArray:
    """Return where (end, time) displacement is missing in `planes` but not in `whole`, which keeps the clipped samples."""
    return (planes.displacement.isnull() & whole.displacement.notnull()).any("axis")
