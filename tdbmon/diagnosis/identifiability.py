"""What drops from given speeds could show, before any record: detectable sizes, look-alikes, and which drop to add.

A nominal drop is simulated at each speed, and every suspect put into it at a small trial size.  A diagnosis sees only the
change of the residuals, projected orthogonally to the Jacobian of the calibrated values.  The length of that vector in standard
deviations of the noise determines what is detectable, and the angle between the vectors of two suspects what looks alike (a
canonical correlation, H. Hotelling, Biometrika 28 (1936) 321, since an unknown angle of an effect makes a plane of its vector).
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray
from tdbsim.drop_model import build_model
from tdbsim.drop_record import sensed
from tdbsim.effect import Parameter as Declared
from tdbsim.errors import InputError
from tdbsim.machine import Machine
from tdbsim.sensors import ProbeChain, SensorChain, least_sampling
from tdbsim.simulate import DropPlan, run

from tdbmon.diagnosis.beside_values import directions
from tdbmon.diagnosis.effect_size import off_of, off_when_stiff, sized
from tdbmon.diagnosis.score import FURTHEST, QUARTER, Key, Trials, changes_by, trial_keys
from tdbmon.diagnosis.suspects import Suspect, suspects
from tdbmon.estimate import OUTSIDE, Estimate
from tdbmon.identify.crew import Crew
from tdbmon.identify.divergence import with_divergence
from tdbmon.identify.drop import MeasuredDrop, measured_drop
from tdbmon.identify.problem import BENDING, Problem, build_problem, check_start
from tdbmon.identify.stages import stages_of
from tdbmon.progress import Progress, silent

Array = NDArray[np.float64]
DETECTABLE = 5.0  # standard deviations: some hundred suspects are tried, each with several chances
ALIKE = 0.95  # similarity above which two suspects are not told apart
# speeds of one more drop, shares of the greatest speed given: the machine may not be allowed to go faster
CANDIDATES = (0.5, 0.75, 1.0)

_LEVITATED_S = 0.1
_PAST_S = 0.008  # simulated beyond the horizon
_OFF_CENTRE = 0.1  # of the gap
_ABSORBED = 1e-8  # share of a change's square below which the rest is rounding
_METHOD = f"from trial simulations, at {DETECTABLE:g} standard deviations of the stated noise"
_LEAST_TRIAL = 0.01  # least second trial, share of the first: less is rounding
_STEEPEST = 3.0  # greatest power of the size with which a change may grow


@dataclass(frozen=True, eq=False)
class Detectable:
    """The size from which on an effect shows in the first contacts.

    Attributes
    ----------
    suspect : Suspect
    parameter : str
        Its size.
    size : Estimate
        Smallest detectable difference from where the effect is off; for a spring in series, the greatest detectable stiffness.
    unseen : float, optional
        If it does not show: the size up to which it does not (for a spring in series, the stiffness down to which), SI; either
        the limit of the catalogue, or the limit to which the trial is extrapolated.
    looks_like : tuple of (Suspect, float), optional
        The most similar other suspect, with the similarity from 0 to 1.
    """

    suspect: Suspect
    parameter: str
    size: Estimate
    unseen: float | None = None
    looks_like: tuple[Suspect, float] | None = None

    @property
    def may_show_later(self) -> bool:
        """True for effects by drag, rubbing or heat, which `diagnose` also seeks long after the first contacts."""
        return self.suspect.declared.kind.builds_up or self.suspect.declared.kind.slows


@dataclass(frozen=True, eq=False)
class Identifiability:
    """What drops from some speeds could show.

    Attributes
    ----------
    machine : Machine
    speeds : tuple of float
        Hz.
    noise : float
        Of a probe, m rms.
    detectable : tuple of Detectable
    pairs : tuple of (Suspect, Suspect, float)
        Look-alikes with their similarity, the most similar first.
    next_drops : tuple of (float, int)
        Speeds of one more drop, Hz, with the number of pairs that would still look alike, the best first.
    seconds : float
        Time of computation.
    """

    machine: Machine
    speeds: tuple[float, ...]
    noise: float
    detectable: tuple[Detectable, ...]
    pairs: tuple[tuple[Suspect, Suspect, float], ...]
    next_drops: tuple[tuple[float, int], ...]
    seconds: float

    @property
    def horizon(self) -> float:
        """Horizon of the simulations, s after the release: past the first contacts."""
        return stages_of(self.machine).bounced

    @property
    def limits(self) -> tuple[str, ...]:
        """Limits of validity of the sizes and pairs, in words."""
        return (
            "a size is the difference from the value at which the effect is off (for a gain, from 1); for a stiffness it is the"
            " greatest value that shows",
            "each effect is simulated at a small size and again where it should just show, and its change interpolated by a power"
            " of the size; the compensation by fitted values is taken as linear, and contacts are not linear",
            "only the stated noise and the fit's allowance for model error are included: no hum, no drift, no unknown physics",
            f"simulated to {self.horizon * 1e3:g} ms after the release, each drop from one set-point, a tenth of the gap off"
            " centre",
            "one effect at a time; an unknown angle is the least favourable one, an off-sized ball the one that shows most",
        )


def identifiability(
    machine: Machine,
    speeds: Sequence[float],
    noise: float,
    progress: Progress = silent,
    among: Sequence[Suspect] | None = None,
) -> Identifiability:
    """Return what drops of a machine could show, from its nominal values alone.

    Parameters
    ----------
    machine : Machine
    speeds : sequence of float
        Speed at the release of each drop, Hz.
    noise : float
        White noise of each probe, m rms.
    progress : callable, optional
        Called with the name of each step as it begins.
    among : sequence of Suspect, optional
        By default every effect of the catalogue at every place.

    Raises
    ------
    InputError
        If no speed is given, a speed or the noise is not positive, or a nominal drop cannot be simulated or read.
    """
    began = time.monotonic()
    if not speeds:
        raise InputError('no speed given; give --speed "100 Hz" once a drop')
    if not noise > 0:
        raise InputError(f"noise {noise * 1e6:g} um must be positive; without noise everything shows")
    drops = []
    for k, speed in enumerate(speeds):
        if not speed > 0:
            raise InputError(f"speed {speed:g} Hz must be positive")
        progress(f"simulating a drop from {speed:g} Hz")
        drops.append(_nominal_drop(machine, speed, noise, k))
    further = []
    for k, share in enumerate(CANDIDATES):
        try:
            further.append((share * max(speeds), _nominal_drop(machine, share * max(speeds), noise, len(drops) + k)))
        except InputError:  # no drop from this speed can be simulated, so it is not suggested
            continue
    with Crew() as crew:
        every = build_problem(machine, (*drops, *(drop for _, drop in further)), crew)
        check_start(every, every.stages.bounced)
        every = with_divergence(every)
        wanted = suspects(machine, drops[0].probes, every.standing) if among is None else tuple(among)
        progress(f"trying {len(wanted)} effects in {len(every.drops)} drops")
        seen = every.each(lambda drop: _observe(every, drop, wanted))
        first = _Comparison.of(every, seen, range(len(drops)), wanted)
        progress("trying them again where they should just show")
        shares = [first.just_shows(k) for k in range(len(wanted))]
        again = every.each(lambda drop: _again(every, drop, wanted, shares, seen[drop].slopes))
        second = _Comparison.of(every, again, range(len(drops)), wanted)
    pairs = first.alike()
    after = [
        (speed, len(_Comparison.of(every, seen, (*range(len(drops)), len(drops) + k), wanted).alike()))
        for k, (speed, _) in enumerate(further)
    ]
    return Identifiability(
        machine=machine,
        speeds=tuple(speeds),
        noise=noise,
        detectable=tuple(each for k in range(len(wanted)) for each in first.detectable(k, second, shares[k])),
        pairs=tuple((wanted[i], wanted[j], similar) for i, j, similar in pairs),
        next_drops=tuple(sorted(after, key=lambda each: each[1])),
        seconds=time.monotonic() - began,
    )


def _nominal_drop(machine: Machine, speed: float, noise: float, number: int) -> MeasuredDrop:
    """Return a simulated drop as a diagnosis would read it; `number` seeds noise, set-point and angles."""
    rng = np.random.default_rng(number)
    toward = 2 * np.pi * rng.uniform(size=2)
    reach = [_OFF_CENTRE * bearing.radial_gap.nominal for bearing in machine.touchdown_bearings]
    a, b = ((r * math.cos(t), r * math.sin(t)) for r, t in zip(reach, toward, strict=True))
    plan = DropPlan(
        speed=speed,
        seconds=stages_of(machine).bounced + _PAST_S,
        levitated=_LEVITATED_S,
        sampling=max(DropPlan.sampling, least_sampling(machine, speed)),
        set_point=(a, b),
        shaft_angle=float(rng.uniform(0, 2 * np.pi)),
        sensors=SensorChain(probe=ProbeChain(noise=noise), speed_noise_hz=0.05),
        seed=number,
    )
    record = sensed(run(build_model(machine, bending=BENDING), plan))
    record.attrs["source_file"] = f"nominal drop {number + 1} from {speed:g} Hz"
    return measured_drop(record, machine)


def _keys(suspect: Suspect) -> list[Key]:
    """Return the trials at the least trial size; of a ball at its full size, where its number shows."""
    return [key for key in trial_keys(suspect) if key[1] == _share(suspect) and key[2] in QUARTER]


def _share(suspect: Suspect) -> float:
    shares = sorted({key[1] for key in trial_keys(suspect)})
    return shares[1] if suspect.counted else shares[0]


@dataclass(frozen=True, eq=False)
class _Observed:
    """A drop's Jacobian (m, columns) and the change of its residuals (m,) by each trial of each suspect."""

    slopes: Array
    trials: Sequence[Trials]


