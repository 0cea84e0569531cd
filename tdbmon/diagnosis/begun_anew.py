"""What contacts meet alike: other angles, waves and lobes of another order, a ball of another size, tried where a model fails.

Contacts happen where the weight presses, and there waves of one order look much like those of the next.  At the first contact
lobes of any order do, and a ball as well, each with a size and angles of its own; which is right shows at the next one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

from tdbsim.errors import InputError

from tdbmon.diagnosis.attempt import WAVE_PHASES, followed_on, turned
from tdbmon.diagnosis.contender import FEW_SLOPES, SLOPES, Contender, settled, with_cause, with_causes
from tdbmon.diagnosis.effect_size import sized
from tdbmon.diagnosis.score import Score, scores
from tdbmon.diagnosis.suspects import Start, Suspect, alike_at_first_contact, alike_but_for_the_law

# by the plain model in the fall and the cause: the best few that were fitted to where both ends have touched
FirstContactFits = dict[tuple[Contender, Suspect], list[Contender]]

_DOWN = -math.pi / 2  # rad, where the weight presses
_GO_ON = (16, 12, 8, 5, 3)  # that go on from there, at one horizon after the other
_BALL_SIZES = (-2.5, -1.0, 1.0, 2.5)  # of the typical size
_SIZES = (1.0, 0.55, 0.3)  # of the usual size; of a spring the usual stiffness, three and ten times that
_OF_EACH = 2  # of one wave among them, begun at other phases
_PLAY = 1e-3  # of its scale, by which a value that is held may move all the same


def in_neighbouring_orders(
    fallen: Contender, best: Contender, cause: Suspect, near: Sequence[Suspect], horizons: Sequence[float]
) -> Contender:
    """Return a contender, or the best of those one of whose causes has a wave or a lobe more or less, from the fall on.

    Parameters
    ----------
    fallen : Contender
        The plain model, fitted to the fall.
    best : Contender
    cause : Suspect
        One of its causes.
    near : sequence of Suspect
        The cause's `neighbours`.
    horizons : sequence of float
        All; fits go along those up to the contender's own.
    """
    if not near:
        return best
    index = best.causes.index(cause)
    start = best.starts()[index]
    begun = [(each, _turned_to_the_load(start, each, _orders_apart(each, cause))) for each in near]
    return _in_place_of(index, fallen, best, begun, horizons)


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
    return _in_place_of(-1, fallen, best, [(cause, start) for start in cause.usual()], horizons)


def by_one_alike(
    fallen: Contender, best: Contender, cause: Suspect, alike: Sequence[Suspect], horizons: Sequence[float]
) -> Contender:
    """Return a contender, or the best of those with one that looks like a cause in its place, begun at the same values.

    What acts at both ends looks like one end's own until the other one touches; an evenly bent shaft, in the fall and at first
    contacts, like one bent to its bending mode.  Several values by another law may have gone far astray: then it begins at its
    usual size too.

    Parameters
    ----------
    fallen : Contender
        The plain model, fitted to the fall.
    best : Contender
    cause : Suspect
        One of its causes.
    alike : sequence of Suspect
    horizons : sequence of float
        All; fits go along those up to the contender's own.
    """
    index = best.causes.index(cause)
    begun = [(each, best.starts()[index]) for each in alike]
    if cause.many_valued:
        begun += [(each, start) for each in alike if alike_but_for_the_law(each, cause) for start in each.usual()]
    return _in_place_of(index, fallen, best, begun, horizons)


def at_other_sizes(fallen: Contender, best: Contender, cause: Suspect, horizons: Sequence[float]) -> Contender:
    """Return a contender, or the best of those with a cause begun anew at several sizes where both ends have touched.

    The first contact alone says little of a cause with several values and leads it far off: a foundation becomes a damper.

    Parameters
    ----------
    fallen : Contender
        The plain model, fitted to the fall.
    best : Contender
    cause : Suspect
        One of its causes.
    horizons : sequence of float
        All; fits go along those up to the contender's own, but for the ones at the first contact.
    """
    sizes = [{size.name: sized(size, share) for size, _ in cause.sizes} for share in _SIZES]
    begun = [
        *((cause, Start(cause.usual_values | each)) for each in sizes),
        *((cause, each) for each in cause.usual()[1:]),
    ]
    on = [h for h in horizons if h == horizons[0] or h >= fallen.problem.stages.touched]
    return _in_place_of(best.causes.index(cause), fallen, best, begun, on)


def _in_place_of(
    index: int, fallen: Contender, best: Contender, begun: Sequence[tuple[Suspect, Start]], horizons: Sequence[float]
) -> Contender:
    """Return a contender, or the best of those fitted from the fall on with one of these in the place of a cause."""
    stay = best.known
    del stay[index]
    others = []
    for each in begun:
        with suppress(InputError):
            others.append(with_causes(fallen, [*stay, each]))
    on = [h for h in horizons if h <= best.horizon]
    return min([best, *followed_on(others, on, most=best.misfit)], key=lambda each: each.misfit)


def of_any_kind(
    fallen: Contender,
    best: Contender,
    cause: Suspect,
    suspects: Sequence[Suspect],
    horizons: Sequence[float],
    *,
    afresh: bool = False,
    first_contact_fits: FirstContactFits | None = None,
) -> Contender:
    """Return a contender, or the best of those that have other waves, lobes or a ball in the place of one of its causes.

    Its own size and phases are those that made up for what it is not, so the others begin without them, at the first contact.

    Parameters
    ----------
    fallen : Contender
        The plain model, fitted to the fall.
    best : Contender
    cause : Suspect
        The one of its causes that fits much.
    suspects : sequence of Suspect
        All.
    horizons : sequence of float
        All; fits go along those up to the contender's own.
    afresh : bool
        Whether those of the other causes that have several values begin at the usual ones: theirs may have made up too.
    first_contact_fits : FirstContactFits, optional
        As `from_the_first_contact` takes it.
    """
    others = [s for s in suspects if s is not cause and alike_at_first_contact(s, cause)]
    known = [
        (each, Start(each.usual_values) if afresh and each.many_valued else start)
        for each, start in best.known
        if each is not cause
    ]
    found = from_the_first_contact(
        fallen, known, others, [h for h in horizons if h <= best.horizon], first_contact_fits
    )
    return min([best, *found], key=lambda each: each.misfit)


def from_the_first_contact(
    fallen: Contender,
    known: Sequence[tuple[Suspect, Start]],
    others: Sequence[Suspect],
    horizons: Sequence[float],
    first_contact_fits: FirstContactFits | None = None,
) -> list[Contender]:
    """Return the best models with known causes and one of several more, begun at its usual size where contacts begin.

    Parameters
    ----------
    fallen : Contender
        The plain model, fitted to the fall.
    known : sequence of pair
        Each cause and where it begins.
    others : sequence of Suspect
        Waves, lobes and balls.
    horizons : sequence of float
        s, along which they are fitted; all to where both ends have touched, the best of them on to the last.
    first_contact_fits : FirstContactFits, optional
        Who came to where both ends have touched when that was asked before, with no other cause known; it is added to.
    """
    touched = fallen.problem.stages.touched
    told = [horizon for horizon in horizons if horizon <= touched]
    later = [horizon for horizon in horizons if horizon > touched]
    taken = any(cause.drop_specific for cause, _ in known)
    stands = {cause.name for cause, _ in known}  # two causes of one name would be one value to the problem
    others = [each for each in others if each.name not in stands and not (taken and each.drop_specific)]
    before = first_contact_fits if first_contact_fits is not None and not known else {}
    asked = [each for each in others if (fallen, each) not in before]
    before.update({(fallen, each): few for each, few in _to_the_first_contacts(fallen, known, asked, told).items()})
    field = [each for suspect in others for each in before.get((fallen, suspect), [])]
    for step, horizon in enumerate([told[-1], *later] if field else []):
        few = _best_few(field)[: _GO_ON[min(step, len(_GO_ON) - 1)]]
        field = followed_on(few, [horizon], FEW_SLOPES if len(few) > _GO_ON[-2] else SLOPES)
    return sorted(field, key=lambda each: each.misfit)


def _to_the_first_contacts(
    fallen: Contender, known: Sequence[tuple[Suspect, Start]], others: Sequence[Suspect], horizons: Sequence[float]
) -> dict[Suspect, list[Contender]]:
    """Return the best few models with known causes and each of several more, fitted to where both ends have touched."""
    met = fallen.problem.stages.met
    begin = [horizon for horizon in horizons if horizon <= met]
    told = [horizon for horizon in horizons if horizon > met]
    if not others or not told:
        return {}
    try:
        loose = with_causes(fallen, known)
        bare = _held(loose)
        for horizon in begin:
            bare = settled(bare, horizon, SLOPES)
        drops = len(bare.problem.drops)
        starts = [(each, start) for each in others if each.counted is None for start in _all_round(each, drops)]
        # which ball it may be is for a score to say first
        balls = [each for each in others if each.counted is not None]
        scored = scores(bare.problem, bare.fit, bare.horizon, balls)
        starts += [(each.suspect, start) for each in scored for start in (each.start, *_of_many_sizes(each))]
    except InputError:
        return {}
    found = bare.problem.crew.apart(_at_first_contact, [(bare, *start, told) for start in starts])
    fitted: dict[Suspect, list[Contender]] = {each: [] for each in others}
    for new, (cause, _) in zip(found, starts, strict=True):
        if new is not None:
            fitted[cause].append(_let_go(new.at_home(bare, (*bare.causes, cause)), loose))
    return {cause: _best_few(each) for cause, each in fitted.items()}


def _best_few(field: Sequence[Contender]) -> list[Contender]:
    """Return the best two of each wave and lobe, and of each ball that is too large or too small, the best of all first."""
    few: list[Contender] = []
    for each in sorted(field, key=lambda each: each.misfit):
        if sum(_alike(each, other) for other in few) < _OF_EACH:
            few.append(each)
    return few


def _alike(one: Contender, other: Contender) -> bool:
    """True where the last causes of two are the same, with a size of the same sign."""
    if one.causes[-1] is not other.causes[-1]:
        return False
    (size, _), *_ = one.causes[-1].sizes
    return one.starts()[-1].shared[size.name] * other.starts()[-1].shared[size.name] > 0


def _at_first_contact(bare: Contender, cause: Suspect, start: Start, horizons: Sequence[float]) -> Contender | None:
    """Return a contender with a cause more, fitted to the first contact and on along horizons; None where impossible."""
    try:
        begun = with_cause(bare, cause, start)
        fitted = turned(begun.problem, begun.fit, bare.horizon)
        if fitted is None:
            return None
        found = replace(begun, fit=fitted)
        # waves that stand still begin at many phases, all else at one, from where the way may be long
        for horizon in horizons if cause.standing_waves else (bare.horizon, *horizons):
            found = settled(found, horizon, FEW_SLOPES if cause.standing_waves else SLOPES)
    except InputError:
        return None
    return found


def _held(contender: Contender) -> Contender:
    """Return a contender whose causes stay where they begin.

    Later contacts have told what they are; the first one alone would lead them astray.
    """
    held = {p.name for each in contender.problem.free for p in each.shared}
    shared = tuple(
        replace(p, low=max(p.low, p.nominal - _PLAY * p.scale), high=min(p.high, p.nominal + _PLAY * p.scale))
        if p.name in held
        else p
        for p in contender.problem.shared
    )
    return replace(contender, problem=replace(contender.problem, shared=shared))


def _let_go(contender: Contender, loose: Contender) -> Contender:
    """Return a contender whose causes are as free again as those of another."""
    known = {p.name: p for p in loose.problem.shared}
    shared = tuple(known.get(p.name, p) for p in contender.problem.shared)
    return replace(contender, problem=replace(contender.problem, shared=shared))


def _all_round(suspect: Suspect, drops: int) -> list[Start]:
    """Return starts of waves or lobes at their usual size: at phases all round a wave, where drops have none of their own."""
    shared, angles = suspect.usual_values, suspect.angles
    own = {angle.name: 0.0 for angle in angles if angle.per_drop}
    if own:
        return [Start(shared, (own,) * drops)]
    return [Start(shared | {angle.name: phase for angle in angles}) for phase in WAVE_PHASES]


def _of_many_sizes(ball: Score) -> list[Start]:
    """Return starts of a ball that is much too large or too small."""
    (size, _), *_ = ball.suspect.sizes
    return [replace(ball.start, shared={**ball.start.shared, size.name: sized(size, share)}) for share in _BALL_SIZES]


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
    known = [angle.name for angle in suspect.angles if angle.name in start.shared]
    angles = {name: start.shared[name] + apart * _DOWN for name in known}
    return replace(start, shared={**start.shared, **angles})
