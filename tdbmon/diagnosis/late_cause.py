"""Causes that build up with rubbing and show only in the rest of the record, after paths diverge.

The model explains the drops up to the horizon.  Where the shaft later whirls, stays or slows otherwise than simulated, such
causes are put into the model at several sizes, and each drop is simulated many times with each.  The proof is on each drop in
turn, with the values that fit the others best.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from tdbsim.errors import InputError

from tdbmon.diagnosis.contender import FEW_SLOPES, MOST_CAUSES, SLOPES, Contender, settled, with_cause
from tdbmon.diagnosis.effect_size import sized
from tdbmon.diagnosis.held_out import LEAST_DROPS, HeldOut, Judge
from tdbmon.diagnosis.late_record import LateRecord, acts_later, departure_of, drawn, late_record
from tdbmon.diagnosis.probability import TEMPERATURE
from tdbmon.diagnosis.slows_otherwise import slowings_of
from tdbmon.diagnosis.suspects import Start, Suspect
from tdbmon.identify.least_squares import Fit, fit
from tdbmon.identify.slowing import Slowing, slowing_misfit, slowings_at

Array = NDArray[np.float64]
Values = Mapping[str, float]

_WORTH = 10.0  # sum of squared departures from which on a cause is sought
_SIZES = np.geomspace(0.25, 4.0, 5)  # first trial sizes, multiples of the typical one
_SHAPES = (0.5, 1.0, 2.0)  # the same of the other values
_FEW, _MORE = 8, 16  # simulations per drop for the first trials, and for later ones
_BEST = 3  # causes that are tried at further values
_FINER = (0.6, 0.8, 1.25, 1.6)  # further trial sizes, multiples of the best first one
_DRAWS = 4  # random trials per value about the best values, in each of two rounds
_SIZE_SIGMA, _SHAPE_SIGMA = 0.3, 0.15  # standard deviations of the first round, of the logarithm
_WIDENED = 2.5  # standard deviations of the second round, in units of those of the trials so far
_HELD = 1e-3  # of a value: prior standard deviation that holds it in the fit
_NEAREST = 0.03  # least standard deviation of a value, of the logarithm
_ROUGH = 8.0  # error of the misfit from so few simulations
_REFIT = 1.0  # excess misfit of the readings above which a trial is fitted with Jacobians of its own
_HOPELESS = 10.0  # multiple of the misfit of the rest above which that is useless
_MAY_LEAVE = 0.5  # share of a model's misfit that may remain with a cause


@dataclass(frozen=True, eq=False)
class Rest:
    """The rest of all drops' records against simulations of a model: whirl, mean positions, and slowing if that is known."""

    late: tuple[LateRecord, ...]
    slowing: tuple[Slowing, ...] | None

    def misfit(self, drops: Sequence[int]) -> float:
        """Return the sum of squared departures of some drops.

        The slowing is a sum over many correlated windows, and is divided by `TEMPERATURE` as readings are.
        """
        slower = slowing_misfit([self.slowing[d] for d in drops]) / TEMPERATURE if self.slowing is not None else 0.0
        return slower + departure_of([self.late[d] for d in drops])


@dataclass(frozen=True, eq=False)
class Trial:
    """A model with a cause held at given values, all other values refitted to the horizon.

    Attributes
    ----------
    values : mapping
        Values of the cause, SI, by name.
    point : (n,) array
        Point of the other values.
    readings : float
        Increase of the misfit of all drops' readings by the cause, divided by `TEMPERATURE`.
    rest : Rest
        Departures in units of the spread of the model without the cause.
    """

    values: Values
    point: Array
    readings: float
    rest: Rest

    def misfit(self, drops: Sequence[int]) -> float:
        """Return the sum of squared departures of some drops plus `readings`."""
        return self.readings + self.rest.misfit(drops)


