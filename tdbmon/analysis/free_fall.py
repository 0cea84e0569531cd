"""Checks of a record's time base and sensitivities by its free fall, whose acceleration must be gravity."""

from __future__ import annotations

import math
from collections.abc import Mapping

from tdbsim.machine import Machine

from tdbmon.analysis.release import Release
from tdbmon.analysis.release_search import PROBE_SCALE
from tdbmon.estimate import Z95, Estimate
from tdbmon.quantity import percent
from tdbmon.record.finding import Check

_LEAST = 1 / math.sqrt(2)  # lower limit, of gravity: geometric mean of it and its half, as the field may decay slowly
_MOST = 1.15  # upper limit, of gravity: no other force acts downwards; unbalance and bending contribute some hundredths
_TELLING = 0.3  # of gravity: a fall with a greater uncertainty is inconclusive
# of the other end's orbit: a released rotor turns about its own axis of inertia, which moves both ends
_ACROSS = 1 / 3
_APART = 0.08  # logarithm of the ratio of two probes: each may be 5 % off (API Standard 670), rarely both in opposite directions
_SURE = Z95  # standard deviations of that logarithm: the interval excludes equal readings
_ONE = 2.0  # ratio of two probes' deviations from the other end's, beyond which the more deviating one is wrong
_UPRIGHT = 0.15  # of gravity: less is no fall
_SCALE = 2.0  # times gravity or more, or half of it or less, at every end: a wrong scale of time or length
_SAME = 0.1  # logarithm of the ratio of two time scale errors that count as the same
_UNLIKE = 0.05  # of gravity: a shaft that tips falls by so much more slowly at one end, and faster at the other
_HOLDS_S = 0.01  # decay time of a magnetic force: a longer one fits a wrong time base as well
_LEAST_GRAVITY = 1.0  # m/s^2: the shaft of a vertical machine does not fall across its bearings


def check_free_fall(release: Release, machine: Machine, over_pulses: float = 1.0) -> list[Check]:
    """Check that each end falls with the acceleration of gravity.

    Lengths k times too long and times c times too long make it fall with k / c^2 of gravity.  A slowly decaying field changes the
    acceleration as well: if the release fit has found its decay, the check names it before the scales.  So does a bent shaft,
    which turns on in the fall, by about the acceleration of its wide orbit.  A speed signal that reads `over_pulses` times the
    keyphasor's speed (1 if unknown) is independent evidence of a wrong time base: together the two prove it.
    `EndState.scale` distinguishes a wrong scale from a lingering field, if the drop allows that.
    """
    if machine.gravity < _LEAST_GRAVITY:
        return []
    found = []
    held = _held(release)
    scales = {end: release.states[end].scale if end in release.states else None for end in release.falls}
    shares = {
        end: -fall.acceleration[1] / machine.gravity if (scale := scales[end]) is None else scale
        for end, fall in release.falls.items()
    }
    late = _later(shares)
    for end, fall in release.falls.items():
        scale, share = scales[end], shares[end]
        detail = f"falls with {share * machine.gravity:.3g} m/s2, {share:.2f} of gravity, before it touches"
        others = [each.whirl for other, each in release.falls.items() if other != end]
        turning = fall.whirl + _ACROSS * max(others, default=0.0)
        doubt = max(turning, fall.turning) / machine.gravity
        passed = _LEAST - doubt < share < _MOST + doubt and (scale is None or abs(scale - 1) <= PROBE_SCALE)
        if scale is not None:
            detail += ", from the release on: a decaying magnetic force does not explain it as well"
        elif doubt > _TELLING:
            what = "wide orbit's" if turning >= fall.turning else "once-per-revolution"
            detail += f", which proves little: the {what} acceleration is {doubt * machine.gravity:.3g} m/s2"
        cure = (
            ""
            if passed
            else f": {_suspects(share, machine, end, over_pulses, at_once=scale is not None, held=held)}{late}"
        )
        found.append(Check("free fall", end, passed, detail + cure))
    return found


