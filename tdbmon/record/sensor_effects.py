"""Correction of readings for the sensor effects in the machine file: gain, lag, crosstalk and angle errors of probes.

A fitted simulation includes the same sensor effects and is compared with the readings as recorded; analyses of the readings
alone require the correction.  Of the runout, only the slow roll stated for a probe is subtracted, as the phase of
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
    """Return the sensor chain given by a machine file's effects, and the effects (name at place) that can be corrected.

    Lags are in s, i.e. in samples at 1 Hz, as channels may have different sampling rates.
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
    """Return a copy of the record corrected for sensor effects and slow roll, and the machine with the true probe angles.

    Parameters
    ----------
    record : Dataset
        Record assigned to the machine (`tdbmon.record.assign.assign`), probes in m.  It is not modified.
    machine : Machine

    Returns
    -------
    Dataset, Machine
        Crosstalk from a probe that is missing in the record cannot be removed.
    """
    return of_sound_sensors(without_slow_roll(record, machine), machine)


def of_sound_sensors(record: xr.Dataset, machine: Machine) -> tuple[xr.Dataset, Machine]:
    """Return the result of `freed` for a record whose slow roll has already been subtracted."""
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
    """Return the readings without crosstalk: each recorded one is the probe's own plus a fraction of its source's."""
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
    """Return readings at times (n,), s, advanced by a lag, s; NaN beyond the ends and where samples are missing."""
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
    """Return a remark on how the effects in the machine file are handled."""
    if not machine.effects:
        return []
    _, sensors = sensor_chain(machine)
    others = [told for each in machine.effects if (told := f"{each.name} at {each.where}") not in sensors]
    said = [f"{', '.join(sensors)}: readings are corrected for it before the analysis"] if sensors else []
    if others:
        said.append(
            f"{', '.join(others)}: the simulation includes it (--forces); analyses of the readings alone do not account for it"
        )
    if turning := [f"{e.name} at {e.where}" for e in machine.effects if _of_one_drop(e)]:
        said.append(
            f"{', '.join(turning)}: the machine file states its angle in one drop; the angle may differ in another drop, which"
            " the simulation does not account for"
        )
    return [Check("effects", "machine file", True, "; ".join(said))]


def _of_one_drop(setting: EffectSetting) -> bool:
    """Tell whether an effect has an angle, or a ball's number, that differs from drop to drop."""
    effect = from_setting(setting)
    return any(each.per_drop for each in effect.parameters()) and not effect.stands_still(effect.values)
