"""Score test with trials of finite size: which suspects would explain the residuals of a fit.

Each suspect is put into the fitted model at a trial size, and every drop is simulated again.  The changes of the residuals,
projected orthogonally to the Jacobian of the fitted values, are fitted to the residuals.  The gain is the reduction of the
sum of squares: C. R. Rao's score test (Proc. Camb. Phil. Soc. 44 (1948) 50) with finite differences, since effects are not
small and contacts not smooth.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from tdbsim.drop_model import with_effects
from tdbsim.effect import Effect
from tdbsim.effect import Parameter as Declared
from tdbsim.errors import InputError

from tdbmon.diagnosis.beside_values import beside_values
from tdbmon.diagnosis.effect_size import scaled, sized
from tdbmon.diagnosis.suspects import Start, Suspect
from tdbmon.identify.least_squares import Fit
from tdbmon.identify.parameters import with_values
from tdbmon.identify.problem import Problem
from tdbmon.identify.variants import Variant, changes

Array = NDArray[np.float64]

_SIZES = (0.3, 1.0)  # trial sizes, multiples of the typical size
QUARTER = (0, 2)  # eighths of a period: for small sizes every angle is a combination of these two
_LARGE = 2.5  # further trial size of a ball
FURTHEST = 4.0  # multiples of the trial size up to which a trial is extrapolated


@dataclass(frozen=True, eq=False)
class Score:
    """The score of a suspect.

    Attributes
    ----------
    suspect : Suspect
    gain : float
        Reduction of the sum of squares, in units of the spread of the residuals.
    total : float
        Sum of squares orthogonal to the Jacobian: the greatest possible gain.
    start : Start
        Start point of its fit.
    """

    suspect: Suspect
    gain: float
    total: float
    start: Start

    def beyond(self, price: float) -> float:
        """Return its gain less the price of its parameters, `price` each."""
        return self.gain - self.start.free(self.suspect).freedom * price


def scores(problem: Problem, fitted: Fit, horizon: float, suspects: Sequence[Suspect]) -> list[Score]:
    """Return the suspects' scores at a fitted point, the highest first.

    Parameters
    ----------
    problem : Problem
    fitted : Fit
        To the horizon.
    horizon : float
        s after the release.
    suspects : sequence of Suspect
    """
    beside = beside_values(problem, fitted)
    tried = problem.crew.apart(
        changes_by,
        [(problem, fitted.point, drop, horizon, suspects, weight) for drop, weight in enumerate(beside.weights)],
    )
    target = _Target(beside.basis, beside.begin, beside.left)
    found = [_score(target, suspect, [drop[k] for drop in tried]) for k, suspect in enumerate(suspects)]
    return sorted((each for each in found if each is not None), key=lambda each: -each.gain)


@dataclass(frozen=True, eq=False)
class _Target:
    """What trials are fitted to: basis of the Jacobian (rows, n), first row of each drop, residuals orthogonal to the basis."""

    basis: Array
    begin: NDArray[np.intp]
    left: Array

    def solve(self, columns: Sequence[Mapping[int, Array]]) -> tuple[Array, float]:
        """Return the least-squares amounts of the columns, limited to `FURTHEST`, and their gain.

        Parameters
        ----------
        columns : sequence of mapping
            Changes of the drops' residuals by drop number.
        """
        spans = [slice(*self.begin[k : k + 2]) for k in range(len(self.begin) - 1)]
        fitted = [sum((self.basis[spans[d]].T @ c for d, c in each.items()), np.zeros(1)) for each in columns]
        toward = -np.array([sum(float(c @ self.left[spans[d]]) for d, c in each.items()) for each in columns])
        square = np.empty((len(columns), len(columns)))
        for i, one in enumerate(columns):
            for j, other in enumerate(columns):
                shared = sum(float(c @ other[d]) for d, c in one.items() if d in other)
                square[i, j] = shared - float(fitted[i] @ fitted[j])
        amounts = np.linalg.solve(square + (1e-9 * float(np.trace(square)) + 1e-30) * np.eye(len(square)), toward)
        # a trial is extrapolated no further than this
        size = float(np.max(np.abs(amounts)))
        if size > FURTHEST:
            amounts = amounts * (FURTHEST / size)
        return amounts, float(2 * amounts @ toward - amounts @ square @ amounts)


Key = tuple[float, ...]
Trials = Mapping[Key, Array | None]


def trial_keys(suspect: Suspect) -> list[Key]:
    """Return the keys of a suspect's trials: index of the size, share of it, angle in eighths of a period, number of the ball."""
    counts = range(1, int(min(suspect.counted.high, 60)) + 1) if suspect.counted else [0]
    eighths = range(8) if suspect.turning else QUARTER
    return [
        (float(s), share, float(eighth), float(count))
        for s, (_, angle) in enumerate(suspect.sizes)
        for share, eighth, count in product(_shares(suspect), eighths if angle else (0,), counts)
    ]


