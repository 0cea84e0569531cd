"""The rest of the record, after paths diverge, compared with many simulations.

A path with impacts can be followed for some tens of milliseconds.  Its synchronous whirl and its mean position can be predicted
much longer, within bounds: simulations from points drawn about the fit diverge from each other as the drop diverges from its
model, and the drop is one of them unless something acts that they lack.  A part that flies off shows in the whirl, a drifting
probe in the mean position.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from tdbsim.errors import InputError

from tdbmon.diagnosis.contender import Contender
from tdbmon.identify.draws import draws
from tdbmon.identify.drop import MeasuredDrop
from tdbmon.identify.least_squares import covariance_of
from tdbmon.identify.prediction import Path, readings
from tdbmon.identify.problem import Problem
from tdbmon.identify.slowing import last_of
from tdbmon.identify.variants import paths

Array = NDArray[np.float64]

_WINDOW_S = 0.05  # least length of a window
_TURNS = 3.0  # revolutions, the same
_LEAST_WINDOWS = 3  # of a drop
_MEMBERS = 32  # simulations of a drop
_FEWEST = 0.25  # share of them that must succeed
_WIDER = 5.0  # multiple of the fit's standard deviations: the model's own error makes paths diverge too
_WHIRL_LAW = 0.3  # standard deviation of the logarithm of the whirl's power due to inexact laws
_VECTOR_LAW = _WHIRL_LAW / 2  # the same of the 1X vector, share of its length
_VECTOR_LEAST = 0.5e-6  # m, least standard deviation of the 1X vector
_PLACE_LAW = 2e-6  # m, standard deviation of the mean position due to inexact laws
WHIRLS_OTHERWISE = 2.0  # standard deviations of a drop's amplitude or 1X vector from which on it departs
STAYS_ELSEWHERE = 1.5  # the same of a probe's mean reading, averaged over the drops
IN_ONE_DROP = (
    3.0  # the same of any of these in a single drop of several; greatest of 90 on which nothing acts late: 2.4
)
_THERE = 0.6  # least share of a probe's samples in a window


@dataclass(frozen=True, eq=False)
class LateRecord:
    """A drop after the horizon, in w windows, and n simulations of it.

    Attributes
    ----------
    name : str
        The drop's.
    begins : float
        Where the model's horizon ends, s after the release.
    time : (w,) array
        Middle of each window, s after the release.
    probes : tuple of str
        Names of those with enough samples in every window.
    once, onces : (probes, w) and (n, probes, w) complex arrays
        1X vectors (amplitude and phase), m, measured and simulated.
    place, places : (probes, w) and (n, probes, w) arrays
        Mean readings, m, likewise.
    wide : LateRecord or None
        The same drop against another model, whose simulations' spread is the unit of departures; None for its own spread.
    """

    name: str
    begins: float
    time: Array
    probes: tuple[str, ...]
    once: NDArray[np.complex128]
    onces: NDArray[np.complex128]
    place: Array
    places: Array
    wide: LateRecord | None = None

    def in_spread_of(self, other: LateRecord) -> LateRecord:
        """Return the same with departures in units of another model's spread, so that both can be compared.

        A wider spread of simulations does not bring them nearer to the drop.
        """
        return replace(self, wide=other)

    @cached_property
    def whirl(self) -> Array:
        """Measured 1X amplitude (w,), m, root mean square over the probes."""
        return np.sqrt(np.mean(np.abs(self.once) ** 2, axis=0))

    @cached_property
    def whirls(self) -> Array:
        """The same of the simulations (n, w)."""
        return np.sqrt(np.mean(np.abs(self.onces) ** 2, axis=1))

    @property
    def whirl_sigma(self) -> Array:
        """Standard deviation of the logarithm of the whirl's power (w,)."""
        powers = 2 * np.log((self.wide or self).whirls)
        return np.hypot(powers.std(axis=0), _WHIRL_LAW)

    @property
    def place_sigma(self) -> Array:
        """Standard deviation of each mean reading (probes, w), m."""
        return np.hypot((self.wide or self).places.std(axis=0), _PLACE_LAW)

    @property
    def whirl_departure(self) -> float:
        """Measured above simulated whirl, in standard deviations, mean over the windows."""
        ahead = 2 * np.log(self.whirl) - np.median(2 * np.log(self.whirls), axis=0)
        return float(np.mean(ahead / self.whirl_sigma))

    @property
    def vector_departure(self) -> float:
        """Distance of measured from simulated 1X vectors, in standard deviations, root mean square over probes and windows.

        An unbalance that changes by a little turns the vectors more than it lengthens them.
        """
        onces = (self.wide or self).onces
        middle = onces.mean(axis=0)
        variance = np.mean(np.abs(onces - middle) ** 2, axis=0) + (_VECTOR_LAW * np.abs(middle)) ** 2 + _VECTOR_LEAST**2
        return math.sqrt(float(np.mean(np.abs(self.once - self.onces.mean(axis=0)) ** 2 / variance)))

    @property
    def whirl_times(self) -> float:
        """Measured amplitude over the simulated one, geometric mean over the windows."""
        return math.exp(float(np.mean(np.log(self.whirl / np.median(self.whirls, axis=0)))))

    @property
    def shifts(self) -> Array:
        """Measured less simulated mean reading (probes,), m, mean over the windows."""
        return np.asarray((self.place - np.median(self.places, axis=0)).mean(axis=1))

    @property
    def place_departures(self) -> Array:
        """`shifts` in standard deviations (probes,), mean over the windows."""
        apart = self.place - np.median(self.places, axis=0)
        return np.asarray((apart / self.place_sigma).mean(axis=1))

    @property
    def departure(self) -> float:
        """Sum of squared departures of whirl and mean readings: about 1 if nothing acts that the simulations lack.

        1X vectors are left out, since the whirl contains their length.  A change of their phase alone shows that something acts
        later (`acts_later`), but no cause gains by explaining it.
        """
        return self.whirl_departure**2 + float(np.sum(self.place_departures**2))

    @property
    def apart(self) -> Array:
        """Measured less simulated reading of each probe, then 1X amplitude (probes + 1,), m, means over the windows."""
        whirl = float(np.mean(self.whirl - np.median(self.whirls, axis=0)))
        return np.append(self.shifts, whirl)

    @property
    def spread(self) -> Array:
        """Standard deviations of `apart` (probes + 1,), m, from the spread of the simulations and inexact laws."""
        whirl, whirls = np.median(self.whirls), self.whirls.mean(axis=1)
        places = np.hypot(self.places.mean(axis=2).std(axis=0), _PLACE_LAW)
        return np.append(places, math.hypot(float(whirls.std()), _WHIRL_LAW / 2 * float(whirl)))


