"""An entry of the machine file that the drops contradict.

A model that fails may lack something, or be a good model of another machine: a gap given as a diameter, a stiffness wrong by a
power of ten.  So each kind of entry in turn, at both ends, is freed of its tolerance.  Where the plain model then follows the
first contacts, which it did not before, the entry is reported with the value that fits the drops.  The shaft's angle over the
rest of the record must agree: up to the first contacts a drag of another law looks like a shorter decay.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from tdbmon.identify.divergence import divergence
from tdbmon.identify.first_fits import SLOPES, STAGES, few_drops, of_which
from tdbmon.identify.follow import FAILING
from tdbmon.identify.least_squares import Fit, fit_or_none
from tdbmon.identify.parameters import Parameter, entries, restated_machine
from tdbmon.identify.problem import Problem, build_problem
from tdbmon.identify.robust import FLOOR
from tdbmon.identify.slowing import slowing_misfit, slowings_at
from tdbmon.identify.stages import stages_of

Array = NDArray[np.float64]

_FACTOR = 10.0  # by which an entry may be wrong
_STARTS = (1.0,), (3.0, 1 / 3)  # times the stated value, where fits begin; the second set where the first finds nothing
_FAILS = 3.0  # times `FLOOR`: misfit ratio of a plain model, from which on the search is worth it
_BEHIND = 2.0  # times the least misfit ratio: entries beyond it are dropped
_WORTH = 0.5  # of the plain model's excess at a horizon, that an entry must remove to be continued
_ALONE = 0.05  # of the same excess, that a gap may leave: restated and fitted anew it may leave noise alone
_LITTLE = 0.3  # excess of the misfit ratio that is tolerated in any case
# sum of squares per window of the shaft's angle, over the rest of the record, that contradicts an entry; right ones leave less
# than one
_CONTRADICTED = 25.0
_LEAST = 0.5  # least sum of squares per residual that noise leaves
# relative changes of an entry that show whether it affects the fall; a gap affects it only where the shaft touches
_NUDGES = (0.01, 1 / _FACTOR - 1)


@dataclass(frozen=True)
class Mistaken:
    """An error of set-up in words, and the values of the machine file's entries (SI, by name) that fit the drops."""

    why: str
    wanted: Mapping[str, float] = field(default_factory=dict)
    of_two_machines: bool = False


@dataclass(frozen=True, eq=False)
class _Trial:
    """Entries of one kind, freed of their tolerances, and the state of a fit with them."""

    entries: tuple[Parameter, ...]
    problem: Problem
    point: Array
    misfit: float = math.inf  # misfit ratio

    @property
    def first(self) -> int:
        """Index of the first entry among the coordinates of the point."""
        return len(self.problem.shared) - len(self.entries)

    @property
    def holds(self) -> bool:
        return self.misfit < FAILING * FLOOR

    @property
    def slows_otherwise(self) -> bool:
        """True where the rotor slows unlike the simulation over the rest of the record."""
        known = slowings_at(self.problem, self.point, STAGES.bounced)
        return known is not None and slowing_misfit(known) > _CONTRADICTED * sum(len(each.time) for each in known)

    @property
    def moves_in_the_fall(self) -> bool:
        """True where the entries change the residuals of the fall, or where that cannot be simulated."""
        before = self.problem.all_residuals(self.point, STAGES.fall)
        for nudge in _NUDGES:
            moved = self.point.copy()
            moved[self.first : self.first + len(self.entries)] += nudge
            after = self.problem.all_residuals(moved, STAGES.fall)
            if before is None or after is None or any(np.any(a != b) for a, b in zip(after, before, strict=True)):
                return True
        return False

    def fitted(self, horizon: float) -> _Trial:
        found = fit_or_none(self.problem, self.point, horizon, SLOPES)
        if found is None:
            return replace(self, misfit=math.inf)
        return replace(self, point=found.point, misfit=found.ratio)


def mistaken_entry(problem: Problem, plain: Mapping[float, Fit]) -> Mistaken | None:
    """Return the entry of the machine file that, freed of its tolerance, lets the plain model follow the drops, or None.

    Only the first two drops are used until one entry stands out.

    Parameters
    ----------
    problem : Problem
        Of the machine, without free effects.
    plain : mapping of float to Fit
        Its `first_fits`.
    """
    last = STAGES.first_contacts[-1]
    if last not in plain or plain[last].ratio <= _FAILS * FLOOR:
        return None
    fallen = _Trial((), few_drops(problem), plain[STAGES.fall].point)
    enough = {h: FLOOR + max(_WORTH * (plain[h].ratio - FLOOR), _LITTLE) for h in STAGES.first_contacts}
    kinds = _kinds(problem)
    later = _LEAST * (plain[last].count - plain[STAGES.fall].count)
    if plain[STAGES.fall].misfit + later > FAILING * FLOOR * plain[last].count:
        # the misfit of the fall alone is too large, and entries that act only in contacts cannot remove it
        kinds = [kind for kind in kinds if _start_trial(fallen, kind, 1.0).moves_in_the_fall]
    for starts in _STARTS:
        tried = [_start_trial(fallen, kind, start) for kind in kinds for start in starts]
        best = min(_surviving(tried, enough), key=lambda each: each.misfit, default=None)
        if best is None:
            continue
        if best.holds:
            return _confirmed(problem, best, plain[last].ratio)
        alone = _is_gap(best.entries) and best.misfit - FLOOR < _ALONE * (plain[last].ratio - FLOOR)
        if alone and (found := _confirmed(problem, best, plain[last].ratio)) is not None:
            return found
    return None


