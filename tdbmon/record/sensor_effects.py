"""Readings freed of what the machine file's effects say of its sensors: gain, lag, crosstalk and angle of probes.

A fitted simulation goes through the same sensors and is compared with the readings as recorded; what is told from readings
alone must be freed of them first.  Of runout only the slow roll that a probe's table states is taken off: the phase of
`probe_runout` may differ from drop to drop.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import xarray as xr
from tdbsim.machine import EffectSetting, Machine
from tdbsim.sensors import SensorChain, delayed
from tdbsim.stated_effects import from_setting

from tdbmon.record.finding import Check
from tdbmon.record.slow_roll import without_slow_roll
from tdbmon.record.timebase import usual_rate


def sensor_chain(machine: Machine) -> tuple[SensorChain, tuple[str, ...]]:
    """Return what a machine file's effects do to its sensors, and those (name at place) that readings can be freed of.

    Lags count in s, as in samples at 1 Hz: channels may be of several rates.
    """
    chain, names = SensorChain(), []
    for setting in machine.effects:
        changed = from_setting(setting).sense(chain, machine, 1.0)
        freed = replace(changed, probes={name: replace(link, runout=()) for name, link in changed.probes.items()})
        if freed != chain:
            names.append(f"{setting.name} at {setting.where}")
        chain = freed
    return chain, tuple(names)


def freed(record: xr.Dataset, machine: Machine) -> tuple[xr.Dataset, Machine]:
    """Return the record with the readings that sound sensors would have given, and the machine with its true angles.

    Parameters
    ----------
    record : Dataset
        Laid over the machine (`tdbmon.record.assign.assign`), probes in m.  It is left as it is.
    machine : Machine

    Returns
    -------
    Dataset, Machine
        A probe whose neighbour leaks into it and is missing keeps what leaked.
    """
    return of_sound_sensors(without_slow_roll(record, machine), machine)


def of_sound_sensors(record: xr.Dataset, machine: Machine) -> tuple[xr.Dataset, Machine]:
    """Return the same of a record whose slow roll is off already."""
    if not machine.effects or not machine.probes:
        return record, machine
    present = [probe.name for probe in machine.probes if probe.name in record]
    if not present:
        return record, machine
    chain, names = sensor_chain(machine)
    if not names:
        return record, machine
    out = record.copy()
    for name in present:
        (dim,) = record[name].dims
        readings = _earlier(record[name].to_numpy(), chain.of(name).lag, record[dim].to_numpy())
        out[name] = (dim, readings, record[name].attrs)
    for name, readings in _without_leaks(out, chain, present).items():
        link = chain.of(name)
        out[name] = (out[name].dims, (readings - link.offset) / link.gain, out[name].attrs)
    turned = tuple(
        probe.model_copy(update={"angle": probe.angle + chain.of(probe.name).angle_error}) for probe in machine.probes
    )
    return out, machine.model_copy(update={"probes": turned})


def _without_leaks(record: xr.Dataset, chain: SensorChain, present: list[str]) -> dict[str, np.ndarray]:
    """Return the readings of the probes before one leaked into another: each is its own and a part of its source's."""
    mixing = np.eye(len(present))
    for name, (source, part) in chain.leaks.items():
        if name in present and source in present and record[name].dims == record[source].dims:
            mixing[present.index(name), present.index(source)] += part
    back = np.linalg.inv(mixing)
    return {
        name: np.asarray(
            sum(share * record[each].to_numpy() for each, share in zip(present, row, strict=True) if share)
        )
        for name, row in zip(present, back, strict=True)
    }


def _earlier(readings: np.ndarray, lag_s: float, time: np.ndarray) -> np.ndarray:
    """Return readings of sampled times, both (n,), earlier by a lag; NaN beyond the end, and where nothing was measured."""
    if lag_s == 0 or len(time) < 2:
        return readings
    lag = lag_s * usual_rate(time)
    missing = ~np.isfinite(readings)
    at = np.arange(len(readings))
    if missing.all():
        return readings
    filled = np.interp(at, at[~missing], readings[~missing]) if missing.any() else readings
    out = delayed(filled, -lag)
    wanted = at + lag
    hidden = np.interp(wanted, at, missing.astype(float)) > 0
    out[hidden | (wanted > at[-1]) | (wanted < 0)] = np.nan
    return out


def check_effects(machine: Machine) -> list[Check]:
    """Say what becomes of the effects that the machine file carries."""
    if not machine.effects:
        return []
    _, sensors = sensor_chain(machine)
    others = [told for each in machine.effects if (told := f"{each.name} at {each.where}") not in sensors]
    said = [f"{', '.join(sensors)}: readings are freed of it before anything is told from them"] if sensors else []
    if others:
        said.append(
            f"{', '.join(others)}: the simulation has it (--forces); what is told from readings alone does not know it"
        )
    if turning := [f"{e.name} at {e.where}" for e in machine.effects if _of_one_drop(e)]:
        said.append(
            f"{', '.join(turning)}: the machine file has the angle of one drop; in another it may lie otherwise, which the"
            " simulation does not know"
        )
    return [Check("effects", "machine file", True, "; ".join(said))]


def _of_one_drop(setting: EffectSetting) -> bool:
    """True where an effect of a machine file has an angle, or a ball's number, that differs from drop to drop."""
    effect = from_setting(setting)
    return any(each.per_drop for each in effect.parameters()) and not effect.stands_still(effect.values)
