"""The orbit at the bearing planes: missing where peaks are cut off, and spared what probes elsewhere misread."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import xarray as xr
from tdbsim.errors import InputError
from tdbsim.machine import Machine

from tdbmon.analysis.axes import at_own_probes, differ, to_planes
from tdbmon.record.finding import Check
from tdbmon.record.lost_samples import without_flat_tops
from tdbmon.record.sensor_effects import freed

_LEAST_HZ = 500.0  # sampling rate of probes, below which no contact is more than a sample


def bearing_planes(record: xr.Dataset, machine: Machine, use: Sequence[str]) -> xr.Dataset:
    """Return displacement at the bearing planes (`to_planes`) by the probes named in `use`, m.

    Where a probe's peaks are cut off it is NaN, and `cut_off` (end, time) says so.

    Raises
    ------
    InputError
        If no orbit is seen, or too few samples a second to see a contact.
    """
    whole = to_planes(*freed(record, machine), use)
    time = whole.time.to_numpy()
    # holes count: where they are a hundred times the rest, the clock is damaged
    rate = (len(time) - 1) / (time[-1] - time[0])
    if rate < _LEAST_HZ:
        raise InputError(
            f"the probes are sampled at {rate:.3g} Hz, where a contact lasts some 2 ms; record at"
            " 2 kHz or more, or mend the sampling interval or the times in the file"
        )
    seen = to_planes(*freed(without_flat_tops(record, machine), machine), use)
    return seen.assign(cut_off=_cut_off(seen, whole))


def apart_from_misread(
    planes: xr.Dataset, record: xr.Dataset, machine: Machine, wrong: Mapping[str, str], checks: list[Check]
) -> xr.Dataset:
    """Take an end whose own probes read well apart from the rigid line that probes elsewhere misread."""
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
        checks.append(Check("orbit", end, True, f"taken at its own probes' plane: {why} would spoil it at the bearing"))
    planes = at_own_probes(planes, *freed(without_flat_tops(record, machine), machine), used, sound)
    whole = at_own_probes(planes, *freed(record, machine), used, sound)
    return planes.assign(cut_off=planes.cut_off.where(~planes.end.isin(sound), _cut_off(planes, whole)))


def _cut_off(planes: xr.Dataset, whole: xr.Dataset) -> xr.DataArray:
    """Return where (end, time) displacement is missing that is there as long as no peak is left out."""
    return (planes.displacement.isnull() & whole.displacement.notnull()).any("axis")
