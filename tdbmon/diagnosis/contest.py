"""Models that compete for the drops: the plain one, and those that a suspect or two extend.

The horizon grows from the free fall past the first contacts.  As soon as the best model fails, every suspect is fitted
to as far as it came: roughly, with slopes that are known; those that come out best once more with their own.  They go on
with it; those that fall behind drop out.  So the competition takes place where the model begins to fail, before wrong
values have made up for what it lacks.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from tdbsim.effect import Parameter as Declared
from tdbsim.errors import InputError

from tdbmon.diagnosis.score import Score, scores
from tdbmon.diagnosis.suspects import Start, Suspect
from tdbmon.identify.cages import better_cages, turn_cages
from tdbmon.identify.calibrate import CONTACT_S, FAILING
from tdbmon.identify.least_squares import Fit, fit, misfit_of
from tdbmon.identify.problem import Problem

Progress = Callable[[str], None]

# s after the release; in small steps, since a fit that is right to one leads into the right minimum of the next
HORIZONS = (0.006, 0.01, 0.014, 0.018, 0.022, 0.027, 0.033, 0.04)
MOST_CAUSES = 3
_SLOPES = 8  # times that slopes are taken for the plain model at a horizon
_FEW_SLOPES = 2  # the same for a model that has lost anyway, or is not the first
_SAME_NAME = 2  # of one effect at one place with other words or orders, that are fitted roughly
_ADMITTED = 8  # of those fitted roughly, fitted with their own slopes
_PROMISED = 5  # of the best scores, fitted with their own slopes too
_SAME_KIND = 3  # of one effect among them
_SMALLER = 0.3  # of the size that a score promises, where that is too much
_SEATED = 3  # of them, that go on
_ROUNDS = 4  # times at most that all suspects are fitted
_FAILING = 1.2  # times the floor, from which on a model with causes fails: sizes and orders are never quite right
MINOR = 0.02  # of what the plain model leaves beyond noise: no effect has quite the law that the catalogue has
_HIGHEST_FLOOR = 0.9  # misfit a residual of noise alone: large residuals count less than their square
_KEPT = 3  # contenders that go on to the next horizon
_EARLIEST_S = 0.022  # s; until then both ends have touched, and mostly twice
_SOUND_S = 0.018  # s; a model that held so far is judged there, if it fails further on
_AHEAD = 100.0  # in the criterion: who leads by so much has won
_SIMPLER = 200.0  # in the criterion, that a model with a cause less may lack: fits end that far off their minimum
_BEHIND = 1.5  # times the best ratio: who leaves more does not go on
_LOST, _LOST_HORIZONS = 3.0, 2  # the best ratio at so many horizons running, where it is no use to go on
_NEARLY = 2.0  # misfit a residual, from which on a model that another halves is hopeless
_NEGLIGIBLE = 0.06  # of the typical size: no ring is quite round, no race without waves
_SURE = 20.0  # sum of squares that a suspect must promise beyond the price of its parameters
_PROMISE = 0.2  # of what is left beyond noise, that a further cause must promise
_SHARE = 0.5  # of what is left beyond noise, that a further cause must take away


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
    """

    causes: tuple[Suspect, ...]
    problem: Problem
    fit: Fit
    horizon: float
    floor: float

    @property
    def misfit(self) -> float:
        """Robust sum of squares in units of the noise, with what is known beforehand."""
        return self.fit.misfit

    @property
    def residuals(self) -> int:
        """How many there are."""
        return sum(len(r) for r in self.fit.residuals)

    @property
    def ratio(self) -> float:
        """Misfit a residual: 1 where only noise is left."""
        return self.misfit / self.residuals

    @property
    def excess(self) -> float:
        """Misfit beyond that of the noise."""
        return max(self.misfit - self.floor * self.residuals, 0.0)

    @property
    def freedom(self) -> int:
        """Parameters that its causes add; a whole number among n counts as one."""
        return sum(each.freedom for each in self.problem.free)

    @property
    def bic(self) -> float:
        """Bayesian information criterion: G. Schwarz, Ann. Statist. 6 (1978) 461."""
        return self.misfit + self.freedom * math.log(self.residuals)

    @property
    def name(self) -> str:
        """Its causes, or that it has none."""
        return " + ".join(cause.name for cause in self.causes) or "plain model"

    @property
    def negligible(self) -> bool:
        """True where one of its causes is so small that every machine has it."""
        shared, _ = self.problem.values(self.fit.point, 0)
        return any(
            all(_share(size, shared[f"{cause.name}.{size.name}"]) < _NEGLIGIBLE for size, _ in cause.sizes)
            for cause in self.causes
        )

    @property
    def fails(self) -> bool:
        """True where more than noise is left."""
        return self.ratio > (_FAILING if self.causes else FAILING) * self.floor

    def fails_beside(self, plain: Contender) -> bool:
        """True where more than noise is left, and not only little of what the plain model leaves."""
        return self.fails and not (self.causes and self.excess < MINOR * plain.excess)