@dataclass(frozen=True, eq=False)
class LateCause:
    """A cause tried at several values in a model, compared with the rest of the record.

    Attributes
    ----------
    base : Contender
        The model without the cause.
    bare : Rest
        The rest of the record against `base`.
    suspect : Suspect
    trials : tuple of Trial
    """

    base: Contender
    bare: Rest
    suspect: Suspect
    trials: tuple[Trial, ...]

    @property
    def drops(self) -> range:
        """Numbers of the drops."""
        return range(len(self.bare.late))

    def best(self, drops: Sequence[int]) -> Trial:
        """Return the trial that fits some drops best."""
        return min(self.trials, key=lambda trial: trial.misfit(drops))

    @property
    def misfit(self) -> float:
        """Sum of squares at the best values."""
        return self.best(self.drops).misfit(self.drops)

    @property
    def spread(self) -> Array:
        """Covariance of the logarithms of the values about the best (k, k), over all trials weighted by likelihood."""
        best, least = self.best(self.drops), self.misfit
        worse = np.array([each.misfit(self.drops) - least for each in self.trials])
        weights = np.exp(-worse / 2 / _ROUGH)
        apart = np.log([[each.values[name] / value for name, value in best.values.items()] for each in self.trials])
        return np.asarray((apart.T * weights) @ apart / weights.sum()) + _NEAREST**2 * np.eye(len(best.values))

    @property
    def sigmas(self) -> dict[str, float]:
        """Standard deviations of the values, SI, by name."""
        shares = np.sqrt(np.diag(self.spread))
        values = self.best(self.drops).values
        return {name: float(share) * value for (name, value), share in zip(values.items(), shares, strict=True)}

    @property
    def promising(self) -> bool:
        """True if the cause takes away half of the misfit of its base."""
        return self.misfit < _MAY_LEAVE * self.bare.misfit(self.drops)

    def contender(self) -> Contender:
        """Return the model with the cause held at its best values (raises InputError if it cannot be simulated)."""
        best = self.best(self.drops)
        # readings up to the horizon counted in the trials; alone, where the cause hardly acts, they would lead it off
        known = {name: _HELD * abs(value) for name, value in best.values.items()}
        begun = with_cause(self.base, self.suspect, Start(best.values, known=known))
        columns = [len(self.base.problem.shared)] * len(best.values)
        there = replace(begun.fit, point=np.insert(best.point, columns, 0.0))
        found = settled(replace(begun, fit=there), self.base.horizon, SLOPES)
        gained = TEMPERATURE * (self.bare.misfit(self.drops) - self.misfit)
        # a change of misfit up to the horizon is counted in the trials already, or due to chance
        return replace(found, later=self.base.later - gained + self.base.misfit - found.misfit)

    def proof(self) -> HeldOut:
        """Return the proof on each drop in turn, with the trial that fits the other drops best."""
        taught = [self.best([other for other in self.drops if other != drop]) for drop in self.drops]
        bare = self.bare.late
        wide = [trial.rest.late[drop] for drop, trial in enumerate(taught)]
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
            extended_misfit=sum(trial.rest.misfit([drop]) for drop, trial in enumerate(taught)),
            without=tuple({f"{self.suspect.name}.{name}": v for name, v in trial.values.items()} for trial in taught),
            judge=Judge.REST,
        )


def departs(late: Sequence[LateRecord]) -> bool:
    """True if the rest of several drops departs so far from simulations that a cause is sought."""
    told = acts_later(late) is not None or departure_of(late) > _WORTH
    return told and len(late) >= LEAST_DROPS


def explains_the_rest(before: Sequence[LateRecord], after: Sequence[LateRecord]) -> bool:
    """True if the departures `after` sum to less than half of those before and call for no further cause."""
    return departure_of(after) < _MAY_LEAVE * departure_of(before) and not departs(after)


