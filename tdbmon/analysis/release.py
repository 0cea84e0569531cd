"""The instant at which the magnetic field let go, found in the record itself.

Before it the shaft stands in its levitated orbit: a constant and once per revolution, with twice per revolution, higher orders
that stand out, and the mains, which the probes see of the shaft's surface and of the wiring and which go on as they were.
After it the rotor falls freely: a parabola under gravity, once per revolution about its inertia axis, and the sag between the
magnetic bearings springs back in the lowest bending modes.  Position and velocity do not jump.
`tdbmon.analysis.release_fit` joins the two, and `tdbmon.analysis.release_search` finds the instant.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import xarray as xr
from tdbsim.errors import InputError
from tdbsim.machine import Machine
from tdbsim.modes import free_free
from tdbsim.rotor import RotorModel

from tdbmon.analysis.axes import seen_ends, to_planes
from tdbmon.analysis.bent_line import BENDS, LevitatedMiss
from tdbmon.analysis.fall_acceleration import fall_acceleration, gravity_alone, turning_alone
from tdbmon.analysis.floor_line import floor_line
from tdbmon.analysis.leaving_orbit import falls_between, surely_levitated
from tdbmon.analysis.missing_stretches import said
from tdbmon.analysis.release_fit import WIDE, ReleaseFit
from tdbmon.analysis.release_search import PROBE_SCALE, FittedRelease, search_release, unless_worse
from tdbmon.analysis.spring_back import Sag, SpringBack
from tdbmon.analysis.surface_orders import surface_orders
from tdbmon.analysis.turning_speed import turning_speed
from tdbmon.estimate import Estimate
from tdbmon.quantity import percent
from tdbmon.record.probe_checks import SHORT_GAP
from tdbmon.runs import runs_of

_CLEAR_S = 0.012  # before the orbit is left: surely levitated
_LEVITATED_S = 0.2  # before the orbit is left: so much of it is fitted
_LATEST_S = 0.004  # after the orbit is left: until then the release is sought
_LONGER = 1.08  # of the fall's length, where each probe's fall is looked at: still short of the turning point
_UPRIGHT = 0.5  # sine of a probe's angle, from which on it sees the fall
# bending modes that may spring back, and up to which frequency: there gravity over its square is a quarter of a micrometre
_BENDING_MODES, _SAGS_HZ = 4, 1000.0
_SEEN_HZ = 0.25  # of the sampling rate: a mode above shows in no record
_SHARE_ERROR = 0.01  # of gravity: what the laws leave out of a fall, standard deviation a probe
_UPWARDS = 0.5  # of gravity, beyond the orbit's turning: the probes' signs are wrong
_LEAST_FALL = 0.15  # of gravity: ends that fall with less all together do not fall
_AT_ONCE = "the fall starts at once; no decaying magnetic force is seen"
_SEEN_S = 2e-3  # of the fall out of the orbit: less, beside a stretch without samples, fits any instant


@dataclass(frozen=True)
class EndState:
    """One end as it was let go (SI).

    Attributes
    ----------
    x, y, vx, vy : Estimate
        Position and velocity of the shaft centre.
    noise : float
        Standard deviation, m, of what remains of the levitated orbit (mean of both axes).
    levitated : tuple
        Mean levitated position (x, y), m.
    scale : float or None
        How many times as far as it went the end reads, where a sudden release on such scales explains the fall, and neither a
        decaying force nor the probes' tolerance does.
    """

    x: Estimate
    y: Estimate
    vx: Estimate
    vy: Estimate
    noise: float
    levitated: tuple[float, float]
    scale: float | None


@dataclass(frozen=True)
class Fall:
    """Free fall of one end: a check on units and directions.

    Attributes
    ----------
    acceleration : tuple
        Fitted to it (x, y), m/s^2.
    whirl : float
        Vertical acceleration of a wide levitated orbit, 0-pk, m/s^2; 0 where it is narrow.
    turning : float
        How much of the vertical acceleration may be once per revolution in the fall, m/s^2.
    """

    acceleration: tuple[float, float]
    whirl: float
    turning: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Release:
    """The release of a drop.

    Attributes
    ----------
    time : Estimate
        From the record's first sample, s; missing where a stretch without samples hides it, or the probes see a fall upwards,
        none or one on a wrong scale: then neither force decay nor states are told.
    force_decay : Estimate
        Time constant T of the magnetic force after the switch-off; missing where the force vanished at once.
    states : dict
        `EndState` by the end's name.
    falls : dict
        `Fall` by the end's name.
    shares : dict
        Share of gravity that each probe shows in the free fall, for probes that stand upright enough to see it; empty where
        speed or bending of the rotor are not known, or not all probes show the fall.
    """

    time: Estimate
    force_decay: Estimate
    states: dict[str, EndState] = field(default_factory=dict)
    falls: dict[str, Fall] = field(default_factory=dict)
    shares: dict[str, Estimate] = field(default_factory=dict)


def find_release(
    planes: xr.Dataset,
    machine: Machine,
    speed_hz: float | None,
    bending_hz: Sequence[float] = (),
    sag: Sag | None = None,
) -> Release | None:
    """Find the release.

    Parameters
    ----------
    planes : Dataset
        Result of `to_planes`.
    machine : Machine
        For gravity and the mains frequency.
    speed_hz : float or None
        Rotor speed before the release; None where it is not known (then the levitated orbit has to tell it).
    bending_hz : sequence of float, optional
        Of the free rotor's bending modes in which the levitated sag springs back (`springing_back`).
    sag : Sag, optional
        That sag by the machine file (`tdbmon.analysis.spring_back.sag_of`).

    Returns
    -------
    Release or None
        None where the record starts after the release or less than 5 ms before it.

    Raises
    ------
    InputError
        If the rotor never leaves its levitated position.
    """
    ends = seen_ends(planes)
    z = planes.displacement.sel(end=ends).to_numpy().reshape(2 * len(ends), -1)
    time, rate = planes.time.to_numpy(), planes.attrs["sampling_hz"]
    begin = int(np.argmax(np.isfinite(z).all(axis=0)))  # a logger may start late
    time, z = time[begin:], z[:, begin:]
    gaps = np.repeat([machine.bearing(end).radial_gap.nominal for end in ends], 2)
    head = surely_levitated(z, rate, gaps, machine.gravity)
    rough = falls_between(z, rate, gaps, head)
    if rough is None:
        return None
    start, stop = rough
    first = max(0, start - int(_LEVITATED_S * rate))
    window = slice(first, stop)
    t, data = time[window], z[:, window]
    valid = np.isfinite(data).all(axis=0)
    hole = _hole(t, valid, time[start] - _CLEAR_S)
    if hole is not None and valid[start - first :].sum() < _SEEN_S * rate:
        why = f"{said(hole)}, where the shaft falls: the release may lie anywhere in it; record without gaps"
        return not_told(why, {})
    t, data = t[valid], data[:, valid]
    mains = machine.mains if start - first > rate / machine.mains else None
    levitated = t < time[start] - _CLEAR_S
    fit = _laws(t, data, levitated, machine.gravity, speed_hz, mains, bending_hz, _SEEN_HZ * rate)
    if sag is not None and fit.speed_hz and "weights" in planes:
        sagging = replace(fit, sag=_seen(sag, planes.weights.sel(end=ends), machine, fit.speed_hz))
        # a rotor that is not the file's may not sag so at all
        fit = unless_worse(sagging, fit, time[start] - _CLEAR_S, time[start] + _LATEST_S)
    # a slow descent that no law of a fall follows makes the fitted orbit wide; the seen one tells
    wide = np.ptp(data[:, t < time[start]], axis=1) > 2 * WIDE
    if _is_slow(time[start:], z[:, start:], gaps, machine.gravity):
        if first == 0 and _moves_at_once(z[:, :start]):
            return None
        # no law fits a descent, and the search for one takes a minute
        at_first = np.nanmax(z[:, :head], axis=1) - np.nanmin(z[:, :head], axis=1) > 2 * WIDE
        falls = _falls(fit, time[start], at_first, ends)
        if why := _no_fall(falls, machine.gravity):
            return not_told(why, falls)
    best = search_release(fit, time[start] - _CLEAR_S, time[start] + _LATEST_S)
    if best.time < t[0]:
        return None
    falls = _falls(fit, best.time, wide, ends)
    if why := _no_fall(falls, machine.gravity):
        return not_told(why, falls)
    later = time < best.time + _LONGER * (t[-1] - best.time)
    later[:first] = False
    later &= np.isfinite(z).all(axis=0)
    shares: dict[str, Estimate] = {}
    if "weights" in planes:  # else the planes were not made from probes
        maps, names = planes.weights.sel(end=ends).to_numpy().reshape(2 * len(ends), -1), planes.probe.values
        shares = _shares(maps, names, machine, replace(fit, t=time[later], data=z[:, later]), best)
    which = "both ends" if len(ends) > 1 else f"end {ends[0]} alone"
    rule = f"levitated orbit and free fall joined without a jump, {which}"
    return Release(
        time=Estimate(best.time, best.low, best.high, "s", rule),
        force_decay=_force_decay(best, float(time[-1] - time[0])),
        states=_states(fit, best, planes, ends),
        falls=falls,
        shares=shares,
    )


def _laws(
    t: np.ndarray,
    data: np.ndarray,
    levitated: np.ndarray,
    gravity: float,
    speed_hz: float | None,
    mains: float | None,
    bending_hz: Sequence[float],
    fastest: float,
) -> ReleaseFit:
    """Return the laws of orbit and fall, with the lines up to the `fastest` (Hz) that the `levitated` samples show."""
    before, orbit = t[levitated], data[:, levitated]
    turning = turning_speed(before, orbit, speed_hz, mains)
    orders = surface_orders(before, orbit, turning, mains, fastest)
    hum = [mains] if mains else []
    # without a speed a line may as well be the shaft's
    floor = floor_line(before, orbit, [turning, 2 * turning, *hum, *orders]) if turning else None
    sags = [hz for hz in bending_hz if hz < fastest]
    return ReleaseFit(t, data, gravity, turning, mains, sags, orders_hz=orders, floor_hz=floor)


def not_told(why: str, falls: dict[str, Fall]) -> Release:
    """Return a release whose instant, and all that rests on it, is missing for the reason `why`."""
    return Release(time=Estimate.missing("s", why), force_decay=Estimate.missing("ms", why), falls=falls)


def _is_slow(time: np.ndarray, z: np.ndarray, gaps: np.ndarray, gravity: float) -> bool:
    """Whether a shaft that leaves its orbit with the first sample takes longer for half the gap than one that hardly falls."""
    if gravity <= 0:
        return False
    until = time[0] + np.sqrt(gaps.max() / (_LEAST_FALL * gravity))
    if time[-1] < until:
        return False
    soon = z[:, (time < until) & np.isfinite(z).all(axis=0)]
    return soon.size > 0 and bool(np.all(np.ptp(soon, axis=1) < gaps / 2))


def _moves_at_once(before: np.ndarray) -> bool:
    """Whether the shaft drifts from the first sample on, as behind a filter that starts with the record, not at the end only."""
    means = np.array([np.nanmean(part, axis=1) for part in np.array_split(before, 4, axis=1)])
    row = int(np.argmax(np.abs(means[3] - means[0])))
    steps = np.diff(means[:, row]) * np.sign(means[3, row] - means[0, row])
    return bool(steps.min() > steps.max() / 2)


def _falls(fit: ReleaseFit, instant: float, wide: np.ndarray, ends: Sequence[str]) -> dict[str, Fall]:
    """Return how each end falls from a release near an instant, s; `wide` (2 n,) are the rows of wide orbits."""
    acceleration = fall_acceleration(fit, instant).reshape(-1, 2).tolist()
    whirl = np.where(wide, fit.whirl(instant), 0.0)[1::2].tolist()
    turning = turning_alone(fit, instant)[1::2].tolist()
    return {
        end: Fall((ax, ay), wide_orbit, turns)
        for end, (ax, ay), wide_orbit, turns in zip(ends, acceleration, whirl, turning, strict=True)
    }


def _no_fall(falls: Mapping[str, Fall], gravity: float) -> str:
    """Say why what the probes see is no fall under gravity, which alone dates a release; "" where it is one."""
    vertical = [(fall.acceleration[1], fall.whirl) for fall in falls.values()]
    if gravity > 0 and all(y > _UPWARDS * gravity + whirl for y, whirl in vertical):
        return "the shaft falls upwards (see free fall), so that no fall under gravity dates the release: check the probes' signs"
    if all(abs(y) < _LEAST_FALL * gravity and whirl == 0.0 for y, whirl in vertical):
        return (
            "the shaft moves without falling (see free fall), so that no fall under gravity dates the release: one that stands"
            " upright does not fall, nor one that the magnetic bearings lower; of a horizontal one that was dropped check"
            " sampling rate and sensitivities"
        )
    return ""


def _force_decay(best: FittedRelease, record_s: float) -> Estimate:
    """Return the time constant of the holding force, or why none is told, in a record so long."""
    misread = _misread(best.misread) if best.misread else ""
    if best.decay is None:
        why = f"{misread}: such a decay is not sure" if misread else _AT_ONCE
        return Estimate.missing("ms", why)
    low, high = (each * 1e3 for each in best.decay[1:])
    if best.decay[2] > record_s:  # that of no fall: a force which hardly changes explains as well what the probes see
        why = f"any decay within {low:.3g} to {high:.3g} ms explains what the probes see, in a record of {record_s * 1e3:.3g} ms"
        return Estimate.missing("ms", why)
    unsure = "; a sudden release explains the fall nearly as well" if low <= 0 else ""
    unsure = f"; {misread}" if misread else unsure
    return Estimate(*best.decay, "ms", f"exponential decay of the holding force, profile of the misfit{unsure}")


def _states(fit: ReleaseFit, best: FittedRelease, planes: xr.Dataset, ends: Sequence[str]) -> dict[str, EndState]:
    """Return each end at the release."""
    decay = best.decay[0] if best.decay is not None and best.decay[1] else 0.0
    value, sigma = (
        each.reshape(2, len(ends), 2) for each in fit.state(best.time, decay)
    )  # (position or velocity, end, axis)
    noise = np.sqrt(np.mean(fit.noise(best.time).reshape(-1, 2) ** 2, axis=1)).tolist()
    places = [(x, y) for x, y in fit.place(best.time).reshape(-1, 2).tolist()]
    out = {}
    for i, end in enumerate(ends):
        where = ", at the probes" if planes.plane.sel(end=end) == "probe" else ""
        rule = f"levitated orbit continued to the release{where}"
        (x, y), (vx, vy) = (
            [Estimate.from_sigma(v, s, unit, rule) for v, s in zip(value[order, i], sigma[order, i], strict=True)]
            for order, unit in enumerate(("um", "mm/s"))
        )
        scale = best.scales[i] if best.scales else None
        out[end] = EndState(x, y, vx, vy, noise=noise[i], levitated=places[i], scale=scale)
    return out


def state_held_bent(state: EndState, miss: LevitatedMiss, speed_hz: float | None) -> EndState:
    """Widen the intervals of an end as it was let go, seen along the rigid line, by how much that misses the shaft."""
    fast = 2 * np.pi * (speed_hz or 0.0) * miss.once
    return replace(
        state,
        x=state.x.widened(miss.once, BENDS),
        y=state.y.widened(miss.sag + miss.once, BENDS),
        vx=state.vx.widened(fast, BENDS),
        vy=state.vy.widened(fast, BENDS),
    )


def springing_back(rotor: RotorModel) -> tuple[float, ...]:
    """Return the frequencies of the free rotor's bending modes whose sag shows in a fall, Hz: the first, and others as low."""
    first, *others = free_free(rotor, _BENDING_MODES).frequencies[2:].tolist()
    return (first, *(hz for hz in others if hz < _SAGS_HZ))


