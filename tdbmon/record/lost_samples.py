"""Invalid samples of probe channels: dropouts (frozen while the shaft moves), spikes and clipped peaks."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tdbsim.machine import Machine, Probe

from tdbmon.record import faults
from tdbmon.record.finding import Check, span
from tdbmon.runs import Runs

JUMP = 0.1  # of the radial gap from one sample to the next


def dropouts(signal: faults.Signal, clipped: Runs) -> Runs:
    """Return the frozen runs that are not clipped peaks; a dropout to the end of the range is entered and left by a jump."""
    runs = faults.frozen_runs(signal)
    return runs.where(~np.isin(runs.first, clipped.first) | faults.jumped_runs(signal, runs))


def spikes(signal: faults.Signal, machine: Machine, probe: Probe) -> Runs:
    """Return the spikes of a probe: samples that deviate from their neighbours more abruptly than a rotor can move."""
    return faults.spikes(signal, JUMP * machine.bearing(probe.end).radial_gap.nominal)


def flat_tops(signal: faults.Signal, clipped: Runs) -> Runs:
    """Return the clipped runs that are not dropouts."""
    return clipped.where(~np.isin(clipped.first, dropouts(signal, clipped).first))


def clipped_of(array: xr.DataArray, signal: faults.Signal) -> Runs:
    """Return the clipped runs of a channel, using its full scale where it is known."""
    limits = array.attrs.get("full_scale")
    return faults.clipped_runs(signal, (float(limits[0]), float(limits[1])) if limits is not None else None)


def dropout_check(name: str, time: np.ndarray, runs: Runs) -> Check:
    """Return the result of the dropout check of a channel."""
    if not len(runs):
        return Check("dropout", name, True, "no frozen stretch")
    stretches = "one stretch" if len(runs) == 1 else f"{len(runs)} stretches"
    return Check(
        "dropout", name, False,
        f"frozen in {stretches} of up to {runs.longest} samples, {span(time, runs)}: the logger lost data or a contact is"
        " loose; these samples are taken as missing",
    )  # fmt: skip


def without_lost_samples(ds: xr.Dataset, machine: Machine) -> xr.Dataset:
    """Return a copy of a record with dropouts and spikes of the probes set to NaN."""

    def lost(probe: Probe, signal: faults.Signal, clipped: Runs) -> NDArray[np.bool_]:
        size = signal.values.size
        return dropouts(signal, clipped).mask(size) | spikes(signal, machine, probe).mask(size)

    return _without(ds, machine, lost)


def without_flat_tops(ds: xr.Dataset, machine: Machine) -> xr.Dataset:
    """Return a copy of a record with the clipped samples of the probes set to NaN."""
    return _without(ds, machine, lambda _, signal, clipped: flat_tops(signal, clipped).mask(signal.values.size))


def _without(
    ds: xr.Dataset,
    machine: Machine,
    lost: Callable[[Probe, faults.Signal, Runs], NDArray[np.bool_]],
) -> xr.Dataset:
    out = ds.copy()
    for probe in machine.probes:
        if probe.name not in ds:
            continue
        array = ds[probe.name]
        signal = faults.prepare(array.values)
        missing = lost(probe, signal, clipped_of(array, signal))
        if missing.any():
            out[probe.name] = (array.dims, np.where(missing, np.nan, array.values), array.attrs)
    return out
