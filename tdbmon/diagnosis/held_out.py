"""Whether an extended model does better on a drop that took no part in its fit.

Both models are fitted to the other drops; of the drop held out only its own values (where it was let go, the cages'
angles) are fitted.  What is left there, beside the noise, is the judge.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from tdbmon.diagnosis.contender import EXPLAINED, Contender
from tdbmon.identify.cages import better_cages
from tdbmon.identify.least_squares import Fit, fit
from tdbmon.identify.one_drop import coordinates, frozen, only
from tdbmon.identify.own_paths import better_paths, lost_drops
from tdbmon.identify.problem import Problem

Array = NDArray[np.float64]

LEAST_DROPS = 2  # to hold one out
_PROOF = (0.022, 0.027, 0.033, 0.04, 0.047, 0.055)  # s in a usual gap; by the first of them both ends have touched
_CLEAR = 0.05  # of the plain model's misfit
_MUCH = 0.5  # of what the plain model leaves beyond the noise
_TELLING = 0.25  # of what the plain model leaves beyond noise in the drop that it explains worst
_DECIDED = 1.2  # times the noise: a plain model that leaves less has nothing to gain from
# times the noise, that shows a lack: of a drop that it was not fitted to a right model leaves up to 1.4 times
_FAILS = 2.0


class Judge(StrEnum):
    """What was measured and simulated of a drop held out."""

    READINGS = "readings from the release on"
    ARC = "arc that the journal has turned"
    REST = "mean place and whirl over the rest of the record"


@dataclass(frozen=True)
class HeldOut:
    """The proof on a drop held out.

    Attributes
    ----------
    drops : tuple of str
        Its file, or those of several.
    plain, extended : float
        rms of measured less simulated there, m.
    noise : float
        m.
    plain_misfit, extended_misfit : float
        Robust sums of squares there in units of the noise; they count the speed and the levitated stretch too.
    without : tuple of mapping
        The extended model's shared values (SI) by name, fitted without the drop, or without each of them.
    judge : Judge
        What was measured and simulated.
    each : tuple of HeldOut
        Of several drops the proof on each.
    """

    drops: tuple[str, ...]
    plain: float
    extended: float
    noise: float
    plain_misfit: float
    extended_misfit: float
    without: tuple[Mapping[str, float], ...] = ()
    judge: Judge = Judge.READINGS
    each: tuple[HeldOut, ...] = ()

    @property
    def drop(self) -> str:
        """The file or files in words."""
        *first, last = self.drops
        return f"{', '.join(first)} and {last}" if first else last

    @property
    def named(self) -> str:
        """The file or files, and that they took no part in the fit, in words."""
        return f"{self.drop}, {'which was held out' if len(self.drops) == 1 else 'each held out by itself'}"

    @property
    def holds(self) -> bool:
        """True where the extended model does better."""
        return self.extended_misfit < self.plain_misfit

    @property
    def clear(self) -> bool:
        """True where one of the models does much better than the other."""
        return abs(self.takes) > _CLEAR

    @property
    def clear_in_each(self) -> bool:
        """True where the extended model does much better in several drops, each held out by itself.

        That tells a cause that is too weak to be seen in readings: what only seems to be there may do so in one of two.
        """
        return bool(self.each) and all(proof.holds and proof.clear for proof in self.each)

    @property
    def takes(self) -> float:
        """Share of the plain model's misfit that the extended one takes away, of the noise in it too."""
        return 1 - self.extended_misfit / self.plain_misfit

    @property
    def seen(self) -> bool:
        """True where the readings show it: the extended model takes away half of what the plain one leaves there.

        Of the rest of a record that is half of the sum of squared departures: where one drop of four departs, means over all of
        them may be within what simulations lie apart.
        """
        if self.judge is Judge.REST:
            return self.takes > _MUCH
        return self.holds and self.gain is not None and self.gain > _MUCH

    @property
    def shown(self) -> bool:
        """True where the readings show it, or several drops do, each held out by itself."""
        return self.seen or self.clear_in_each

    @property
    def gain(self) -> float | None:
        """Share of what the plain model leaves beyond the noise that the extended one takes away, in rms of the readings.

        1 - (extended - noise)/(plain - noise); None where the plain model leaves hardly more than noise.
        """
        if self.plain < _DECIDED * self.noise:
            return None
        return 1 - (self.extended - self.noise) / (self.plain - self.noise)


def proof_of(plain: Contender, extended: Contender) -> HeldOut:
    """Return the proof on the drop that tells most, no further than to where the plain model fails and one clearly does better.

    The values of the other drops predict a path through impacts only so far; further on chance decides.  Where one drop
    is no proof, two are to be one: a ball of another size may hardly be met in one of them.  So are two where the plain model
    leaves noise alone and the cause acts in contacts: there something always fits a little better.

    Parameters
    ----------
    plain, extended : Contender
        Fitted to the same drops and horizon.

    Raises
    ------
    InputError
        If a model cannot be simulated on the other drops.
    """
    first, *further = telling_drops(plain)
    early = [h for h in plain.problem.stages.all_at(_PROOF) if h < extended.horizon]
    proof = held_out(plain, extended, first, [*early, extended.horizon])
    weak = extended.in_contacts and not plain.fails
    suffices = proof.seen if to_be_seen(plain, extended) else proof.holds and not weak
    if suffices or not further:
        return proof
    return together([proof, held_out(plain, extended, further[0], [extended.horizon])])


