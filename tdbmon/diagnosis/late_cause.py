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
_SIZES = np.geomspace(0.25, 4.0, 5)  # of the typical size, at which every cause is tried first
_SHAPES = (0.5, 1.0, 2.0)  # of the typical value of what it has beside its size, likewise
_FEW, _MORE = 8, 16  # simulations of a drop, for that and for what follows
_BEST = 3  # causes that are tried at other values
_FINER = (0.6, 0.8, 1.25, 1.6)  # of the best size so far
_CLOUD = 4  # trials about the best values, a value, twice
_SIZE_APART, _SHAPE_APART = 0.3, 0.15  # how far at first, of the logarithm
_ALONG = 2.5  # then: times as far as they are good
_HELD = 1e-3  # of a value, by which the fit may move it
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
        return slower + departure_of([self.late[d] for d in drops])


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
        """Covariance of the logarithms of the values about the best (k, k): of all trials, by how good they are."""
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
        """True where the cause takes away half of what its base leaves."""
        return self.misfit < _MAY_LEAVE * self.bare.misfit(self.drops)

    def contender(self) -> Contender:
        """Return the model with the cause, held as the rest tells it (raises InputError where impossible)."""
        best = self.best(self.drops)
        # the readings took part in the trials; by themselves, where the cause hardly acts, they would lead it away
        known = {name: _HELD * abs(value) for name, value in best.values.items()}
        begun = with_cause(self.base, self.suspect, Start(best.values, known=known))
        columns = [len(self.base.problem.shared)] * len(best.values)
        there = replace(begun.fit, point=np.insert(best.point, columns, 0.0))
        found = settled(replace(begun, fit=there), self.base.horizon, SLOPES)
        gained = TEMPERATURE * (self.bare.misfit(self.drops) - self.misfit)
        # what the fit leaves more or less up to the horizon is counted in the trials, or chance
        return replace(found, later=self.base.later - gained + self.base.misfit - found.misfit)

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
    told = acts_later(late) is not None or departure_of(late) > _WORTH
    return told and len(late) >= LEAST_DROPS


def explains_the_rest(before: Sequence[LateRecord], after: Sequence[LateRecord]) -> bool:
    """True where a model leaves half of the departures of the one before at most, and none that is worth another cause."""
    return departure_of(after) < _MAY_LEAVE * departure_of(before) and not departs(after)


def with_late_causes(
    base: Contender, field: Sequence[Contender], late: Sequence[LateRecord], suspects: Sequence[Suspect]
) -> tuple[list[Contender], dict[Contender, LateCause]]:
    """Return models and those that have one cause more, which explains the rest of the records, and what was tried of these.

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
    The models, the best first, and nothing more where no cause is convincing, or another model is better still.
    """
    tried: dict[Contender, LateCause] = {}
    for cause in _late_causes(base, late, suspects) if len(base.causes) < MOST_CAUSES else ():
        with suppress(InputError):
            tried[cause.contender()] = cause
    wider = sorted([*field, *tried], key=lambda each: each.bic)
    return (wider, tried) if wider[0] in tried else (list(field), {})


def _late_causes(base: Contender, late: Sequence[LateRecord], suspects: Sequence[Suspect]) -> list[LateCause]:
    """Return the causes that explain the rest of the drops where a model does not."""
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
    # those that are as good as rough misfits can tell, with the same pains
    rivals = [each for each in promising if each.misfit < min(other.misfit for other in promising) + _ROUGH]
    return [each for each in (_sought(rival, points) for rival in rivals) if each.proof().seen]


def _at_all_places(
    base: Contender, bare: Rest, alike: Sequence[Suspect], points: Sequence[Array]
) -> list[tuple[Suspect, Trial]]:
    """Return of one effect, with all its words and at all its places, the best trial at each place."""
    drops = range(len(bare.late))
    shapes = _shapes(alike[0])
    # words and shapes that fit at both ends fit at one: they are sought once
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


def _sought(cause: LateCause, points: Sequence[Array]) -> LateCause:
    """Return a cause tried at values drawn about its best, then about the best of these, farther along where they are good.

    The misfit is rough and its valley narrow, since greater friction for less long does the same: descents end on its side.
    """
    rng, suspect = np.random.default_rng(0), cause.suspect
    size = suspect.sizes[0][0].name
    wide = np.diag([_SIZE_APART if name == size else _SHAPE_APART for name in cause.best(cause.drops).values]) ** 2
    for narrowed in (False, True):
        values = cause.best(cause.drops).values
        spread = _ALONG**2 * cause.spread if narrowed else wide
        times = np.exp(rng.multivariate_normal(np.zeros(len(values)), spread, _CLOUD * len(values)))
        tried = [
            (suspect, {name: _within(suspect, name, values[name] * t) for name, t in zip(values, row, strict=True)})
            for row in times
        ]
        more = (trial for _, trial in _tried(cause.base, cause.bare, tried, points))
        cause = replace(cause, trials=(*cause.trials, *more))
    return cause


def _shapes(suspect: Suspect) -> list[Values]:
    """Return values of what a suspect has beside its size, that are tried first."""
    if not suspect.shapes:
        return [{}]
    return [{p.name: _within(suspect, p.name, p.typical * share) for p in suspect.shapes} for share in _SHAPES]


def _sizes(suspect: Suspect, shape: Values) -> list[Values]:
    """Return the same with sizes that are tried first."""
    size, _ = suspect.sizes[0]
    return [{**shape, size.name: _within(suspect, size.name, sized(size, share))} for share in _SIZES]


def _near(suspect: Suspect, values: Values) -> list[Values]:
    """Return values and others of nearly the same size, each once."""
    size = suspect.sizes[0][0].name
    near = dict.fromkeys(_within(suspect, size, values[size] * share) for share in (1.0, *_FINER))
    return [{**values, size: value} for value in near]


def _within(suspect: Suspect, name: str, value: float) -> float:
    """Return a value of a suspect put within its bounds."""
    of = suspect.declared.parameter(name)
    return float(min(max(value, of.low), of.high))


def _tried(
    base: Contender, bare: Rest, asked: Sequence[tuple[Suspect, Values]], points: Sequence[Array]
) -> list[tuple[Suspect, Trial]]:
    """Return causes at values, with simulations at points about the base's; without those that cannot be, or are no better."""
    found = base.problem.crew.apart(_trial, [(base, bare, suspect, values, points) for suspect, values in asked])
    return [(suspect, trial) for (suspect, _), trial in zip(asked, found, strict=True) if trial is not None]


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
    beside: dict[int, LateRecord] = {}
    # the drop that departs most shows first that nothing is gained
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


def _against(fitted: Fit, base: Contender) -> float:
    """Return by how much more of the readings is left than by a base, squares that count as in a verdict."""
    return max(fitted.misfit - base.fit.misfit, 0.0) / TEMPERATURE