def _observe(problem: Problem, drop: int, wanted: Sequence[Suspect]) -> _Observed:
    horizon = problem.stages.bounced
    base, slopes = problem.slopes(problem.start, drop, horizon)
    ones = np.ones(len(base))
    return _Observed(slopes, changes_by(problem, problem.start, drop, horizon, wanted, ones, _keys))


def _again(
    problem: Problem, drop: int, wanted: Sequence[Suspect], shares: Sequence[Sequence[float]], slopes: Array
) -> _Observed:
    """Return the changes of a drop by suspects with each size at a given share of the typical one."""
    share_of = dict(zip(wanted, shares, strict=True))

    def keys(suspect: Suspect) -> list[Key]:
        return [(number, share_of[suspect][int(number)], *rest) for number, _, *rest in _keys(suspect)]

    ones = np.ones(len(slopes))
    horizon = problem.stages.bounced
    return _Observed(slopes, changes_by(problem, problem.start, drop, horizon, wanted, ones, keys))


@dataclass(frozen=True, eq=False)
class _Comparison:
    """Comparison of the changes that suspects make in some drops; one column per trial.

    Attributes
    ----------
    suspects : tuple of Suspect
    blocks : tuple of tuple
        Of each suspect, for each size: groups of columns with a common unknown angle, one group per drop if the angle differs
        from drop to drop; empty if a trial could not be simulated.
    gram : (n, n) array
        Gram matrix of the columns, projected orthogonally to the Jacobian, each at the size of its trial.
    """

    suspects: tuple[Suspect, ...]
    blocks: tuple[tuple[tuple[tuple[int, ...], ...], ...], ...]
    gram: Array

    @classmethod
    def of(
        cls, problem: Problem, seen: Sequence[_Observed], drops: Sequence[int], wanted: Sequence[Suspect]
    ) -> _Comparison:
        """Return the comparison by these drops."""
        # rows of other drops have weight 0, so that the fitted values do not depend on them
        weights = [np.full(len(each.slopes), float(k in drops)) for k, each in enumerate(seen)]
        basis, begin = directions(problem, [each.slopes for each in seen], weights, problem.low < problem.high)
        columns: list[Mapping[int, Array]] = []
        blocks: list[tuple[tuple[tuple[int, ...], ...], ...]] = []
        for k, suspect in enumerate(wanted):
            of_suspect: list[tuple[tuple[int, ...], ...]] = []
            for number, (_, angle) in enumerate(suspect.sizes):
                groups = _groups({d: seen[d].trials[k] for d in drops}, number, angle)
                if groups is None:
                    of_suspect = []
                    break
                first = len(columns)
                columns += [column for group in groups for column in group]
                ends = first + np.cumsum([0, *(len(group) for group in groups)])
                of_suspect.append(tuple(tuple(range(a, b)) for a, b in pairwise(ends)))
            blocks.append(tuple(of_suspect))
        full = np.zeros((int(begin[-1]), len(columns)))
        for c, column in enumerate(columns):
            for d, change in column.items():
                full[begin[d] : begin[d + 1], c] = change
        fitted = basis[: begin[-1]].T @ full
        gram = full.T @ full
        left = gram - fitted.T @ fitted
        hidden = np.diag(left) <= _ABSORBED * np.diag(gram)
        left[hidden, :] = 0.0
        left[:, hidden] = 0.0
        return cls(tuple(wanted), tuple(blocks), left)

    def _parts(self, suspect: int) -> list[list[int]]:
        """Return a suspect's columns other than zero; one list per drop if its angle differs from drop to drop."""
        sizes = self.blocks[suspect]
        if not sizes:
            return []
        apart = len(sizes[0]) if all(len(size) == len(sizes[0]) for size in sizes) else 1
        groups = [[size[d] for size in sizes] for d in range(apart)] if apart > 1 else [[g for s in sizes for g in s]]
        return [[c for group in part for c in group if self.gram[c, c] > 0] for part in groups]

    def _white(self, columns: Sequence[int]) -> Array:
        """Return the matrix that makes the columns orthonormal."""
        scale = 1 / np.sqrt(np.diag(self.gram)[columns])
        values, vectors = np.linalg.eigh(self.gram[np.ix_(columns, columns)] * np.outer(scale, scale))
        keep = values > 1e-6
        white: Array = scale[:, None] * vectors[:, keep] / np.sqrt(values[keep])
        return white

    def _correlation(self, one: Sequence[int], other: Sequence[int]) -> float:
        """Return the greatest canonical correlation of two sets of columns, 0 if one is empty."""
        if not one or not other:
            return 0.0
        shared = self._white(one).T @ self.gram[np.ix_(one, other)] @ self._white(other)
        return min(1.0, float(np.linalg.norm(shared, 2)))

    def _similarity(self, one: int, other: int) -> float:
        """Return the cosine of two suspects' changes at the angles where they are most alike.

        If the angles of both differ from drop to drop, each drop has its own, but the size is common to all: the cosine is the
        sum over the drops, each weighted by the lengths of both changes in it.
        """
        parts, others = self._parts(one), self._parts(other)
        if len(parts) != len(others) or len(parts) == 1:
            return self._correlation([c for part in parts for c in part], [c for part in others for c in part])
        share = np.sqrt(self._shares(parts) * self._shares(others))
        each = [self._correlation(a, b) for a, b in zip(parts, others, strict=True)]
        return min(1.0, float(share @ np.array(each)))

    def _shares(self, parts: Sequence[Sequence[int]]) -> Array:
        """Return each drop's share of the squared length of a suspect's change."""
        square = np.array([float(np.diag(self.gram)[list(part)].sum()) for part in parts])
        total = float(square.sum())
        return square / total if total > 0 else square

    @cached_property
    def similarities(self) -> Array:
        """Similarity of each pair, (suspects, suspects), 0 with itself."""
        count = len(self.suspects)
        out = np.zeros((count, count))
        for i, j in combinations(range(count), 2):
            out[i, j] = out[j, i] = self._similarity(i, j)
        return out

    def alike(self) -> list[tuple[int, int, float]]:
        """Return the pairs that look alike, the most similar first."""
        similar = self.similarities
        found = [(i, j, float(similar[i, j])) for i, j in combinations(range(len(similar)), 2)]
        return sorted((each for each in found if each[2] > ALIKE), key=lambda each: -each[2])

    def just_shows(self, suspect: int) -> list[float]:
        """Return the shares of the typical sizes at which a suspect would just show if its change were linear."""
        of, found = self.suspects[suspect], []
        for number, (size, _) in enumerate(of.sizes):
            length = self._length(self.blocks[suspect][number]) if self.blocks[suspect] else 0.0
            amount = min(max(DETECTABLE / length, _LEAST_TRIAL), 1.0) if length > 0 else 1.0
            found.append(_share(of) * (math.sqrt(amount) if off_when_stiff(size) else amount))
        return found

    def detectable(self, suspect: int, second: _Comparison, shares: Sequence[float]) -> list[Detectable]:
        """Return the least detectable sizes of a suspect, by this trial and a second one at other shares of the typical size."""
        similar = self.similarities[suspect]
        nearest = int(np.argmax(similar))
        like = (self.suspects[nearest], float(similar[nearest])) if similar[nearest] > 0 else None
        of = self.suspects[suspect]
        if not self.blocks[suspect]:
            why = "its trial could not be simulated"
            return [Detectable(of, size.name, Estimate.missing(size.unit, why)) for size, _ in of.sizes]
        found = []
        for number, ((size, _), groups) in enumerate(zip(of.sizes, self.blocks[suspect], strict=True)):
            length, power = self._length(groups), 1.0
            smaller = shares[number] / _share(of)
            if smaller < 1 and second.blocks[suspect]:
                shrunk = second._length(second.blocks[suspect][number]) / length
                way = 2 * math.log(smaller) if off_when_stiff(size) else math.log(smaller)
                # a change whose linear part a later release can make grows with the square of the size
                power = min(max(math.log(shrunk) / way, 1.0), _STEEPEST) if shrunk > 0 else _STEEPEST
            found.append(Detectable(of, size.name, *_smallest(size, _share(of), length, power), looks_like=like))
        return found

    def _length(self, groups: Sequence[tuple[int, ...]]) -> float:
        """Return the change of the residuals by a trial in standard deviations, at the least favourable angle."""
        least = [float(np.linalg.eigvalsh(self.gram[np.ix_(group, group)])[0]) for group in groups]
        return math.sqrt(sum(max(0.0, each) for each in least))


