"""A cause of the rotor's slowing: a ring that is hard to turn, sought after paths diverge.

Up to the horizon it hardly acts.  So it is tried at several sizes in a model that explains the drops up to there, and judged by
the later residual of the shaft's angle.  The proof is on each drop in turn, with the size that fits the others best.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from tdbsim.errors import InputError

from tdbmon.diagnosis.contender import (
    EXPLAINED,
    MOST_CAUSES,
    SIMPLER,
    SLOPES,
    Contender,
    plain_of,
    settled,
    with_cause,
)
from tdbmon.diagnosis.effect_size import sized
from tdbmon.diagnosis.held_out import LEAST_DROPS, HeldOut, Judge
from tdbmon.diagnosis.slows_otherwise import WORTH, slowings_of
from tdbmon.diagnosis.suspects import Start, Suspect
from tdbmon.identify.slowing import Slowing, factors_of, slowing_misfit, slowings_at

Array = NDArray[np.float64]

_SHARES = np.geomspace(0.1, 6.4, 10).tolist()  # first trial sizes, multiples of the typical one
# further trial sizes where the greatest of those is as good as any, as for a ring that does not turn at all
_GREATER = (10.0, 16.0, 25.0)
_AS_GOOD = 4.0  # sum of squares beyond the least: two standard deviations
_FINER = 8  # trial sizes between the neighbours of the best
_NEAR = 2.0  # greatest misfit ratio of a plain model worth extending, in units of the best one's
_MAY_LEAVE = 0.5  # share of the slowing's misfit that may remain with a cause


@dataclass(frozen=True, eq=False)
class Slowed:
    """A cause of the rotor's slowing, tried at several sizes in a model.

    Attributes
    ----------
    base : Contender
        The model without the cause.
    bare : tuple of Slowing
        Slowing of the drops against `base`.
    suspect : Suspect
    sizes : (k,) array
        Trial sizes, SI, rising.
    trials : tuple of tuple of Slowing
        Slowing of the drops at each size.
    """

    base: Contender
    bare: tuple[Slowing, ...]
    suspect: Suspect
    sizes: Array
    trials: tuple[tuple[Slowing, ...], ...]

    def best(self, drops: Sequence[int]) -> int:
        """Return the index of the trial that fits some drops best."""
        return int(np.argmin([slowing_misfit([trial[d] for d in drops]) for trial in self.trials]))

    @property
    def misfit(self) -> float:
        """Sum of squares at the best size."""
        return slowing_misfit(self.trials[self.best(range(len(self.bare)))])

    @property
    def parameter(self) -> str:
        """Full name of the size."""
        return f"{self.suspect.name}.{self.suspect.sizes[0][0].name}"

    @property
    def convincing(self) -> bool:
        """True if the cause takes away half of the slowing's misfit, and held-out drops prove it."""
        return self.misfit < _MAY_LEAVE * slowing_misfit(self.bare) and self.proof().seen

    def contender(self) -> Contender:
        """Return the model with the cause, its size known from the slowing (raises InputError if it cannot be simulated)."""
        best = self.best(range(len(self.bare)))
        misfits = np.array([slowing_misfit(trial) for trial in self.trials])
        # a quarter of the range of the sizes within two standard deviations of the best
        within = self.sizes[misfits <= misfits[best] + _AS_GOOD]
        spacing = float(np.max(np.diff(self.sizes[max(best - 1, 0) : best + 2])))
        sigma = max(float(np.ptp(within)) / 4, spacing / 2)
        size = self.suspect.sizes[0][0].name
        found = _refitted(self.base, self.suspect, Start({size: float(self.sizes[best])}, known={size: sigma}))
        # the cause hardly acts up to the horizon: a change of misfit there is due to chance, another local minimum
        return replace(found, later=float(misfits[best]) + self.base.misfit - found.misfit)

    def proof(self) -> HeldOut:
        """Return the proof on each drop in turn, with the size and the factors of lag and drag that fit the others best."""
        everything = range(len(self.bare))
        bare, wide, noise, without = [], [], [], []
        misfits = np.zeros(2)
        for drop in everything:
            others = [each for each in everything if each != drop]
            best = self.best(others)
            pairs = (self.bare, self.trials[best])
            factors = [factors_of([slowings[d] for d in others]) for slowings in pairs]
            misfits += [s[drop].misfit(f) for s, f in zip(pairs, factors, strict=True)]
            bare.append(self.bare[drop].rest(factors[0]))
            wide.append(self.trials[best][drop].rest(factors[1]))
            noise.append(self.bare[drop].sigma)
            without.append({self.parameter: float(self.sizes[best])})
        machine = self.base.problem.model.machine
        ends = (
            [machine.bearing(self.suspect.where)] if self.suspect.where in machine.ends else machine.touchdown_bearings
        )
        radius = sum(end.journal_radius for end in ends) / len(ends)
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
            judge=Judge.ARC,
        )


