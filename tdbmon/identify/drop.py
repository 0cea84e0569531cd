"""A measured drop prepared for calibration: readings without hum and surface harmonics, levitated noise, shaft rotation."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tdbsim.errors import InputError
from tdbsim.machine import Machine, Probe
from tdbsim.rotor import build_rotor

from tdbmon.analysis.axes import to_planes
from tdbmon.analysis.exchanged_probes import ExchangedProbes, exchanged_probes
from tdbmon.analysis.free_fall import check_free_fall, check_probe_scales
from tdbmon.analysis.missing_stretches import said, too_long
from tdbmon.analysis.release import Release, release_of, springing_back
from tdbmon.analysis.returned import returned
from tdbmon.analysis.rotation import Rotation
from tdbmon.analysis.spring_back import sag_of
from tdbmon.identify.noise import HARMONICS, Noise, levitated_noise
from tdbmon.identify.stages import Stages, stages_of
from tdbmon.identify.turning import Turning, fit_turning
from tdbmon.record.assign import assign
from tdbmon.record.finding import Check
from tdbmon.record.held_end import never_touches
from tdbmon.record.lift_off import from_lift_off
from tdbmon.record.lost_samples import without_flat_tops, without_lost_samples
from tdbmon.record.quality import LeftOut, check, left_out, repair_gaps
from tdbmon.record.sensor_effects import freed
from tdbmon.record.skipped_samples import with_skipped_samples
from tdbmon.record.slow_roll import without_slow_roll
from tdbmon.record.speed_checks import require_one_speed, without_refuted
from tdbmon.record.taken_up import until_taken_up
from tdbmon.record.timebase import usual_interval

Array = NDArray[np.float64]

_TOUCHED = 0.6  # of the smallest gap: a shaft that moves less never touched, or the gap is stated as a diameter
USUAL_DIVERGENCE = 42.0  # 1/s, divergence rate of neighbouring paths (median of drops with contact at both ends)
LEAD_S = 0.008  # simulated before the first guess of the release: the uncertainty of that guess
_CLEAR_S = 0.003  # before the first guess of the release, which may be late, kept out of the levitated stretch
_COUNTED_S = 0.065  # in a usual gap: span after the release in which a probe's samples are counted
_LEAST_PRESENT = 0.6  # of these samples, that must be present
_FEWEST_LEVITATED = 64  # samples before the release for noise and orbit, however lately the drive has tripped
_LEAST_PIECE = 0.5  # of the levitated stretch (between holes), that must be present in one piece, for the noise


@dataclass(frozen=True, eq=False)
class MeasuredDrop:
    """One record, prepared (SI).

    Attributes
    ----------
    name : str
        The file.
    time : (n,) array
        s.
    probes : tuple of Probe
        Usable ones only.
    reading : (probes, n) array
        Without hum and the third harmonic of the surface, m; NaN where a sample is missing or cut off.
    noise : tuple of Noise
        One per probe.
    release : float
        First guess of the instant, s.
    omega : float
        Angular speed at `release`, rad/s, negative clockwise.
    angle, angle_sigma : float
        Shaft angle at `release` and its standard deviation, rad; infinite without a keyphasor.
    acceleration, acceleration_sigma : float
        Angular acceleration before the release and its standard deviation, rad/s^2.
    pulse_times, pulse_angles : (m,) arrays
        Keyphasor pulses after the release, s and rad.
    pulse_sigma : float
        Standard deviation of a pulse's angle, rad.
    remarks : tuple of str
        On what the record lacks and how that was dealt with.
    faults : tuple of str
        Other failed checks of the record's channels.
    foreign : str
        The one of `faults` that says that the record names another machine; "" where it does not.
    whirls_backward : tuple of str
        Ends whose 1X whirls backward before the release, as with two probes exchanged.
    crossed : tuple of tuple of str
        Pairs of probes, one of each end, one pair of which looks exchanged; the check by circles cannot tell which.
    scale_doubts : tuple of str
        Those of `remarks` in which the free fall contradicts the scales of time or probes; a model that follows the drop with
        these scales refutes them.
    compensated : bool
        Whether the slow roll stated in the machine file was subtracted from the readings.
    divergence : float
        Divergence rate of neighbouring paths, 1/s (`tdbmon.identify.divergence`).
    flight : float
        End of the fall, s after the release: paths diverge from then on.
    even_from : float
        s, since when the shaft had this acceleration; minus infinity where from the first sample on.
    """

    name: str
    time: Array
    probes: tuple[Probe, ...]
    reading: Array
    noise: tuple[Noise, ...]
    release: float
    omega: float
    angle: float
    angle_sigma: float
    acceleration: float
    acceleration_sigma: float
    pulse_times: Array
    pulse_angles: Array
    pulse_sigma: float
    remarks: tuple[str, ...]
    faults: tuple[str, ...] = ()
    foreign: str = ""
    whirls_backward: tuple[str, ...] = ()
    crossed: tuple[tuple[str, str], ...] = ()
    scale_doubts: tuple[str, ...] = ()
    compensated: bool = False
    divergence: float = USUAL_DIVERGENCE
    flight: float = Stages().flight
    even_from: float = -math.inf

    @cached_property
    def interval(self) -> float:
        """Sampling interval, s."""
        return usual_interval(self.time)

    @cached_property
    def unbroken(self) -> int:
        """Number of samples up to the first hole in the time axis after the release: beyond it samples do not count time."""
        holes = np.flatnonzero(too_long(np.diff(self.time)) & (self.time[1:] > self.release)) + 1
        return int(holes[0]) if holes.size else len(self.time)

    @property
    def seconds(self) -> float:
        """Length of the record after the release, up to the first hole in its time axis, s."""
        return float(self.time[self.unbroken - 1]) - self.release

    @property
    def speed(self) -> float:
        """Speed at the release, Hz."""
        return abs(self.omega) / (2 * math.pi)


def straight_shaft(machine: Machine, probes: Sequence[Probe], axes: NDArray[np.complex128]) -> Array:
    """Return the matrix (probes, 4) from x, y at the first and x, y at the second end of a straight shaft to readings.

    Parameters
    ----------
    machine : Machine
    probes : sequence of Probe
    axes : (probes, probes) complex array
        Its product with the motions x + i y in the probes' planes has the readings as real part.
    """
    first, second = (bearing.position for bearing in machine.touchdown_bearings)
    share = np.array([(probe.position - first) / (second - first) for probe in probes])
    along = axes @ np.column_stack([1 - share, share])
    return np.stack([along.real, -along.imag], axis=2).reshape(len(probes), 4)


def measured_drop(record: xr.Dataset, machine: Machine) -> MeasuredDrop:
    """Prepare a record for calibration.

    Parameters
    ----------
    record : Dataset
        As `tdbmon.record.read.read` gives it.
    machine : Machine

    Raises
    ------
    InputError
        If the record has no levitated stretch, no drop, no contact, no speed or fewer than three usable probes, or if it ends or
        has a hole in its time axis before the first contacts are over.
    """
    name = str(record.attrs.get("source_file", "record"))
    laid, lying = from_lift_off(assign(record, machine), machine)
    laid, lifted = until_taken_up(laid, machine)
    checks = check(laid, machine)
    failed = [each for each in (*lying, *lifted, *checks) if not each.passed]
    if still := next((each.detail for each in failed if each.check == "drop"), ""):
        raise InputError(f"{name}: {still}")
    unused = left_out(laid, machine, checks)
    laid = without_flat_tops(without_lost_samples(with_skipped_samples(laid), machine), machine)
    laid = without_refuted(repair_gaps(laid), machine)
    require_one_speed(laid, machine, name)
    wrong_speed = [f"speed: {each.detail}" for each in failed if each.check == "speed"]
    if wrong_speed and not {"speed", "keyphasor"} & set(laid):
        raise InputError(f"{name}: {wrong_speed[0]}")
    lost = {p.name: int(laid[p.name].attrs.get("nan_left", 0)) for p in machine.probes if p.name not in unused}
    probes = _require_three([p for p in machine.probes if p.name not in unused], lost, name)
    names = [p.name for p in probes]
    # a fit models the sensor effects of the machine file; evaluations of the readings alone need them removed
    seen, upright = freed(laid, machine)
    planes = to_planes(_bridged(seen, probes), upright, names)
    time = planes.time.to_numpy()
    rotor = build_rotor(machine)
    searched = (
        seen,
        upright,
        to_planes(seen, upright, names),
        Rotation.of(laid, machine).before(None),
        springing_back(rotor),
    )
    # a first guess, for which the sag may be left out: the fit finds the instant
    found, release = _known_release(release_of(*searched), name)
    after_hole = np.append(False, too_long(np.diff(time)))
    stages = stages_of(machine)
    _check_unbroken(time, after_hole, release, stages.least, name)
    counted = stages.at(_COUNTED_S)
    turning = fit_turning(laid, machine, release, name)
    levitated = _levitated_samples(time, release, turning.begin)
    probes = _require_three(
        [p for p in probes if _has_enough_samples(time, after_hole, laid[p.name].values, release, counted, levitated)],
        lost,
        name,
    )
    _check_length(time, release, stages.least, name)
    _check_touch(planes, machine, release, name)
    crossed = exchanged_probes(planes, seen, upright, release)
    failed += [] if crossed is None else [crossed.check]
    compensated = without_slow_roll(laid, machine)
    raw = np.stack([compensated[p.name].values for p in probes])
    places = [f"{name}: probe '{p.name}'" for p in probes]
    noise = _noise(raw, time, after_hole, levitated, turning.since(time[levitated] - release), machine, places)
    free_fall, scales = _failed_scale_checks(found, machine)
    if scales:  # the spring-back of the shaft, neglected without its sag, may look like a wrong scale
        free_fall, scales = _failed_scale_checks(release_of(*searched, sag_of(machine, rotor)) or found, machine)
    remarks = [
        *_probe_remarks(machine, probes, unused, lost),
        *(f"probe '{each.channel}': {each.detail}" for each in failed if each.check == "dead"),
        *wrong_speed,
        *_speed_scale_remarks(turning),
        *(f"end '{end}': {back}" for end in machine.ends if (back := returned(planes, end, machine, release))),
        *(f"{each.channel}: {each.detail}" for each in free_fall),
    ]
    return MeasuredDrop(
        name=name,
        time=time,
        probes=probes,
        reading=_cleaned(raw, noise, time, turning.since(time - release), machine.mains),
        noise=noise,
        release=release,
        omega=turning.omega,
        angle=turning.angle,
        angle_sigma=turning.angle_sigma,
        acceleration=turning.acceleration,
        acceleration_sigma=turning.acceleration_sigma,
        pulse_times=turning.pulse_times,
        pulse_angles=turning.pulse_angles,
        pulse_sigma=turning.pulse_sigma,
        remarks=tuple(f"{name}: {each}" for each in remarks),
        faults=tuple(
            f"{name}: {each.channel or 'record'}: {each.detail}"
            for each in failed
            if each.check not in ("present", "dead", "speed")  # these are among the remarks
        ),
        foreign=next((f"{name}: {each.detail}" for each in failed if each.check == "machine"), ""),
        whirls_backward=tuple(each.channel for each in failed if each.check == "whirl"),
        crossed=_crossed_pairs(crossed, probes),
        scale_doubts=tuple(f"{name}: {each.channel}: {each.detail}" for each in scales),
        compensated=compensated is not laid,
        flight=stages.flight,
        even_from=turning.begin,
    )


def _failed_scale_checks(found: Release, machine: Machine) -> tuple[list[Check], list[Check]]:
    """Return the failed checks of the fall's acceleration, and these with the failed checks of the probes' scales."""
    free_fall = [each for each in check_free_fall(found, machine) if not each.passed]
    return free_fall, [*free_fall, *(each for each in check_probe_scales(found, machine) if not each.passed)]


def _crossed_pairs(found: ExchangedProbes | None, probes: Sequence[Probe]) -> tuple[tuple[str, str], ...]:
    """Return the pairs of probes that look exchanged, among those used."""
    names = {probe.name for probe in probes}
    return () if found is None else tuple(pair for pair in found.pairs if names.issuperset(pair))


def _known_release(found: Release | None, name: str) -> tuple[Release, float]:
    """Return a release and its instant, s; raise InputError where it is unknown."""
    if found is None:
        raise InputError(
            f"{name}: the record starts after the release, or less than 5 ms before it: the start of the fall is unknown."
            " Record 50 ms of levitation or more"
        )
    if found.time.value is None:
        raise InputError(f"{name}: {found.time.why}")
    return found, float(found.time.value)


def _probe_remarks(
    machine: Machine, probes: Sequence[Probe], unused: Mapping[str, LeftOut], lost: Mapping[str, int]
) -> list[str]:
    """Return remarks on the probes of a machine that are not used, and on missing samples of the others."""
    said = [
        f"calibrated without probe '{p.name}'"
        + (f", which {unused[p.name].why}" if p.name in unused else "")  # checks have no table here
        + (f", since {lost[p.name]} of its samples are missing or cut off" if lost.get(p.name) else "")
        for p in machine.probes
        if p not in probes
    ]
    if partly := [f"{lost[p.name]} of '{p.name}'" for p in probes if lost[p.name]]:
        said.append(f"samples that are missing or cut off are not used in the fit: {', '.join(partly)}")
    return said


def _speed_scale_remarks(turning: Turning) -> list[str]:
    """Return a remark on the scale error of a speed signal that the keyphasor contradicts."""
    off = turning.signal_over_pulses - 1
    if off == 0:
        return []
    return [
        f"speed: before the release it reads {100 * abs(off):.2g} % {'more' if off > 0 else 'less'} than the keyphasor counts"
        f" ({abs(turning.omega) / (2 * math.pi):.1f} Hz at the release), which is trusted: correct the speed's sensitivity"
    ]


def _levitated_samples(time: Array, release: float, begin: float) -> NDArray[np.bool_]:
    """Return the mask of levitated samples with the acceleration up to the release, which the shaft has since `begin`, s."""
    clear = time < release - _CLEAR_S
    last = time[clear][-_FEWEST_LEVITATED:]
    return clear & (time >= min([begin, *last[:1].tolist()]))


def _noise(
    raw: Array,
    time: Array,
    after_hole: NDArray[np.bool_],
    levitated: NDArray[np.bool_],
    angle: Array,
    machine: Machine,
    places: Sequence[str],
) -> tuple[Noise, ...]:
    """Return the noise of each row of readings (probes, n) in its longest `levitated` piece without a hole."""
    before = time[levitated]
    found = []
    for row, place in zip(raw[:, levitated], places, strict=True):
        at = _longest_piece(row, after_hole[levitated])
        found.append(levitated_noise(before[at], row[at], angle[at], machine.mains, place))
    return tuple(found)


def _cleaned(raw: Array, noise: Sequence[Noise], time: Array, angle: Array, mains: float) -> Array:
    """Return readings (probes, n) without hum and the surface's higher orders, which continue unchanged after the release.

    1X and 2X stay, since the model has them.
    """
    cleaned = raw.copy()
    for row, each in zip(cleaned, noise, strict=True):
        for k in range(3, HARMONICS + 1):
            row -= (each.orders[k - 1] * np.exp(1j * k * angle)).real
        row -= (each.hum * np.exp(2j * np.pi * mains * time)).real
    return cleaned


def _require_three(probes: Sequence[Probe], lost: Mapping[str, int], name: str) -> tuple[Probe, ...]:
    """Return probes; raise InputError where they are too few."""
    if len(probes) < 3:
        raise InputError(
            f"{name}: {len(probes)} usable probes; a calibration needs at least three: check the channels"
            + "".join(f"; {n} samples of '{each}' are missing or cut off" for each, n in lost.items() if n)
        )
    return tuple(probes)


def _bridged(laid: xr.Dataset, probes: Sequence[Probe]) -> xr.Dataset:
    """Return a record with the probes' gaps interpolated linearly: good enough to find the release, not for a fit."""
    rows = {probe.name: laid[probe.name] for probe in probes}
    return laid.assign({name: (row.dims, bridged(row.values), row.attrs) for name, row in rows.items()})