def _groups(trials: Mapping[int, Trials], number: int, angle: Declared | None) -> list[list[dict[int, Array]]] | None:
    """Return the columns of a size, one list per unknown angle; None if no trial of a drop could be simulated.

    A column holds the change of each drop, by drop number.
    """
    parts: list[dict[int, Array]] = []
    for eighth in QUARTER if angle else (0,):
        part: dict[int, Array] = {}
        for drop, trial in trials.items():
            found = [c for key, c in trial.items() if (key[0], key[2]) == (number, eighth) and c is not None]
            if not found:
                return None
            part[drop] = max(found, key=lambda change: float(change @ change))  # of the balls, the one that shows most
        parts.append(part)
    if angle is not None and angle.per_drop:
        return [[{drop: part[drop]} for part in parts] for drop in trials]
    return [parts]


def about(size: float, unit: str) -> str:
    """Return a size, SI, as text in its unit outside, to two digits."""
    return f"{float(f'{size * OUTSIDE[unit]:.2g}'):.6g}{'' if unit == '1' else f' {unit}'}"


def _smallest(size: Declared, share: float, length: float, power: float = 1.0) -> tuple[Estimate, float | None]:
    """Return the least detectable size, and, if the effect does not show, the size up to which it does not.

    A trial at a share of the typical size changes the residuals by `length`, which grows with a power of the size.
    """
    if length <= 0:
        return Estimate.missing(size.unit, "fitted values can have the same effect: it does not show"), None
    amount, trial = (DETECTABLE / length) ** (1 / power), sized(size, share)
    off, stiff = off_of(size), off_when_stiff(size)
    if stiff:
        value, limit = trial / amount, max(trial / FURTHEST, size.low)
    else:
        value, limit = (
            abs(amount * (trial - off)),
            min(FURTHEST * abs(trial - off), max(size.high - off, off - size.low)),
        )
    if value < limit if stiff else value > limit:
        told = about(limit, size.unit)
        why = (
            f"not detectable in the first contacts of these drops {'down' if stiff else 'up'} to {told}, the furthest"
            " extrapolation of the trial"
        )
        return Estimate.missing(size.unit, why), limit
    return Estimate(value, unit=size.unit, method=_METHOD, why="computed from trial simulations, without an interval"), None
