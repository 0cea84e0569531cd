"""Do the probes see a world in which things fall down?  A check on their directions, by the record itself.

Gravity is the one force whose direction is known: the shaft must come to rest at the bottom of the clearance.  (That the
levitated orbit goes with the rotation is checked at the door, in `tdbmon.record.direction_checks`.)
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

_BOTTOM_DEG = 20.0  # friction and an uneven seat let a rotor rest a little beside the bottom
_NEARER = 0.5  # times the angle that a cause must leave at most, beside being within that


def check_orientation(
    planes: xr.Dataset,
    record: xr.Dataset,
    machine: Machine,
    release_s: float | None,
    back: Mapping[str, str],
    checks: Sequence[Check] = (),
    whirl: Mapping[str, Whirl] | None = None,
) -> list[Check]:
    """Check the rest position of each end.

    Parameters
    ----------
    planes : Dataset
        Result of `to_planes`.
    record : Dataset
        Probes in m (for trying other directions).
    machine : Machine
    release_s : float or None
        The release; the record's start where it is not known.
    back : mapping
        What `returned` says of each end.
    checks : sequence of Check
        Of the channels: an end with a probe out of its range or cut off is not accused, for that says where to look first.
        Where the levitated orbit goes with the rotation, a single inversion or an exchange alone is none.
    whirl : mapping, optional
        Whirl of the ends: one that whirls when the record ends is not at rest.

    Returns
    -------
    list of Check
        One row an end; a failed one names the likely cause.  An end that is back where it levitated has the row "stays down"
        instead: that tells nothing of directions.  None where the record ends before the shaft is at rest: while it whirls,
        or bounces so widely that its mean place is no place of rest.
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
    """True where the shaft moves (rms) wider than its mean place lies from where it levitated, or else the probes' zero."""
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
    """Angle of a position from straight down, degrees, positive towards +x."""
    return float(np.rad2deg(np.arctan2(rest[0], -rest[1])))


def _likely_cause(
    end: str, record: xr.Dataset, machine: Machine, release_s: float | None, samples: int, forward: bool | None
) -> str:
    """Try a zero that is off, then inverted, swapped and turned probes; name what would put the shaft at the bottom.

    `forward` says whether the levitated orbit goes with the rotation, which an odd number of faults would turn about.
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
        return f"yet it fell straight down: a probe's zero is off ({before} while it levitated), check its offset"
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
        if min(signs) < 0:  # holds of readings in volts and in um; a sensitivity would tell nothing of the latter
            turned = " and ".join(f"'{p.name}'" for p, s in zip(probes, signs, strict=True) if s < 0)
            cures.append(f"add 180 deg to the angle of {turned}")
        found.append((swap + signs.count(-1), " and ".join(parts), " and ".join(cures)))
    if found:
        _, cause, cure = min(found)
        return f"likely {cause}: check the cabling, or, in the machine file, {cure}"
    return f"the probes' angles look {-seen:+.0f} deg off: check them against the drawing"


def _levitated(probes: list[Probe], record: xr.Dataset, release_s: float | None) -> np.ndarray | None:
    """Return what the probes read before the release, m; None where the record does not show it."""
    if release_s is None:
        return None
    before = [record[p.name].to_numpy()[times_of(record[p.name]) < release_s] for p in probes]
    if not all(np.isfinite(values).any() for values in before):
        return None
    return np.array([float(np.nanmean(values)) for values in before])
