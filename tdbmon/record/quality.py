"""Quality checks of a record's channels; every finding states a number, a time and a remedy."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import xarray as xr
from tdbsim.errors import did_you_mean
from tdbsim.machine import Machine, Probe

from tdbmon.quantity import counted, percent
from tdbmon.record import faults
from tdbmon.record.bandwidth import check_bandwidth
from tdbmon.record.broken_turn import broken_turn_checks
from tdbmon.record.date import unread_date
from tdbmon.record.direction_checks import fall_directions, motions_of, whirl_directions
from tdbmon.record.finding import Check
from tdbmon.record.held_end import falls_at, held_ends, turns_throughout
from tdbmon.record.keyphasor import Pulses, pulses_if_any, sampling_for_pulses
from tdbmon.record.one_time import best_time_base
from tdbmon.record.probe_checks import SHORT_GAP, cut_in_fall, missing_samples, no_drop, probe_checks, twins
from tdbmon.record.probe_places import check_places
from tdbmon.record.samples import known_samples, times_of
from tdbmon.record.slow_roll import without_slow_roll
from tdbmon.record.speed_checks import (
    dead_speed,
    first_speed,
    keyphasor_speed_check,
    shorter_than_a_sample,
    speed_check,
    stands,
)
from tdbmon.record.speed_spikes import check_speed_spikes, without_speed_spikes
from tdbmon.record.suspect_gap import with_suspect_gap
from tdbmon.record.timebase import LONG, usual_interval
from tdbmon.runs import runs_of

_SLOWEST = 2000.0  # Hz: gives four samples in a contact of 2 ms
_ROUNDING = 1e-3  # of a rate: a smaller deviation comes from rounded time stamps or the logger's clock
_LEAST = 0.5  # of a probe's samples: fewer with a value make it unfit
_UNFIT = {
    "dead": "is dead",
    "identical": "equals another probe",
    "unit": "is wrong by a constant factor",
}  # keyed by the failed check
_WHOLE = 0.9  # of the probes' duration: even the last sample of a slow channel is later
_UNEVEN = 0.01  # of the interval: jitter that affects a spectrum


def check(ds: xr.Dataset, machine: Machine) -> tuple[Check, ...]:
    """Check the channels of a record and return the results; only checks that could be performed are listed.

    Parameters
    ----------
    ds : xarray.Dataset
        A record assigned to `machine` (`tdbmon.record.assign.assign`).
    machine : tdbsim.machine.Machine
        Provides the gaps and the probes' ranges and angles.

    Returns
    -------
    tuple of Check
        A channel missing from the file is a failed check ``present`` that states the consequences.
    """
    found: list[Check] = []
    if ds.attrs.get("incomplete"):
        found.append(Check("complete", "", False, f"{ds.attrs['incomplete']}; the rest can be analysed"))
    if stated := ds.attrs.get("drop_time_unread"):
        found.append(Check("date", "", False, unread_date(str(stated))))
    found += _machine(ds, machine)
    found += [_missing(name, ds, machine) for name in ds.attrs.get("missing", ())]
    probes = [probe for probe in machine.probes if probe.name in ds]
    found += [_sampling(ds, str(dimension), {probe.name for probe in probes}) for dimension in ds.sizes]
    found += check_places(machine, probes)
    found += ds.attrs.get("time_remarks", ())
    found += _rates(ds, machine, probes) + _ends_early(ds, probes)
    # if the shaft does not fall, or has hardly moved in some directions, neither dead probes nor wrong units can be detected
    early = no_drop(ds, machine, probes) or cut_in_fall(ds, machine, probes)
    marks = pulses_if_any(ds, machine)
    hovers = [] if early is not None else _at_held_ends(ds, machine, first_speed(ds, marks))
    for probe in probes:
        of_probe = probe_checks(ds, machine, probe)
        if early is not None or probe.name in hovers:
            of_probe = [each for each in of_probe if each.check not in ("dead", "unit")]
        if probe.name in hovers:
            why = "moves little, since its end stays levitated: 1X is visible before and after the drop"
            found.append(Check("dead", probe.name, True, why))
        found += of_probe
    found = with_suspect_gap(found, ds, machine)
    found += [early] if early is not None else []
    dead = dead_speed(ds, marks) if "speed" in ds else ""
    if "speed" in ds:
        constant = Check("dead", "speed", True, "is constant: a set-point rather than a measured speed?")
        found += [Check("dead", "speed", False, dead)] if dead else _signal(ds, constant)
        found += check_speed_spikes(ds)
        ds = without_speed_spikes(ds)
    if "keyphasor" in ds:
        why = ", as the shaft is at standstill" if stands(ds) else ": check its cable and the logger's channel"
        found += _signal(ds, Check("dead", "keyphasor", stands(ds), f"is constant{why}"))
    found += twins(ds, probes)
    if early is None:  # otherwise the apparent levitation may contain the fall
        found += check_bandwidth(
            ds.drop_vars({e.channel for e in found if not e.passed and e.check in _UNFIT}), machine
        )
    found += fall_directions(ds, machine)
    if marks is not None:
        found.append(_keyphasor(ds, machine, marks))
        found += broken_turn_checks(marks, times_of(ds["keyphasor"]))
    found += whirl_directions(without_slow_roll(ds, machine), machine, first_speed(ds, marks))
    if "speed" in ds and not dead:
        found.append(speed_check(ds, machine, marks))
    counted = keyphasor_speed_check(ds, machine, marks)
    found += [counted] if counted is not None else []
    return tuple(found)


def _at_held_ends(ds: xr.Dataset, machine: Machine, hz: float | None) -> list[str]:
    """Return the probes that move little because their end stays levitated, if all of them show 1X before and after the drop."""
    motions = motions_of(ds, machine)
    held = held_ends(motions, machine)
    fell = falls_at({end: motion for end, motion in motions.items() if end not in held}, machine)
    if fell is None or hz is None:
        return []
    found = []
    for end in held:
        names = [probe.name for probe in machine.probes_at(end) if probe.name in ds]
        if all(turns_throughout(*known_samples(ds[name]), hz, fell, machine.mains) for name in names):
            found += names
    return found


class LeftOut(NamedTuple):
    """Why a probe is unfit for analysis, as a phrase to follow its name, and the related check ("" for none)."""

    why: str
    see: str = ""

    def __str__(self) -> str:
        return f"{self.why} (see {self.see})" if self.see else self.why


def left_out(ds: xr.Dataset, machine: Machine, checks: Iterable[Check]) -> dict[str, LeftOut]:
    """Return the probes that are unfit for analysis, with the reason.

    These are probes that are missing, dead, identical to another one (one of the two is not what its name says), off by
    a factor of ten or more relative to the gap, without a value in half of their samples or more, or not on the best
    time base (`tdbmon.record.one_time.best_time_base`).
    """
    out = {p.name: LeftOut("is not in the record", "present") for p in machine.probes if p.name not in ds}
    for entry in checks:
        if not entry.passed and entry.check in _UNFIT:
            out[entry.channel] = LeftOut(_UNFIT[entry.check], entry.check)
    kept = [probe.name for probe in machine.probes if probe.name not in out]
    out |= {name: LeftOut(why) for name in kept if (why := _mostly_missing(ds[name]))}
    kept = [name for name in kept if name not in out]
    on_one = best_time_base(ds, machine, kept)
    return out | {name: LeftOut("is on another time base", "time base") for name in kept if name not in on_one}


def _mostly_missing(array: xr.DataArray) -> str:
    """Return a message if a probe has too few values, with where to cut the record if it fails for good; "" otherwise."""
    there = np.isfinite(array.values)
    share = float(np.mean(there)) if there.size else 0.0
    if share > _LEAST:
        return ""
    said = f"has no value in {percent(1 - share)} of the samples (limit {percent(_LEAST)})"
    last = int(there.size - np.argmax(there[::-1])) if there.any() else 0  # the first sample after the last value
    if np.mean(there[:last]) <= _LEAST or last == 0:
        return said
    at = float(times_of(array)[last])
    return f"{said} and none from {at:.4g} s on: cut the record at {at:.4g} s"


def repair_gaps(ds: xr.Dataset) -> xr.Dataset:
    """Interpolate runs of at most five missing samples linearly; longer ones remain NaN.

    Filtering would spread a single missing sample over the whole signal.  The error of linear interpolation over six
    intervals h for a motion of acceleration a is at most ``a (6 h)^2 / 8``: 9 um at 10 kHz in a hard contact
    (`tdbmon.record.one_time.HARD_CONTACT`).

    Returns
    -------
    xarray.Dataset
        The channel attributes ``repaired`` and ``nan_left`` count the samples filled and those still missing, where
        there are any.
    """
    out = ds.copy()
    for name in ds.data_vars:
        values = ds[name].values
        bad = ~np.isfinite(values)
        if not bad.any() or bad.all():
            continue
        runs = runs_of(bad)
        inside = (runs.first > 0) & (runs.first + runs.length < values.size)
        short = runs.where(inside & (runs.length <= SHORT_GAP))
        fill = short.mask(values.size)
        time = times_of(ds[name])
        repaired = np.where(bad, np.nan, values)
        repaired[fill] = np.interp(time[fill], time[~bad], values[~bad])
        out[name] = (ds[name].dims, repaired, {**ds[name].attrs, "repaired": int(fill.sum())})
        if left := int(bad.sum() - fill.sum()):
            out[name].attrs["nan_left"] = left
    return out


def same_name(one: str, other: str) -> bool:
    """Return whether two machine names are equal, ignoring case and white space."""
    return "".join(one.split()).casefold() == "".join(other.split()).casefold()


def names_another(ds: xr.Dataset, machine: Machine) -> str:
    """Return a message if the record names a different machine than the machine file; "" otherwise."""
    stated = str(ds.attrs.get("machine", ""))
    if not stated or same_name(stated, machine.name):
        return ""
    return (
        f"the record names machine '{stated}', the machine file '{machine.name}': use the machine file of that machine, or,"
        " if both are the same machine, write the record's name into the machine file"
    )


def _machine(ds: xr.Dataset, machine: Machine) -> list[Check]:
    """Compare the machine name in the record, if there is one, with that of the machine file."""
    if not ds.attrs.get("machine"):
        return []
    another = names_another(ds, machine)
    return [Check("machine", "", not another, another or "the record names this machine")]


def _missing(name: str, ds: xr.Dataset, machine: Machine) -> Check:
    channel = machine.channel_in_file(name)
    unused = [str(other) for other in ds.attrs.get("unused", ())]
    also = f"; unused channels of the file: {', '.join(unused[:8])}" if unused else ""
    hint = did_you_mean(channel, unused)
    also += hint if "did you mean" in hint else ""
    if name == "speed":
        follows = "the speed comes from the keyphasor" if "keyphasor" in ds else "the speed is not evaluated"
    elif name == "keyphasor":
        follows = "there is no shaft angle, so the phase of the unbalance is unknown"
    else:
        end = next(probe.end for probe in machine.probes if probe.name == name)
        left = sum(probe.name in ds for probe in machine.probes_at(end))
        follows = (
            f"end {end} has only {left} of two directions, so no orbit, gap or contacts are determined there"
            if left < 2
            else f"end {end} has {left} probes left"
        )
    fault = ds.attrs.get("left_out", {}).get(channel)
    if fault:
        return Check("present", name, False, f"channel '{channel}' is in the file, but left out: {follows}; {fault}")
    detail = f"channel '{channel}' is not in the file: {follows}; map it in [channels] if it has another name{also}"
    return Check("present", name, False, detail)


def _rates(ds: xr.Dataset, machine: Machine, probes: list[Probe]) -> list[Check]:
    """Return a failed check for the probes that are not on the time base used for analysis."""
    names = [probe.name for probe in probes]
    kept = best_time_base(ds, machine, names)
    if len(kept) == len(names):
        return []

    left = [name for name in names if name not in kept]
    detail = (
        f"left out: {_bases(ds, left)}; analysed: {_bases(ds, list(kept))}. An orbit needs simultaneous readings: record all"
        " probes at one rate, from start to end"
    )
    return [Check("time base", ", ".join(left), False, detail)]


def _bases(ds: xr.Dataset, names: list[str]) -> str:
    """Return a text with the sampling rate and time span of some channels, grouped by time base."""
    found: dict[str, list[str]] = {}
    for name in names:
        found.setdefault(str(ds[name].dims[0]), []).append(name)
    return "; ".join(f"{', '.join(held)} {_sampled(ds[dimension].values)}" for dimension, held in found.items())


def _sampled(time: np.ndarray) -> str:
    if time.size < 2:
        return f"has {time.size} sample"
    return f"at {1 / usual_interval(time):.6g} Hz from {time[0]:.4g} s to {time[-1]:.4g} s"


def _ends_early(ds: xr.Dataset, probes: list[Probe]) -> list[Check]:
    """Return failed checks for speed or keyphasor if they end long before the probes, as if the logger was cut off.

    A slowly sampled channel may end up to one interval earlier.
    """
    last = max((float(ds[ds[probe.name].dims[0]][-1]) for probe in probes), default=0.0)
    found = []
    for name in ("speed", "keyphasor"):
        time = times_of(ds[name]) if name in ds else np.array([last])
        end, interval = float(time[-1]), usual_interval(time) if time.size > 1 else 0.0
        if end < _WHOLE * last and last - end > LONG * interval:
            detail = (
                f"ends at {end:.5g} s, but the probes end at {last:.5g} s: its last part is missing; was the logger cut off?"
            )
            found.append(Check("time base", name, False, detail))
    return found


def _sampling(ds: xr.Dataset, dimension: str, probes: set[str]) -> Check:
    """Check a time base (named by its channels if there are several); the minimum rate for contacts applies to probes only."""
    held = [str(name) for name in ds.data_vars if ds[name].dims == (dimension,)]
    base = dimension if len(ds.sizes) == 1 else ", ".join(held)
    time = ds[dimension].values
    if time.size < 2:
        return Check("sampling", base, False, f"{time.size} sample; export the whole record")
    intervals = np.diff(time)
    interval = float(np.median(intervals))
    long = intervals > LONG * interval
    gaps, lost = runs_of(long), intervals[long]
    jitter = float(np.std(intervals[~long]))
    rate = 1 / usual_interval(time)
    faulty = []
    if len(gaps):
        at = time[gaps.first[0]]
        faulty.append(
            f"{counted(lost.size, 'gap')} in time, the longest {lost.max() * 1e3:.3g} ms, the first at {at:.5g} s:"
            " analyse the parts separately, or export again without gaps"
        )
    if jitter > _UNEVEN * interval:
        faulty.append(
            f"sampling intervals vary by {percent(jitter / interval, 1)}: spectra are blurred; use the logger's own clock"
        )
    if rate < (1 - _ROUNDING) * _SLOWEST and not probes.isdisjoint(held):
        faulty.append(f"a contact of 2 ms has {2e-3 * rate:.1f} samples: record at {_SLOWEST / 1e3:g} kHz or more")
    detail = f"{rate:.6g} Hz, {time.size} samples, {time[-1] - time[0]:.4g} s"
    detail += f"; {ds[dimension].attrs['counted']}" if "counted" in ds[dimension].attrs else ""
    return Check("sampling", base, not faulty, "; ".join([detail, *faulty]))


def _signal(ds: xr.Dataset, still: Check) -> list[Check]:
    """Check that a channel has values and that they change; `still` is the result for a constant channel."""
    name = still.channel
    signal = faults.prepare(ds[name].values)
    changes = signal.quantum != 0.0
    return [
        missing_samples(name, times_of(ds[name]), signal),
        Check("dead", name, True, "changes") if changes else still,
    ]


def _keyphasor(ds: xr.Dataset, machine: Machine, marks: Pulses) -> Check:
    """Check the keyphasor pulses; pulses missed within gaps of the time axis are not a fault."""
    count = machine.keyphasor.pulses_per_revolution if machine.keyphasor is not None else 1
    if marks.times.size < 2 and stands(ds):
        return Check("keyphasor", "keyphasor", True, f"{marks.quality}; the speed signal shows standstill")
    if marks.times.size < 2:
        doubt = f"pulses_per_revolution = {count} in [keyphasor] and " if count > 1 else ""
        detail = f"{marks.quality}; without pulses there is no shaft angle: check {doubt}the sensor's gap"
        return Check("keyphasor", "keyphasor", False, detail)
    if marks.missed > 0 and marks.missed == marks.in_holes and marks.extra == 0:
        return Check("keyphasor", "keyphasor", True, f"{marks.quality}; all missed pulses lie in gaps of the time axis")
    wanted = sampling_for_pulses(ds, machine)
    faulty = marks.missed + marks.extra > 0
    cure = (
        "; this was corrected for in the shaft angle: check the sensor's gap and the mark" if faulty else ""
    )
    if faulty and wanted is not None:
        cure = f"; {shorter_than_a_sample(wanted)}"
    return Check("keyphasor", "keyphasor", not faulty, marks.quality + cure)