def _confirmed(problem: Problem, found: _Trial, before: float) -> Mistaken | None:
    """Return the mistaken entry if with it the model follows all drops, to a later horizon; else None."""
    values, _ = found.problem.values(found.point, 0)
    wanted = {each.name: values[each.name] for each in found.entries}
    held = _fitted_to_bounce(
        _start_trial(_fitted_to_fall(problem), found.entries, wanted[found.entries[0].name] / found.entries[0].nominal)
    )
    if not held.holds and _is_gap(found.entries):
        held = _fitted_to_bounce(_fitted_to_fall(_restated(problem, wanted)))
    if not held.holds or held.slows_otherwise:
        return None
    values, _ = held.problem.values(held.point, 0)
    wrong = [each for each in found.entries if not each.low <= values[each.name] <= each.high]
    off = [each.instead(values[each.name], *sorted({each.low, each.high})) for each in wrong]
    if not off:
        return None
    return Mistaken(
        f"the misfit of the plain model is {before:.3g} times that of noise alone in the first"
        f" {STAGES.first_contacts[-1] * 1e3:g} ms{of_which(problem)}, but"
        f" only noise is left up to {STAGES.bounced * 1e3:g} ms with {' and '.join(off)}: check that entry of the machine file",
        {each.name: values[each.name] for each in wrong},
    )


def _fitted_to_fall(problem: Problem) -> _Trial:
    return _Trial((), problem, problem.start).fitted(STAGES.fall)


def _fitted_to_bounce(trial: _Trial) -> _Trial:
    """Return a trial fitted to all drops step by step until both ends have bounced."""
    for horizon in (*STAGES.first_contacts, STAGES.bounced):
        trial = trial.fitted(horizon)
    return trial


def _restated(problem: Problem, gaps: Mapping[str, float]) -> Problem:
    """Return the problem with other stated gaps of wide tolerance, and the stages and divergence rate that follow from them.

    With a gap stated far too wide, contacts come before the model's error is assumed to grow, so even a right model fails; with
    one far too narrow the assumed fall ends early, and values that compensated for it leave the fitted gap too small.
    """
    machine = restated_machine(problem.model.machine, gaps)
    flight = stages_of(machine).flight
    drops = tuple(replace(drop, flight=flight) for drop in problem.drops)
    restated = replace(build_problem(machine, drops, problem.crew), standing=problem.standing)
    rate = divergence(restated)
    return replace(restated, drops=tuple(replace(drop, divergence=rate) for drop in drops))


def _kinds(problem: Problem) -> list[tuple[Parameter, ...]]:
    """Return the entries grouped by kind over both ends; without zero ones, which cannot be wrong by a factor."""
    machine = problem.model.machine
    magnets = {f"magnet {magnet.name}" for magnet in machine.magnetic_bearings}
    kinds: dict[str, tuple[Parameter, ...]] = {}
    for each in (each for each in entries(machine) if each.nominal > 0):
        owner, _, field = each.name.rpartition(".")
        kind = f"magnet {field}" if owner in magnets else field
        kinds[kind] = (*kinds.get(kind, ()), each)
    return list(kinds.values())


def _start_trial(fallen: _Trial, kind: tuple[Parameter, ...], start: float) -> _Trial:
    """Return a trial of entries that starts at a multiple of the stated values; all else as in a fit to the fall."""
    problem = fallen.problem
    wide = [replace(p, low=p.nominal / _FACTOR, high=p.nominal * _FACTOR, sigma=math.inf, span=p.nominal) for p in kind]
    names = {each.name for each in wide}
    stay = [k for k, p in enumerate(problem.shared) if p.name not in names]
    shared = (*(problem.shared[k] for k in stay), *wide)
    point = np.concatenate([fallen.point[stay], np.full(len(wide), start - 1.0), fallen.point[len(problem.shared) :]])
    return _Trial(kind, replace(problem, shared=shared), point)


def _is_gap(kind: Sequence[Parameter]) -> bool:
    return any(each.name.endswith(".radial_gap") for each in kind)


def _surviving(tried: Sequence[_Trial], enough: Mapping[float, float]) -> list[_Trial]:
    """Return the trials fitted to the last horizon whose misfit ratio is small enough at each, and not far above the least."""
    for horizon, most in enough.items():
        tried = [each.fitted(horizon) for each in tried]
        least = min((each.misfit for each in tried), default=0.0)
        tried = [each for each in tried if each.misfit <= min(most, _BEHIND * max(least, FLOOR))]
    return list(tried)
