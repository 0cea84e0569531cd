"""Which drop or measurement would teach most after a verdict."""

from __future__ import annotations

from collections.abc import Sequence

from tdbmon.diagnosis.contender import Contender
from tdbmon.diagnosis.stated_exactly import stated_exactly
from tdbmon.diagnosis.verdict import Kind, Verdict
from tdbmon.identify.drop import MeasuredDrop
from tdbmon.identify.free_effect import place_in_words
from tdbmon.quantity import decapitalised

# for wrong cables or machine file, and for a mark that moved
PUT_RIGHT = "none: put that right, and diagnose the same drops again"
ONE_MARK = "the same drops again with a mark that does not move, or only those drops that have it in one place"
DRIFT = (
    "the same drops with another probe, cable and driver in that place: a drift that stays comes from the shaft surface there"
    " or from the machine"
)
APART = (
    "none yet: diagnose both sets of drops separately, each with the file of its machine; or, if it is one machine that has"
    " changed, the later ones with the earlier ones as --reference"
)
CHANGED = "none needed: inspect what has changed, or state it in the machine file if the change was intended"
DRIVE_OFF = (
    "the same drops with the drive disconnected from the machine before the release, so that only drag slows the rotor"
)
_ALIKE = 1.1  # ratio of the greatest to the least speed below which all drops count as from one speed


def of_one_speed(drops: Sequence[MeasuredDrop]) -> bool:
    """True if the drops hardly differ in speed."""
    speeds = [abs(drop.omega) for drop in drops]
    return max(speeds) < _ALIKE * min(speeds)


def next_test(
    verdict: Verdict, contenders: tuple[Contender, ...], driven: bool = False, unseen: Sequence[MeasuredDrop] = ()
) -> str:
    """Return one piece of advice.

    `driven`: the drops slow as if by the torque of a drive; `unseen`: drops that keep the rest from being compared.
    """
    drops = contenders[0].problem.drops
    speeds, alike = sorted(drop.speed for drop in drops), of_one_speed(drops)
    if verdict.kind is Kind.NONE and alike:
        return (
            f"drops from two speeds below {speeds[-1]:.0f} Hz: from one speed alone an unbalance, a bow and a runout look"
            " alike, and what only one drop shows is not proved"
        )
    if verdict.kind is Kind.NONE and unseen:
        return _rest_asked_for(unseen, drops)
    if verdict.kind is Kind.NONE:
        return "none needed: the model follows the drops; repeat after the next assembly or a hard drop"
    if verdict.kind is Kind.UNKNOWN:
        faulty = [drop.name for drop in drops if drop.faults]
        exact = stated_exactly(contenders[0].problem.model.machine)
        first = "; ".join(
            [
                *([f"correct what the checks of {', '.join(faulty)} report"] if faulty else []),
                *([f"state in the machine file a tolerance for {'; '.join(exact)}"] if exact else []),
            ]
        )
        first = f"{first}, and diagnose the same drops again; if it stays, " if first else ""
        if driven:
            return f"{first if exact else ''}{DRIVE_OFF}"
        return (
            f"{first}two drops from the same speed and set-point: what repeats comes from the machine, what does not from"
            " outside; record the acceleration of the foundation too"
        )
    if verdict.alike:
        ends = sorted({cause.where for cause in verdict.alike[0].causes if cause.fits_much})
        return (
            f"turn the inner ring at {', '.join(ends)} slowly by hand under a dial gauge: lobes repeat with the ring, an odd ball"
            " with the cage (about 0.4 of a turn a turn), waves of a race with the balls that pass; then look at the balls"
        )
    causes = [cause for each in verdict.accused for cause in each.causes]
    of_one = len({each.effects for each in verdict.accused}) == 1  # ambiguous with the plain model only, no other cause
    if verdict.kind is Kind.NAMED or of_one:
        between = "a speed below" if alike else f"between {speeds[0]:.0f} and"
        return "; ".join(
            [
                *(
                    f"at {place_in_words(cause.where)}, {decapitalised(cause.declared.on_the_machine).removesuffix('.')}"
                    for cause in causes
                ),
                f"a drop after that, from {between} {speeds[-1]:.0f} Hz, should agree with a simulation made beforehand,"
                " with the machine file as it is if the cause is gone, otherwise with the extended one",
            ]
        )
    kinds = {cause.declared.acts_on_sensors for cause in causes}
    if kinds == {True, False}:
        probes = sorted({cause.where for cause in causes if cause.declared.acts_on_sensors})
        return (
            f"check {', '.join(probes)} at standstill: move the rotor through the clearance with the magnetic bearings and"
            " compare the probes; this separates faults of sensors from those of the machine"
        )
    if kinds == {True}:
        return (
            "at standstill, disconnect the other probe of the end, and move the rotor with the magnetic bearings along each"
            " probe in turn: crosstalk disappears with the other probe, an error of angle or gain stays"
        )
    return (
        "one more drop from another set-point, half the gap to the side: direction and place of the first contact change,"
        " which separates causes that look alike in a straight fall"
    )


def _rest_asked_for(unseen: Sequence[MeasuredDrop], drops: Sequence[MeasuredDrop]) -> str:
    """Return the advice where the rest of the records was not looked at, since some of the drops do not tell theirs."""
    how = "with a keyphasor, recorded for half a second after the release"
    far = "the model follows these as far as they were compared, but later causes were not looked for"
    if len(unseen) == len(drops):
        return f"the same drops {how}: {far}"
    speeds, names = " and ".join(f"{drop.speed:.0f} Hz" for drop in unseen), ", ".join(drop.name for drop in unseen)
    return f"none yet: diagnose the drops without {names}; or drop from {speeds} again {how}: {far}"
