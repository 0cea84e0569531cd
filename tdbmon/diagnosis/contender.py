"""A model with causes, fitted to a horizon; one cause put on, and taken off again."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from tdbsim.errors import InputError

from tdbmon.diagnosis.effect_size import share_of
from tdbmon.diagnosis.suspects import Start, Suspect
from tdbmon.identify.cages import better_cages
from tdbmon.identify.follow import FAILING
from tdbmon.identify.least_squares import Fit, as_it_stands, fit
from tdbmon.identify.prediction import DECELERATION
from tdbmon.identify.problem import Problem
from tdbmon.identify.stated_values import with_stated_values
from tdbmon.identify.stray import led_back, stray_drop
from tdbmon.identify.widened import widened

MOST_CAUSES = 3
PLAIN_LEAD = 60.0  # of the plain model in the criterion: of more than a hundred suspects one always fits best
AHEAD = 100.0  # in the criterion: who leads by so much, and leaves noise alone, has won
SIMPLER = 200.0  # in the criterion, that a model with a cause less may lack: fits end that far off their minimum
SLOPES = 8  # times that slopes are taken for the plain model at a horizon
FEW_SLOPES = 2  # the same for a model that has lost anyway, or is not the first
_FAILING = 1.2  # times the floor, from which on a model with causes in contacts fails: their laws are never quite right
EXPLAINED = 1.6  # misfit a residual, up to which a model explains the drops
NEARLY = 3.0  # the same where that is next to nothing of what its causes explain
HARDLY = 1.3  # times the floor: a plain model that leads as far as all are followed and leaves less hardly fails
MINOR = 0.02  # of what its causes in contacts take away: no effect has quite the law that the catalogue has
_COASTS = 6.0  # standard deviations of the deceleration before the release
_NO_BETTER = 0.8  # of what the plain model leaves beyond noise: who leaves so much explains next to nothing
_COMPARABLE = ("m", "rad", "s", "1")  # units of sizes that mean the same to machines large and small
_NEGLIGIBLE = 0.06  # of the typical size: no ring is quite round, no race without waves


@dataclass(frozen=True, eq=False)
class Contender:
    """A model with causes, fitted to a horizon.

    Attributes
    ----------
    causes : tuple of Suspect
        None for the plain model.
    problem : Problem
    fit : Fit
    horizon : float
        s after the release.
    floor : float
        Misfit a residual of the fall before the first contact, where the model can hardly be wrong: that of the noise.
    later : float
        Sum of squares of how the rotor slows after the horizon (see `tdbmon.identify.slowing`), less what a cause takes away
        of the rest of the record (see `tdbmon.diagnosis.late_cause`); 0 as long as nobody asked.
    failed_s : float
        Horizon at which it failed after it had held up to its own, s; 0 where it did not.
    exact_excess : float
        Misfit beyond that of the noise that those of its causes leave by themselves that act outside contacts; infinite where
        it has none beside others, or nobody asked (see `weighed`).
    """

    causes: tuple[Suspect, ...]
    problem: Problem
    fit: Fit
    horizon: float
    floor: float
    later: float = 0.0
    failed_s: float = 0.0
    exact_excess: float = math.inf

    @property
    def misfit(self) -> float:
        """Robust sum of squares in units of the noise, with what is known beforehand."""
        return self.fit.misfit

    @property
    def ratio(self) -> float:
        """Misfit a residual: 1 where only noise is left."""
        return self.fit.ratio

    @property
    def excess(self) -> float:
        """Misfit beyond that of the noise."""
        return max(self.misfit - self.floor * self.fit.count, 0.0)

    @property
    def freedom(self) -> int:
        """Parameters that its causes add; a whole number among n counts as one."""
        return sum(each.freedom for each in self.problem.free)

    @property
    def bic(self) -> float:
        """Bayesian information criterion: G. Schwarz, Ann. Statist. 6 (1978) 461."""
        return self.misfit + self.later + self.freedom * math.log(self.fit.count)

    @property
    def name(self) -> str:
        """Its causes, or that it has none."""
        return " + ".join(cause.name for cause in self.causes) or "plain model"

    @property
    def effects(self) -> frozenset[str]:
        """Identifiers and places of its causes, whatever their words and orders, and whichever joined first."""
        return frozenset(cause.name for cause in self.causes)

    @property
    def words(self) -> str:
        """Its causes and their places in words, or that it has none."""
        return " and ".join(cause.words for cause in self.causes) or "plain model"

    @property
    def times_noise(self) -> str:
        """Its misfit a residual, as people write it."""
        return f"{self.ratio:.2f}" if self.ratio < 10 else f"{self.ratio:.0f}"

    def at_home(self, like: Contender, causes: tuple[Suspect, ...]) -> Contender:
        """Return it, come back from another process, with drops, crew and causes that it was sent off with."""
        known = like.problem
        return replace(self, causes=causes, problem=replace(self.problem, drops=known.drops, crew=known.crew))

    @property
    def drop_specific(self) -> bool:
        """True where one of its causes has angles or a number of its own in every drop, by which it fits much."""
        return any(cause.drop_specific for cause in self.causes)

    @property
    def fits_much(self) -> bool:
        """True where one of its causes is a ball, waves or lobes."""
        return self.much_fitting is not None

    @property
    def much_fitting(self) -> Suspect | None:
        """The last of its causes that is a ball, waves or lobes; None without one."""
        return next((cause for cause in reversed(self.causes) if cause.fits_much), None)

    @property
    def in_contacts(self) -> bool:
        """True where one of its causes acts in contacts."""
        return any(cause.in_contacts for cause in self.causes)

    @property
    def on_shaft(self) -> bool:
        """True where one of its causes acts on the shaft, and not only on what the probes show of it."""
        return not all(cause.declared.acts_on_sensors for cause in self.causes)

    @property
    def negligible(self) -> bool:
        """True where one of its causes is so small that every machine has it."""
        return any(negligible(cause, start.shared) for cause, start in self.known)

    def starts(self) -> list[Start]:
        """Return the values of its causes, from where another fit may begin."""
        each = [self.problem.values(self.fit.point, drop) for drop in range(len(self.problem.drops))]
        return [
            Start(
                {name: each[0][0][f"{free.name}.{name}"] for name in free.start},
                tuple(
                    {name: own[f"{free.name}.{name}"] for name in start}
                    for start, (_, own) in zip(free.each_start, each, strict=True)
                )
                if free.each_start
                else (),
                free.each_held,
                free.known,
            )
            for free in self.problem.free
        ]

    @property
    def known(self) -> list[tuple[Suspect, Start]]:
        """Its causes, each with where it stands."""
        return list(zip(self.causes, self.starts(), strict=True))

    @property
    def fails(self) -> bool:
        """True where more than noise is left."""
        return self.ratio > (_FAILING if self.in_contacts else FAILING) * self.floor

    def fails_beside(self, plain: Contender) -> bool:
        """True where more than noise is left, and not only little of what the plain model leaves.

        Little may be left by a cause in contacts, whose law is a little off; but that has no part in how the rotor coasts, and
        what acts elsewhere has exact laws.  Where the plain model is far off, a second cause may be as little.
        """
        inexact = self.in_contacts and self.ratio <= EXPLAINED
        return self.fails and not (inexact and self.leaves_little(plain) and self.coasts)

    def fails_with_causes(self, plain: Contender) -> bool:
        """True where it has causes that explain something, and fails all the same."""
        return bool(self.causes) and self.fails_beside(plain) and not self.hardly_better(plain)

    def leaves_little(self, plain: Contender) -> bool:
        """True where it leaves so little of what its causes in contacts take away that their laws may be a little off."""
        return self.excess < MINOR * min(plain.excess, self.exact_excess)

    @property
    def coasts(self) -> bool:
        """True where every drop slows before its release as the model has it."""
        return all(abs(residuals[DECELERATION]) < _COASTS for residuals in self.fit.residuals)

    def hardly_better(self, plain: Contender) -> bool:
        """True where it fails and leaves nearly all that the plain model leaves to the same horizon."""
        return self.fails and self.horizon == plain.horizon and self.excess > _NO_BETTER * plain.excess


def negligible(cause: Suspect, values: Mapping[str, float]) -> bool:
    """Return whether sizes (SI, by name) are so small that every machine has such a cause.

    Stiffnesses, torques and unbalances are as large as the machine is: what is little to one is much to another.
    """
    return all(size.si in _COMPARABLE and share_of(size, values[size.name]) < _NEGLIGIBLE for size, _ in cause.sizes)


def settled(contender: Contender, horizon: float, slopes: int) -> Contender:
    """Return a contender fitted to a horizon with slopes taken so many times.

    Where it fails, its cages are turned, and a drop that lost its way is led back.
    """
    problem = contender.problem
    found = replace(contender, fit=fit(problem, contender.fit.point, horizon, slopes), horizon=horizon)
    if horizon < problem.stages.loaded or not found.fails or slopes < 2:
        return found
    found = replace(found, fit=better_cages(problem, found.fit, horizon, 3))
    stray = stray_drop(found.fit, _FAILING * found.floor) if found.fails and horizon >= problem.stages.bounced else None
    return found if stray is None else replace(found, fit=led_back(problem, found.fit, stray, horizon))


def weighed(contender: Contender) -> Contender:
    """Return a contender with what its causes outside contacts leave by themselves.

    Asked where it fails, and by little, and has causes of both kinds.  What a large runout takes away before anything touches
    says nothing of how well the law of a contact fits.
    """
    contacts = [index for index, cause in enumerate(contender.causes) if cause.in_contacts]
    if not contender.fails or contender.ratio > NEARLY or len(contacts) in (0, len(contender.causes)):
        return contender
    try:
        bare = contender
        for index in reversed(contacts):
            bare = without_cause(bare, index)
        return replace(contender, exact_excess=settled(bare, contender.horizon, FEW_SLOPES).excess)
    except InputError:
        return contender


def plain_of(contenders: Sequence[Contender]) -> Contender:
    """Return the plain model among some contenders."""
    return next(each for each in contenders if not each.causes)


def leader(plain: Contender, field: Sequence[Contender], horizon: float) -> Contender:
    """Return the best model that was fitted as far as this."""
    return min((each for each in [plain, *field] if each.horizon == horizon), key=lambda each: each.bic)


def best_of_each_name(fitted: Sequence[Contender]) -> list[Contender]:
    """Return the contenders, the best first, of those with other words or orders of the same cause the best only.

    What turns with a ring and what stands still are two causes: the one has an angle of its own in every drop.
    """
    best: dict[tuple[str, bool], Contender] = {}
    for each in sorted(fitted, key=lambda each: each.bic):
        best.setdefault((each.name, each.causes[-1].turning), each)
    return list(best.values())


def replaced(
    plain: Contender, field: list[Contender], old: Contender, new: Contender
) -> tuple[Contender, list[Contender]]:
    """Return the plain model and the others with one of them, the old one, replaced by the new one."""
    if old is plain:
        return new, field
    return plain, [new if each is old else each for each in field]


def with_cause(contender: Contender, suspect: Suspect, start: Start) -> Contender:
    """Return a contender with one cause more, which begins at given values; its slopes are known, not yet its best fit.

    Raises
    ------
    InputError
        If it cannot be simulated there.
    """
    problem, free = contender.problem, start.free(suspect)
    own = [free.own(drop) for drop in range(len(problem.drops))]
    acting = replace(problem, free=(*problem.free, free))
    wider, found = widened(acting, contender.fit, contender.horizon, free.shared, own)
    causes = (*contender.causes, suspect)
    return replace(contender, causes=causes, problem=wider, fit=found, exact_excess=math.inf)


def with_causes(contender: Contender, causes: Sequence[tuple[Suspect, Start]]) -> Contender:
    """Return `with_cause` for several, one after the other."""
    for each in causes:
        contender = with_cause(contender, *each)
    return contender


def eased(contender: Contender) -> Contender:
    """Return a contender whose machine's values may move too that its file states without tolerance.

    Its slopes are known, not yet its best fit (raises InputError where it cannot be simulated).
    """
    problem, found = with_stated_values(contender.problem, contender.fit, contender.horizon)
    return replace(contender, problem=problem, fit=found)


def without_cause(contender: Contender, index: int) -> Contender:
    """Return a contender with one cause less, not fitted anew (raises InputError where it cannot be simulated)."""
    problem, gone = contender.problem, contender.problem.free[index]
    names = {p.name for p in (*gone.shared, *gone.own(0))}
    narrower = replace(
        problem,
        shared=tuple(p for p in problem.shared if p.name not in names),
        own=tuple(tuple(p for p in own if p.name not in names) for own in problem.own),
        free=tuple(each for each in problem.free if each is not gone),
    )
    point = contender.fit.point[np.array([p.name not in names for p in problem.parameters])]
    slopes = tuple(
        jacobian[:, np.array([p.name not in names for p in (*problem.shared, *problem.own[drop])])]
        for drop, jacobian in enumerate(contender.fit.slopes)
    )
    fitted = as_it_stands(narrower, point, contender.horizon, slopes)
    causes = tuple(cause for k, cause in enumerate(contender.causes) if k != index)
    return replace(contender, causes=causes, problem=narrower, fit=fitted, exact_excess=math.inf)


def without_each(best: Contender, horizon: float) -> list[Contender]:
    """Return a contender without each of its causes in turn, fitted anew from there.

    A cause may only have led the way out of a wrong minimum; without it the model then fits as well, and is the simpler one.
    """
    found = [_fitted_without(best, index, horizon) for index in range(len(best.causes))]
    return [each for each in found if each is not None]


def without_last(found: Sequence[Contender], horizon: float) -> list[Contender]:
    """Return contenders without the cause that joined last, fitted anew from there."""
    bare = [_fitted_without(each, len(each.causes) - 1, horizon) for each in found]
    return [each for each in bare if each is not None]


def _fitted_without(best: Contender, index: int, horizon: float) -> Contender | None:
    """Return a contender with one cause less, fitted anew; None where it cannot be simulated."""
    try:
        bare = without_cause(best, index)
        return replace(bare, fit=fit(bare.problem, bare.fit.point, horizon, 1, slopes=bare.fit.slopes))
    except InputError:
        return None