def _share(size: Declared, value: float) -> float:
    """Return a size as a share of the typical one, both counted from where the effect is off."""
    off = size.off if isinstance(size.off, float) else 0.0
    if math.isinf(off):
        return size.typical / value
    return abs(value - off) / abs(size.typical - off)


def contest(
    problem: Problem, suspects: Sequence[Suspect], horizons: Sequence[float], progress: Progress
) -> list[Contender]:
    """Return the contenders at the last horizon, the best first; the plain model is always among them.

    Raises
    ------
    InputError
        If the plain model cannot be simulated.
    """
    fallen = fit(problem, problem.start, horizons[0], _SLOPES)
    # an effect may show in the fall already: then the noise is no less than it was before the release
    floor = min(fallen.misfit / sum(len(r) for r in fallen.residuals), _HIGHEST_FLOOR)
    plain = Contender((), problem, fallen, horizons[0], floor)
    search = _Search(suspects, horizons, progress)
    field: list[Contender] = []
    sound: tuple[Contender, ...] = ()
    lost, decided = 0, False
    for horizon in horizons:
        progress(f"fitting the first {horizon * 1e3:g} ms")
        hopeless = decided or (plain.ratio > _NEARLY and any(plain.ratio > 2 * each.ratio for each in field))
        if not hopeless:
            plain = settled(plain, horizon, _SLOPES)
        field = _refitted(field, horizon)
        if hopeless and all(each.fails for each in field):  # how much is left, is judged by what it leaves
            plain = settled(plain, horizon, _FEW_SLOPES)
        plain, field = search.compared(plain, field, horizon)
        best = min([plain, *field], key=lambda each: each.ratio)
        field = _kept(field)
        fine = any(not each.fails_beside(plain) for each in field)
        if sound and not fine:  # what held up to here is the better witness: neighbouring paths part
            field, horizon = list(sound), sound[0].horizon
            plain = settled(plain, horizon, _SLOPES)
            break
        sound = tuple(field) if fine and horizon >= _SOUND_S else ()
        # where nothing explains the first contacts, nothing will explain the later ones
        lost = lost + 1 if best.ratio > (_LOST if search.rounds else _NEARLY) else 0
        if lost >= _LOST_HORIZONS:
            break
        if not decided and horizon >= _EARLIEST_S and _decided(plain, field, horizon):
            decided, field = True, [_leader(plain, field, horizon)]
    if plain.horizon < horizon:
        plain = settled(plain, horizon, _FEW_SLOPES)
    plain, field = _simplified(plain, field)
    return sorted([plain, *field], key=lambda each: each.bic)


@dataclass
class _Search:
    """The search for causes: what it may draw on, and how often it still may.

    Attributes
    ----------
    suspects : sequence of Suspect
    horizons : sequence of float
        s.
    progress : callable
    rounds : int
        Times that all suspects may still be fitted.
    """

    suspects: Sequence[Suspect]
    horizons: Sequence[float]
    progress: Progress
    rounds: int = _ROUNDS

    def compared(self, plain: Contender, field: list[Contender], horizon: float) -> tuple[Contender, list[Contender]]:
        """Return the plain model and the others, after suspects were asked to explain what the best model leaves."""
        last = horizon == self.horizons[-1]
        best = _leader(plain, field, horizon)
        while len(best.causes) < MOST_CAUSES and self.rounds:
            if not (best.fails_beside(plain) or (last and not best.causes)):
                break
            self.rounds -= 1
            self.progress(f"looking for what would explain the first {horizon * 1e3:g} ms")
            found = _invited(best, horizon, self.suspects, field)
            if best.causes:
                found = [each for each in found if best.misfit - each.misfit > _SHARE * best.excess]
            if not found:
                break
            field = field + [each for each in found if not each.negligible]
            after = min([best, *found], key=lambda each: each.bic)
            for freed in _freed(after, horizon):
                if freed.causes:
                    field.append(freed)
                elif freed.misfit < plain.misfit or plain.horizon < horizon:
                    plain = freed
            after = _leader(plain, field, horizon)
            if after is best or after.bic > best.bic - _SURE:
                break
            best = after
        return plain, field


def _simplified(plain: Contender, field: list[Contender]) -> tuple[Contender, list[Contender]]:
    """Return the models with those among them that need a cause less and leave noise alone just as well."""
    while field:
        best = min(field, key=lambda each: each.bic)
        simpler = []
        for freed in _freed(best, best.horizon):
            # a model that is nowhere near without a cause needs it
            near = settled(freed, best.horizon, _SLOPES) if freed.ratio < 2 * _NEARLY * best.ratio else freed
            if not near.fails_beside(plain) and near.bic < best.bic + _SIMPLER:
                simpler.append(near)
        if not simpler:
            break
        kept = min(simpler, key=lambda each: each.bic)
        field = [each for each in field if len(each.causes) <= len(kept.causes) and each.name != kept.name]
        if not kept.causes:
            plain = min(plain, kept, key=lambda each: each.misfit)
            break
        field.append(kept)
    return plain, field


