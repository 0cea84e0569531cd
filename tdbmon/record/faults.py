"""Detection of faults in a sampled signal: runs of frozen samples, clipped peaks, spikes and level steps.

Pure functions of arrays; their findings are interpreted for a machine in `tdbmon.record.quality`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tdbmon.runs import Runs, runs_of

_FLAT = 10  # equal samples in a moving signal that cannot be a coincidence
_TOP = 3  # equal samples at an extreme value that cannot be a turning point
_CLIPPED = 5  # equal samples at an extreme below full scale: fewer may be a quantised peak
_SPIKE = 5  # longest spike, samples
_ABRUPT = 5  # quanta between neighbouring samples: distinguishes motion from flicker of the last digit
_MANY = 10_000  # steps used to estimate the typical step
_AROUND = 50  # samples on either side of a run used to judge whether the signal moves


@dataclass(frozen=True)
class Signal:
    """A channel with its first differences, resolution and constant runs, computed once for all searches.

    Parameters
    ----------
    values : numpy.ndarray, shape (n,)
        Samples, NaN where missing.
    steps : numpy.ndarray, shape (n - 1,)
        First differences.
    quantum : float
        Smallest nonzero absolute difference between neighbours: the resolution of a quantised signal.
    flat : Runs
        Runs of at least three equal samples.
    """

    values: np.ndarray
    steps: np.ndarray
    quantum: float
    flat: Runs


def prepare(values: np.ndarray) -> Signal:
    """Return a channel prepared for the search; infinite samples count as missing."""
    if np.isinf(values).any():
        values = np.where(np.isfinite(values), values, np.nan)
    steps = np.diff(values)
    size = np.abs(steps)
    moving = size[size > 0]
    # differences of 1e-16 come from rounding of decimals, not from resolution; the quantile ignores a step to 1e30 and back
    usual = float(np.quantile(moving[:: moving.size // _MANY + 1], 0.9)) if moving.size else 0.0
    moving = moving[moving > 1e-9 * usual]
    quantum = float(moving.min()) if moving.size else 0.0
    equal = runs_of(steps == 0)
    equal = equal.where(equal.length >= _TOP - 1)
    return Signal(values, steps, quantum, Runs(equal.first, equal.length + 1))


def clipped_runs(signal: Signal, full_scale: tuple[float, float] | None) -> Runs:
    """Return runs of equal samples at full scale, or at the largest or smallest value if it is reached abruptly."""
    flat = signal.flat
    if not len(flat) or signal.quantum == 0.0:
        return Runs(np.empty(0, dtype=int), np.empty(0, dtype=int))
    level = signal.values[flat.first]
    extreme = (level == np.nanmax(signal.values)) | (level == np.nanmin(signal.values))
    entry, leave = _neighbouring_steps(signal, flat)
    abrupt = np.maximum(entry, leave) >= _ABRUPT * signal.quantum
    clipped = extreme & abrupt & (flat.length >= _CLIPPED)
    if full_scale is not None:
        margin = 1e-6 * (full_scale[1] - full_scale[0]) + 0.5 * signal.quantum
        clipped |= (level >= full_scale[1] - margin) | (level <= full_scale[0] + margin)
    return flat.where(clipped)


def frozen_runs(signal: Signal) -> Runs:
    """Return long runs of equal samples in a signal that moves by much more than its resolution before or after."""
    flat = signal.flat.where(signal.flat.length >= _FLAT)
    if not len(flat):
        return flat
    # no longer than the run: a coarsely quantised signal is also constant for a while at its turning points
    beside, last = np.minimum(flat.length, _AROUND), flat.first + flat.length - 1
    sides = ((flat.first - beside, flat.first), (last, last + beside))
    moves = [_usual_step(signal.steps, *side) >= 3 * signal.quantum for side in sides]
    return flat.where(moves[0] | moves[1])


def _usual_step(steps: np.ndarray, first: np.ndarray, stop: np.ndarray) -> np.ndarray:
    """Return the median absolute step in stretches of at most `_AROUND` steps; NaN if there are too few or none is known."""
    first, stop = np.maximum(first, 0), np.minimum(stop, steps.size)
    at = first[:, None] + np.arange(_AROUND)
    size = np.where(at < stop[:, None], np.abs(steps[np.minimum(at, steps.size - 1)]), np.nan)
    size.sort(axis=1)  # NaN is sorted last
    known, row = np.isfinite(size).sum(axis=1), np.arange(len(first))
    middle = 0.5 * (size[row, np.maximum(known - 1, 0) // 2] + size[row, known // 2])
    return np.where(stop - first >= _FLAT, middle, np.nan)


def jumped_runs(signal: Signal, runs: Runs) -> np.ndarray:
    """Tell which runs are entered and left by a jump much larger than the steps of the adjacent samples.

    A clipped peak, in contrast, is entered and left at the signal's own rate of change.
    """
    size = np.abs(np.nan_to_num(signal.steps))
    jumped = np.zeros(len(runs), dtype=bool)
    for i, (first, length) in enumerate(zip(runs.first, runs.length, strict=True)):
        entry, leave = first - 1, first + length - 1  # of the steps
        sides = [(entry, size[max(entry - 3, 0) : max(entry, 0)]), (leave, size[leave + 1 : leave + 4])]
        within = [(at, beside) for at, beside in sides if 0 <= at < size.size and beside.size]
        jumped[i] = bool(within) and all(
            size[at] > max(3 * beside.max(), _ABRUPT * signal.quantum) for at, beside in within
        )
    return jumped


def spikes(signal: Signal, height: float) -> Runs:
    """Return the runs of up to five samples that deviate from both neighbours by more than `height` to the same side.

    The first and the last sample have one neighbour only.
    """
    size = np.abs(signal.steps)
    found: dict[int, int] = {}
    for width in range(1, _SPIKE + 1):
        rise, fall = signal.steps[:-width], signal.steps[width:]
        out = np.minimum(np.abs(rise), np.abs(fall))
        alone = (rise * fall < 0) & (out > height) & (np.abs(rise + fall) < 0.3 * out)
        for i in np.flatnonzero(alone):
            # in a slow record a bounce may last a few samples only, but the velocity does not triple from step to step
            beside = np.concatenate(
                (size[max(i - 3, 0) : i], size[i + 1 : i + width], size[i + width + 1 : i + width + 4])
            )
            if out[i] > 3 * np.nanmax(beside, initial=0.0):
                found.setdefault(int(i) + 1, width)
    for first, at, beside in ((0, 0, size[1:4]), (size.size, -1, size[-4:-1])):
        if beside.size == 3 and size[at] > max(height, 3 * np.nanmax(beside, initial=0.0)):
            found.setdefault(first, 1)
    return Runs(np.array(sorted(found), dtype=int), np.array([found[i] for i in sorted(found)], dtype=int))


def level_steps(signal: Signal, height: float) -> np.ndarray:
    """Return the indices at which the signal jumps by more than `height` from the previous sample to a new lasting level.

    Owing to its inertia, a rotor cannot triple its velocity for one sample only.
    """
    size = np.abs(signal.steps)
    found = []
    for i in np.flatnonzero(size > height):
        beside = np.concatenate((size[max(i - 3, 0) : i], size[i + 1 : i + 4]))
        if beside.size == 0 or not size[i] > 3 * np.nanmax(beside, initial=0.0):
            continue
        before, after = signal.values[max(i - 9, 0) : i + 1], signal.values[i + 1 : i + 11]
        if abs(np.nanmedian(after) - np.nanmedian(before)) > 0.7 * size[i]:
            found.append(int(i) + 1)
        if len(found) > 100:
            break
    return np.array(found, dtype=int)


def _neighbouring_steps(signal: Signal, runs: Runs) -> tuple[np.ndarray, np.ndarray]:
    size = np.abs(np.nan_to_num(signal.steps))
    end = runs.first + runs.length - 1
    entry = np.where(runs.first > 0, size[np.maximum(runs.first - 1, 0)], 0.0)
    leave = np.where(end < size.size, size[np.minimum(end, size.size - 1)], 0.0)
    return entry, leave