def _later(shares: Mapping[str, float]) -> str:
    """Return the suspicion that one magnet released later than the other, which tips the shaft about its end; "" if none."""
    if len(shares) < 2:
        return ""
    slow, fast = min(shares, key=shares.__getitem__), max(shares, key=shares.__getitem__)
    if not 0 < shares[slow] < 1 - _UNLIKE or shares[fast] < 1 + _UNLIKE:
        return ""
    return f"; or the magnet of {slow} releases later than that of {fast}, which tilts the shaft"


def _held(release: Release) -> float:
    """Return the decay time, s, of a magnetic force that lingers for milliseconds; 0 if a sudden release explains the fall.

    Times a fifth too long may have the same effect: a decay is no proof that the scales are right.
    """
    decay = release.force_decay
    sure = decay.value is not None and decay.low is not None and decay.low > 0 and decay.value < _HOLDS_S
    return float(decay.value or 0.0) if sure else 0.0


def undated(release: Release, machine: Machine) -> str:
    """Return why a fall does not date the release, as its acceleration is far from gravity at every end; "" if it does.

    A lingering field slows a fall too; if it lasts milliseconds only, its fitted decay distinguishes it from a wrong scale.
    """
    if not release.time.known or not release.falls or machine.gravity < _LEAST_GRAVITY:
        return ""
    if max(fall.whirl for fall in release.falls.values()) > _TELLING * machine.gravity:
        return ""
    shares = [-fall.acceleration[1] / machine.gravity for fall in release.falls.values()]
    held = release.force_decay.value is not None and release.force_decay.value < _HOLDS_S
    if min(shares) < _SCALE and (max(shares) > 1 / _SCALE or held):
        return ""
    return (
        f"the shaft falls with {min(shares):.2g} times gravity (see free fall): times or lengths may be on a wrong scale,"
        " so neither the release nor any contact is reported; correct sampling rate or sensitivities"
    )


def check_probe_scales(release: Release, machine: Machine) -> list[Check]:
    """Check that both probes of an end show the same fall, which is vertical whatever magnetic force remains.

    A probe with a wrong gain tilts the direction of the fall that both probes show, and hardly changes its size.
    """
    found = []
    for end in machine.ends:
        pair = _telling(release, machine, end)
        if len(pair) != 2:
            continue
        one, other = sorted(pair, key=lambda name: _log(pair[name])[0])
        apart, sigma = _log_ratio(pair[other], pair[one])
        times, least, most = _times(apart, sigma)
        detail = f"'{other}' shows the free fall {times:.2f} ({least:.2f} to {most:.2f}) times as large as '{one}'"
        passed = apart < max(_APART, _SURE * sigma)
        if not passed:
            others = [s for name in release.shares if name not in pair and (s := _share(release, name)) is not None]
            level = sum(_log(s)[0] for s in others) / len(others) if others else 0.0
            small, large = (_log(pair[name])[0] - level for name in (one, other))
            detail += f": {_wrong(one, other, small, large)}"
        found.append(Check("probe scales", end, passed, detail))
    return found


def probe_ratio(release: Release, machine: Machine, end: str) -> Estimate:
    """Return the ratio of the free fall by the first probe of an end to that by its second: 1 if both read correctly.

    A drifting gain of a probe changes it from drop to drop, and it is available whether or not the shaft comes to rest.

    Parameters
    ----------
    release : Release
    machine : Machine
    end : str
    """
    pair = _telling(release, machine, end)
    if len(machine.probes_at(end)) != 2 or len(pair) != 2:
        return Estimate.missing("1", "fewer than two probes of this end measure the free fall")
    first, second = pair
    rule = f"free fall measured by '{first}' over that by '{second}'"
    return Estimate(*_times(*_log_ratio(pair[first], pair[second])), "1", rule)


