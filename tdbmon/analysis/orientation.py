"""Check of the probe orientations by the record itself: the shaft must come to rest at the bottom of the clearance.

Gravity is the only force whose direction is known.  (Whether the levitated orbit is forward is checked when the record is
read, in `tdbmon.record.direction_checks`.)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np
import xarray as xr
from tdbsim.machine import Machine, Probe

from tdbmon.analysis.returned import BOUNCING_S, at_rest
from tdbmon.analysis.whirl import Whirl
from tdbmon.record.finding import Check
from tdbmon.record.samples import times_of

_BOTTOM_DEG = 20.0  # friction and an uneven seat may hold a rotor slightly off the bottom
_NEARER = 0.5  # a cause must also reduce the angle from the bottom to this share at most


def check_orientation(
    planes: xr.Dataset,
    record: xr.Dataset,
    machine: Machine,
    release_s: float | None,
    back: Mapping[str, str],
    checks: Sequence[Check] = (),
    whirl: Mapping[str, Whirl] | None = None,
) -> list[Check]:
    """Check that the rest position of each end is at the bottom of its clearance.

    Parameters
    ----------
    planes : Dataset
        Result of `to_planes`.
    record : Dataset
        Probes in m (to test other orientations).
    machine : Machine
    release_s : float or None
        The release, s; None if unknown, and the start of the record is used.
    back : mapping
        Result of `returned` for each end.
    checks : sequence of Check
        Of the channels: an end with a probe out of range or clipped gets no failed check, since that is the first thing to
        mend.  If the levitated orbit is forward, a single inverted probe or an exchange alone is ruled out.
    whirl : mapping, optional
        Whirl of the ends: one that whirls when the record ends is not at rest.

    Returns
    -------
    list of Check
        One check per end; a failed one names the likely cause.  An end that has returned to its levitated position has the
        check "stays down" instead, as it says nothing about orientation.  No check if the record ends before the shaft is at
        rest: while it whirls, or bounces so widely that its mean position is no rest position.
    """
    rows: list[Check] = []
    time = planes.time.to_numpy()
    start = float(time[0]) if release_s is None else release_s
    if time[-1] - start < BOUNCING_S:
        return rows
    out_of_range = {check.channel for check in checks if check.check in ("range", "clipping") and not check.passed}
    for end in machine.ends:
        xy = planes.displacement.sel(end=end).to_numpy()
        if not np.isfinite(xy).any():
            continue
        if back.get(end):
            rows.append(Check("stays down", end, False, back[end]))
            continue
        tail = at_rest(time, xy, start)
        if not np.isfinite(tail).any():
            continue
        if whirl is not None and end in whirl and whirl[end].last_s > time[-tail.shape[1]]:
            continue
        rest = np.nanmean(tail, axis=1)
        if _restless(tail, rest, xy[:, time < start]):
            continue
        forward = next((check.passed for check in checks if (check.check, check.channel) == ("whirl", end)), None)
        row = _rest_row(end, rest, record, machine, release_s, len(tail[0]), forward)
        if row.passed or not out_of_range.intersection(probe.name for probe in machine.probes_at(end)):
            rows.append(row)
    return rows


def _restless(tail: np.ndarray, rest: np.ndarray, before: np.ndarray) -> bool:
    """Return True if the rms motion exceeds the distance of the mean position from the levitated one (or the probes' zero)."""
    levitated = np.nanmean(before, axis=1) if np.isfinite(before).all(axis=0).any() else np.zeros(2)
    moves = np.sqrt(np.nanmean(np.sum((tail - rest[:, None]) ** 2, axis=0)))
    return bool(moves > np.hypot(*(rest - levitated)))


def _rest_row(
    end: str,
    rest: np.ndarray,
    record: xr.Dataset,
    machine: Machine,
    release_s: float | None,
    samples: int,
    forward: bool | None,
) -> Check:
    angle = _from_bottom(rest)
    where = f"at rest the shaft lies {np.hypot(*rest) * 1e6:.0f} um from the probes' zero, {round(angle):+d} deg from the bottom"
    if abs(angle) <= _BOTTOM_DEG:
        return Check("rest at the bottom", end, True, where)
    cause = _likely_cause(end, record, machine, release_s, samples, forward)
    return Check("rest at the bottom", end, False, f"{where}; {cause}")


def _from_bottom(rest: np.ndarray) -> float:
    """Return the angle of a position from straight down, degrees, positive towards +x."""
    return float(np.rad2deg(np.arctan2(rest[0], -rest[1])))


def _likely_cause(
    end: str, record: xr.Dataset, machine: Machine, release_s: float | None, samples: int, forward: bool | None
) -> str:
    """Return the cause that would put the shaft at the bottom: a zero offset, then inverted, swapped or rotated probes.

    `forward` is whether the levitated orbit is forward, which an odd number of faults would reverse; None if unknown.
    """
    probes = [p for p in machine.probes_at(end) if p.name in record]
    if len(probes) != 2:
        return "check the probes' angles and signs"
    readings = np.array([float(np.nanmean(record[p.name].to_numpy()[-samples:])) for p in probes])
    angles = np.array([p.angle for p in probes])
    directions = np.column_stack([np.cos(angles), np.sin(angles)])
    seen = _from_bottom(np.linalg.solve(directions, readings))

    def at_bottom(read: np.ndarray) -> bool:
        left = abs(_from_bottom(np.linalg.solve(directions, read)))
        return left <= min(_BOTTOM_DEG, _NEARER * abs(seen))

    levitated = _levitated(probes, record, release_s)
    if levitated is not None and at_bottom(readings - levitated):
        before = " and ".join(f"{p.name} {v * 1e6:+.0f} um" for p, v in zip(probes, levitated, strict=True))
        return f"yet it fell straight down: the zero of a probe is wrong ({before} in levitation), check its offset"
    found = []
    for swap, signs in product((False, True), product((1, -1), repeat=2)):
        tried = (readings[::-1] if swap else readings) * np.array(signs)
        mirrored = swap != (signs[0] * signs[1] < 0)
        if not at_bottom(tried) or forward is mirrored:
            continue
        parts = [f"probe '{p.name}' is inverted" for p, s in zip(probes, signs, strict=True) if s < 0]
        if max(signs) < 0:
            parts = [f"probes '{probes[0].name}' and '{probes[1].name}' are both inverted"]
        if swap:
            parts.insert(0, f"probes '{probes[0].name}' and '{probes[1].name}' are swapped")
        cures = ["exchange their channels in [channels]"] if swap else []
        if min(signs) < 0:  # valid for readings in V and in um; the sign of a sensitivity would not affect the latter
            turned = " and ".join(f"'{p.name}'" for p, s in zip(probes, signs, strict=True) if s < 0)
            cures.append(f"add 180 deg to the angle of {turned}")
        found.append((swap + signs.count(-1), " and ".join(parts), " and ".join(cures)))
    if found:
        _, cause, cure = min(found)
        return f"likely {cause}: check the cabling, or, in the machine file, {cure}"
    return f"the probes' angles look {-seen:+.0f} deg off: check them against the drawing"


def _levitated(probes: list[Probe], record: xr.Dataset, release_s: float | None) -> np.ndarray | None:
    """Return the mean probe readings before the release, m; None if the record does not show them."""
    if release_s is None:
        return None
    before = [record[p.name].to_numpy()[times_of(record[p.name]) < release_s] for p in probes]
    if not all(np.isfinite(values).any() for values in before):
        return None
    return np.array([float(np.nanmean(values)) for values in before])
