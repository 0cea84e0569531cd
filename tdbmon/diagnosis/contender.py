"""A model with causes, fitted to a horizon; adding and removing one cause."""

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
PLAIN_LEAD = 60.0  # BIC lead of the plain model: of more than a hundred suspects one always fits best by chance
AHEAD = 100.0  # BIC lead with which a model that holds has won
SIMPLER = 200.0  # BIC by which a model with one cause less may be worse: fits end that far from their minimum
SLOPES = 8  # Jacobians at a horizon for the plain model and the leader
FEW_SLOPES = 2  # Jacobians at a horizon for any other model
_FAILING = 1.2  # times the floor: a model with contact causes fails above it, since their laws are never exact
EXPLAINED = 1.6  # misfit ratio up to which a model explains the drops
NEARLY = 3.0  # the same where the excess is next to nothing of what the causes explain
HARDLY = 1.3  # times the floor: a plain model that leads at the last common horizon and leaves less hardly fails
MINOR = 0.02  # share of the excess that contact causes may leave: no law of the catalogue is exact
_COASTS = 6.0  # standard deviations of the deceleration before the release
_NO_BETTER = 0.8  # of the plain model's excess: a model that leaves more explains next to nothing
_COMPARABLE = ("m", "rad", "s", "1")  # units of sizes that do not scale with the machine
_NEGLIGIBLE = 0.06  # of the typical size: no ring is perfectly round, no race free of waves


@dataclass(frozen=True, eq=False)
class Contender:
    """A model of a contest, plain or with causes, fitted to a horizon.

    Attributes
    ----------
    causes : tuple of Suspect
        Empty for the plain model.
    problem : Problem
    fit : Fit
    horizon : float
        s after the release.
    floor : float
        Misfit ratio of the fall, where the model can hardly be wrong: that of noise alone.
    later : float
        Misfit of the slowing after the horizon (see `tdbmon.identify.slowing`), less what a cause takes away of the misfit of
        the rest of the record (see `tdbmon.diagnosis.late_cause`); 0 unless computed.
    failed_s : float
        Later horizon at which it failed after it held at its own, s; 0 if it did not fail.
    exact_excess : float
        Excess without its contact causes; infinite unless computed (see `weighed`) for a model with causes of both kinds.
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
        """Robust sum of squared residuals in units of the noise, priors included."""
        return self.fit.misfit

    @property
    def ratio(self) -> float:
        """Misfit ratio: misfit per residual, 1 for noise alone."""
        return self.fit.ratio

    @property
    def excess(self) -> float:
        """Misfit beyond the floor."""
        return max(self.misfit - self.floor * self.fit.count, 0.0)

    @property
    def freedom(self) -> int:
        """Number of parameters that its causes add; a whole number counts as one."""
        return sum(each.freedom for each in self.problem.free)

    @property
    def bic(self) -> float:
        """Bayesian information criterion: G. Schwarz, Ann. Statist. 6 (1978) 461."""
        return self.misfit + self.later + self.freedom * math.log(self.fit.count)

    @property
    def name(self) -> str:
        """Names of its causes, or ``plain model``."""
        return " + ".join(cause.name for cause in self.causes) or "plain model"

    @property
    def effects(self) -> frozenset[str]:
        """Identifiers and places of its causes, regardless of their words, orders and sequence."""
        return frozenset(cause.name for cause in self.causes)

    @property
    def words(self) -> str:
        """Its causes and their places in words, or ``plain model``."""
        return " and ".join(cause.words for cause in self.causes) or "plain model"

    @property
    def times_noise(self) -> str:
        """Its misfit ratio as text."""
        return f"{self.ratio:.2f}" if self.ratio < 10 else f"{self.ratio:.0f}"

    def at_home(self, like: Contender, causes: tuple[Suspect, ...]) -> Contender:
        """Return this contender, received from another process, with the drops and crew of `like` and the given causes."""
        known = like.problem
        return replace(self, causes=causes, problem=replace(self.problem, drops=known.drops, crew=known.crew))

    @property
    def drop_specific(self) -> bool:
        """True if one of its causes has an angle or a number of its own in every drop."""
        return any(cause.drop_specific for cause in self.causes)

    @property
    def fits_much(self) -> bool:
        """True if one of its causes is a ball, waves or lobes."""
        return self.much_fitting is not None

    @property
    def much_fitting(self) -> Suspect | None:
        """Its last cause that is a ball, waves or lobes; None without one."""
        return next((cause for cause in reversed(self.causes) if cause.fits_much), None)

    @property
    def in_contacts(self) -> bool:
        """True if one of its causes acts in contacts."""
        return any(cause.in_contacts for cause in self.causes)

    @property
    def on_shaft(self) -> bool:
        """True if one of its causes acts on the shaft, not on sensors alone."""
        return not all(cause.declared.acts_on_sensors for cause in self.causes)

    @property
    def negligible(self) -> bool:
        """True if one of its causes is so small that every machine has it."""
        return any(negligible(cause, start.shared) for cause, start in self.known)

    def starts(self) -> list[Start]:
        """Return the fitted values of its causes as start points."""
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
        """Its causes with their fitted values as start points."""
        return list(zip(self.causes, self.starts(), strict=True))

    @property
    def fails(self) -> bool:
        """True if its misfit ratio exceeds what noise alone leaves."""
        return self.ratio > (_FAILING if self.in_contacts else FAILING) * self.floor

    def fails_beside(self, plain: Contender) -> bool:
        """True if it fails, and inexact laws of its contact causes do not account for the excess.

        Such laws leave a small share of the plain model's excess; up to a misfit ratio of `EXPLAINED` only, since where the plain
        model is far off a second cause may be as small a share.  They have no part in how the rotor coasts, and causes outside
        contacts have exact laws.
        """
        inexact = self.in_contacts and self.ratio <= EXPLAINED
        return self.fails and not (inexact and self.leaves_little(plain) and self.coasts)

    def fails_with_causes(self, plain: Contender) -> bool:
        """True if it has causes that explain something, and still fails."""
        return bool(self.causes) and self.fails_beside(plain) and not self.hardly_better(plain)

    def leaves_little(self, plain: Contender) -> bool:
        """True if its excess is so small a share of what its contact causes take away that inexact laws may account for it."""
        return self.excess < MINOR * min(plain.excess, self.exact_excess)

    @property
    def coasts(self) -> bool:
        """True if every drop slows before its release as the model predicts."""
        return all(abs(residuals[DECELERATION]) < _COASTS for residuals in self.fit.residuals)

    def hardly_better(self, plain: Contender) -> bool:
        """True if it fails and leaves nearly all of the plain model's excess at the same horizon."""
        return self.fails and self.horizon == plain.horizon and self.excess > _NO_BETTER * plain.excess


