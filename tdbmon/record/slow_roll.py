"""Subtraction of the slow roll stated in the machine file, using the shaft angle from the keyphasor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from tdbsim.machine import Machine, Probe
from tdbsim.slow_roll import slow_roll

from tdbmon.record.finding import Check, um
from tdbmon.record.keyphasor import Pulses, pulses_if_any

COMPENSATED = "slow roll compensated"  # wording in figures
NOT_COMPENSATED = "runout not compensated"
# revolutions of extrapolation: the speed is constant in levitation before the first pulse, but not in coast-down
_BEFORE, _AFTER = 3, 1


def without_slow_roll(record: xr.Dataset, machine: Machine) -> xr.Dataset:
    """Return a record with the slow roll (m) subtracted from its probes where the shaft angle is known.

    The angle is extrapolated at constant speed for three revolutions before the first and one after the last pulse.  If the
    pulses begin later than that, nothing is subtracted, since the readings would jump there as at a release.
    """
    stated = _stated(record, machine)
    angles = _angles(record, machine, stated)
    if isinstance(angles, str):
        return record
    out = record.copy()
    for probe in stated:
        (dim,) = record[probe.name].dims
        turned = angles[str(dim)]
        roll = np.where(np.isfinite(turned), slow_roll(probe, turned), 0.0)
        out[probe.name] = (dim, record[probe.name].to_numpy() - roll, record[probe.name].attrs)
    return out


def check_slow_roll(record: xr.Dataset, machine: Machine) -> list[Check]:
    """Return a check that states whether and where the slow roll of the machine file was subtracted."""
    stated = _stated(record, machine)
    if not stated:
        return []
    said = ", ".join(f"{probe.name} {um(probe.slow_roll.peak_to_peak)} pk-pk" for probe in stated if probe.slow_roll)
    angles = _angles(record, machine, stated)
    if isinstance(angles, str):
        return [Check("slow roll", "", False, f"{said}: not subtracted, since {angles}")]
    dim, turned = next(iter(angles.items()))
    known = np.isfinite(turned)
    if not known.all():
        first, last = record[dim].to_numpy()[known][[0, -1]]
        detail = f"{said}: subtracted between {first:.5g} s and {last:.5g} s, where keyphasor pulses give the shaft angle"
        return [Check("slow roll", "", True, detail)]
    return [Check("slow roll", "", True, f"{said}: subtracted from all readings, by the shaft angle from the keyphasor")]


def runout_words(checks: Sequence[Check]) -> str:
    """Return the note on runout compensation for figures, from the checks of a record."""
    return COMPENSATED if _taken_off(checks) else NOT_COMPENSATED


def runout_sentence(checks: Sequence[Check]) -> str:
    """Return the sentence on runout compensation for texts, from the checks of a record."""
    return "Slow roll is compensated." if _taken_off(checks) else "Runout is not compensated."


def _taken_off(checks: Sequence[Check]) -> bool:
    return any(each.check == "slow roll" and each.passed for each in checks)


def _stated(record: xr.Dataset, machine: Machine) -> list[Probe]:
    return [probe for probe in machine.probes if probe.slow_roll is not None and probe.name in record]


def _angles(record: xr.Dataset, machine: Machine, stated: Sequence[Probe]) -> dict[str, np.ndarray] | str:
    """Return the rotation angle at the samples of each time base of the probes, rad, or the reason why it is unavailable."""
    key = pulses_if_any(record, machine) if stated else None
    if key is None or len(key.times) <= 2:
        return "the record has no keyphasor pulses that give the shaft angle"
    bases = dict.fromkeys(str(record[probe.name].dims[0]) for probe in stated)
    angles = {dim: _turned(key, record[dim].to_numpy()) for dim in bases}
    for dim, turned in angles.items():
        known = np.isfinite(turned)
        if known.any() and not known[0]:
            return (
                f"keyphasor pulses give the shaft angle only from {record[dim].to_numpy()[known][0]:.5g} s on, and readings"
                " would jump there; if the shaft still levitates then, cut the record there"
            )
    return angles


def _turned(key: Pulses, time: np.ndarray) -> np.ndarray:
    """Return the rotation angle relative to the first pulse at times (n,), s, rad; NaN too far outside the pulses."""
    from scipy.interpolate import PchipInterpolator

    course = PchipInterpolator(key.times, key.turns)
    (first, second), (before, last) = key.times[:2], key.times[-2:]
    turns = np.asarray(course(np.clip(time, first, last)))
    turns += np.clip(time - first, None, 0.0) / (second - first) * (key.turns[1] - key.turns[0])
    turns += np.clip(time - last, 0.0, None) / (last - before) * (key.turns[-1] - key.turns[-2])
    near = (turns >= key.turns[0] - _BEFORE) & (turns <= key.turns[-1] + _AFTER)
    return np.where(near, 2 * np.pi * turns, np.nan)