def _shares(suspect: Suspect) -> tuple[float, ...]:
    """Return the trial sizes, shares of the typical one: the number of a ball shows at its full size only."""
    if suspect.counted is not None:
        return (*_SIZES, _LARGE)
    return _SIZES[:1] if any(angle.per_drop for angle in suspect.angles) else _SIZES


def _effect(suspect: Suspect, key: tuple[float, ...]) -> Effect:
    number, share, eighth, count = key
    size, angle = suspect.sizes[int(number)]
    values = {size.name: sized(size, share)}
    if angle is not None:
        values[angle.name] = _turned(angle, eighth)
    if suspect.counted is not None:
        values[suspect.counted.name] = count
    return suspect.effect(values)


def changes_by(
    problem: Problem,
    point: Array,
    drop: int,
    horizon: float,
    suspects: Sequence[Suspect],
    weight: Array,
    keys: Callable[[Suspect], Sequence[Key]] = trial_keys,
) -> list[dict[Key, Array | None]]:
    """Return the change of a drop's weighted residuals by each trial of each suspect; None if it cannot be simulated."""
    shared, own = problem.values(point, drop)
    measured, machine = problem.drops[drop], problem.model.machine
    still, bare = problem.variant(point, drop, horizon), with_values(problem.model, shared)
    found: list[dict[Key, Array | None]] = []
    tried: list[tuple[dict[Key, Array | None], Key, Variant]] = []
    for suspect in suspects:
        found.append({})
        for key in keys(suspect):
            if suspect.counted and key[3] > machine.bearing(suspect.where).balls.count:
                continue
            found[-1][key] = None
            effects = (*still.model.effects, _effect(suspect, key))
            try:
                model = still.model if suspect.declared.acts_on_sensors else with_effects(bare, effects)
                sensors = problem.sensors(effects, shared, own, drop)
            except InputError:
                continue
            tried.append((found[-1], key, Variant(model, still.plan, sensors)))
    _, changed = changes(measured, machine, still, [each for *_, each in tried], horizon)
    for (of_suspect, key, _), change in zip(tried, changed, strict=True):
        of_suspect[key] = None if change is None else weight * change
    return found


def _score(target: _Target, suspect: Suspect, trials: Sequence[Trials]) -> Score | None:
    """Return the best score over a suspect's trial sizes; None if no trial could be simulated or changed any residual."""
    if not any(change is not None and change.any() for trial in trials for change in trial.values()):
        return None  # say a contact cause before the first contact
    best: Score | None = None
    for share in _shares(suspect):
        found = _at_share(target, suspect, trials, share)
        if found is not None and (best is None or found.gain > best.gain):
            best = found
    return best


