"""Release of a drop: the instant at which the magnetic bearings let go of the rotor, estimated from the displacement.

Before it the shaft is in its levitated orbit: mean position and 1X, with 2X, significant higher orders and mains hum, which are
run-out of the probe tracks and pick-up of the wiring and continue unchanged.  After it the rotor falls freely: a parabola under
gravity, 1X rotation about its inertia axis, and the relaxation of the sag between the magnetic bearings in the lowest bending
modes.  Position and velocity are continuous.
`tdbmon.analysis.release_fit` fits the two together, and `tdbmon.analysis.release_search` finds the instant.
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

_CLEAR_S = 0.012  # before the shaft leaves its orbit: certainly levitated until then
_LEVITATED_S = 0.2  # levitated stretch that is fitted, before the shaft leaves its orbit
_LATEST_S = 0.004  # after the shaft leaves its orbit: end of the search for the release
_LONGER = 1.08  # of the fall's length, for the shares of gravity by probe: still before the rebound
_UPRIGHT = 0.5  # least sine of a probe's angle for it to measure the fall
# bending modes of the sag, and their highest frequency, at which gravity over its square is a quarter of a micrometre
_BENDING_MODES, _SAGS_HZ = 4, 1000.0
_SEEN_HZ = 0.25  # of the sampling rate: modes above are not resolved
_SHARE_ERROR = 0.01  # of gravity: standard deviation of the model error of a probe's fall
_UPWARDS = 0.5  # upward acceleration over gravity, beyond that of the orbit, which proves wrong probe signs
_LEAST_FALL = 0.15  # acceleration over gravity: a shaft with less at all ends does not fall
_AT_ONCE = "the fall starts at once; no decaying magnetic force is seen"
_SEEN_S = 2e-3  # least of the fall outside the orbit: less, beside a gap, is compatible with any instant


@dataclass(frozen=True)
class EndState:
    """State of the shaft at one end at the release (SI).

    Attributes
    ----------
    x, y, vx, vy : Estimate
        Position and velocity of the shaft centre.
    noise : float
        Standard deviation of the residual of the levitated orbit, m (rms of both axes).
    levitated : tuple
        Mean levitated position (x, y), m.
    scale : float or None
        Reading over true displacement, if a sudden release with such gain errors explains the fall and neither a decaying
        force nor the probes' tolerance does.
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
        Fitted acceleration (x, y), m/s^2.
    whirl : float
        Vertical acceleration of a wide levitated orbit, 0-pk, m/s^2; 0 if it is narrow.
    turning : float
        How much of the vertical acceleration may be 1X motion during the fall, m/s^2.
    """

    acceleration: tuple[float, float]
    whirl: float
    turning: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Release:
    """Estimated release of a drop: instant, force decay, and state and fall of each end.

    Attributes
    ----------
    time : Estimate
        From the record's first sample, s; missing if it lies in a gap, or the probes show a fall upwards, no fall or one on a
        wrong scale: then force decay and states are missing too.
    force_decay : Estimate
        Time constant T of the magnetic force after the switch-off; missing if the force vanished at once.
    states : dict
        `EndState` by the end's name.
    falls : dict
        `Fall` by the end's name.
    shares : dict
        Measured acceleration of each probe in the free fall over that expected from gravity, for probes close enough to the
        vertical; empty if speed or bending of the rotor is unknown, or not all probes show the fall.
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
    """Estimate instant, force decay and state of the release of a drop.

    Parameters
    ----------
    planes : Dataset
        Result of `to_planes`.
    machine : Machine
        For gravity and the mains frequency.
    speed_hz : float or None
        Rotor speed before the release; None if unknown (then it is estimated from the levitated orbit).
    bending_hz : sequence of float, optional
        Frequencies of the free rotor's bending modes in which the levitated sag relaxes (`springing_back`).
    sag : Sag, optional
        That sag computed from the machine file (`tdbmon.analysis.spring_back.sag_of`).

    Returns
    -------
    Release or None
        None if the record starts after the release or less than 5 ms before it.

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
        why = f"{said(hole)}, when the shaft falls: the release may lie anywhere in this gap; record without gaps"
        return not_told(why, {})
    t, data = t[valid], data[:, valid]
    mains = machine.mains if start - first > rate / machine.mains else None
    levitated = t < time[start] - _CLEAR_S
    fit = _laws(t, data, levitated, machine.gravity, speed_hz, mains, bending_hz, _SEEN_HZ * rate)
    if sag is not None and fit.speed_hz and "weights" in planes:
        sagging = replace(fit, sag=_seen(sag, planes.weights.sel(end=ends), machine, fit.speed_hz))
        # if the rotor is not that of the machine file, its sag may be quite different
        fit = unless_worse(sagging, fit, time[start] - _CLEAR_S, time[start] + _LATEST_S)
    # a slow descent, which no model of a fall fits, inflates the fitted orbit: judge the width by the measured one
    wide = np.ptp(data[:, t < time[start]], axis=1) > 2 * WIDE
    if _is_slow(time[start:], z[:, start:], gaps, machine.gravity):
        if first == 0 and _moves_at_once(z[:, :start]):
            return None
        # no model fits a slow descent, and the search takes a minute: reject it beforehand
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
    if "weights" in planes:  # else the planes were not computed from probes
        maps, names = planes.weights.sel(end=ends).to_numpy().reshape(2 * len(ends), -1), planes.probe.values
        shares = _shares(maps, names, machine, replace(fit, t=time[later], data=z[:, later]), best)
    which = "both ends" if len(ends) > 1 else f"end {ends[0]} alone"
    rule = f"levitated orbit and free fall joined continuously, {which}"
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
    """Return the model of orbit and fall, with the lines up to `fastest`, Hz, that are significant in the `levitated` samples."""
    before, orbit = t[levitated], data[:, levitated]
    turning = turning_speed(before, orbit, speed_hz, mains)
    orders = surface_orders(before, orbit, turning, mains, fastest)
    hum = [mains] if mains else []
    # without a speed a floor line could be the shaft's own
    floor = floor_line(before, orbit, [turning, 2 * turning, *hum, *orders]) if turning else None
    sags = [hz for hz in bending_hz if hz < fastest]
    return ReleaseFit(t, data, gravity, turning, mains, sags, orders_hz=orders, floor_hz=floor)


def not_told(why: str, falls: dict[str, Fall]) -> Release:
    """Return a release whose instant, and everything derived from it, is missing for the reason `why`."""
    return Release(time=Estimate.missing("s", why), force_decay=Estimate.missing("ms", why), falls=falls)


def _is_slow(time: np.ndarray, z: np.ndarray, gaps: np.ndarray, gravity: float) -> bool:
    """Return True if a shaft that leaves its orbit at the first sample takes longer for half the gap than the slowest fall."""
    if gravity <= 0:
        return False
    until = time[0] + np.sqrt(gaps.max() / (_LEAST_FALL * gravity))
    if time[-1] < until:
        return False
    soon = z[:, (time < until) & np.isfinite(z).all(axis=0)]
    return soon.size > 0 and bool(np.all(np.ptp(soon, axis=1) < gaps / 2))


def _moves_at_once(before: np.ndarray) -> bool:
    """Return True if the shaft drifts from the first sample on, as behind a filter settling, rather than only at the end."""
    means = np.array([np.nanmean(part, axis=1) for part in np.array_split(before, 4, axis=1)])
    row = int(np.argmax(np.abs(means[3] - means[0])))
    steps = np.diff(means[:, row]) * np.sign(means[3, row] - means[0, row])
    return bool(steps.min() > steps.max() / 2)


def _falls(fit: ReleaseFit, instant: float, wide: np.ndarray, ends: Sequence[str]) -> dict[str, Fall]:
    """Return the fall of each end for a release near an instant, s; `wide` (2 n,) marks the rows of wide orbits."""
    acceleration = fall_acceleration(fit, instant).reshape(-1, 2).tolist()
    whirl = np.where(wide, fit.whirl(instant), 0.0)[1::2].tolist()
    turning = turning_alone(fit, instant)[1::2].tolist()
    return {
        end: Fall((ax, ay), wide_orbit, turns)
        for end, (ax, ay), wide_orbit, turns in zip(ends, acceleration, whirl, turning, strict=True)
    }


def _no_fall(falls: Mapping[str, Fall], gravity: float) -> str:
    """Return why the motion is no fall under gravity, without which a release cannot be dated; "" if it is one."""
    vertical = [(fall.acceleration[1], fall.whirl) for fall in falls.values()]
    if gravity > 0 and all(y > _UPWARDS * gravity + whirl for y, whirl in vertical):
        return "the shaft falls upwards (see free fall), so its fall cannot date the release: check the probes' signs"
    if all(abs(y) < _LEAST_FALL * gravity and whirl == 0.0 for y, whirl in vertical):
        return (
            "the shaft moves without falling (see free fall), so no fall can date the release: a vertical shaft does not fall,"
            " nor does one that the magnetic bearings lower; if a horizontal shaft was dropped, check sampling rate and"
            " sensitivities"
        )
    return ""


def _force_decay(best: FittedRelease, record_s: float) -> Estimate:
    """Return the time constant of the magnetic force, or why there is none, for a record of length `record_s`, s."""
    misread = _misread(best.misread) if best.misread else ""
    if best.decay is None:
        why = f"{misread}: such a decay is uncertain" if misread else _AT_ONCE
        return Estimate.missing("ms", why)
    low, high = (each * 1e3 for each in best.decay[1:])
    if best.decay[2] > record_s:  # as without a fall: a force that hardly changes explains the motion as well
        why = f"any decay from {low:.3g} to {high:.3g} ms explains the probe readings, in a record of {record_s * 1e3:.3g} ms"
        return Estimate.missing("ms", why)
    unsure = "; a sudden release explains the fall nearly as well" if low <= 0 else ""
    unsure = f"; {misread}" if misread else unsure
    return Estimate(*best.decay, "ms", f"exponential decay of the holding force, profile likelihood{unsure}")


def _states(fit: ReleaseFit, best: FittedRelease, planes: xr.Dataset, ends: Sequence[str]) -> dict[str, EndState]:
    """Return the state of each end at the release."""
    decay = best.decay[0] if best.decay is not None and best.decay[1] else 0.0
    value, sigma = (
        each.reshape(2, len(ends), 2) for each in fit.state(best.time, decay)
    )  # (position or velocity, end, axis)
    noise = np.sqrt(np.mean(fit.noise(best.time).reshape(-1, 2) ** 2, axis=1)).tolist()
    places = [(x, y) for x, y in fit.place(best.time).reshape(-1, 2).tolist()]
    out = {}
    for i, end in enumerate(ends):
        where = ", at the probe plane" if planes.plane.sel(end=end) == "probe" else ""
        rule = f"levitated orbit extrapolated to the release{where}"
        (x, y), (vx, vy) = (
            [Estimate.from_sigma(v, s, unit, rule) for v, s in zip(value[order, i], sigma[order, i], strict=True)]
            for order, unit in enumerate(("um", "mm/s"))
        )
        scale = best.scales[i] if best.scales else None
        out[end] = EndState(x, y, vx, vy, noise=noise[i], levitated=places[i], scale=scale)
    return out


def state_held_bent(state: EndState, miss: LevitatedMiss, speed_hz: float | None) -> EndState:
    """Widen the intervals of an end's state at the release by the error of the rigid line through the probes on a bent shaft."""
    fast = 2 * np.pi * (speed_hz or 0.0) * miss.once
    return replace(
        state,
        x=state.x.widened(miss.once, BENDS),
        y=state.y.widened(miss.sag + miss.once, BENDS),
        vx=state.vx.widened(fast, BENDS),
        vy=state.vy.widened(fast, BENDS),
    )