def _decided(plain: Contender, field: Sequence[Contender], horizon: float) -> bool:
    """True where one model leaves noise alone and no other comes near: it goes on alone."""
    ranked = sorted((each for each in field if each.horizon == horizon), key=lambda each: each.bic)
    if not ranked or ranked[0].fails_beside(plain) or plain.ratio < _BEHIND * ranked[0].ratio:
        return False
    mine = {cause.name for cause in ranked[0].causes}
    rivals = [each for each in ranked[1:] if {cause.name for cause in each.causes} != mine]
    return all(each.bic > ranked[0].bic + _AHEAD for each in rivals)


def _leader(plain: Contender, field: Sequence[Contender], horizon: float) -> Contender:
    """Return the best model that was fitted as far as this."""
    return min((each for each in [plain, *field] if each.horizon == horizon), key=lambda each: each.bic)


def _kept(field: Sequence[Contender]) -> list[Contender]:
    """Return the contenders that go on: the best, and those not far behind."""
    ranked = sorted(field, key=lambda each: each.bic)[:_KEPT]
    return [each for each in ranked if each.ratio < _BEHIND * ranked[0].ratio]


def settled(contender: Contender, horizon: float, slopes: int) -> Contender:
    """Return a contender fitted to a horizon with slopes taken so many times, its cages turned where it fails."""
    problem = contender.problem
    found = replace(contender, fit=fit(problem, contender.fit.point, horizon, slopes), horizon=horizon)
    if horizon < CONTACT_S or not found.fails or slopes < 2:
        return found
    return replace(found, fit=better_cages(problem, found.fit, horizon, 3))


def with_cause(contender: Contender, suspect: Suspect, start: Start) -> Contender:
    """Return a contender with one cause more, which begins at given values; its slopes are known, not yet its best fit.

    Raises
    ------
    InputError
        If it cannot be simulated there.
    """
    problem, free = contender.problem, start.free(suspect)
    wider = replace(
        problem,
        shared=(*problem.shared, *free.shared),
        own=tuple((*own, *free.own(drop)) for drop, own in enumerate(problem.own)),
        free=(*problem.free, free),
    )
    count, width = len(problem.shared), len(problem.own[0])
    parts = [contender.fit.point[:count], np.zeros(len(free.shared))]
    for drop in range(len(problem.drops)):
        begin = count + drop * width
        parts += [contender.fit.point[begin : begin + width], np.zeros(len(free.own(drop)))]
    point = np.concatenate(parts)
    new = {p.name for p in (*free.shared, *free.own(0))}
    linear = wider.each(lambda drop: wider.slopes(point, drop, contender.horizon, new))
    slopes = []
    for drop, (_, added) in enumerate(linear):
        kept = contender.fit.slopes[drop]
        old = np.array([p.name not in new for p in (*wider.shared, *wider.own[drop])])
        added[:, old] = kept
        slopes.append(added)
    residuals = tuple(r for r, _ in linear)
    fitted = Fit(point, residuals, tuple(slopes), misfit_of(wider, residuals, point))
    return replace(contender, causes=(*contender.causes, suspect), problem=wider, fit=fitted)


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
    residuals = narrower.all_residuals(point, contender.horizon)
    if residuals is None:
        raise InputError(f"without {gone.name} the model cannot be simulated")
    fitted = Fit(point, tuple(residuals), slopes, misfit_of(narrower, residuals, point))
    causes = tuple(cause for k, cause in enumerate(contender.causes) if k != index)
    return replace(contender, causes=causes, problem=narrower, fit=fitted)


def _refitted(field: Sequence[Contender], horizon: float) -> list[Contender]:
    """Return the contenders fitted to a horizon, the leader with most care."""
    out = []
    for place, each in enumerate(sorted(field, key=lambda each: each.bic)):
        try:
            out.append(settled(each, horizon, _SLOPES if place == 0 else _FEW_SLOPES))
        except InputError:
            continue
    return out


