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

from tdbmon.diagnosis.contender import FEW_SLOPES, MOST_CAUSES, SLOPES, Contender, settled, with_cause
from tdbmon.diagnosis.held_out import LEAST_DROPS, HeldOut, Judge
from tdbmon.diagnosis.late_record import LateRecord, acts_later, drawn, late_record
from tdbmon.diagnosis.suspects import Start, Suspect, sized
from tdbmon.diagnosis.verdict import TEMPERATURE
from tdbmon.identify.least_squares import Fit, fit
from tdbmon.identify.problem import Problem
from tdbmon.identify.slowing import Slowing, slowing_misfit, slowings_at

Array = NDArray[np.float64]
Values = Mapping[str, float]

_WORTH = 10.0  # sum of squared departures from which on a cause is sought
_SIZES = np.geomspace(0.25, 4.0, 5)  # of the typical size, at which every cause is tried first
_SHAPES = (0.5, 1.0, 2.0)  # of the typical value of what it has beside its size, likewise
_FEW, _MORE = 8, 16  # simulations of a drop, for that and for what follows
_BEST = 3  # causes that are tried at other values
_FINER = (0.6, 0.8, 1.25, 1.6)  # of the best size so far
_CLOUD = 4  # trials about the best values, a value, twice
_SIZE_APART, _SHAPE_APART = 0.3, 0.15  # how far at first, of the logarithm
_ALONG = 2.5  # then: times as far as they are good
_NEAREST = 0.03  # of the logarithm: no value is known better
_ROUGH = 8.0  # by how much the misfit of so few simulations may be off
_AGAINST = 1.0  # of what the readings have against a trial, from which on slopes are taken for it
_HOPELESS = 10.0  # times what the rest leaves, from which on these do not help any more
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
class Trial:
    """A model with a cause at values that are held, all else fitted to the horizon again.

    Attributes
    ----------
    values : mapping
        Of the cause, SI, by name.
    point : (n,) array
        Of the model without the cause.
    readings : float
        By how much more of the readings of all drops is left than without the cause; as little counts as in any verdict.
    rest : Rest
        With departures in the spread of the model without the cause.
    """

    values: Values
    point: Array
    readings: float
    rest: Rest

    def misfit(self, drops: Sequence[int]) -> float:
        """Return the sum of squares of some drops' departures, with what the readings have against it."""
        return self.readings + self.rest.misfit(drops)


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
    trials : tuple of Trial
    """

    base: Contender
    bare: Rest
    suspect: Suspect
    trials: tuple[Trial, ...]

    @property
    def drops(self) -> range:
        """Their places."""
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
        """Covariance of the logarithms of the values about the best (k, k): of all trials, by how good they are."""
        best = self.best(self.drops)
        worse = np.array([each.misfit(self.drops) - self.misfit for each in self.trials])
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
        """True where the cause takes away half of what its base leaves."""
        return self.misfit < _MAY_LEAVE * self.bare.misfit(self.drops)

    def contender(self) -> Contender:
        """Return the model with the cause, its values known from the rest (raises InputError where impossible)."""
        best = self.best(self.drops)
        # a square of the rest counts as many of readings: else these, where the cause hardly acts, lead it away
        known = {name: sigma / math.sqrt(TEMPERATURE) for name, sigma in self.sigmas.items()}
        begun = with_cause(self.base, self.suspect, Start(best.values, known=known))
        columns = [len(self.base.problem.shared)] * len(best.values)
        there = replace(begun.fit, point=np.insert(best.point, columns, 0.0))
        found = settled(replace(begun, fit=there), self.base.horizon, SLOPES)
        # what the fit leaves more or less up to the horizon is counted in the trials, or chance
        return replace(found, later=TEMPERATURE * self.misfit + self.base.misfit - found.misfit)

    def proof(self) -> HeldOut:
        """Return the proof on each drop in turn, its values those of the other drops."""
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
    """True where the rest of several drops is so far from its simulations that a cause is worth seeking."""
    told = acts_later(late) is not None or sum(each.departure for each in late) > _WORTH
    return told and len(late) >= LEAST_DROPS


def departures_left(before: Sequence[LateRecord], after: Sequence[LateRecord]) -> tuple[float, float]:
    """Return the sums of squared departures by two models, in the spread of the first one's simulations."""
    left = [each.in_spread_of(wide) for each, wide in zip(after, before, strict=True)]
    return sum(each.departure for each in before), sum(each.departure for each in left)


def explains(before: Sequence[LateRecord], after: Sequence[LateRecord]) -> bool:
    """True where a model leaves half of the departures of the one before at most, in the spread of that one."""
    without, left = departures_left(before, after)
    return left < _MAY_LEAVE * without


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
    everything, few, more = range(drops), drawn(base, _FEW), drawn(base, _MORE)
    bare = _rest(base.problem, more, base.horizon)
    if bare is None:
        return []
    asked = [each for each in suspects if each.declared.kind.builds_up]
    effects = dict.fromkeys(each.declared for each in asked)
    first = [
        each
        for declared in effects
        if all(declared is not cause.declared for cause in base.causes)
        for each in _at_all_places(base, bare, [each for each in asked if each.declared is declared], few)
    ]
    likeliest = sorted(first, key=lambda each: each[1].misfit(everything))[:_BEST]
    scanned = [
        LateCause(base, bare, suspect, _scanned(base, bare, suspect, at.values, more)) for suspect, at in likeliest
    ]
    promising = sorted([each for each in scanned if each.trials and each.promising], key=lambda each: each.misfit)
    return [each for each in [*(_sought(best, more) for best in promising[:1]), *promising[1:]] if each.proof().seen]