def _seen(sag: Sag, weights: xr.DataArray, machine: Machine, speed_hz: float) -> SpringBack:
    """Return how a sag springs back in the rows of the ends that weights (end, axis, probe) lead to."""
    probes = {probe.name: (probe.position, probe.angle) for probe in machine.probes}
    maps = weights.to_numpy().reshape(-1, weights.sizes["probe"])
    return sag.seen(maps, [probes[str(name)] for name in weights.probe.values], machine.sense * 2 * np.pi * speed_hz)


def _shares(
    maps: np.ndarray, names: np.ndarray, machine: Machine, fit: ReleaseFit, release: FittedRelease
) -> dict[str, Estimate]:
    """Return the share of gravity that each probe shows in the fall; `maps` led from the readings to the fit's data."""
    used = np.any(maps != 0, axis=0)
    maps, names = maps[:, used], names[used]
    if machine.gravity <= 0 or maps.shape[0] != maps.shape[1] or np.linalg.matrix_rank(maps) < len(maps):
        return {}
    decay = 0.0 if release.decay is None else release.decay[0]
    angles = {probe.name: probe.angle for probe in machine.probes}
    pull = np.array([-machine.gravity * np.sin(angles[str(name)]) for name in names])
    upright = np.abs(pull) > _UPRIGHT * machine.gravity
    fit = replace(
        fit, data=np.linalg.solve(maps, fit.data), sag=None if fit.sag is None else fit.sag.mapped(np.linalg.inv(maps))
    )
    found = gravity_alone(fit, release.time, decay)
    if found is not None and fit.sag is not None:  # a probe that reads too much reads too much of the sag too
        read = np.where(upright, found[0] / np.where(upright, pull, 1.0), 1.0)
        found = gravity_alone(replace(fit, sag=fit.sag.mapped(np.diag(read))), release.time, decay)
    if found is None:
        return {}
    rule = "free fall, freed of turning and springing back"
    return {
        str(name): Estimate.from_sigma(float(value / p), float(np.hypot(error / p, _SHARE_ERROR)), "1", rule)
        for name, value, error, p, seen in zip(names, *found, pull, upright, strict=True)
        if seen
    }