def _invited(
    best: Contender, horizon: float, suspects: Sequence[Suspect], field: Sequence[Contender]
) -> list[Contender]:
    """Return the best contender with each of the suspects that explain most, fitted.

    The scores say where the fit of each begins; where that is no good, what acts in contacts begins at its usual size too,
    at several angles.
    Where the plain model fails, all are fitted roughly: with the slopes of the model that they extend and their own at
    their start.  A score follows straight lines; these fits go beyond.
    """
    rough = []
    asked = _asked(best, horizon, suspects, field)
    for score in asked:
        suspect = score.suspect
        begun = [_roughly(best, suspect, score.start)]
        if begun[0] is None or begun[0].misfit > best.misfit:  # the score saw a straight line further than it goes
            further = (suspect.smaller(score.start, _SMALLER), *(suspect.usual() if horizon <= _SOUND_S else ()))
            begun += [_roughly(best, suspect, start) for start in further]
        rough += sorted((each for each in begun if each is not None), key=lambda each: each.bic)[:1]
    rough.sort(key=lambda each: each.bic)
    likely, others = _admitted(rough, [score.suspect for score in asked[:_PROMISED]])
    fitted = _with_own_slopes(likely, horizon)
    explained = any(best.misfit - each.misfit > _SHARE * best.excess for each in fitted)
    if not explained and not best.causes and horizon <= _SOUND_S:
        fitted += _with_own_slopes(others, horizon)
    seated = sorted(fitted, key=lambda each: each.bic)[:_SEATED]
    return [settled(each, horizon, _SLOPES if place == 0 else _FEW_SLOPES) for place, each in enumerate(seated)]


def _admitted(rough: Sequence[Contender], promised: Sequence[Suspect]) -> tuple[list[Contender], list[Contender]]:
    """Return who of those fitted roughly, the best first, gets slopes of his own, and who gets them if nobody explains.

    Those of the best scores do: a rough fit may fail where the score is right.  What acts in contacts is seldom near its
    minimum yet, nor is it known which ball differs; later on it takes too long.
    """
    likely: list[Contender] = []
    others: list[Contender] = []
    kinds: dict[str, int] = {}
    for place, each in enumerate(rough):
        new = each.causes[-1]
        kind = new.declared.identifier
        if new in promised or new.counted is not None:
            likely.append(each)
            continue
        kinds[kind] = kinds.get(kind, 0) + 1
        if kinds[kind] <= _SAME_KIND and place < _ADMITTED:
            likely.append(each)
        elif kinds[kind] <= _SAME_KIND and new.in_contacts and not new.turning:
            others.append(each)
    return likely, others


def _roughly(best: Contender, suspect: Suspect, start: Start) -> Contender | None:
    """Return a contender with one cause more, fitted with the slopes that are known; None where that is impossible."""
    try:
        widened = with_cause(best, suspect, start)
        return replace(widened, fit=fit(widened.problem, widened.fit.point, best.horizon, 0, slopes=widened.fit.slopes))
    except InputError:
        return None


def _asked(best: Contender, horizon: float, suspects: Sequence[Suspect], field: Sequence[Contender]) -> list[Score]:
    """Return the suspects to fit roughly: all where the plain model fails, else those that promise a gain."""
    taken = {each.name for each in best.causes}
    known = {frozenset(cause.name for cause in each.causes) for each in field if each.horizon == horizon}
    open_to = [s for s in suspects if s.name not in taken and frozenset({*taken, s.name}) not in known]
    price = math.log(best.residuals)
    asked: list[Score] = []
    names: dict[str, int] = {}
    for score in scores(best.problem, best.fit, horizon, open_to):
        name = score.suspect.name
        names[name] = names.get(name, 0) + 1
        worth = score.gain - score.start.free(score.suspect).freedom * price
        least = _PROMISE * best.excess if best.causes else -math.inf if best.fails else _SURE
        if names[name] <= _SAME_NAME and worth > least:
            asked.append(score)
    return asked


def _with_own_slopes(contenders: Sequence[Contender], horizon: float) -> list[Contender]:
    """Return those contenders that can be simulated, fitted anew."""
    out = []
    for each in contenders:
        try:
            out.append(_anew(each, horizon))
        except InputError:
            continue
    return out


def _anew(contender: Contender, horizon: float) -> Contender:
    """Return a contender fitted anew; which ball differs, or at which phase a ring is, is searched too."""
    problem, new = contender.problem, contender.causes[-1]
    if new.counted is None and not new.turning:
        return replace(contender, fit=fit(problem, contender.fit.point, horizon, 1))
    found = contender.fit
    for _ in range(2):
        found = fit(problem, turn_cages(problem, found, horizon), horizon, 1)
    return replace(contender, fit=found)


def _freed(best: Contender, horizon: float) -> list[Contender]:
    """Return a contender without each of its causes in turn, fitted anew from there.

    A cause may only have led the way out of a wrong minimum; without it the model then fits as well, and is the simpler one.
    """
    out = []
    for index in range(len(best.causes)):
        try:
            bare = without_cause(best, index)
            out.append(replace(bare, fit=fit(bare.problem, bare.fit.point, horizon, 1, slopes=bare.fit.slopes)))
        except InputError:
            continue
    return out
