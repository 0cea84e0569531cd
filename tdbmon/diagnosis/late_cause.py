"""A cause that shows in the rest of the record only: what builds up with rubbing, sought after paths have parted.

Up to the horizon a model explains the drops.  Where it lets the shaft whirl, stay or slow otherwise later, such causes are
put into it at sizes, and each drop is simulated many times with them.  The proof is each drop in turn, with values from the
others.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from tdbsim.effect import Parameter as Declared
from tdbsim.errors import InputError

from tdbmon.diagnosis.contender import MOST_CAUSES, Contender
from tdbmon.diagnosis.held_out import LEAST_DROPS, HeldOut, Judge
from tdbmon.diagnosis.late_record import LateRecord, acts_later, drawn, late_record
from tdbmon.diagnosis.slowing_cause import followed
from tdbmon.diagnosis.suspects import Start, Suspect, sized
from tdbmon.diagnosis.verdict import TEMPERATURE
from tdbmon.identify.problem import Problem
from tdbmon.identify.slowing import Slowing, slowing_misfit, slowings_at

Array = NDArray[np.float64]
Values = Mapping[str, float]

_WORTH = 10.0  # sum of squared departures from which on a cause is sought
_SIZES = np.geomspace(0.125, 4.0, 6)  # of the typical size, at which every cause is tried first
_FEW, _MORE = 8, 16  # simulations of a drop, for that and for what follows
_BEST = 3  # causes that are tried at finer values
_SHAPES = (0.5, 1.0, 2.0)  # of the typical value of what a cause has beside its size
_FINER = (0.6, 0.8, 1.25, 1.6)  # of the best size
_AS_GOOD = 4.0  # beyond the least misfit: two standard deviations
_MAY_LEAVE = 0.5  # of what a model leaves, that it may leave with a cause


@dataclass(frozen=True, eq=False)
class Rest:
    """The rest of all drops' records beside simulations of a model: whirl and places, and how each slows if that is known."""

    late: tuple[LateRecord, ...]
    slowing: tuple[Slowing, ...] | None

    def misfit(self, drops: Sequence[int]) -> float:
        """Return the sum of squares of some drops' departures.

        How they slow is a sum over many windows that follow each other, and counts as little as readings do.
        """
        slower = slowing_misfit([self.slowing[d] for d in drops]) / TEMPERATURE if self.slowing is not None else 0.0
        return slower + sum(self.late[d].departure for d in drops)


@dataclass(frozen=True, eq=False)
class LateCause:
    """A model with a cause put in at values, held against the rest of the record.

    Attributes
    ----------
    base : Contender
        Without the cause.
    bare : Rest
        Of it.
    suspect : Suspect
    trials : tuple of pair
        Values (SI, by name), and the rest with them.
    """

    base: Contender
    bare: Rest
    suspect: Suspect
    trials: tuple[tuple[Values, Rest], ...]

    @property
    def drops(self) -> range:
        """Their places."""
        return range(len(self.bare.late))

    def best(self, drops: Sequence[int]) -> tuple[Values, Rest]:
        """Return the trial that fits some drops best."""
        return min(self.trials, key=lambda trial: trial[1].misfit(drops))

    @property
    def misfit(self) -> float:
        """Sum of squares at the best values."""
        return self.best(self.drops)[1].misfit(self.drops)

    @property
    def convincing(self) -> bool:
        """True where the cause takes away half of what its base leaves, and is seen on drops held out."""
        return self.misfit < _MAY_LEAVE * self.bare.misfit(self.drops) and self.proof().seen

    def contender(self) -> Contender:
        """Return the model with the cause, its values known from the rest (raises InputError where impossible)."""
        values, _ = self.best(self.drops)
        as_good = [each for each, rest in self.trials if rest.misfit(self.drops) <= self.misfit + _AS_GOOD]
        known = {}
        for name, value in values.items():
            spread = float(np.ptp([each[name] for each in as_good])) / 4
            # no better than the trials lie apart
            apart = min((abs(each[name] - value) for each, _ in self.trials if each[name] != value), default=abs(value))
            known[name] = max(spread, apart / 2)
        found = followed(self.base, self.suspect, Start(values, known=known))
        # up to the horizon the cause hardly acts: what the fit leaves more or less there is chance
        return replace(found, later=TEMPERATURE * self.misfit + self.base.misfit - found.misfit)

    def proof(self) -> HeldOut:
        """Return the proof on each drop in turn, its values those of the other drops."""
        taught = [self.best([other for other in self.drops if other != drop]) for drop in self.drops]
        bare = self.bare.late
        wide = [rest.late[drop] for drop, (_, rest) in enumerate(taught)]
        plain, extended, noise = (
            math.sqrt(float(np.mean(np.concatenate(each) ** 2)))
            for each in ([e.apart for e in bare], [e.apart for e in wide], [e.spread for e in bare])
        )
        return HeldOut(
            drops=tuple(each.name for each in bare),
            plain=plain,
            extended=extended,
            noise=noise,
            plain_misfit=sum(self.bare.misfit([drop]) for drop in self.drops),
            extended_misfit=sum(rest.misfit([drop]) for drop, (_, rest) in enumerate(taught)),
            without=tuple({f"{self.suspect.name}.{name}": v for name, v in values.items()} for values, _ in taught),
            judge=Judge.REST,
        )


def departs(late: Sequence[LateRecord]) -> bool:
    """True where the rest of several drops is so far from its simulations that a cause is worth seeking."""
    told = acts_later(late) is not None or sum(each.departure for each in late) > _WORTH
    return told and len(late) >= LEAST_DROPS


