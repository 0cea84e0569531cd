"""New start points for a cause of a failing model: other angles, sizes and orders, and other causes that look alike.

Contacts occur where the weight presses, and there waves of one order look much like those of the next.  At the first contact
so do lobes of any order and a ball, each with its own size and angles; the next contact tells them apart.
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

# key: plain model fitted to the fall, and cause; value: the best few fits up to the instant by which both ends have touched
FirstContactFits = dict[tuple[Contender, Suspect], list[Contender]]

_DOWN = -math.pi / 2  # rad, direction of the weight
_SURVIVORS = (16, 12, 8, 5, 3)  # contenders kept at each horizon from there on
_BALL_SIZES = (-2.5, -1.0, 1.0, 2.5)  # multiples of the typical size
_SIZES = (1.0, 0.55, 0.3)  # shares of the usual size; for a spring: 1, 3 and 10 times the usual stiffness
_FITS_PER_CAUSE = 2  # kept of one cause, from different start phases
_HELD_RANGE = 1e-3  # of its scale, to either side: bounds of a value that is held


def in_neighbouring_orders(
    fallen: Contender, best: Contender, cause: Suspect, near: Sequence[Suspect], horizons: Sequence[float]
) -> Contender:
    """Return the best of the contender and the same with one wave or lobe more or less in a cause, fitted from the fall on.

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
        All, s; those up to the contender's own are used.
    """
    if not near:
        return best
    index = best.causes.index(cause)
    start = best.starts()[index]
    begun = [(each, _turned_to_the_load(start, each, _orders_apart(each, cause))) for each in near]
    return _in_place_of(index, fallen, best, begun, horizons)


def at_other_angles(fallen: Contender, best: Contender, horizons: Sequence[float]) -> Contender:
    """Return the best of the contender and the same with its last cause started at its usual size at quarters of its period.

    A single contact hardly separates the size of an oval from its direction; a fit keeps the direction that it takes first.

    Parameters
    ----------
    fallen : Contender
        The plain model, fitted to the fall.
    best : Contender
        With a cause.
    horizons : sequence of float
        All, s; those up to the contender's own are used.
    """
    cause = best.causes[-1]
    return _in_place_of(-1, fallen, best, [(cause, start) for start in cause.usual()], horizons)


def by_one_alike(
    fallen: Contender, best: Contender, cause: Suspect, alike: Sequence[Suspect], horizons: Sequence[float]
) -> Contender:
    """Return the best of the contender and the same with a look-alike in the place of a cause, started at the cause's values.

    A cause at both ends looks like one at a single end until the other end touches; an evenly bent shaft looks, in the fall and
    at the first contacts, like one bent in the shape of its bending mode.  A cause with several values may have run far off
    under the wrong law, so the other law also starts at the usual values.

    Parameters
    ----------
    fallen : Contender
        The plain model, fitted to the fall.
    best : Contender
    cause : Suspect
        One of its causes.
    alike : sequence of Suspect
        Its look-alikes.
    horizons : sequence of float
        All, s; those up to the contender's own are used.
    """
    index = best.causes.index(cause)
    begun = [(each, best.starts()[index]) for each in alike]
    if cause.many_valued:
        begun += [(each, start) for each in alike if alike_but_for_the_law(each, cause) for start in each.usual()]
    return _in_place_of(index, fallen, best, begun, horizons)


def at_other_sizes(fallen: Contender, best: Contender, cause: Suspect, horizons: Sequence[float]) -> Contender:
    """Return the best of the contender and the same with a cause restarted at several sizes after both ends have touched.

    The first contact alone hardly determines a cause with several values and leads it far off: a foundation becomes a damper.

    Parameters
    ----------
    fallen : Contender
        The plain model, fitted to the fall.
    best : Contender
    cause : Suspect
        One of its causes.
    horizons : sequence of float
        All, s; those up to the contender's own are used, except between the fall and the instant when both ends have touched.
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
    """Return the best of the contender and the same with each of `begun` in the place of a cause, fitted from the fall on."""
    kept = best.known
    del kept[index]
    others = []
    for each in begun:
        with suppress(InputError):
            others.append(with_causes(fallen, [*kept, each]))
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
    """Return the best of the contender and the same with other waves, lobes or a ball in the place of one of its causes.

    The size and phases of a wrong cause only compensate for the right one, so the others start from usual sizes at the first
    contact.

    Parameters
    ----------
    fallen : Contender
        The plain model, fitted to the fall.
    best : Contender
    cause : Suspect
        One of its causes: waves, lobes or a ball.
    suspects : sequence of Suspect
        All.
    horizons : sequence of float
        All, s; those up to the contender's own are used.
    afresh : bool
        Start the contender's other many-valued causes at their usual values: theirs may compensate for the wrong one too.
    first_contact_fits : FirstContactFits, optional
        As in `from_the_first_contact`.
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
    """Return the best models with the known causes and one further, started at its usual size at the first contact.

    Parameters
    ----------
    fallen : Contender
        The plain model, fitted to the fall.
    known : sequence of pair
        Cause and start point.
    others : sequence of Suspect
        Waves, lobes and balls.
    horizons : sequence of float
        s; all models are fitted until both ends have touched, only the best of them beyond.
    first_contact_fits : FirstContactFits, optional
        Results of earlier calls without known causes; reused, and extended by this call.
    """
    touched = fallen.problem.stages.touched
    early = [horizon for horizon in horizons if horizon <= touched]
    later = [horizon for horizon in horizons if horizon > touched]
    taken = any(cause.drop_specific for cause, _ in known)
    names = {cause.name for cause, _ in known}  # parameters are identified by the name of their cause
    others = [each for each in others if each.name not in names and not (taken and each.drop_specific)]
    before = first_contact_fits if first_contact_fits is not None and not known else {}
    asked = [each for each in others if (fallen, each) not in before]
    before.update({(fallen, each): few for each, few in _to_the_first_contacts(fallen, known, asked, early).items()})
    field = [each for suspect in others for each in before.get((fallen, suspect), [])]
    for step, horizon in enumerate([early[-1], *later] if field else []):
        few = _best_few(field)[: _SURVIVORS[min(step, len(_SURVIVORS) - 1)]]
        field = followed_on(few, [horizon], FEW_SLOPES if len(few) > _SURVIVORS[-2] else SLOPES)
    return sorted(field, key=lambda each: each.misfit)


def _to_the_first_contacts(
    fallen: Contender, known: Sequence[tuple[Suspect, Start]], others: Sequence[Suspect], horizons: Sequence[float]
) -> dict[Suspect, list[Contender]]:
    """Return, for each further cause, the best few models with it and the known ones, fitted until both ends have touched."""
    met = fallen.problem.stages.met
    at_first_contact = [horizon for horizon in horizons if horizon <= met]
    later = [horizon for horizon in horizons if horizon > met]
    if not others or not later:
        return {}
    try:
        free = with_causes(fallen, known)
        bare = _with_causes_held(free)
        for horizon in at_first_contact:
            bare = settled(bare, horizon, SLOPES)
        drops = len(bare.problem.drops)
        starts = [(each, start) for each in others if each.counted is None for start in _all_round(each, drops)]
        # a score determines the ball's number in each drop
        balls = [each for each in others if each.counted is not None]
        scored = scores(bare.problem, bare.fit, bare.horizon, balls)
        starts += [(each.suspect, start) for each in scored for start in (each.start, *_of_many_sizes(each))]
    except InputError:
        return {}
    found = bare.problem.crew.apart(_at_first_contact, [(bare, *start, later) for start in starts])
    fitted: dict[Suspect, list[Contender]] = {each: [] for each in others}
    for new, (cause, _) in zip(found, starts, strict=True):
        if new is not None:
            fitted[cause].append(_with_causes_freed(new.at_home(bare, (*bare.causes, cause)), free))
    return {cause: _best_few(each) for cause, each in fitted.items()}


def _best_few(field: Sequence[Contender]) -> list[Contender]:
    """Return the best two fits of each wave and lobe, and of each ball per sign of its size; the best first."""
    few: list[Contender] = []
    for each in sorted(field, key=lambda each: each.misfit):
        if sum(_alike(each, other) for other in few) < _FITS_PER_CAUSE:
            few.append(each)
    return few


def _alike(one: Contender, other: Contender) -> bool:
    """True if the last causes of both are the same, with sizes of the same sign."""
    if one.causes[-1] is not other.causes[-1]:
        return False
    (size, _), *_ = one.causes[-1].sizes
    return one.starts()[-1].shared[size.name] * other.starts()[-1].shared[size.name] > 0


def _at_first_contact(bare: Contender, cause: Suspect, start: Start, horizons: Sequence[float]) -> Contender | None:
    """Return the contender with one more cause, fitted to the first contact, then along the horizons; None if impossible."""
    try:
        begun = with_cause(bare, cause, start)
        fitted = turned(begun.problem, begun.fit, bare.horizon)
        if fitted is None:
            return None
        found = replace(begun, fit=fitted)
        # standing waves start at many phases; anything else at one, which may be far from the minimum
        for horizon in horizons if cause.standing_waves else (bare.horizon, *horizons):
            found = settled(found, horizon, FEW_SLOPES if cause.standing_waves else SLOPES)
    except InputError:
        return None
    return found


def _with_causes_held(contender: Contender) -> Contender:
    """Return the contender with its causes held at their start values.

    Later contacts have determined them; a fit to the first contact alone would lead them off.
    """
    held = {p.name for each in contender.problem.free for p in each.shared}
    shared = tuple(
        replace(
            p, low=max(p.low, p.nominal - _HELD_RANGE * p.scale), high=min(p.high, p.nominal + _HELD_RANGE * p.scale)
        )
        if p.name in held
        else p
        for p in contender.problem.shared
    )
    return replace(contender, problem=replace(contender.problem, shared=shared))


def _with_causes_freed(contender: Contender, free: Contender) -> Contender:
    """Return the contender with the bounds of another in place of those that held its causes."""
    known = {p.name: p for p in free.problem.shared}
    shared = tuple(known.get(p.name, p) for p in contender.problem.shared)
    return replace(contender, problem=replace(contender.problem, shared=shared))


def _all_round(suspect: Suspect, drops: int) -> list[Start]:
    """Return start points of waves or lobes at their usual size: at all `WAVE_PHASES` if the phase is common to all drops."""
    shared, angles = suspect.usual_values, suspect.angles
    own = {angle.name: 0.0 for angle in angles if angle.per_drop}
    if own:
        return [Start(shared, (own,) * drops)]
    return [Start(shared | {angle.name: phase for angle in angles}) for phase in WAVE_PHASES]


def _of_many_sizes(ball: Score) -> list[Start]:
    """Return start points of a ball at `_BALL_SIZES`."""
    (size, _), *_ = ball.suspect.sizes
    return [replace(ball.start, shared={**ball.start.shared, size.name: sized(size, share)}) for share in _BALL_SIZES]


def neighbours(cause: Suspect, suspects: Sequence[Suspect]) -> list[Suspect]:
    """Return the suspects that differ from the cause by one wave or lobe only."""
    return [each for each in suspects if abs(_orders_apart(each, cause)) == 1]


def _orders_apart(suspect: Suspect, cause: Suspect) -> float:
    """Return by how many waves or lobes a suspect differs from a cause; 0 if anything else differs too."""
    if suspect.name != cause.name or suspect.held.keys() != cause.held.keys():
        return 0.0
    orders = {p.name for p in suspect.declared.parameters if p.whole}
    if any(suspect.held[name] != cause.held[name] for name in suspect.held.keys() - orders):
        return 0.0
    return sum(float(suspect.held[name]) - float(cause.held[name]) for name in suspect.held.keys() & orders)


def _turned_to_the_load(start: Start, suspect: Suspect, apart: float) -> Start:
    """Return the start point with its angles shifted so that waves of an order higher by `apart` match at the bottom."""
    known = [angle.name for angle in suspect.angles if angle.name in start.shared]
    angles = {name: start.shared[name] + apart * _DOWN for name in known}
    return replace(start, shared={**start.shared, **angles})
