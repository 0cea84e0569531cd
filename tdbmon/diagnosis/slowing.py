"""How the rotor slows after paths have parted, and a ring that is hard to turn, which shows in nothing else.

Where the shaft is in its gap can be followed for some tens of milliseconds only, since paths with impacts part.  How far it
has turned can be followed to the end of the record: friction takes as much speed away however the impacts fall, until the
inner rings turn with the shaft.  The lag behind a rotor that only coasts counts with a factor of its own, the same in all
drops: it is as uncertain as polar inertia and friction at small loads are.  What it does, a ring that is hard to turn
cannot be made up for: slip lasts longer, and longer at one speed than at another.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from tdbsim.columns import INERTIA
from tdbsim.drop_model import DropModel
from tdbsim.errors import InputError

from tdbmon.diagnosis.contender import MOST_CAUSES, SIMPLER, SLOPES, Contender, settled, with_cause
from tdbmon.diagnosis.held_out import LEAST_DROPS, HeldOut
from tdbmon.diagnosis.suspects import Start, Suspect
from tdbmon.diagnosis.verdict import EXPLAINED
from tdbmon.identify.prediction import coasting, predict
from tdbmon.identify.problem import Problem

Array = NDArray[np.float64]

_LAST_S = 0.6  # after the release; what slows a rotor later is drag alone
_WINDOW_S = 0.02  # over which angles are averaged
_LEAST_WINDOWS = 5  # of a drop
_ANGLE_SIGMA = 0.005  # rad, of a mean: the simulated path is one of many
_LAG_SIGMA = 0.02  # of the lag, for the same reason
_LIMIT = 400.0  # that one window may add to the misfit
_LEAST_FACTOR, _GREATEST_FACTOR = 0.5, 3.0  # of the simulated lag
_COASTING_STEPS = 200
_SHARES = np.geomspace(0.1, 6.4, 10)  # of the typical size, at which a cause is tried first
_PLAINLY, _CERTAINLY = 0.15, 5.0  # off 1, and in standard deviations: a factor of the lag that is told
_WORTH = 60.0  # sum of squares from which on a cause is sought
_NEAR = 2.0  # times what the best model leaves: a plain one that leaves more lacks something else
_SHARE = 0.5  # of what a model leaves of how the rotor slows, that a cause may leave of it
_FINER = 8  # sizes tried between the neighbours of the best


@dataclass(frozen=True, eq=False)
class Slowing:
    """How a drop's shaft turned after the horizon; w windows.

    Attributes
    ----------
    time : (w,) array
        Middle of each window, s after the release.
    left : (w,) array
        Measured less simulated shaft angle, forward, rad.
    lag : (w,) array
        Simulated angle less that of a rotor that nothing touches, forward, rad.
    noise, sigma : (w,) arrays
        Standard deviations of the measured angle, and of what is left of it, rad.
    """

    time: Array
    left: Array
    lag: Array
    noise: Array
    sigma: Array

    def rest(self, factor: float) -> Array:
        """Return what is left, rad, where the simulated lag counts by a factor."""
        return self.left - (factor - 1) * self.lag

    def misfit(self, factor: float) -> float:
        """Return the sum of squares in units of their standard deviations."""
        return float(np.minimum((self.rest(factor) / self.sigma) ** 2, _LIMIT).sum())


def slowing_of(problem: Problem, point: Array, drop: int, horizon: float) -> Slowing | None:
    """Return how a drop slows at a point of a fit; None without a keyphasor, a longer record, or a simulation."""
    measured = problem.drops[drop]
    last = min(measured.seconds - 0.002, _LAST_S)
    since = measured.pulse_times - measured.release
    angle, since = measured.pulse_angles[since < last], since[since < last]
    spans = [(a, b) for a, b in pairwise(np.arange(horizon, last, _WINDOW_S)) if ((since >= a) & (since < b)).any()]
    if len(spans) < _LEAST_WINDOWS:
        return None
    shared, own = problem.values(point, drop)
    try:
        model, _ = problem.setting(shared, own, drop)
        prediction = predict(measured, model, own, last)
    except InputError:
        return None
    sense = problem.model.machine.sense
    time = measured.time[prediction.first : prediction.first + len(prediction.angle)] - measured.release
    simulated = np.interp(since, time, prediction.angle)
    release = own["release"]
    turned = simulated - np.interp(release, time, prediction.angle)
    lag = sense * turned - _coasted(model, prediction.motion.plan.speed, since - release)
    left = sense * (angle - simulated)
    rows = []
    for begin, end in spans:
        inside = (since >= begin) & (since < end)
        noise = measured.pulse_sigma / math.sqrt(inside.sum())
        rows.append([(begin + end) / 2, left[inside].mean(), lag[inside].mean(), noise])
    middle, apart, behind, noise_of = np.array(rows).T
    sigma = np.sqrt(noise_of**2 + _ANGLE_SIGMA**2 + (_LAG_SIGMA * behind) ** 2)
    return Slowing(middle, apart, behind, noise_of, sigma)


def _coasted(model: DropModel, speed: float, since: Array) -> Array:
    """Return the angle, rad, that a rotor of a speed, Hz, turns in times (k,), s, where nothing touches it."""
    grid = np.linspace(0.0, max(float(since.max()), 1e-3), _COASTING_STEPS + 1)
    step, omega, angle = grid[1], 2 * math.pi * speed, [0.0]
    for _ in grid[1:]:
        middle = omega + coasting(model, omega) * step / 2
        angle.append(angle[-1] + middle * step)
        omega += coasting(model, middle) * step
    return np.interp(since, grid, angle)


def lag_factor(slowings: Sequence[Slowing]) -> float:
    """Return the factor of the simulated lag with which drops leave least, within bounds."""
    lag, left, sigma = (np.concatenate([getattr(s, name) for s in slowings]) for name in ("lag", "left", "sigma"))
    power = float(np.sum((lag / sigma) ** 2))
    if power == 0.0:
        return 1.0
    return float(np.clip(1 + np.sum(lag * left / sigma**2) / power, _LEAST_FACTOR, _GREATEST_FACTOR))


def slows_otherwise(contender: Contender) -> bool:
    """True where a rotor slows so that a cause of it is worth seeking."""
    slowings = slowings_of(contender)
    return slowings is not None and _misfit(slowings) > _WORTH


def slowing_remarks(contender: Contender) -> list[str]:
    """Return what there is to say of how fast the rotor slows, where it is plainly not as simulated."""
    slowings = slowings_of(contender)
    if slowings is None:
        return []
    factor = lag_factor(slowings)
    power = sum(float(np.sum((each.lag / each.sigma) ** 2)) for each in slowings)
    if abs(factor - 1) < _PLAINLY or (factor - 1) ** 2 * power < _CERTAINLY**2:
        return []
    inertia = float(contender.problem.model.arrays.spin[INERTIA])
    return [
        f"after the release the shaft falls behind one that only coasts by {factor:.2f} times what is simulated, in all drops:"
        f" the rotor's polar inertia ({inertia:.4g} kg m^2 by the machine file), that of the inner rings, or friction at"
        " small loads is not as the file has it. The verdict does not rest on it"
    ]


def _misfit(slowings: Sequence[Slowing]) -> float:
    factor = lag_factor(slowings)
    return sum(each.misfit(factor) for each in slowings)


def slowings_of(contender: Contender) -> tuple[Slowing, ...] | None:
    """Return how all drops slow as a model has it; None where that of one is not known."""
    return _slowings(contender.problem, contender.fit.point, contender.horizon)


def _slowings(problem: Problem, point: Array, horizon: float) -> tuple[Slowing, ...] | None:
    found = [slowing_of(problem, point, drop, horizon) for drop in range(len(problem.drops))]
    known = tuple(each for each in found if each is not None)
    return known if len(known) == len(found) else None


@dataclass(frozen=True, eq=False)
class Slowed:
    """A model with a cause that shows in how the rotor slows, tried at sizes.

    Attributes
    ----------
    base : Contender
        Without the cause.
    bare : tuple of Slowing
        Its drops.
    suspect : Suspect
    sizes : (k,) array
        SI, rising.
    trials : tuple of tuple of Slowing
        The drops at each size.
    """

    base: Contender
    bare: tuple[Slowing, ...]
    suspect: Suspect
    sizes: Array
    trials: tuple[tuple[Slowing, ...], ...]

    def best(self, drops: Sequence[int]) -> int:
        """Return the trial that fits some drops best."""
        return int(np.argmin([_misfit([trial[d] for d in drops]) for trial in self.trials]))

    @property
    def misfit(self) -> float:
        """Sum of squares at the best size."""
        return _misfit(self.trials[self.best(range(len(self.bare)))])

    @property
    def parameter(self) -> str:
        """Full name of the size."""
        return f"{self.suspect.name}.{self.suspect.sizes[0][0].name}"

    @property
    def convincing(self) -> bool:
        """True where the cause takes away half of what its base leaves, and is seen on drops held out."""
        return self.misfit < _SHARE * _misfit(self.bare) and self.proof().seen

    def contender(self) -> Contender:
        """Return the model with the cause, its size known from how the rotor slows (raises InputError where impossible)."""
        best = self.best(range(len(self.bare)))
        misfits = np.array([_misfit(trial) for trial in self.trials])
        # half as wide as what lies within two standard deviations of the best
        within = self.sizes[misfits <= misfits[best] + 4]
        spacing = float(np.min(np.diff(self.sizes)))
        sigma = max(float(np.ptp(within)) / 4, spacing / 2)
        size = self.suspect.sizes[0][0].name
        start = Start({size: float(self.sizes[best])}, known={size: sigma})
        found = settled(with_cause(self.base, self.suspect, start), self.base.horizon, SLOPES)
        # up to the horizon the cause hardly acts: what the fit leaves more or less there is chance, another hollow
        return replace(found, later=float(misfits[best]) + self.base.misfit - found.misfit)

    def proof(self) -> HeldOut:
        """Return the proof on each drop in turn: size and factor of the lag are those of the other drops."""
        everything = range(len(self.bare))
        bare, wide, noise, without = [], [], [], []
        misfits = np.zeros(2)
        for drop in everything:
            others = [each for each in everything if each != drop]
            best = self.best(others)
            pairs = (self.bare, self.trials[best])
            factors = [lag_factor([slowings[d] for d in others]) for slowings in pairs]
            misfits += [s[drop].misfit(f) for s, f in zip(pairs, factors, strict=True)]
            bare.append(self.bare[drop].rest(factors[0]))
            wide.append(self.trials[best][drop].rest(factors[1]))
            noise.append(self.bare[drop].sigma)
            without.append({self.parameter: float(self.sizes[best])})
        radius = self.base.problem.model.machine.bearing(self.suspect.where).journal_radius
        plain, extended, alone = (
            radius * math.sqrt(float(np.mean(np.concatenate(each) ** 2))) for each in (bare, wide, noise)
        )
        return HeldOut(
            drops=tuple(each.name for each in self.base.problem.drops),
            plain=plain,
            extended=extended,
            noise=alone,
            plain_misfit=float(misfits[0]),
            extended_misfit=float(misfits[1]),
            without=tuple(without),
            quantity="arc that the journal has turned",
        )


def slowed(base: Contender, suspects: Sequence[Suspect]) -> list[Slowed]:
    """Return a model with each of the suspects that act on how the rotor slows, tried at sizes.

    Parameters
    ----------
    base : Contender
        Of its drops it must be known how they slow.
    suspects : sequence of Suspect
    """
    bare = slowings_of(base)
    if bare is None:
        return []
    found = []
    for suspect in suspects:
        sizes = suspect.sizes[0][0].typical * _SHARES
        first = _tried(base, suspect, sizes)
        if not first:
            continue
        at = min(range(len(first)), key=lambda k: _misfit(first[k][1]))
        low, high = first[max(at - 1, 0)][0], first[min(at + 1, len(first) - 1)][0]
        trials = sorted([*first, *_tried(base, suspect, np.linspace(low, high, _FINER + 2)[1:-1])], key=lambda t: t[0])
        found.append(Slowed(base, bare, suspect, np.array([s for s, _ in trials]), tuple(t for _, t in trials)))
    return found


def _tried(base: Contender, suspect: Suspect, sizes: Array) -> list[tuple[float, tuple[Slowing, ...]]]:
    """Return the sizes at which a cause could be simulated, with how the drops slow there."""
    size = suspect.sizes[0][0].name
    tasks = []
    for value in sizes:
        free = Start({size: float(value)}).free(suspect)
        problem = replace(base.problem, free=(*base.problem.free, free), shared=(*base.problem.shared, *free.shared))
        point = np.insert(base.fit.point, len(base.problem.shared), 0.0)
        tasks.append((problem, point, base.horizon))
    found = base.problem.crew.apart(_slowings, tasks)
    return [(float(s), each) for s, each in zip(sizes, found, strict=True) if each is not None]


def with_slowing(field: Sequence[Contender], suspects: Sequence[Suspect]) -> tuple[list[Contender], Slowed | None]:
    """Return the models, the best first, with what they leave of how the rotor slows, and with a cause of it.

    A model that does not explain the drops is no ground for it: then nothing is added.  The second value is what was tried
    of the cause that the best model has, if it has one.
    """
    if field[0].ratio > EXPLAINED:
        return list(field), None
    known = [slowings_of(each) for each in field]
    judged = [replace(each, later=_misfit(of)) for each, of in zip(field, known, strict=True) if of is not None]
    if len(judged) < len(field):
        return list(field), None
    judged.sort(key=lambda each: each.bic)
    base = next(each for each in judged if not _slows(each.causes))
    if base.later < _WORTH or len(base.causes) == MOST_CAUSES or len(base.problem.drops) < LEAST_DROPS:
        return judged, None
    # what such a cause does up to the horizon, another may have been taken for
    plain = next(each for each in judged if not each.causes)
    bases = [base, plain] if base.causes and plain.ratio < _NEAR * base.ratio else [base]
    grown: dict[str, Slowed] = {}
    found: list[Contender] = []
    for each in (tried for ground in bases for tried in slowed(ground, _slows(suspects))):
        if not each.convincing:  # then it slows otherwise for another reason
            continue
        try:
            found.append(each.contender())
        except InputError:
            continue
        grown[found[-1].name] = each
    judged = sorted([*(each for each in judged if each.name not in grown), *found], key=lambda each: each.bic)
    simpler = [each for each in found if each.bic < judged[0].bic + SIMPLER and not each.fails_beside(plain)]
    if simpler:
        fewest = min(len(each.causes) for each in simpler)
        judged = [each for each in judged if len(each.causes) <= fewest]
    return judged, grown.get(judged[0].name)


def _slows(suspects: Sequence[Suspect]) -> list[Suspect]:
    return [each for each in suspects if each.declared.kind.slows]