def departure_of(records: Sequence[LateRecord]) -> float:
    """Return the sum of `departure` over some drops."""
    return sum(each.departure for each in records)


def drawn(contender: Contender, members: int) -> list[Array]:
    """Return the point of a fit and points drawn about it, whose paths diverge as the drop diverges from its model.

    The instants of release, known to microseconds, are kept, so that the drops can be simulated side by side.
    """
    problem, point = contender.problem, contender.fit.point
    wide = _WIDER**2 * covariance_of(problem, contender.fit, contender.horizon)
    release = [each.name == "release" for each in problem.parameters]
    points = draws(problem, point, wide, members, np.random.default_rng(0))
    return [np.where(release, point, each) for each in points]


def late_records(contender: Contender) -> tuple[LateRecord, ...] | None:
    """Return the rest of all drops' records after a model's horizon; None if that of one cannot be compared."""
    problem, points = contender.problem, drawn(contender, _MEMBERS)
    tasks = [(problem, points, drop, contender.horizon) for drop in range(len(problem.drops))]
    found = problem.crew.apart(late_record, tasks)
    known = tuple(each for each in found if each is not None)
    return known if len(known) == len(found) else None


def late_record(problem: Problem, points: Sequence[Array], drop: int, horizon: float) -> LateRecord | None:
    """Return a drop after a horizon with simulations of it at several points.

    None without a keyphasor, in too short a record, or if too few simulations succeed.
    """
    measured = problem.drops[drop]
    last, length = last_of(measured), _window(measured)
    begins = horizon + length * np.arange(_windows(measured, horizon))
    if len(begins) < _LEAST_WINDOWS:
        return None
    variants = []
    for point in points:
        try:
            variants.append(problem.variant(point, drop, last))
        except InputError:
            continue
    simulated = [
        (path, variant.sensors)
        for path, variant in zip(paths(measured, variants, last), variants, strict=True)
        if isinstance(path, Path)
    ]
    if len(simulated) < _FEWEST * len(points):
        return None
    first, machine = simulated[0][0].first, problem.model.machine
    span = slice(first, first + simulated[0][0].x.shape[-1])
    since = measured.time[span] - measured.release
    windows = [(since >= begin) & (since < begin + length) for begin in begins]
    there = np.isfinite(measured.reading[:, span])
    probes = np.all([there[:, window].mean(axis=1) >= _THERE for window in windows], axis=0)
    if not probes.any():
        return None

    def averages(seen: Array, angle: Array) -> tuple[NDArray[np.complex128], Array]:
        return _averages(np.where(there, seen, np.nan)[probes], angle, windows)

    once, place = averages(measured.reading[:, span], _shaft_angle(measured, measured.time[span]))
    each = [averages(readings(path, measured, machine, sensors), path.angle) for path, sensors in simulated]
    onces, places = zip(*each, strict=True)
    names = tuple(probe.name for probe, used in zip(measured.probes, probes, strict=True) if used)
    middle = np.asarray(begins + length / 2, dtype=float)
    return LateRecord(measured.name, horizon, middle, names, once, np.array(onces), place, np.array(places))


