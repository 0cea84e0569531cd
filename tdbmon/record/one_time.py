"""Resampling of probes that a logger stored on several time bases to a common one.

Loggers may stop their channels a few samples apart, and a multiplexed converter samples them one after the other.  An orbit
needs simultaneous readings of both probes of an end.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
import xarray as xr
from tdbsim.machine import Machine

from tdbmon.record.finding import Check
from tdbmon.record.samples import times_of
from tdbmon.record.timebase import LONG, usual_interval

_ONE_RATE = 0.01  # relative: sampling rates this close are equal except for clock drift
_EXACT = 1e-3  # of an interval: a sample this close is used without interpolation
_APART = 0.05  # of an interval: a smaller drift between two clocks over a record is rounding of the time stamps
_LEAST = 0.5  # of the record: the others are not cut to a probe that covers less
_MANY = 0.01  # of the record: a smaller loss is negligible
# m/s^2 of a shaft in a hard contact: after a fall through 250 um it arrives at 0.07 m/s and, leaving after 2 ms, has
# 110 m/s^2; with whirl and bending up to twice as much
HARD_CONTACT = 200.0


def on_one_time(ds: xr.Dataset, machine: Machine) -> tuple[xr.Dataset, list[Check]]:
    """Resample probes of equal rate to the time base that most of them have, over the interval that all cover.

    A probe sampled between those times is interpolated linearly: over a sampling interval h the error for a motion of
    acceleration a is at most ``a h^2 / 8``.

    Parameters
    ----------
    ds : Dataset
        Channels under their machine names.
    machine : Machine

    Returns
    -------
    ds : Dataset
        Probes of equal rate on one dimension; everything else unchanged.
    remarks : list of Check
        What was cut or interpolated; passed if it is negligible.
    """
    remarks: list[Check] = []
    for names in _of_one_rate(ds, [probe.name for probe in machine.probes if probe.name in ds]):
        leading = Counter(str(ds[name].dims[0]) for name in names).most_common(1)[0][0]
        reference = ds[leading].to_numpy()
        owns = {name: times_of(ds[name]) for name in names}
        owns = {name: own for name, own in owns.items() if _overlap(reference, own) > _LEAST}
        if len({ds[name].dims for name in owns}) < 2:
            continue
        common = _common(reference, list(owns.values()))
        target = leading if len(common) == reference.size else f"{leading} in common"
        remarks += _cut(owns, reference, common)
        lead = next(name for name in owns if ds[name].dims == (leading,))
        moved = {}
        for name, own in owns.items():
            values, between = _read_at(common, own, ds[name].to_numpy())
            moved[name] = xr.Variable(target, values, ds[name].attrs, None if between else ds[name].encoding)
            if between:
                remarks.append(_between(name, lead, own, common))
        ds = ds.assign_coords({target: (target, common, ds[leading].attrs)}).assign(moved)
    return ds, remarks


def best_time_base(ds: xr.Dataset, machine: Machine, names: Sequence[str]) -> tuple[str, ...]:
    """Return those of the probes `names` that share the best time base: the one with orbits of most ends, then the fastest.

    Probes sampled at two rates give no orbit, and a contact missed by the slower one cannot be recovered.
    """
    bases: dict[str, list[str]] = {}
    for name in names:
        bases.setdefault(str(ds[name].dims[0]), []).append(name)
    if len(bases) < 2:
        return tuple(names)

    def worth(dimension: str) -> tuple[int, float, int]:
        held = bases[dimension]
        pairs = sum(sum(probe.name in held for probe in machine.probes_at(end)) > 1 for end in machine.ends)
        return pairs, -_interval(ds[dimension].values), len(held)

    return tuple(bases[max(bases, key=worth)])


def _interval(time: np.ndarray) -> float:
    return usual_interval(time) if time.size > 1 else np.inf


def _of_one_rate(ds: xr.Dataset, names: list[str]) -> list[list[str]]:
    groups: list[tuple[float, list[str]]] = []
    for name in names:
        interval = _interval(times_of(ds[name]))
        known = next((held for each, held in groups if abs(interval / each - 1) < _ONE_RATE), None)
        if known is not None:
            known.append(name)
        elif np.isfinite(interval):
            groups.append((interval, [name]))
    return [held for _, held in groups]


def _overlap(reference: np.ndarray, time: np.ndarray) -> float:
    """Return the fraction of a time base that another one covers."""
    return float((min(reference[-1], time[-1]) - max(reference[0], time[0])) / (reference[-1] - reference[0]))


def _common(reference: np.ndarray, times: list[np.ndarray]) -> np.ndarray:
    margin = _EXACT * _interval(reference)
    first, last = max(time[0] for time in times), min(time[-1] for time in times)
    return reference[(reference >= first - margin) & (reference <= last + margin)]


def _read_at(wanted: np.ndarray, time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, bool]:
    """Return values at the wanted times, NaN within a gap in time, and whether any of them was interpolated."""
    usual = _interval(time)
    after = np.clip(np.searchsorted(time, wanted - _EXACT * usual), 1, time.size - 1)
    step = time[after] - time[after - 1]
    share = (wanted - time[after - 1]) / step
    between = (share > _EXACT) & (share < 1 - _EXACT)
    line = values[after - 1] + share * (values[after] - values[after - 1])
    out = np.where(share < 0.5, values[after - 1], values[after])
    out = np.where(between, np.where(step > LONG * usual, np.nan, line), out)
    return out, bool(between.any())


def _cut(owns: dict[str, np.ndarray], reference: np.ndarray, common: np.ndarray) -> list[Check]:
    """Return a remark on each probe that begins late or ends early by its times in `owns`, so that the others are cut."""
    found = []
    for name, own in owns.items():
        lacks = int(np.sum(reference < own[0]) + np.sum(reference > own[-1]))
        # a probe sampled between the others' times lacks a sample at their first or last time
        granted = 1 if own.size == reference.size else 0
        if lacks <= granted:
            continue
        lost = reference.size - common.size
        detail = (
            f"has samples only from {own[0]:.5g} s to {own[-1]:.5g} s: all probes at its rate are analysed from"
            f" {common[0]:.5g} s to {common[-1]:.5g} s, and {lost} of {reference.size} samples are left out"
        )
        found.append(Check("time base", name, bool(lost < _MANY * reference.size), detail))
    return found


def _between(name: str, lead: str, own: np.ndarray, common: np.ndarray) -> Check:
    usual = _interval(common)
    late = (own[0] - common[0] + usual / 2) % usual - usual / 2
    drift = (_interval(own) / usual - 1) * (own[-1] - own[0])
    when = f"{abs(late) * 1e6:.3g} us {'after' if late > 0 else 'before'} {lead}"
    if abs(drift) > _APART * usual:
        when = f"by a clock that drifts relative to that of {lead} by {abs(drift) * 1e6:.3g} us over the record"
    detail = (
        f"is sampled {when}: it is interpolated linearly to the times of"
        f" {lead}, accurate to {HARD_CONTACT * usual**2 / 8 * 1e6:.2g} um"
        f" at {HARD_CONTACT:g} m/s^2, as in a hard contact"
    )
    return Check("time base", name, True, detail)
