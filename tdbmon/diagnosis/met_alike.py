"""What contacts meet alike: other angles, waves and lobes of another order, a ball of another size, tried where a model fails.

Contacts happen where the weight presses, and there waves of one order look much like those of the next.  At the first contact
lobes of any order do, and a ball as well, each with a size and angles of its own; which is right shows at the next one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from tdbsim.errors import InputError

from tdbmon.diagnosis.attempt import all_from_the_fall, followed_on, with_own_slopes
from tdbmon.diagnosis.contender import SLOPES, Contender, settled, with_cause, without_cause
from tdbmon.diagnosis.score import scores
from tdbmon.diagnosis.suspects import Start, Suspect

_DOWN = -math.pi / 2  # rad, where the weight presses
_MET_S = 0.01  # s after the release; by then an end has met its bearing at least
_TOLD_S = 0.014  # s; and by then both, and more than once
_KEPT = 3  # orders that go on from there


def in_neighbouring_orders(
    fallen: Contender, best: Contender, near: Sequence[Suspect], horizons: Sequence[float]
) -> Contender:
    """Return a contender, or the best of those whose last cause has a wave or a lobe more or less, from the fall on.

    Parameters
    ----------
    fallen : Contender
        The plain model, fitted to the fall.
    best : Contender
        With a cause.
    near : sequence of Suspect
        Its last cause's `neighbours`.
    horizons : sequence of float
        All; fits go along those up to the contender's own.
    """
    if not near:
        return best
    start, cause = best.starts()[-1], best.causes[-1]
    begun = [(each, _turned_to_the_load(start, each, _orders_apart(each, cause))) for each in near]
    return _in_place_of_the_last(fallen, best, begun, horizons)


def at_other_angles(fallen: Contender, best: Contender, horizons: Sequence[float]) -> Contender:
    """Return a contender, or the best of those whose last cause begins at its usual size and quarters of its period.

    One contact hardly tells how large an oval is from which way it lies; a fit that leans one way at first stays there.

    Parameters
    ----------
    fallen : Contender
        The plain model, fitted to the fall.
    best : Contender
        With a cause.
    horizons : sequence of float
        All; fits go along those up to the contender's own.
    """
    cause = best.causes[-1]
    return _in_place_of_the_last(fallen, best, [(cause, start) for start in cause.usual()], horizons)


def _in_place_of_the_last(
    fallen: Contender, best: Contender, begun: Sequence[tuple[Suspect, Start]], horizons: Sequence[float]
) -> Contender:
    """Return a contender, or the best of those fitted from the fall on with one of these in the place of its last cause."""
    try:
        bare = without_cause(best, len(best.causes) - 1)
        others = [with_cause(bare, *each) for each in begun]
    except InputError:
        return best
    return min([best, *all_from_the_fall(fallen, others, horizons)], key=lambda each: each.misfit)


def of_any_kind(
    fallen: Contender, best: Contender, suspects: Sequence[Suspect], horizons: Sequence[float]
) -> Contender:
    """Return a contender, or the best of those that have other waves, lobes or a ball in the place of its last cause.

    Its own size and phases are those that made up for what it is not, so the others begin without them, at the first contact.

    Parameters
    ----------
    fallen : Contender
        The plain model, fitted to the fall.
    best : Contender
        With a cause.
    suspects : sequence of Suspect
        All.
    horizons : sequence of float
        All; fits go along those up to the contender's own.
    """
    *stay, cause = best.causes
    taken = any(each.of_each_drop for each in stay)
    others = [s for s in suspects if s is not cause and met_alike(s, cause) and not (s.of_each_drop and taken)]
    met = [horizon for horizon in horizons if horizon <= _MET_S]
    told = [horizon for horizon in horizons if _MET_S < horizon <= min(_TOLD_S, best.horizon)]
    later = [horizon for horizon in horizons if _TOLD_S < horizon <= best.horizon]
    if not others or not told:
        return best
    try:
        bare = fallen
        for each, start in zip(stay, best.starts(), strict=False):
            bare = with_cause(bare, each, start)
        for horizon in met:
            bare = settled(bare, horizon, SLOPES)
        drops = len(bare.problem.drops)
        starts = [(each, _usual(each, drops)) for each in others if each.counted is None]
        # which ball it may be is for a score to say
        balls = [each for each in others if each.counted is not None]
        starts += [(each.suspect, each.start) for each in scores(bare.problem, bare.fit, bare.horizon, balls)]
        begun = [with_cause(bare, *each) for each in starts]
    except InputError:
        return best
    found = followed_on(with_own_slopes(begun, bare.horizon), [bare.horizon, *told])
    found = followed_on(sorted(found, key=lambda each: each.misfit)[:_KEPT], later)
    return min([best, *found], key=lambda each: each.misfit)


def met_alike(one: Suspect, other: Suspect) -> bool:
    """True for waves, lobes and balls of one bearing: the first contact hardly tells them apart."""
    return one.where == other.where and one.fits_much and other.fits_much


def _usual(suspect: Suspect, drops: int) -> Start:
    """Return a start at the usual size, where all angles are 0."""
    shared = {p.name: p.typical for p in suspect.shapes} | {size.name: size.typical for size, _ in suspect.sizes}
    angles = [angle for _, angle in suspect.sizes if angle is not None]
    own = {angle.name: 0.0 for angle in angles if angle.per_drop}
    return Start(shared | {a.name: 0.0 for a in angles if not a.per_drop}, (own,) * drops if own else ())


def neighbours(cause: Suspect, suspects: Sequence[Suspect]) -> list[Suspect]:
    """Return the suspects that differ from a cause by one wave or lobe and are otherwise the same."""
    return [each for each in suspects if abs(_orders_apart(each, cause)) == 1]


def _orders_apart(suspect: Suspect, cause: Suspect) -> float:
    """Return by how many waves or lobes a suspect differs from a cause; 0 where that is not all that differs."""
    if suspect.name != cause.name or suspect.held.keys() != cause.held.keys():
        return 0.0
    orders = {p.name for p in suspect.declared.parameters if p.whole}
    if any(suspect.held[name] != cause.held[name] for name in suspect.held.keys() - orders):
        return 0.0
    return sum(float(suspect.held[name]) - float(cause.held[name]) for name in suspect.held.keys() & orders)


def _turned_to_the_load(start: Start, suspect: Suspect, apart: float) -> Start:
    """Return a start whose waves, so many more than before, stand as before where the weight presses."""
    angles = {
        angle.name: start.shared[angle.name] + apart * _DOWN
        for _, angle in suspect.sizes
        if angle is not None and angle.name in start.shared
    }
    return replace(start, shared={**start.shared, **angles})