def bridged(values: Array) -> Array:
    """Return values with gaps interpolated linearly."""
    there, index = np.isfinite(values), np.arange(values.size)
    return values if there.all() else np.interp(index, index[there], values[there])


def _has_enough_samples(
    time: Array,
    after_hole: NDArray[np.bool_],
    values: Array,
    release: float,
    counted: float,
    levitated: NDArray[np.bool_],
) -> bool:
    """True where a probe has most samples of the fitted stretch and a long enough piece of the levitated one."""
    followed = (time >= release - _CLEAR_S) & (time < release + counted)
    piece = _longest_piece(values[levitated], after_hole[levitated])
    most = _longest_piece(np.zeros(levitated.sum()), after_hole[levitated])
    enough = piece.stop - piece.start >= _LEAST_PIECE * (most.stop - most.start)
    return bool(np.isfinite(values[followed]).mean() >= _LEAST_PRESENT and enough)


def _longest_piece(values: Array, after_hole: NDArray[np.bool_]) -> slice:
    """Return the longest stretch without a missing sample or a hole in the time axis."""
    there = np.isfinite(values)
    begin = np.flatnonzero(there & np.append(True, ~there[:-1] | after_hole[1:]))
    end = np.flatnonzero(there & np.append(~there[1:] | after_hole[1:], True)) + 1
    if not begin.size:
        return slice(0, 0)
    longest = int(np.argmax(end - begin))
    return slice(int(begin[longest]), int(end[longest]))