def to_be_seen(plain: Contender, extended: Contender) -> bool:
    """True where readings must show a cause: what has angles of its own in every drop fits a little of anything there.

    So do waves, lobes and balls beside a plain model that explains the drops: that one may have lost its way within the noise.
    """
    return extended.drop_specific or (extended.fits_much and plain.ratio <= EXPLAINED)


def proved(plain: Contender, extended: Contender, proof: HeldOut) -> bool:
    """True where the model of a verdict does better on a drop held out.

    To be seen in readings where `to_be_seen` says so; and if a cause acts on the shaft and the plain model explains the drops,
    where readings can tell: with nothing hidden some such cause made up for laws that are a little off, and took away 0.23 to
    0.37 of what was left there in four fits to synthetic drops.  Sensors have exact laws.
    """
    tells = extended.on_shaft and plain.ratio <= EXPLAINED and proof.gain is not None
    return proof.seen if tells or to_be_seen(plain, extended) else proof.holds


def proved_beside(named: Contender, wider: Contender, proof: HeldOut) -> bool:
    """True where a drop held out shows one weak cause more beside a named model, or several drops do, each by itself."""
    return proof.seen if to_be_seen(named, wider) else proof.shown


def together(proofs: Sequence[HeldOut]) -> HeldOut:
    """Return the proof on several drops, each held out by itself."""

    def mean(values: Iterable[float]) -> float:
        return math.sqrt(math.fsum(value**2 for value in values) / len(proofs))

    return HeldOut(
        drops=tuple(name for proof in proofs for name in proof.drops),
        plain=mean(proof.plain for proof in proofs),
        extended=mean(proof.extended for proof in proofs),
        noise=mean(proof.noise for proof in proofs),
        plain_misfit=sum(proof.plain_misfit for proof in proofs),
        extended_misfit=sum(proof.extended_misfit for proof in proofs),
        without=tuple(values for proof in proofs for values in proof.without),
        each=tuple(proofs),
    )


def held_out(plain: Contender, extended: Contender, index: int, horizons: Sequence[float]) -> HeldOut:
    """Fit both models without one drop and judge them there, to the first of some horizons that tells."""
    bare, wide = (taught(each, index, extended.horizon) for each in (plain, extended))
    for horizon in horizons:
        proof = judged(bare, wide, horizon)
        if proof.plain > _FAILS * proof.noise and proof.clear:
            break
    return proof


@dataclass(frozen=True, eq=False)
class Taught:
    """A model whose shared values are as the other drops have them.

    Attributes
    ----------
    exam : Problem
        The drop held out alone.
    point : (n,) array
        Where the fit of its own values begins.
    """

    exam: Problem
    point: Array


def taught(contender: Contender, index: int, horizon: float) -> Taught:
    """Fit a model without one drop: to all that is known of the others, since what they know of a cause shows late."""
    problem = contender.problem
    others = [k for k in range(len(problem.drops)) if k != index]
    count = len(problem.shared)
    lesson = fit(only(problem, others), contender.fit.point[coordinates(problem, others)], horizon, 2, 3e-3)
    own = contender.fit.point[coordinates(problem, [index])][count:]
    return Taught(frozen(only(problem, [index]), lesson.point[:count]), np.concatenate([np.zeros(count), own]))


def judged(plain: Taught, extended: Taught, horizon: float) -> HeldOut:
    """Return what both models leave of the drop held out to a horizon."""
    (drop,) = extended.exam.drops
    noise = math.sqrt(float(np.mean([each.sigma**2 for each in drop.noise])))
    bare, wide = (_examined(each, horizon) for each in (plain, extended))
    left, extended_left = (
        rms(each.exam, found.point, [0], horizon) for each, found in ((plain, bare), (extended, wide))
    )
    values, _ = extended.exam.values(wide.point, 0)
    return HeldOut((drop.name,), left, extended_left, noise, bare.misfit, wide.misfit, (values,))


def telling_drops(plain: Contender) -> list[int]:
    """Return the drops in the order in which to hold them out: of middle speed first, so that others lie on both sides.

    Those that the plain model explains nearly as well as the others are asked last: with friction that rises where the
    shaft slips slowly it may fail in the slowest drop alone, and on the others there is nothing to gain.
    """
    order = np.argsort([drop.speed for drop in plain.problem.drops])
    middle = (len(order) - 1) // 2
    drops = [int(order[k]) for k in sorted(range(len(order)), key=lambda k: abs(k - middle - 0.1))]
    beyond = [max(ratio - plain.floor, 0.0) for ratio in plain.fit.ratio_of_drops]
    return sorted(drops, key=lambda drop: beyond[drop] < _TELLING * max(beyond))


def rms(problem: Problem, point: np.ndarray, drops: Sequence[int], horizon: float) -> float:
    """Return the rms of measured less simulated readings of drops from release to horizon, m."""
    squares = [np.nanmean(problem.simulated(point, drop, horizon).left_after ** 2) for drop in drops]
    return math.sqrt(float(np.mean(squares)))


def _examined(pupil: Taught, horizon: float) -> Fit:
    """Return the fit of the drop's own values; a model is judged by what it leaves, not by a path that was not found."""
    exam = pupil.exam
    found = better_cages(exam, fit(exam, pupil.point, horizon, 2), horizon, 1)
    return better_paths(exam, found, horizon, [0]) if lost_drops(exam, found, horizon) else found