def with_late_causes(
    base: Contender, field: Sequence[Contender], late: Sequence[LateRecord], suspects: Sequence[Suspect]
) -> tuple[list[Contender], dict[Contender, LateCause]]:
    """Return the models, with those that have one more cause which explains the rest of the records, and the trials of these.

    Parameters
    ----------
    base : Contender
        The believed model, which explains the drops to its horizon.
    field : sequence of Contender
        All models, the base among them.
    late : sequence of LateRecord
        The rest of the records against the base.
    suspects : sequence of Suspect
        All of the machine.

    Returns
    -------
    The models, the best first, and the trials by model; `field` and no trials unless an extended model is the best.
    """
    tried: dict[Contender, LateCause] = {}
    for cause in _late_causes(base, late, suspects) if len(base.causes) < MOST_CAUSES else ():
        with suppress(InputError):
            tried[cause.contender()] = cause
    wider = sorted([*field, *tried], key=lambda each: each.bic)
    return (wider, tried) if wider[0] in tried else (list(field), {})


def _late_causes(base: Contender, late: Sequence[LateRecord], suspects: Sequence[Suspect]) -> list[LateCause]:
    """Return the late causes that explain the rest of the records and are proved."""
    bare, points = Rest(tuple(late), slowings_of(base)), drawn(base, _MORE)
    drops = range(len(late))
    asked = [each for each in suspects if each.declared.kind.builds_up]
    first = [
        each
        for declared in dict.fromkeys(each.declared for each in asked)
        if all(declared is not cause.declared for cause in base.causes)
        for each in _at_all_places(base, bare, [each for each in asked if each.declared is declared], points[:_FEW])
    ]
    scanned = []
    for suspect, trial in sorted(first, key=lambda each: each[1].misfit(drops))[:_BEST]:
        found = _tried(base, bare, [(suspect, values) for values in _near(suspect, trial.values)], points)
        if found:
            scanned.append(LateCause(base, bare, suspect, tuple(trial for _, trial in found)))
    promising = [each for each in scanned if each.promising]
    # those that rough misfits cannot tell from the best are refined alike
    rivals = [each for each in promising if each.misfit < min(other.misfit for other in promising) + _ROUGH]
    return [each for each in (_refined(rival, points) for rival in rivals) if each.proof().seen]


def _at_all_places(
    base: Contender, bare: Rest, alike: Sequence[Suspect], points: Sequence[Array]
) -> list[tuple[Suspect, Trial]]:
    """Return the best trial of one effect, over all its words, at each of its places."""
    drops = range(len(bare.late))
    shapes = _shapes(alike[0])
    # words and shapes that fit best at both ends are taken for one end too
    widest = [each for each in alike if each.where == "both"] or alike
    one_end = [each for each in alike if each not in widest]
    found = _tried(base, bare, [(each, v) for each in widest for of in shapes for v in _sizes(each, of)], points)
    if found:
        likely, at = min(found, key=lambda each: each[1].misfit(drops))
        one_end = [each for each in one_end if each.held == likely.held]
        shapes = [{p.name: at.values[p.name] for p in likely.shapes}]
    found += _tried(base, bare, [(each, v) for each in one_end for of in shapes for v in _sizes(each, of)], points)
    best: dict[str, tuple[Suspect, Trial]] = {}
    for each in sorted(found, key=lambda each: each[1].misfit(drops)):
        best.setdefault(each[0].name, each)
    return list(best.values())


def _refined(cause: LateCause, points: Sequence[Array]) -> LateCause:
    """Return the cause with trials at values drawn about its best ones, twice: the second time from the spread of the trials.

    The misfit is rough and its valley narrow, since more friction for less long acts the same; a descent would end on its side.
    """
    rng, suspect = np.random.default_rng(0), cause.suspect
    size = suspect.sizes[0][0].name
    wide = np.diag([_SIZE_SIGMA if name == size else _SHAPE_SIGMA for name in cause.best(cause.drops).values]) ** 2
    for narrowed in (False, True):
        values = cause.best(cause.drops).values
        spread = _WIDENED**2 * cause.spread if narrowed else wide
        times = np.exp(rng.multivariate_normal(np.zeros(len(values)), spread, _DRAWS * len(values)))
        tried = [
            (suspect, {name: _within(suspect, name, values[name] * t) for name, t in zip(values, row, strict=True)})
            for row in times
        ]
        more = (trial for _, trial in _tried(cause.base, cause.bare, tried, points))
        cause = replace(cause, trials=(*cause.trials, *more))
    return cause