def _at_all_places(
    base: Contender, bare: Rest, alike: Sequence[Suspect], points: Sequence[Array]
) -> list[tuple[Suspect, Trial]]:
    """Return of one effect, with all its words and at all its places, the best trial at each place."""
    everything = range(len(bare.late))

    def tried(suspects: Sequence[Suspect], shapes: Sequence[Values]) -> list[tuple[Suspect, Trial]]:
        return [
            (each, trial)
            for each in suspects
            for shape in shapes
            for trial in _tried(base, bare, each, _sizes(each, shape), points)
        ]

    # words and shapes that fit at both ends fit at one: they are sought once
    widest = [each for each in alike if each.where == "both"] or alike
    found = tried(widest, _shapes(widest[0]))
    if found and len(widest) < len(alike):
        likely, at = min(found, key=lambda each: each[1].misfit(everything))
        one_end = [each for each in alike if each not in widest and each.held == likely.held]
        found += tried(one_end, [{p.name: at.values[p.name] for p in likely.shapes}])
    best: dict[str, tuple[Suspect, Trial]] = {}
    for each in sorted(found, key=lambda each: each[1].misfit(everything)):
        best.setdefault(each[0].name, each)
    return list(best.values())


def _scanned(base: Contender, bare: Rest, suspect: Suspect, near: Values, points: Sequence[Array]) -> tuple[Trial, ...]:
    """Return a cause tried at some values and at other sizes near them."""
    size = suspect.sizes[0][0]
    finer = [{**near, size.name: _within(size, near[size.name] * share)} for share in (1.0, *_FINER)]
    return tuple(_tried(base, bare, suspect, finer, points))


def _sought(cause: LateCause, points: Sequence[Array]) -> LateCause:
    """Return a cause tried at values drawn about its best, then about the best of these as far as they are good.

    The misfit is rough and its valley narrow, since greater friction for less long does the same: descents end on its side.
    """
    rng, suspect = np.random.default_rng(0), cause.suspect
    size = suspect.sizes[0][0].name
    wide = np.diag([_SIZE_APART if name == size else _SHAPE_APART for name in cause.best(cause.drops).values]) ** 2
    for narrowed in (False, True):
        values = cause.best(cause.drops).values
        spread = _ALONG**2 * cause.spread if narrowed else wide
        times = np.exp(rng.multivariate_normal(np.zeros(len(values)), spread, _CLOUD * len(values)))
        drawn_values = [
            {
                name: _within(suspect.declared.parameter(name), value * t)
                for (name, value), t in zip(values.items(), row, strict=True)
            }
            for row in times
        ]
        more = _tried(cause.base, cause.bare, suspect, drawn_values, points)
        cause = replace(cause, trials=(*cause.trials, *more))
    return cause


def _shapes(suspect: Suspect) -> list[Values]:
    """Return values of what a suspect has beside its size, that are tried first."""
    if not suspect.shapes:
        return [{}]
    return [{p.name: _within(p, p.typical * share) for p in suspect.shapes} for share in _SHAPES]


def _sizes(suspect: Suspect, shape: Values) -> list[Values]:
    """Return the same with sizes that are tried first."""
    size, _ = suspect.sizes[0]
    return [{**shape, size.name: _within(size, sized(size, share))} for share in _SIZES]


def _within(of: Declared, value: float) -> float:
    return float(min(max(value, of.low), of.high))


def _tried(
    base: Contender, bare: Rest, suspect: Suspect, values: Sequence[Values], points: Sequence[Array]
) -> list[Trial]:
    """Return a cause at values, with simulations at points about the base's; without those that cannot be, or are no better."""
    found = base.problem.crew.apart(_trial, [(base, bare, suspect, each, points) for each in values])
    return [each for each in found if each is not None]


def _trial(base: Contender, bare: Rest, suspect: Suspect, values: Values, points: Sequence[Array]) -> Trial | None:
    """Return a cause at values; None where it cannot be simulated, or the readings have more against it than it could explain."""
    problem = replace(base.problem, standing=(*base.problem.standing, suspect.effect(values)))
    left = bare.misfit(range(len(bare.late)))
    try:
        found = fit(problem, base.fit.point, base.horizon, linearisations=0, slopes=base.fit.slopes)
        readings = _against(found, base)
        if _AGAINST < readings < _HOPELESS * left:
            found = fit(problem, found.point, base.horizon, FEW_SLOPES)
            readings = _against(found, base)
    except InputError:
        return None
    if readings > left:
        return None
    at = [np.clip(point + found.point - base.fit.point, problem.low, problem.high) for point in points]
    rest = _rest(problem, at, base.horizon)
    if rest is None:
        return None
    late = tuple(each.in_spread_of(wide) for each, wide in zip(rest.late, bare.late, strict=True))
    return Trial(values, found.point, readings, replace(rest, late=late))


def _against(fitted: Fit, base: Contender) -> float:
    """Return by how much more of the readings is left than by a base, squares that count as in a verdict."""
    return max(fitted.misfit - base.fit.misfit, 0.0) / TEMPERATURE


def _rest(problem: Problem, points: Sequence[Array], horizon: float) -> Rest | None:
    """Return the rest of all drops beside simulations at several points, the first of them the fitted one."""
    late = [late_record(problem, points, drop, horizon) for drop in range(len(problem.drops))]
    known = tuple(each for each in late if each is not None)
    return Rest(known, slowings_at(problem, points[0], horizon)) if len(known) == len(late) else None
