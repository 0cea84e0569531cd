"""Checks of the displacement channels, individually and against each other."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import xarray as xr
from tdbsim.machine import Machine, Probe
from tdbsim.units import si_unit_of

from tdbmon.quantity import counted, percent
from tdbmon.record import faults
from tdbmon.record.finding import Check, span, um
from tdbmon.record.lost_samples import JUMP, clipped_of, dropout_check, dropouts, flat_tops, spikes
from tdbmon.record.misread import limits
from tdbmon.record.samples import known_samples, times_of
from tdbmon.record.timebase import LONG, usual_interval
from tdbmon.runs import Runs, runs_of

SHORT_GAP = 5  # samples: half a millisecond at 10 kHz, a quarter of a typical first contact

_STILL = 0.02  # of the radial gap: a probe that moves less has not registered the drop
_STUCK = 0.3  # of the record: a probe that is constant for longer is stuck
_FALLS = 0.1  # of the radial gap: if all probes move less, the shaft has not fallen
_SOON = 3.0  # times the free-fall time through the gap: until then the shaft may have moved straight down only
_LEVITATES = 0.6  # of the radial gap, pk-pk: a levitated shaft moves less (zone A of ISO 14839-2)
_LASTS_S = 1e-3  # shorter excursions are spikes
_LIKE_A_DROP = (0.5, 3.0)  # of the radial gap, pk-pk
# of the pk-pk motion, between the initial and final positions: a levitated shaft stays about one position
_STAYS_AWAY = 0.3
_FACTORS = {
    1000.0: "um written as mm, or nm as um", 25.4: "um written as mil", 1e6: "um written as m",
    1e-3: "mm written as um", 1 / 25.4: "mil written as um", 1e-6: "m written as um",
}  # fmt: skip


def probe_checks(ds: xr.Dataset, machine: Machine, probe: Probe) -> list[Check]:
    """Check a single probe: missing samples, motion, unit, clipping, dropouts, range and jumps, as far as applicable."""
    name, array = probe.name, ds[probe.name]
    time, signal = times_of(array), faults.prepare(array.values)
    finite = signal.values[~np.isnan(signal.values)] if np.isnan(signal.values).any() else signal.values
    if finite.size < 2:
        return [Check("dead", name, False, "has no values: check its cable and the logger's channel")]
    found = [missing_samples(name, time, signal)]
    gap = machine.bearing(probe.end).radial_gap.nominal
    peaks = spikes(signal, machine, probe)
    apart = peaks.mask(array.size)
    clipped = clipped_of(array, signal)
    lost = dropouts(signal, clipped)
    # a logger's code for "no value", such as -9999, must not affect the check of the unit
    absent = lost.where(faults.jumped_runs(signal, lost)).mask(array.size)
    held = signal.values[~apart & ~absent & ~np.isnan(signal.values)]
    low, high = (float(q) for q in np.quantile(held, (0.001, 0.999)))  # robust against a few outliers
    swing, moved = high - low, float(np.ptp(held))
    dead = float(np.ptp(finite)) < _STILL * gap
    little = f"only {um(np.ptp(finite))} pk-pk in a gap of {um(gap)}: check its cable and driver"
    found.append(Check("dead", name, not dead, f"moves by {little if dead else f'{um(moved)} pk-pk'}"))
    if dead and (not _moves_slowly(finite) or lost.longest > _STUCK * array.size):
        return found  # neither noise nor a stuck signal can show a wrong unit
    unit = _unit(name, moved, swing, gap, str(array.attrs.get("source_units", "")))
    found.append(unit)
    if dead:
        return found
    found += [_clipping(name, time, signal, flat_tops(signal, clipped)), dropout_check(name, time, lost)]
    if unit.passed:  # with a wrong unit these checks would only repeat the finding
        measured = faults.prepare(np.where(lost.mask(array.size) | apart, np.nan, signal.values))
        steps = faults.level_steps(measured, JUMP * gap)
        paused = np.diff(time) > LONG * np.median(np.diff(time))  # a step across a gap in time is legitimate
        steps = steps[~paused[steps - 1]]
        found += [_range(name, time, measured, probe, gap), _jumps(name, time, signal, peaks, steps, gap)]
    return found


def no_drop(ds: xr.Dataset, machine: Machine, probes: list[Probe]) -> Check | None:
    """Return a failed check if no probe moves as in a drop; None if one does, or if fewer than two have values."""
    travel, leaves = [], False
    for probe in probes:
        _, values = known_samples(ds[probe.name])
        if values.size > 1:
            moved = float(np.ptp(values))
            travel.append((moved, machine.bearing(probe.end).radial_gap.nominal))
            first, last = max(min(values.size // 10, 400), 1), max(values.size // 10, 1)
            leaves |= abs(float(np.median(values[:first]) - np.median(values[-last:]))) > _STAYS_AWAY * moved
    if len(travel) < 2 or any(moved > _FALLS * gap for moved, gap in travel):
        return None
    most, gap = max(travel, key=lambda each: each[0] / each[1])
    low, high = _LIKE_A_DROP
    factor = next((f for f in _FACTORS if leaves and all(low < moved / f / gap < high for moved, gap in travel)), None)
    detail = f"no probe moves by more than {um(most)} pk-pk in a gap of {um(gap)}: "
    if factor is None:
        detail += (
            "the shaft does not fall in this record. Was it cut before the release, or did the magnets hold? Otherwise check"
            " the unit of all displacements and their cables"
        )
    else:
        detail += (
            f"multiplied by {1 / factor:g} it would be {um(most / factor)}, as in a drop: {_FACTORS[factor]}? Check the unit of"
            " all displacements in the file or the machine file, and radial_gap in the machine file"
        )
    return Check("drop", "", False, detail)


def cut_in_fall(ds: xr.Dataset, machine: Machine, probes: list[Probe]) -> Check | None:
    """Return a failed check if the record ends soon after the release, before probes across the fall could move; else None.

    None also if the record before its last three free-fall times is shorter than these, or if a probe moves more there than
    in levitation.
    """
    begun, gaps = [], [machine.bearing(probe.end).radial_gap.nominal for probe in probes]
    fall = float(np.sqrt(2 * max(gaps, default=0.0) / machine.gravity)) if machine.gravity > 0 else 0.0
    for probe, gap in zip(probes, gaps, strict=True):
        values, time = ds[probe.name].values, times_of(ds[probe.name])
        if not np.isfinite(values).any():
            continue
        last = time > time[-1] - _SOON * fall
        levitated = values[~last & np.isfinite(values)]
        if levitated.size < last.sum() or np.ptp(levitated) > _LEVITATES * gap:
            return None
        beyond = np.maximum(values - levitated.max(), levitated.min() - values)
        lasting = runs_of(last & (beyond > _FALLS * gap))
        lasting = lasting.where(lasting.length * usual_interval(time) > _LASTS_S)
        begun += [float(time[lasting.first[0]])] if len(lasting) else []
    if not begun:
        return None
    # extrapolate back from a tenth of the gap to the start of the fall
    released = min(begun) - float(np.sqrt(_FALLS)) * fall
    after = float(time[-1]) - released
    where = "while the shaft is still falling" if after < fall else "during its first contacts"
    detail = (
        f"the record ends {after * 1e3:.2g} ms after the release, {where}: it shows little of the drop, and probes that have"
        " hardly moved cannot be checked. Was the file cut? Record for a second or more after the release"
    )
    return Check("length", "", False, detail)


def _moves_slowly(values: np.ndarray) -> bool:
    """Tell whether a signal varies more slowly than white noise, so that it contains motion, however small its scale."""
    return float(np.std(values)) > 1.5 * float(np.std(np.diff(values))) / np.sqrt(2)


def _unit(name: str, moved: float, swing: float, gap: float, unit: str) -> Check:
    ratio = swing / gap
    detail = f"moves by {um(moved)} pk-pk in a radial gap of {um(gap)}"
    if 0.1 <= ratio <= 10 or swing == 0:
        return Check("unit", name, True, detail)
    nearest = min(_FACTORS, key=lambda factor: abs(np.log(ratio / 1.5 / factor)))
    way = "large" if ratio > 1 else "small"
    times = ratio if ratio > 1 else 1 / ratio
    return Check(
        "unit", name, False,
        f"{detail}: {times:.0f} times too {way} for a drop; most likely a factor {nearest:g} ({_FACTORS[nearest]}):"
        f" check {_where_stated(unit)}",
    )  # fmt: skip


def _where_stated(unit: str) -> str:
    """Return, in words, where the unit of a probe is defined; `unit` is the one stated in the file."""
    if unit and si_unit_of(unit) != si_unit_of("V"):
        return f"'{unit}' in the file (a unit in the machine file is used only if the file states none)"
    return (
        "the probe's sensitivity in the machine file" if unit else "the probe's unit or sensitivity in the machine file"
    )


def _clipping(name: str, time: np.ndarray, signal: faults.Signal, runs: Runs) -> Check:
    if not len(runs):
        return Check("clipping", name, True, "no flat tops")
    level = signal.values[runs.first[0]]
    return Check(
        "clipping", name, False,
        f"{runs.total} samples are at {um(level)} in {counted(len(runs), 'flat top')}, {span(time, runs)}:"
        " peaks are cut off; widen the input range or the probe's gap",
    )  # fmt: skip


def _range(name: str, time: np.ndarray, signal: faults.Signal, probe: Probe, gap: float) -> Check:
    low, high = limits(probe, gap)
    what = "the probe's range" if probe.range is not None else f"{high / gap:g} radial gaps"
    outside = runs_of((signal.values < low) | (signal.values > high))
    if not len(outside):
        return Check("range", name, True, f"within {what}, {um(low)} to {um(high)}")
    extreme = max(np.nanmax(signal.values), np.nanmin(signal.values), key=abs)
    return Check(
        "range", name, False,
        f"{outside.total} samples outside {what} ({um(low)} to {um(high)}), up to {um(extreme)}, {span(time, outside)}:"
        " check sensitivity and offset",
    )  # fmt: skip


def _jumps(name: str, time: np.ndarray, signal: faults.Signal, peaks: Runs, steps: np.ndarray, gap: float) -> Check:
    if not len(peaks) and not steps.size:
        return Check("jumps", name, True, f"no spike and no step above {um(JUMP * gap)}")
    words = []
    if steps.size:
        i = int(steps[0])
        words.append(f"{steps.size} steps, the first of {um(signal.steps[i - 1])} at {time[i]:.5g} s")
    if len(peaks):
        i = int(peaks.first[0])
        size = signal.steps[i - 1] if i else -signal.steps[0]
        words.append(
            f"{len(peaks)} spikes, the first of {um(size)} at {time[i]:.5g} s (their samples are taken as missing)"
        )
    cause = "no rotor moves like that; look for a loose contact or a change of range"
    return Check("jumps", name, False, f"{' and '.join(words)}: {cause}")


def twins(ds: xr.Dataset, probes: list[Probe]) -> list[Check]:
    """Check that no two probes are the same channel, i.e. identical sample by sample and not constant."""
    same: dict[str, list[str]] = {}
    for one, other in combinations(probes, 2):
        if ds[one.name].dims != ds[other.name].dims:
            continue
        a, b = ds[one.name].values, ds[other.name].values
        alike = np.array_equal(a[:100], b[:100], equal_nan=True) and np.array_equal(a, b, equal_nan=True)
        moves = alike and np.nanmin(a, initial=np.inf) < np.nanmax(a, initial=-np.inf)
        if moves:  # two constant channels are both dead instead
            same.setdefault(one.name, []).append(other.name)
            same.setdefault(other.name, []).append(one.name)
    cause = "sample by sample: one of them is the wrong channel; check [channels] and the wiring"
    found = [Check("identical", name, False, f"equals {', '.join(others)} {cause}") for name, others in same.items()]
    if probes and not found:
        found.append(Check("identical", "", True, "no two probes are the same"))
    return found


def missing_samples(name: str, time: np.ndarray, signal: faults.Signal) -> Check:
    """Check that a channel at times (n,), s, has no missing samples."""
    runs = runs_of(np.isnan(signal.values))
    if not len(runs):
        return Check("nan", name, True, "every sample has a value")
    share = runs.total / signal.values.size
    return Check(
        "nan", name, False,
        f"{runs.total} samples ({percent(share, 2)}) without a value in {counted(len(runs), 'run')}, the longest"
        f" {counted(runs.longest, 'sample')}, {span(time, runs)};"
        f" runs of up to {SHORT_GAP} samples can be interpolated, longer ones are left out",
    )  # fmt: skip