def _shapes(suspect: Suspect) -> list[Values]:
    """Return the first trial values of a suspect's shapes."""
    if not suspect.shapes:
        return [{}]
    return [{p.name: _within(suspect, p.name, p.typical * share) for p in suspect.shapes} for share in _SHAPES]


def _sizes(suspect: Suspect, shape: Values) -> list[Values]:
    """Return a shape with each of the first trial sizes."""
    size, _ = suspect.sizes[0]
    return [{**shape, size.name: _within(suspect, size.name, sized(size, share))} for share in _SIZES]


def _near(suspect: Suspect, values: Values) -> list[Values]:
    """Return the values and the same at `_FINER` sizes, without duplicates."""
    size = suspect.sizes[0][0].name
    near = dict.fromkeys(_within(suspect, size, values[size] * share) for share in (1.0, *_FINER))
    return [{**values, size: value} for value in near]


def _within(suspect: Suspect, name: str, value: float) -> float:
    """Return a value of a suspect, clipped to its bounds."""
    of = suspect.declared.parameter(name)
    return float(min(max(value, of.low), of.high))


def _tried(
    base: Contender, bare: Rest, asked: Sequence[tuple[Suspect, Values]], points: Sequence[Array]
) -> list[tuple[Suspect, Trial]]:
    """Return the trials of causes at values, simulated at points about the base's, except those that `_trial` gives up."""
    found = base.problem.crew.apart(_trial, [(base, bare, suspect, values, points) for suspect, values in asked])
    return [(suspect, trial) for (suspect, _), trial in zip(asked, found, strict=True) if trial is not None]


def _trial(base: Contender, bare: Rest, suspect: Suspect, values: Values, points: Sequence[Array]) -> Trial | None:
    """Return the trial of a cause at values; None if it cannot be simulated, or its misfit exceeds that without the cause."""
    problem = replace(base.problem, standing=(*base.problem.standing, suspect.effect(values)))
    left = bare.misfit(range(len(bare.late)))
    try:
        found = fit(problem, base.fit.point, base.horizon, linearisations=0, slopes=base.fit.slopes)
        readings = _added_misfit(found, base)
        if _REFIT < readings < _HOPELESS * left:
            found = fit(problem, found.point, base.horizon, FEW_SLOPES)
            readings = _added_misfit(found, base)
    except InputError:
        return None
    if readings > left:
        return None
    at = [np.clip(point + found.point - base.fit.point, problem.low, problem.high) for point in points]
    beside: dict[int, LateRecord] = {}
    # the drop that departs most comes first: it shows soonest that nothing is gained
    for drop in sorted(range(len(bare.late)), key=lambda drop: -bare.late[drop].departure):
        late = late_record(problem, at, drop, base.horizon)
        if late is None:
            return None
        beside[drop] = late.in_spread_of(bare.late[drop])
        if readings + departure_of(list(beside.values())) > left:
            return None
    slowing = slowings_at(problem, found.point, base.horizon)
    if (slowing is None) != (bare.slowing is None):
        return None
    return Trial(values, found.point, readings, Rest(tuple(beside[drop] for drop in sorted(beside)), slowing))


def _added_misfit(fitted: Fit, base: Contender) -> float:
    """Return the increase of the readings' misfit over the base's, at least 0, divided by `TEMPERATURE`."""
    return max(fitted.misfit - base.fit.misfit, 0.0) / TEMPERATURE