def negligible(cause: Suspect, values: Mapping[str, float]) -> bool:
    """True if the cause's sizes (SI, by name) are so small that every machine has such a cause.

    Never for stiffnesses, torques and unbalances, which scale with the machine.
    """
    return all(size.si in _COMPARABLE and share_of(size, values[size.name]) < _NEGLIGIBLE for size, _ in cause.sizes)


def settled(contender: Contender, horizon: float, slopes: int) -> Contender:
    """Return the contender fitted to a horizon with `slopes` Jacobians.

    If it fails, other cage angles are tried, and the path of a drop that went astray is searched for again.
    """
    problem = contender.problem
    found = replace(contender, fit=fit(problem, contender.fit.point, horizon, slopes), horizon=horizon)
    if horizon < problem.stages.loaded or not found.fails or slopes < 2:
        return found
    found = replace(found, fit=better_cages(problem, found.fit, horizon, 3))
    stray = stray_drop(found.fit, _FAILING * found.floor) if found.fails and horizon >= problem.stages.bounced else None
    return found if stray is None else replace(found, fit=led_back(problem, found.fit, stray, horizon))


def weighed(contender: Contender) -> Contender:
    """Return the contender with `exact_excess` computed, if it has causes of both kinds and fails by little.

    Else a large runout, explained before any contact, would make every excess look small against what the causes explain, and
    pass it for an inexact law of a contact.
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
    """Return the plain model among the contenders."""
    return next(each for each in contenders if not each.causes)


def leader(plain: Contender, field: Sequence[Contender], horizon: float) -> Contender:
    """Return the model with the lowest BIC at a horizon."""
    return min((each for each in [plain, *field] if each.horizon == horizon), key=lambda each: each.bic)


def best_of_each_name(fitted: Sequence[Contender]) -> list[Contender]:
    """Return the best contender of each name, the best first; other words and orders of the last cause share its name.

    A cause that turns with a ring and the same at rest count as two: the former has an angle of its own in every drop.
    """
    best: dict[tuple[str, bool], Contender] = {}
    for each in sorted(fitted, key=lambda each: each.bic):
        best.setdefault((each.name, each.causes[-1].turning), each)
    return list(best.values())


def replaced(
    plain: Contender, field: list[Contender], old: Contender, new: Contender
) -> tuple[Contender, list[Contender]]:
    """Return the plain model and the others, with `old` replaced by `new`."""
    if old is plain:
        return new, field
    return plain, [new if each is old else each for each in field]


def with_cause(contender: Contender, suspect: Suspect, start: Start) -> Contender:
    """Return the contender with one more cause at its start point: Jacobian evaluated, not yet fitted.

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
    """Apply `with_cause` for several causes in turn."""
    for each in causes:
        contender = with_cause(contender, *each)
    return contender


def eased(contender: Contender) -> Contender:
    """Return the contender with the values freed that the machine file states without tolerance.

    The Jacobian is evaluated, the model not yet fitted (raises InputError if it cannot be simulated).
    """
    problem, found = with_stated_values(contender.problem, contender.fit, contender.horizon)
    return replace(contender, problem=problem, fit=found)


def without_cause(contender: Contender, index: int) -> Contender:
    """Return the contender with one cause removed, not refitted (raises InputError if it cannot be simulated)."""
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
    """Return the contender with each of its causes removed in turn, refitted.

    A cause may only have led the fit out of a wrong minimum; without it the model then fits as well, and is simpler.
    """
    found = [_fitted_without(best, index, horizon) for index in range(len(best.causes))]
    return [each for each in found if each is not None]


def without_last(found: Sequence[Contender], horizon: float) -> list[Contender]:
    """Return the contenders with their last cause removed, refitted."""
    bare = [_fitted_without(each, len(each.causes) - 1, horizon) for each in found]
    return [each for each in bare if each is not None]


def _fitted_without(best: Contender, index: int, horizon: float) -> Contender | None:
    """Return the contender with one cause removed, refitted; None if it cannot be simulated."""
    try:
        bare = without_cause(best, index)
        return replace(bare, fit=fit(bare.problem, bare.fit.point, horizon, 1, slopes=bare.fit.slopes))
    except InputError:
        return None
