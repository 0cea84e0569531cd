"""Warning for a simulated record that ends while the shaft still bounces, in which `tdbmon analyse` cannot find some values."""

from __future__ import annotations

import xarray as xr
from tdbsim.errors import InputError
from tdbsim.machine import Machine

from tdbmon.analysis.axes import seen_ends, to_planes
from tdbmon.analysis.gap import SETTLED_S, NoCircle, settled_from
from tdbmon.record.assign import assign

_USUAL_S = 2.0  # after the release: rotors of a few kilograms to 1.5 tonnes have settled by then


def unsettled_lines(drop: xr.Dataset, machine: Machine) -> list[str]:
    """Return a line naming the ends whose clearance, contacts and stiffness cannot be estimated, and the remedy; else none."""
    try:
        planes = to_planes(assign(drop, machine), machine)
    except InputError:
        return []  # without probes there is nothing to analyse
    release = float(drop.attrs["release_time_s"])
    ends = [
        end
        for end in seen_ends(planes)
        if isinstance(settled_from(planes, end, machine.bearing(end).radial_gap.nominal, release), NoCircle)
    ]
    if not ends:
        return []
    simulated = float(drop.time[-1]) - release
    longer = f"--seconds {_USUAL_S:g} is mostly enough" if simulated < _USUAL_S else "simulate for longer"
    return [
        f"analyse cannot estimate radius, gap, first contact and stiffness of {' and '.join(ends)} from this record: the shaft"
        f" does not lie on the ring for {SETTLED_S:g} s; {longer}"
    ]