def _check_unbroken(time: Array, after_hole: NDArray[np.bool_], release: float, least: float, name: str) -> None:
    """Raise InputError where the time axis has a hole between the lead before the release and the first contacts."""
    followed = after_hole & (time > release - LEAD_S) & (np.append(time[0], time[:-1]) < release + least)
    if followed.any():
        at = int(np.flatnonzero(followed)[0])
        raise InputError(
            f"{name}: {said((float(time[at - 1]), float(time[at])))}, and the shaft is released at {release:.5f} s: every"
            f" sample from {LEAD_S * 1e3:g} ms before to {least * 1e3:g} ms after that is needed; record without pauses"
        )


def _check_length(time: Array, release: float, least: float, name: str) -> None:
    """Raise InputError where the record ends before the first contacts are over."""
    if time[-1] - release < least:
        raise InputError(
            f"{name}: the record ends {(time[-1] - release) * 1e3:.3g} ms after the release, before the first contacts"
            f" are over; give at least {least * 1e3:g} ms"
        )


def _check_touch(planes: xr.Dataset, machine: Machine, release: float, name: str) -> None:
    """Raise InputError where an end never moves far enough from its levitated position to have touched."""
    after = planes.time.to_numpy() >= release
    moved = planes.displacement.to_numpy()
    for i, bearing in enumerate(machine.touchdown_bearings):
        if np.isnan(moved[i]).any():
            continue
        start = np.median(moved[i][:, ~after], axis=1)
        reach = float(np.hypot(*(moved[i][:, after] - start[:, None])).max())
        if never_touches(complex(*start), reach, bearing, _TOUCHED):
            raise InputError(
                f"{name}: end '{bearing.name}' moves by no more than {reach * 1e6:.4g} um and never reaches the touchdown"
                f" bearing (gap {bearing.radial_gap.nominal * 1e6:g} um): there is no contact to calibrate from"
            )