def _refitted(base: Contender, suspect: Suspect, start: Start) -> Contender:
    """Return the model with a cause known from the rest of the record, refitted to its horizon.

    Raises
    ------
    InputError
        If it cannot be simulated.
    """
    found = with_cause(base, suspect, start)
    # a ring that is hard to turn shifts the late paths a little: the fit follows them from earlier horizons on
    stages = base.problem.stages
    earlier = [each for each in stages.diagnosis if stages.followed <= each < base.horizon]
    for horizon in (*earlier, base.horizon):
        found = settled(found, horizon, SLOPES)
    return found


def slowed(base: Contender, suspects: Sequence[Suspect]) -> list[Slowed]:
    """Return each suspect tried at several sizes in a model; nothing if the slowing of its drops is unknown.

    Parameters
    ----------
    base : Contender
    suspects : sequence of Suspect
        Those that act on the slowing.
    """
    bare = slowings_of(base)
    if bare is None:
        return []
    found = []
    for suspect in suspects:
        first = _tried(base, suspect, _sizes(suspect, _SHARES))
        if len(first) < 2:  # a single size gives neither the best one nor its error
            continue
        misfits = [slowing_misfit(trial) for _, trial in first]
        if misfits[-1] <= min(misfits) + _AS_GOOD:
            first += _tried(base, suspect, _sizes(suspect, _GREATER))
        at = min(range(len(first)), key=lambda k: slowing_misfit(first[k][1]))
        low, high = first[max(at - 1, 0)][0], first[min(at + 1, len(first) - 1)][0]
        trials = sorted([*first, *_tried(base, suspect, np.linspace(low, high, _FINER + 2)[1:-1])], key=lambda t: t[0])
        found.append(Slowed(base, bare, suspect, np.array([s for s, _ in trials]), tuple(t for _, t in trials)))
    return found


def _sizes(suspect: Suspect, shares: Sequence[float]) -> Array:
    """Return sizes of a cause at shares of the typical one, rising, within its bounds."""
    size = suspect.sizes[0][0]
    return np.unique(np.clip([sized(size, share) for share in shares], size.low, size.high))


def _tried(base: Contender, suspect: Suspect, sizes: Array) -> list[tuple[float, tuple[Slowing, ...]]]:
    """Return the sizes at which a cause could be simulated, with the slowing of the drops at each."""
    size = suspect.sizes[0][0].name
    tasks = []
    for value in sizes:
        free = Start({size: float(value)}).free(suspect)
        problem = replace(base.problem, free=(*base.problem.free, free), shared=(*base.problem.shared, *free.shared))
        point = np.insert(base.fit.point, len(base.problem.shared), 0.0)
        tasks.append((problem, point, base.horizon))
    found = base.problem.crew.apart(slowings_at, tasks)
    return [(float(s), each) for s, each in zip(sizes, found, strict=True) if each is not None]


def with_slowing(field: Sequence[Contender], suspects: Sequence[Suspect]) -> tuple[list[Contender], Slowed | None]:
    """Return the models with their misfit of the slowing, and those with a cause of it, the best first.

    Nothing is added if the best model does not explain the drops.  The second value is the trials of the best model's slowing
    cause, if it has one.
    """
    if field[0].ratio > EXPLAINED:
        return list(field), None
    known = [slowings_of(each) for each in field]
    judged = [replace(each, later=slowing_misfit(of)) for each, of in zip(field, known, strict=True) if of is not None]
    if len(judged) < len(field):
        return list(field), None
    judged.sort(key=lambda each: each.bic)
    base = next(each for each in judged if not _slows(each.causes))
    # with each other cause the simulated path is less certain
    if (
        base.later < WORTH * (1 + len(base.causes))
        or len(base.causes) == MOST_CAUSES
        or len(base.problem.drops) < LEAST_DROPS
    ):
        return judged, None
    # what such a cause does up to the horizon may have been taken for another cause
    plain = plain_of(judged)
    bases = [base, plain] if base.causes and plain.ratio < _NEAR * base.ratio else [base]
    grown: dict[str, Slowed] = {}
    found: list[Contender] = []
    for each in (tried for ground in bases for tried in slowed(ground, _slows(suspects))):
        if not each.convincing:  # the rotor slows otherwise for another reason then
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
