"""Proof of an extended model on a held-out drop.

Plain and extended model are fitted to the other drops; to the held-out drop only its own values are fitted (release, angles of
shaft and cages).  Their residuals there, against the noise, decide.
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
_PROOF = (0.022, 0.027, 0.033, 0.04, 0.047, 0.055)  # horizons, s, in a usual gap; by the first both ends have touched
_CLEAR = 0.05  # share of the plain model's misfit
_MUCH = 0.5  # gain
_TELLING = 0.25  # excess of the plain model in a drop, relative to the drop that it explains worst
_DECIDED = 1.2  # times the noise: below that rms the plain model leaves nothing to gain
# times the noise, rms above which a model fails on a held-out drop: a right one leaves up to 1.4 times
_FAILS = 2.0


class Judge(StrEnum):
    """The quantity compared in a held-out drop."""

    READINGS = "readings from the release on"
    ARC = "arc that the journal has turned"
    REST = "mean position and whirl over the rest of the record"


@dataclass(frozen=True)
class HeldOut:
    """The proof on one held-out drop, or on several, each held out by itself.

    Attributes
    ----------
    drops : tuple of str
        File of each drop.
    plain, extended : float
        rms of measured less simulated, m.
    noise : float
        rms, m.
    plain_misfit, extended_misfit : float
        Robust sums of squares in units of the noise, speed and levitated stretch included.
    without : tuple of mapping
        The extended model's shared values (SI) by name, fitted without each drop.
    judge : Judge
        The quantity compared.
    each : tuple of HeldOut
        Of several drops, the proof on each.
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
        """The file or files, with the words that say how they were held out."""
        return f"{self.drop}, {'which was held out' if len(self.drops) == 1 else 'each held out by itself'}"

    @property
    def holds(self) -> bool:
        """True if the extended model has the lower misfit."""
        return self.extended_misfit < self.plain_misfit

    @property
    def clear(self) -> bool:
        """True if the misfits differ clearly."""
        return abs(self.takes) > _CLEAR

    @property
    def clear_in_each(self) -> bool:
        """True if the extended model is clearly better in each of several drops, each held out by itself.

        That proves a cause too weak for the rms of the readings; by chance one of two drops may show such a cause.
        """
        return bool(self.each) and all(proof.holds and proof.clear for proof in self.each)

    @property
    def takes(self) -> float:
        """Share of the plain model's misfit, noise included, that the extended model takes away."""
        return 1 - self.extended_misfit / self.plain_misfit

    @property
    def seen(self) -> bool:
        """True if the gain in readings exceeds one half.

        For the rest of a record, half of the sum of squared departures counts instead: if only one drop of four departs, the
        means over all may lie within the spread of the simulations.
        """
        if self.judge is Judge.REST:
            return self.takes > _MUCH
        return self.holds and self.gain is not None and self.gain > _MUCH

    @property
    def shown(self) -> bool:
        """True if the readings show the cause, or several drops do, each held out by itself."""
        return self.seen or self.clear_in_each

    @property
    def gain(self) -> float | None:
        """Share of the plain model's residual beyond noise that the extended model takes away, in rms.

        1 - (extended - noise)/(plain - noise); None if the plain model leaves hardly more than noise.
        """
        if self.plain < _DECIDED * self.noise:
            return None
        return 1 - (self.extended - self.noise) / (self.plain - self.noise)


def proof_of(plain: Contender, extended: Contender) -> HeldOut:
    """Return the proof on the most telling drop, at the first horizon where the plain model fails and the misfits differ clearly.

    Values fitted to other drops predict a path through impacts only so far; beyond that chance decides.  A second drop is held
    out too where the first proves nothing, since a ball of another size may hardly be met in one drop; and where the plain model
    holds and the cause acts in contacts, since some contact cause always fits a little better.

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
    """True if readings must show the cause: a drop-specific cause fits a little of anything.

    So do all waves, lobes and balls beside a plain model that explains the drops but may have lost the path within the noise.
    """
    return extended.drop_specific or (extended.fits_much and plain.ratio <= EXPLAINED)


def proved(plain: Contender, extended: Contender, proof: HeldOut) -> bool:
    """True if the held-out drop proves the extended model.

    The gain in readings must exceed one half if `to_be_seen`, or if a cause acts on the shaft, the plain model explains the
    drops and the gain is known: with nothing hidden, such causes compensated for inexact laws and gained 0.23 to 0.37 in four
    fits to synthetic drops.  Else a lower misfit is enough; sensors have exact laws.
    """
    tells = extended.on_shaft and plain.ratio <= EXPLAINED and proof.gain is not None
    return proof.seen if tells or to_be_seen(plain, extended) else proof.holds


def proved_beside(named: Contender, wider: Contender, proof: HeldOut) -> bool:
    """True if held-out drops prove one more weak cause beside those of a named model."""
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
    """Fit both models without one drop and compare them there, at the first horizon that tells, else at the last."""
    bare, wide = (taught(each, index, extended.horizon) for each in (plain, extended))
    for horizon in horizons:
        proof = judged(bare, wide, horizon)
        if proof.plain > _FAILS * proof.noise and proof.clear:
            break
    return proof


@dataclass(frozen=True, eq=False)
class Taught:
    """A model whose shared values were fitted to the other drops.

    Attributes
    ----------
    exam : Problem
        The held-out drop alone, shared values frozen.
    point : (n,) array
        Start point of the fit of the drop's own values.
    """

    exam: Problem
    point: Array


def taught(contender: Contender, index: int, horizon: float) -> Taught:
    """Fit a model without one drop, to the whole horizon of the others, since a cause may show only late in them."""
    problem = contender.problem
    others = [k for k in range(len(problem.drops)) if k != index]
    count = len(problem.shared)
    training = fit(only(problem, others), contender.fit.point[coordinates(problem, others)], horizon, 2, 3e-3)
    own = contender.fit.point[coordinates(problem, [index])][count:]
    return Taught(frozen(only(problem, [index]), training.point[:count]), np.concatenate([np.zeros(count), own]))


def judged(plain: Taught, extended: Taught, horizon: float) -> HeldOut:
    """Return the proof on the held-out drop up to a horizon."""
    (drop,) = extended.exam.drops
    noise = math.sqrt(float(np.mean([each.sigma**2 for each in drop.noise])))
    bare, wide = (_fitted_to_held_out(each, horizon) for each in (plain, extended))
    left, extended_left = (
        rms(each.exam, found.point, [0], horizon) for each, found in ((plain, bare), (extended, wide))
    )
    values, _ = extended.exam.values(wide.point, 0)
    return HeldOut((drop.name,), left, extended_left, noise, bare.misfit, wide.misfit, (values,))


def telling_drops(plain: Contender) -> list[int]:
    """Return the drops in the order in which to hold them out: those of middle speed first, with others on both sides.

    Drops with a small excess of the plain model come last, since there is little to gain on them: with friction that rises at low
    slip the plain model may fail in the slowest drop alone.
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


def _fitted_to_held_out(model: Taught, horizon: float) -> Fit:
    """Return the fit of the held-out drop's own values; a lost path is searched for again, so as not to count as misfit."""
    exam = model.exam
    found = better_cages(exam, fit(exam, model.point, horizon, 2), horizon, 1)
    return better_paths(exam, found, horizon, [0]) if lost_drops(exam, found, horizon) else found