def _window(drop: MeasuredDrop) -> float:
    return max(_WINDOW_S, _TURNS / drop.speed)


def _windows(drop: MeasuredDrop, horizon: float) -> int:
    """Return the number of windows of a record after a horizon; 0 without a keyphasor."""
    if not _turns_told(drop):
        return 0
    until = min(last_of(drop), float(drop.pulse_times[-1]) - drop.release)
    return max(math.floor((until - horizon) / _window(drop) + 1e-9), 0)


def _turns_told(drop: MeasuredDrop) -> bool:
    return len(drop.pulse_times) >= 2


def rest_lacks(contender: Contender) -> list[MeasuredDrop]:
    """Return the drops of a model whose records end too early after its horizon, or have no keyphasor there."""
    horizon = contender.horizon
    return [
        drop for drop in contender.problem.drops if not _turns_told(drop) or _windows(drop, horizon) < _LEAST_WINDOWS
    ]


def untold(contender: Contender) -> str:
    """Say why the rest of the drops' records is not compared with simulations, and what that costs."""
    drops, horizon = contender.problem.drops, contender.horizon
    incomplete = rest_lacks(contender)
    mute = [drop.name for drop in incomplete if not _turns_told(drop)]
    short = [drop for drop in incomplete if _turns_told(drop)]
    why = [f"no keyphasor shows how the shaft turns after the release in {', '.join(mute)}"] if mute else []
    if short:
        needed = max(horizon + _LEAST_WINDOWS * _window(drop) for drop in short)
        names, hold = ", ".join(drop.name for drop in short), "holds" if len(short) == 1 else "hold"
        why.append(f"{names} {hold} less than {needed * 1e3:.0f} ms after the release")
    if not why:
        why.append("its probes lack too many samples there, or too few of its simulations succeed")
    others = (
        ". Diagnose the other drops separately to have theirs compared" if 0 < len(incomplete) < len(drops) else ""
    )
    return (
        f"the rest of the record is not compared with simulations, since {' and '.join(why)}: causes that act later than"
        f" {horizon * 1e3:g} ms are neither sought nor excluded{others}"
    )