def _at_share(target: _Target, suspect: Suspect, trials: Sequence[Trials], share: float) -> Score | None:
    if suspect.counted is not None or suspect.turning:
        return _chosen(target, suspect, trials, share)
    apart = any(angle.per_drop for angle in suspect.angles)
    parts = [(float(s), float(q)) for s, (_, angle) in enumerate(suspect.sizes) for q in (QUARTER if angle else (0,))]
    columns: list[dict[int, Array]] = []
    for s, q in parts:
        each = [trial.get((s, share, q, 0.0)) for trial in trials]
        columns.append({drop: change for drop, change in enumerate(each) if change is not None})
        if len(columns[-1]) < len(trials):
            return None
    if apart:
        solved = [target.solve([{drop: c[drop]} for c in columns]) for drop in range(len(trials))]
        amounts = [amount for amount, _ in solved]
        gain = sum(gain for _, gain in solved)
    else:
        one, gain = target.solve(columns)
        amounts = [one]
    start = _start(suspect, parts, amounts, share, len(trials))
    if start is None:
        gain = 0.0
        start = _start(suspect, parts, [np.abs(a) for a in amounts], share, len(trials))
    if start is None:
        return None
    return Score(suspect, gain, float(target.left @ target.left), start)


def _chosen(target: _Target, suspect: Suspect, trials: Sequence[Trials], share: float) -> Score | None:
    """Return the score of a drop-specific cause, with the best number or phase in each drop."""
    (size, angle), *_ = suspect.sizes
    # with a phase, half a period is the same as the other sign
    keys = _keys_by_drop(target, trials, share, (1.0,) if angle is not None else (1.0, -1.0))
    if keys is None:
        return None
    column = {drop: change for drop, key in enumerate(keys) if (change := trials[drop][key]) is not None}
    amounts, gain = target.solve([column])
    value = scaled(size, share, float(amounts[0]))
    if value is None or (angle is not None and amounts[0] < 0):  # the phases of the drops contradict each other
        gain, value = 0.0, scaled(size, share, abs(float(amounts[0])))
    if value is None:
        return None
    shared = {p.name: p.typical for p in suspect.shapes} | {size.name: value}
    phases = tuple({angle.name: _turned(angle, key[2])} for key in keys) if angle is not None else ()
    held = tuple({suspect.counted.name: key[3]} for key in keys) if suspect.counted is not None else ()
    return Score(suspect, gain, float(target.left @ target.left), Start(shared, phases, held))


def _keys_by_drop(target: _Target, trials: Sequence[Trials], share: float, signs: Sequence[float]) -> list[Key] | None:
    """Return, for each drop, the trial with the greatest gain by itself; the sign of the size is common to all drops."""
    by_sign: dict[float, list[tuple[float, Key]]] = {sign: [] for sign in signs}
    for drop, trial in enumerate(trials):
        promised = {}
        for key, change in trial.items():
            if key[1] == share and change is not None:
                amount, gain = target.solve([{drop: change}])
                promised[key] = (float(amount[0]), gain)
        if not promised:
            return None
        for sign, picked in by_sign.items():
            right = [(gain, key) for key, (amount, gain) in promised.items() if amount * sign > 0]
            picked.append(max(right, default=(0.0, next(iter(promised)))))
    best = max(by_sign.values(), key=lambda picked: sum(gain for gain, _ in picked))
    return [key for _, key in best]


def _turned(angle: Declared, eighth: float) -> float:
    return eighth * math.pi / 4 / angle.harmonic


def _start(
    suspect: Suspect, parts: Sequence[tuple[float, float]], amounts: Sequence[Array], share: float, drops: int
) -> Start | None:
    """Return the start point that the amounts of the trials give; None if a size has a sign that is not allowed."""
    shared = {p.name: p.typical for p in suspect.shapes}
    each: list[dict[str, float]] = [{} for _ in range(drops)]
    for s, (size, angle) in enumerate(suspect.sizes):
        rows = [k for k, part in enumerate(parts) if part[0] == s]
        if angle is None:
            value = scaled(size, share, float(np.mean([a[rows[0]] for a in amounts])))
            if value is None:
                return None
            shared[size.name] = value
            continue
        vectors = [complex(a[rows[0]], a[rows[1]]) for a in amounts]
        length = float(np.mean(np.abs(vectors)))
        value = scaled(size, share, length)
        if value is None:
            return None
        shared[size.name] = value
        turned = [float(np.angle(v)) / angle.harmonic for v in vectors]
        if angle.per_drop:
            for row, each_turned in zip(each, turned, strict=True):
                row[angle.name] = each_turned
        else:
            shared[angle.name] = turned[0]
    return Start(shared, tuple(each) if each[0] else ())