def springing_back(rotor: RotorModel) -> tuple[float, ...]:
    """Return the free rotor's bending frequencies whose sag is visible in a fall, Hz: the first, and others up to 1 kHz."""
    first, *others = free_free(rotor, _BENDING_MODES).frequencies[2:].tolist()
    return (first, *(hz for hz in others if hz < _SAGS_HZ))


def _seen(sag: Sag, weights: xr.DataArray, machine: Machine, speed_hz: float) -> SpringBack:
    """Return the relaxation of a sag in the coordinates of the ends, which `weights` (end, axis, probe) form from the probes."""
    probes = {probe.name: (probe.position, probe.angle) for probe in machine.probes}
    maps = weights.to_numpy().reshape(-1, weights.sizes["probe"])
    return sag.seen(maps, [probes[str(name)] for name in weights.probe.values], machine.sense * 2 * np.pi * speed_hz)


def _shares(
    maps: np.ndarray, names: np.ndarray, machine: Machine, fit: ReleaseFit, release: FittedRelease
) -> dict[str, Estimate]:
    """Return the share of gravity that each probe measures in the fall; `maps` leads from the readings to the fit's data."""
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
    if found is not None and fit.sag is not None:  # a gain error of a probe affects the sag that it reads too
        read = np.where(upright, found[0] / np.where(upright, pull, 1.0), 1.0)
        found = gravity_alone(replace(fit, sag=fit.sag.mapped(np.diag(read))), release.time, decay)
    if found is None:
        return {}
    rule = "free fall, corrected for once-per-revolution motion and elastic spring-back"
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
    """Estimate the release; if samples are missing around it, from one end whose own probes have no gap there.

    The positions at the bearing planes use all probes, so that a missing value of one leaves both ends without a position.  In
    its own probe plane each end is in free fall just the same.

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
    """Return True if samples are missing around a release, from where the shaft is certainly levitated until it touches."""
    if found.time.value is None:
        return True
    gap = max(machine.bearing(end).radial_gap.nominal for end in machine.ends)
    fall = np.sqrt(2 * gap / max(machine.gravity, 1.0))
    about = planes.sel(time=slice(found.time.value - _CLEAR_S, found.time.value + fall))
    seen = about.displacement.sel(end=seen_ends(planes))
    valid = np.isfinite(seen.to_numpy()).all(axis=(0, 1))
    return _hole(about.time.to_numpy(), valid, -np.inf) is not None


def _hole(t: np.ndarray, valid: np.ndarray, since: float) -> tuple[float, float] | None:
    """Return the first and last missing instant, s, of the longest gap that ends after `since` and cannot be bridged."""
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
        f" {percent(PROBE_SCALE)} too much or too little, which is possible (check their sensitivity)"
    )