def release_of(
    record: xr.Dataset,
    machine: Machine,
    planes: xr.Dataset,
    speed_hz: float | None,
    bending_hz: Sequence[float] = (),
    sag: Sag | None = None,
) -> Release | None:
    """Find the release; where samples are missing about it, by an end whose own probes miss none there.

    The bearing planes take all probes, so that one of them without a value leaves no end a place.  At its own probes an end falls
    as freely.

    Parameters
    ----------
    record : Dataset
        Probes in m, from which `planes` were made.
    machine, planes, speed_hz, bending_hz, sag
        As in `find_release`.
    """
    found = find_release(planes, machine, speed_hz, bending_hz, sag)
    if found is None or not _holed(planes, machine, found):
        return found
    used = {str(name) for name in planes.probe.values}
    for end in machine.ends:
        try:
            own = to_planes(record, machine, [probe.name for probe in machine.probes_at(end) if probe.name in used])
            alone = find_release(own, machine, speed_hz, bending_hz, sag)
        except InputError:  # the end shows no orbit, or no drop
            continue
        if alone is not None and not _holed(own, machine, alone):
            return alone
    return found


def _holed(planes: xr.Dataset, machine: Machine, found: Release) -> bool:
    """Whether samples are missing about a release, from where the shaft surely levitates until it touches."""
    if found.time.value is None:
        return True
    gap = max(machine.bearing(end).radial_gap.nominal for end in machine.ends)
    fall = np.sqrt(2 * gap / max(machine.gravity, 1.0))
    about = planes.sel(time=slice(found.time.value - _CLEAR_S, found.time.value + fall))
    seen = about.displacement.sel(end=seen_ends(planes))
    valid = np.isfinite(seen.to_numpy()).all(axis=(0, 1))
    return _hole(about.time.to_numpy(), valid, -np.inf) is not None


def _hole(t: np.ndarray, valid: np.ndarray, since: float) -> tuple[float, float] | None:
    """Return the longest stretch without samples, too long to be bridged, that ends after `since`."""
    runs = runs_of(~valid)
    runs = runs.where((runs.length > SHORT_GAP) & (t[np.minimum(runs.first + runs.length, t.size) - 1] > since))
    if not len(runs):
        return None
    longest = int(np.argmax(runs.length))
    first = int(runs.first[longest])
    return float(t[first]), float(t[first + runs.length[longest] - 1])


def _misread(decay: float) -> str:
    return (
        f"a sudden release explains the fall as well as a force that decays in {decay * 1e3:.2g} ms, if the probes read up to"
        f" {percent(PROBE_SCALE)} too much or too little, as they may (check their sensitivity)"
    )