def _telling(release: Release, machine: Machine, end: str) -> dict[str, Estimate]:
    """Return the share of gravity by each probe of an end that determines one; empty for a large 1X component in the fall."""
    if end in release.falls and release.falls[end].turning > _TELLING * machine.gravity:
        return {}
    names = [probe.name for probe in machine.probes_at(end)]
    return {name: share for name in names if (share := _share(release, name)) is not None}


def _log_ratio(one: Estimate, other: Estimate) -> tuple[float, float]:
    """Return the logarithm of the ratio of two shares, and its standard deviation."""
    (first, error), (second, error_too) = _log(one), _log(other)
    return first - second, math.hypot(error, error_too)


def _times(apart: float, sigma: float) -> tuple[float, float, float]:
    """Return a ratio and the limits of its 95 % interval from its logarithm and the standard deviation of that."""
    half = Z95 * sigma
    return math.exp(apart), math.exp(apart - half), math.exp(apart + half)


def _share(release: Release, name: str) -> Estimate | None:
    """Return the share of gravity by a probe; None if its interval is missing or includes zero."""
    share = release.shares.get(name)
    return share if share is not None and share.low is not None and share.low > 0 else None


def _log(share: Estimate) -> tuple[float, float]:
    """Return the logarithm of a positive share and its standard deviation."""
    value = share.value or 1.0
    return math.log(value), (share.sigma or 0.0) / value


def _wrong(one: str, other: str, small: float, large: float) -> str:
    """Return which of two probes is wrong, from the logarithms of their shares relative to the other end's."""
    if abs(large) > _ONE * abs(small):
        said = f"'{other}' reads about {percent(math.exp(large) - 1)} too much"
    elif abs(small) > _ONE * abs(large):
        said = f"'{one}' reads about {percent(1 - math.exp(small))} too little"
    else:
        said = f"'{other}' reads too much or '{one}' too little"
    return f"{said}, compared with the other end's fall (check sensitivities, angles, and that no channel is delayed)"


def _suspects(share: float, machine: Machine, end: str, over_pulses: float, at_once: bool, held: float) -> str:
    """Return the possible causes of an end falling with this share of gravity, and what to check."""
    names = ", ".join(f"'{probe.name}'" for probe in machine.probes_at(end))
    if abs(share) < _UPRIGHT:
        return (
            "a vertical shaft does not fall (only horizontal ones are covered), nor does one that the magnetic bearings lower;"
            " if a horizontal shaft was dropped, check sampling rate and unit of the time, and sensitivity and angle of"
            f" {names}"
        )
    if share <= 0:
        return f"check sign of the sensitivity and angle of {names}"
    longer = math.sqrt(1 / share)
    if over_pulses > 0 and over_pulses != 1 and abs(math.log(longer / over_pulses)) < _SAME:
        off = f"{over_pulses:.3g} times too low" if over_pulses > 1 else f"{1 / over_pulses:.3g} times too high"
        return (
            f"times {_stretch(longer)} would explain this, and also why the speed signal reads {over_pulses:.3g} times"
            f" the keyphasor's speed (see speed): together they show that the stated sampling rate is {off}"
        )
    times = f"times {_stretch(longer)} would explain this (check sampling rate and unit of the time)"
    lengths = f"or displacements {_stretch(share)} (check the sensitivity of {names})"
    if at_once:
        return f"{times}, {lengths}"
    if held and share < 1:
        decay = f"a magnetic force that decays in {held * 1e3:.2g} ms, as fitted at the release, would explain this"
        return f"{decay}, and then nothing is wrong; otherwise {times}, {lengths}"
    field = ", or a magnetic field that persists for milliseconds" if share < 1 else ", or a large unbalance"
    return f"{times}, {lengths}{field}"


def _stretch(factor: float) -> str:
    """Return a scale error in words."""
    return f"that read about {factor:.2g} times too long" if factor > 1 else f"that read about {1 / factor:.2g} times too short"