def _averages(seen: Array, angle: Array, windows: Sequence[NDArray[np.bool_]]) -> tuple[NDArray[np.complex128], Array]:
    """Return 1X vectors and means, both (probes, windows), of readings (probes, k) at shaft angles (k,)."""
    turning = np.exp(-1j * angle)
    once, place = np.empty((len(seen), len(windows)), dtype=complex), np.empty((len(seen), len(windows)))
    for column, window in enumerate(windows):
        kept = seen[:, window]
        place[:, column] = middle = np.nanmean(kept, axis=1)
        once[:, column] = 2 * np.nanmean((kept - middle[:, None]) * turning[window], axis=1)
    return once, place


def _shaft_angle(drop: MeasuredDrop, time: Array) -> Array:
    """Return the shaft's angle by the keyphasor, rad, at instants between the release and its last pulse."""
    # on a slow shaft the first pulse may come after the first window begins
    times, angles = [drop.release, *drop.pulse_times], [drop.angle, *drop.pulse_angles]
    return np.interp(time, times, angles)


def acts_later(records: Sequence[LateRecord]) -> str | None:
    """Say how the rest of the records departs from simulations; None if it does not.

    It does if the whirl departs in half of the drops and in at least two, by amplitude to the same side or by vector; if the mean
    reading of a probe departs on average over at least two drops; or if one of these departs by `IN_ONE_DROP` in one of several.
    """
    if len(records) < 2:
        return None
    found = _whirls_otherwise(records) or _turns_otherwise(records) or _stays_elsewhere(records)
    return (
        found and f"the rest of the record differs from {len(records[0].whirls)} simulations of each drop: {found}"
    )


def _whirls_otherwise(records: Sequence[LateRecord]) -> str | None:
    for sign in (1, -1):
        apart = [(each, sign * each.whirl_departure) for each in records]
        told = [f"{each.whirl_times:.2g} times as simulated in {each.name}" for each in _departing(apart)]
        if told:
            return f"the 1X whirl is {', '.join(told)}"
    return None


def _turns_otherwise(records: Sequence[LateRecord]) -> str | None:
    apart = [(each, each.vector_departure) for each in records]
    told = [f"{each.vector_departure:.1f} standard deviations off in {each.name}" for each in _departing(apart)]
    return f"the 1X vector is {', '.join(told)}" if told else None


def _departing(apart: Sequence[tuple[LateRecord, float]]) -> list[LateRecord]:
    """Return the drops that depart by more than `WHIRLS_OTHERWISE`; none if too few do."""
    found = [(each, by) for each, by in apart if by > WHIRLS_OTHERWISE]
    enough = len(found) >= max(2, math.ceil(len(apart) / 2)) or any(by > IN_ONE_DROP for _, by in found)
    return [each for each, _ in found] if enough else []


def seen_in_all(records: Sequence[LateRecord]) -> list[str]:
    """Return the probes that are compared in all drops."""
    return [name for name in records[0].probes if all(name in each.probes for each in records)]


def _stays_elsewhere(records: Sequence[LateRecord]) -> str | None:
    found = []
    for name in seen_in_all(records):
        rows = [(each, each.probes.index(name)) for each in records]
        if abs(np.mean([each.place_departures[row] for each, row in rows])) > STAYS_ELSEWHERE:
            shift = float(np.mean([each.shifts[row] for each, row in rows]))
            found.append(f"probe '{name}' reads {shift * 1e6:+.2g} um more")
            continue
        alone = [(each, row) for each, row in rows if abs(each.place_departures[row]) > IN_ONE_DROP]
        found += [f"probe '{name}' reads {each.shifts[row] * 1e6:+.2g} um more in {each.name}" for each, row in alone]
    return ", ".join(found) or None