def explains(before: Sequence[LateRecord], after: Sequence[LateRecord]) -> bool:
    """True where a model leaves half of the departures of the one before at most."""
    return sum(each.departure for each in after) < _MAY_LEAVE * sum(each.departure for each in before)


def with_late_causes(
    base: Contender, field: Sequence[Contender], late: Sequence[LateRecord], suspects: Sequence[Suspect]
) -> tuple[list[Contender], LateCause | None]:
    """Return models and those that have one cause more, which explains the rest of the records, and what was tried of the best.

    Parameters
    ----------
    base : Contender
        The model that is believed: it explains the drops to its horizon.
    field : sequence of Contender
        All models, the base among them.
    late : sequence of LateRecord
        The rest of the drops, which departs from the base.
    suspects : sequence of Suspect
        All of the machine.

    Returns
    -------
    The models, the best first, and None where no cause is convincing, or another model is better still.
    """
    tried: dict[Contender, LateCause] = {}
    for cause in _late_causes(base, len(late), suspects) if len(base.causes) < MOST_CAUSES else ():
        with suppress(InputError):
            tried[cause.contender()] = cause
    if not tried:
        return list(field), None
    best = min(tried, key=lambda each: each.bic)
    # what the base leaves of the rest, the others leave too, as far as anybody asked
    rest = TEMPERATURE * sum(each.departure for each in tried[best].bare.late)
    before = [replace(each, later=each.later + rest) for each in field]
    wider = sorted([*before, *tried], key=lambda each: each.bic)
    return (wider, tried[best]) if wider[0] is best else (list(field), None)


def _late_causes(base: Contender, drops: int, suspects: Sequence[Suspect]) -> list[LateCause]:
    """Return the causes that explain the rest of so many drops where a model does not."""
    alike: dict[str, list[Suspect]] = {}  # but for their words
    for suspect in suspects:
        if suspect.declared.kind.builds_up and all(suspect.declared is not each.declared for each in base.causes):
            alike.setdefault(suspect.name, []).append(suspect)
    everything, few, more = range(drops), drawn(base, _FEW), drawn(base, _MORE)
    first = {
        name: _tried(base, suspect, [_at(suspect, share) for share in _SIZES], few)
        for name, (suspect, *_) in alike.items()
    }
    best = {
        name: min(trials, key=lambda trial: trial[1].misfit(everything)) for name, trials in first.items() if trials
    }
    likeliest = sorted(best, key=lambda name: best[name][1].misfit(everything))[:_BEST]
    bare = _rest(base.problem, more, base.horizon)
    if bare is None:
        return []
    found = [
        LateCause(base, bare, suspect, tuple(trials))
        for name in likeliest
        for suspect, trials in [_refined(base, alike[name], best[name][0], more)]
        if trials
    ]
    return [each for each in found if each.convincing]


def _refined(
    base: Contender, alike: Sequence[Suspect], near: Values, points: Sequence[Array]
) -> tuple[Suspect, list[tuple[Values, Rest]]]:
    """Return the cause in the words that fit best, tried at values near some: other shapes first, then finer sizes."""
    everything = range(len(base.problem.drops))
    shapes, size = alike[0].shapes, alike[0].sizes[0][0]
    other = (
        [{**near, **{p.name: _within(p, p.typical * share) for p in shapes}} for share in _SHAPES] if shapes else [near]
    )
    in_words = [(suspect, _tried(base, suspect, other, points)) for suspect in alike]
    suspect, trials = min(
        in_words,
        key=lambda pair: min((rest.misfit(everything) for _, rest in pair[1]), default=math.inf),
    )
    if not trials:
        return suspect, trials
    values, _ = min(trials, key=lambda trial: trial[1].misfit(everything))
    finer = [{**values, size.name: _within(size, values[size.name] * share)} for share in _FINER]
    return suspect, [*trials, *_tried(base, suspect, finer, points)]


def _at(suspect: Suspect, share: float) -> Values:
    """Return the usual values of a suspect, its size a share of the typical one."""
    size, _ = suspect.sizes[0]
    return {**suspect.usual_values, size.name: _within(size, sized(size, share))}


def _within(of: Declared, value: float) -> float:
    return min(max(value, of.low), of.high)


def _tried(
    base: Contender, suspect: Suspect, values: Sequence[Values], points: Sequence[Array]
) -> list[tuple[Values, Rest]]:
    """Return values with which a cause could be simulated, with the rest of the records beside simulations at points."""
    shared = len(base.problem.shared)
    tasks = []
    for each in values:
        free = Start(each).free(suspect)
        problem = replace(base.problem, free=(*base.problem.free, free), shared=(*base.problem.shared, *free.shared))
        tasks.append((problem, [np.insert(point, [shared] * len(each), 0.0) for point in points], base.horizon))
    found = base.problem.crew.apart(_rest, tasks)
    return [(each, rest) for each, rest in zip(values, found, strict=True) if rest is not None]


def _rest(problem: Problem, points: Sequence[Array], horizon: float) -> Rest | None:
    """Return the rest of all drops beside simulations at several points, the first of them the fitted one."""
    late = [late_record(problem, points, drop, horizon) for drop in range(len(problem.drops))]
    known = tuple(each for each in late if each is not None)
    return Rest(known, slowings_at(problem, points[0], horizon)) if len(known) == len(late) else None
