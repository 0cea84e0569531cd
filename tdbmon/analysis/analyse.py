"""Analysis of one record: everything that its channels, assigned to a machine, yield without a fitted model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from tdbsim.errors import InputError
from tdbsim.machine import Machine
from tdbsim.rotor import RotorModel, build_rotor, static_loads

from tdbmon.analysis.axes import seen_ends
from tdbmon.analysis.bearing_orders import name_bearing_orders
from tdbmon.analysis.bearing_planes import apart_from_misread, bearing_planes
from tdbmon.analysis.bent_line import LevitatedMiss, levitated_misses
from tdbmon.analysis.braked import beyond_contacts
from tdbmon.analysis.drifting_swings import DriftingSwing, drifting_swings, lacking_swings
from tdbmon.analysis.ends import analyse_ends
from tdbmon.analysis.exchanged_probes import exchanged_probes
from tdbmon.analysis.expected_lines import expected_lines
from tdbmon.analysis.free_fall import check_free_fall, check_probe_scales, undated
from tdbmon.analysis.let_go_alone import let_go_alone
from tdbmon.analysis.levitation import Levitation, held_bent, levitation, levitation_alone
from tdbmon.analysis.line_names import Band
from tdbmon.analysis.lines import Line, find_lines, spectra_against_time
from tdbmon.analysis.order import track
from tdbmon.analysis.orientation import check_orientation
from tdbmon.analysis.phases import Phase, split_phases
from tdbmon.analysis.release import Release, not_told, release_of, springing_back, state_held_bent
from tdbmon.analysis.rest import rest_travel
from tdbmon.analysis.result import NO_DROP, Analysis, EndResult, falls
from tdbmon.analysis.returned import returned
from tdbmon.analysis.rotation import Rotation
from tdbmon.analysis.rundown import RunDown
from tdbmon.analysis.set_point import check_set_point, no_centre
from tdbmon.analysis.spectrum import waterfall
from tdbmon.analysis.spring_back import sag_of
from tdbmon.analysis.swing import Swing
from tdbmon.analysis.whirl import Whirl, find_whirl, whirl_about_drawing
from tdbmon.progress import Progress, silent
from tdbmon.quantity import counted
from tdbmon.record.assign import assign
from tdbmon.record.clock_jumps import without_clock_jumps
from tdbmon.record.finding import Check
from tdbmon.record.held_end import held_check, held_ends, paths_of, said_held
from tdbmon.record.lift_off import from_lift_off
from tdbmon.record.lost_samples import without_flat_tops, without_lost_samples
from tdbmon.record.misread import misread
from tdbmon.record.quality import LeftOut, check, left_out, repair_gaps
from tdbmon.record.sensor_effects import check_effects, freed
from tdbmon.record.skipped_samples import with_skipped_samples
from tdbmon.record.slow_roll import check_slow_roll
from tdbmon.record.speed_checks import signal_over_pulses, without_refuted
from tdbmon.record.taken_up import until_taken_up

_FEWEST = 128  # samples: eight windows of sixteen, the least for a waterfall


def analyse(record: xr.Dataset, machine: Machine, progress: Progress = silent) -> Analysis:
    """Analyse one dropdown record.

    Parameters
    ----------
    record : Dataset
        As `tdbmon.record.read` returns it.
    machine : Machine
    progress : callable, optional
        Called with the name of each step as it begins.

    Returns
    -------
    Analysis
        Without the results for which the record lacks data (a speed signal, the keyphasor, an end's probes); its checks
        list what is missing.

    Raises
    ------
    InputError
        If the record holds neither an orbit nor a speed of this machine, or is too short to analyse.
    """
    progress("checking the channels")
    record, lying = from_lift_off(assign(record, machine), machine)
    record, lifted = until_taken_up(record, machine)
    _long_enough(record, machine)
    checks = [*lying, *lifted, *check(record, machine), *check_effects(machine)]
    over_pulses = signal_over_pulses(record, machine)
    record, jumps = without_clock_jumps(without_refuted(record, machine), machine)
    checks += [*jumps, *check_slow_roll(record, machine)]
    record = _bridged(without_lost_samples(with_skipped_samples(record), machine), machine)
    laid = _Laid(record, machine, build_rotor(machine), Rotation.of(record, machine), over_pulses)
    unused = left_out(record, machine, checks)
    planes = _planes(laid, unused, checks)
    if planes is None:
        return _speed_only(laid, checks)
    if not falls(checks):
        return _levitated_only(laid, planes, checks)
    return _drop(laid, planes, unused, checks, progress)


def _long_enough(record: xr.Dataset, machine: Machine) -> None:
    """Raise InputError if the probe channels are too short for a spectrum; a record without probes may still hold a speed."""
    longest = max((record[probe.name].size for probe in machine.probes if probe.name in record), default=_FEWEST)
    if longest < _FEWEST:
        raise InputError(
            f"{record.attrs.get('source_file', 'record')}: the record is too short: the probes have {counted(longest, 'sample')};"
            f" export the whole record, at least {_FEWEST} samples"
        )


@dataclass(frozen=True, eq=False)
class _Laid:
    """A record assigned to its machine, the rotation of the shaft, and the speed ratio from `signal_over_pulses`."""

    record: xr.Dataset
    machine: Machine
    rotor: RotorModel
    rotation: Rotation
    over_pulses: float

    def without_orbit(self, checks: Iterable[Check], rundown: RunDown | None) -> Analysis:
        """Return an analysis of the speed alone."""
        return Analysis(
            machine=self.machine,
            rotor=self.rotor,
            record=self.record,
            checks=tuple(checks),
            rundown=rundown,
            speed_time=self.rotation.time,
            speed_hz=self.rotation.hz,
        )


def _planes(laid: _Laid, unused: Iterable[str], checks: list[Check]) -> xr.Dataset | None:
    """Return displacement at the bearing planes; None if a record with speed holds no orbit, which is added to `checks`."""
    fit = [probe.name for probe in laid.machine.probes if probe.name not in unused]
    try:
        return bearing_planes(laid.record, laid.machine, fit)
    except InputError as error:
        if not laid.rotation.known:
            told = next((f" ({c.channel}: {c.detail})" for c in checks if not c.passed), "")
            raise InputError(f"{laid.record.attrs.get('source_file', 'record')}: {error}{told}") from None
        if laid.machine.probes:
            checks.append(Check("orbit", "", False, f"{error}; only the speed is analysed"))
        else:  # as the machine file intends, for a vertical shaft, say
            checks.append(Check("orbit", "", True, "the machine file has no probes: only the speed is analysed"))
        return None


def _drop(
    laid: _Laid, planes: xr.Dataset, unused: Mapping[str, LeftOut], checks: list[Check], progress: Progress
) -> Analysis:
    """Return the analysis of a record with a drop; `unused` maps the probes left out to the reason."""
    record, machine, rotor, rotation = laid.record, laid.machine, laid.rotor, laid.rotation
    progress("finding the release and the contacts")
    time = planes.time.to_numpy()
    reaches = held_ends(paths_of(planes), machine)
    release, released, unscaled = _release(laid, planes, reaches, checks)
    held = {} if release is None else {end: said_held(end, reach, machine) for end, reach in reaches.items()}
    checks += [held_check(end, reaches[end], machine) for end in held]
    start = float(time[0]) if released is None else released
    wrong = misread(record, machine, start, checks)
    apart = apart_from_misread(planes, record, machine, wrong, checks)
    if release is not None and apart is not planes:
        release = _at_planes(release, laid, apart, reaches)
    planes = apart
    sound = freed(record, machine)
    back = {end: returned(planes, end, machine, released) for end in machine.ends}
    # a shaft in full whirl does not rest, so that no clearance circle at rest can be fitted
    drawn = {end: whirl_about_drawing(planes, machine, end, start) for end in seen_ends(planes)}
    checks += check_orientation(_without(planes, held), *sound, released, back, checks, drawn)
    crossed = exchanged_probes(planes, *sound, released)
    checks += [] if crossed is None else [crossed.check]
    ends, swing = analyse_ends(planes, machine, rotor, released, back, checks, drawn, wrong, unused, held, unscaled)
    if release is not None:
        checks += check_set_point(ends, release, machine)
        if all(each.passed for each in checks if each.check == "machine and record"):
            checks += check_probe_scales(release, machine)  # needs the bending of the machine file's rotor

    progress("fitting the run-down")
    circled = {end: result.gap for end, result in ends.items() if result.gap is not None}
    whirl = drawn | {
        end: find_whirl(planes, end, gap.place, gap.size, machine.sense, start) for end, gap in circled.items()
    }
    rundown = _run_down(laid, released, whirl, checks)
    before = rotation.before(released)
    levitated, misses = _levitation(laid, planes, released, before, ends, checks)

    progress("looking for lines and whirl")
    seen, angle = planes.sel(end=seen_ends(planes)), rotation.angle(time, machine)
    bands = _bands(laid, swing)
    lines = _lines(laid, seen, bands)
    return replace(
        laid.without_orbit(checks, rundown),
        planes=planes,
        release=None if release is None else _held_bent(release, misses, before),
        phases=_phases(time, None if unscaled else released, ends, rundown) + _again(record),
        levitation=levitated,
        ends=ends,
        swing=swing,
        angle=angle,
        waterfall=_spectra(seen),
        lines=lines,
        drifting=_drifting(laid, seen, bands, lines),
        whirl=whirl,
        tracks=track(seen, angle, sense=machine.sense) if angle is not None else None,
    )


def _run_down(laid: _Laid, released: float | None, whirl: Mapping[str, Whirl], checks: list[Check]) -> RunDown | None:
    """Return the run-down, and add a failed check if no coasting rotor decelerates like that.

    `whirl` holds the whirl of the visible ends.  A whirling rotor follows no drag law either; as whirl is reported itself, it
    fails no check here.
    """
    rundown = laid.rotation.run_down(released, laid.rotor, checks)
    if rundown is None:
        return None
    whirls = any(each.worst or each.hidden for each in whirl.values())
    if released is not None and whirl and not whirls:
        rundown = beyond_contacts(rundown, laid.machine, laid.rotor, released)
    if rundown.doubt and not whirls:
        checks.append(Check("run-down", "", False, rundown.doubt))
    return rundown


def _without(planes: xr.Dataset, ends: Iterable[str]) -> xr.Dataset:
    """Return the planes with the given ends, which did not fall, marked as not visible, to keep them out of tests of the fall."""
    left = planes.end.isin(list(ends))
    return planes.assign(plane=planes.plane.where(~left, "none"), displacement=planes.displacement.where(~left))


def _bridged(record: xr.Dataset, machine: Machine) -> xr.Dataset:
    """Return the record with short gaps in its probe channels filled, since one missing sample would void a whole spectrum."""
    probes = [probe.name for probe in machine.probes if probe.name in record]
    return record.assign(dict(repair_gaps(record[probes]).data_vars))


def _speed_only(laid: _Laid, checks: list[Check]) -> Analysis:
    rundown = _run_down(laid, None, {}, checks) if falls(checks) else laid.rotation.without_drop()
    return laid.without_orbit(checks, rundown)


def _levitated_only(laid: _Laid, planes: xr.Dataset, checks: list[Check]) -> Analysis:
    """Return the analysis of a record without a drop: the levitated orbit and the speed."""
    machine, rotation = laid.machine, laid.rotation
    time = planes.time.to_numpy()
    loads = static_loads(machine, laid.rotor)
    ends = {
        end: EndResult.without_contact(
            end,
            str(planes.plane.sel(end=end).item()),
            loads[end],
            rest_travel(machine.bearing(end), loads[end]),
            NO_DROP,
        )
        for end in machine.ends
    }
    seen, speed_hz = seen_ends(planes), rotation.before(float(time[-1]))
    found = {
        end: levitation_alone(planes, end, speed_hz, machine.mains, machine.bearing(end).radial_gap.nominal)
        for end in seen
    }
    return replace(
        laid.without_orbit(checks, rotation.without_drop()),
        planes=planes,
        phases=(Phase("levitated", float(time[0]), float(time[-1])),),
        levitation=_levitated_bent(laid, planes, speed_hz, found)[0],
        ends=ends,
        angle=rotation.angle(time, machine),
        waterfall=_spectra(planes.sel(end=seen)),
        lines=_lines(laid, planes.sel(end=seen), _bands(laid, None)),
    )


def _release(
    laid: _Laid, planes: xr.Dataset, held: Iterable[str], checks: list[Check]
) -> tuple[Release | None, float | None, str]:
    """Return the release, its approximate instant, s, and why later times are withheld (if their scale may be wrong; else "").

    It is determined from the ends that fall, without those `held`.
    """
    machine = let_go_alone(laid.machine, laid.rotor, held)
    release = _found_release(laid, machine, planes, held)
    if release is None:
        detail = (
            "the record starts after the release, or less than 5 ms before it: without a levitated stretch the release"
            " cannot be determined; times count from the first sample"
        )
        checks.append(Check("levitated stretch", "", False, detail))
        return None, None, ""
    if machine is laid.machine:  # else the acceleration of the fall is not gravity alone
        checks += check_free_fall(release, machine, laid.over_pulses)
    released, unscaled = release.time.value, undated(release, machine)
    if not unscaled:
        return release, released, ""
    # the approximate instant still marks the end of levitation
    within = released is not None and planes.time[0] < released < planes.time[-1]
    return not_told(unscaled, release.falls), released if within else None, unscaled


def _found_release(laid: _Laid, machine: Machine, planes: xr.Dataset, held: Iterable[str]) -> Release | None:
    """Return the release determined from the ends that fall."""
    record, upright = freed(without_flat_tops(laid.record, machine), machine)
    sag = None if held else sag_of(machine, laid.rotor)  # with one end held, the sag springs back differently
    bending = springing_back(laid.rotor)
    return release_of(record, upright, _without(planes, held), laid.rotation.before(None), bending, sag)


def _at_planes(release: Release, laid: _Laid, planes: xr.Dataset, held: Iterable[str]) -> Release:
    """Return a release with the states of its ends re-evaluated at other planes than those it was found at."""
    if not release.states:
        return release
    found = _found_release(laid, let_go_alone(laid.machine, laid.rotor, held), planes, held)
    return replace(release, states={} if found is None else found.states)


def _phases(
    time: np.ndarray, released: float | None, ends: Mapping[str, EndResult], rundown: RunDown | None
) -> tuple[Phase, ...]:
    settled = [end.gap.settled_from for end in ends.values() if end.gap is not None]
    touched = [end.events[0].start for end in ends.values() if end.events]
    every_end = len(settled) == sum(end.seen and not end.held for end in ends.values())
    return split_phases(
        float(time[0]),
        float(time[-1]),
        released,
        min(touched) if touched else None,
        max(settled) if settled and every_end else None,
        rundown.standstill_time.value if rundown is not None else None,
    )


def _again(record: xr.Dataset) -> tuple[Phase, ...]:
    """Return the phase in which the shaft is levitated again, which is excluded from the analysis."""
    if "lifted_s" not in record.attrs:
        return ()
    return (Phase("levitated again", record.attrs["lifted_s"], record.attrs["hovers_s"]),)


def _levitation(
    laid: _Laid,
    planes: xr.Dataset,
    released: float | None,
    speed_hz: float | None,
    ends: dict[str, EndResult],
    checks: list[Check],
) -> tuple[dict[str, Levitation], dict[str, LevitatedMiss]]:
    """Return position and orbit of the levitated shaft at each visible end, and the possible error of the rigid line there."""
    machine = laid.machine
    if released is None:
        return {}, {}
    found = {
        name: levitation(
            planes,
            name,
            released,
            speed_hz,
            machine.mains,
            end.gap,
            machine.bearing(name).radial_gap.nominal,
            no_centre(checks, name),
        )
        for name, end in ends.items()
        if end.seen
    }
    return _levitated_bent(laid, planes, speed_hz, found)


def _levitated_bent(
    laid: _Laid, planes: xr.Dataset, speed_hz: float | None, found: Mapping[str, Levitation]
) -> tuple[dict[str, Levitation], dict[str, LevitatedMiss]]:
    """Return the levitation results with intervals widened by the possible error of the rigid line, and that error."""
    orbits = [each.once.value for each in found.values() if each.once.value is not None]
    misses = levitated_misses(planes, laid.machine, laid.rotor, speed_hz, orbits)
    clearance = {end: laid.machine.bearing(end).radial_gap.nominal for end in found}
    return {end: held_bent(each, misses[end], clearance[end]) for end, each in found.items()}, misses


def _held_bent(release: Release, misses: Mapping[str, LevitatedMiss], speed_hz: float | None) -> Release:
    states = {
        end: state_held_bent(state, misses.get(end, LevitatedMiss()), speed_hz) for end, state in release.states.items()
    }
    return replace(release, states=states)


def _spectra(seen: xr.Dataset) -> xr.Dataset | None:
    """Return the waterfall; None if every window of the record lacks samples."""
    spectra = waterfall(seen)
    return spectra if bool(np.isfinite(spectra.amplitude).any()) else None


def _bands(laid: _Laid, swing: Swing | None) -> list[Band]:
    """Return the frequency bands of named lines; none without a speed, as lines are found only with one."""
    return expected_lines(laid.machine, laid.rotor, swing) if laid.rotation.known else []


def _lines(laid: _Laid, seen: xr.Dataset, bands: list[Band]) -> tuple[Line, ...]:
    machine, rotation = laid.machine, laid.rotation
    if not rotation.known:
        return ()
    lines = find_lines(seen, rotation.time, rotation.hz, machine.sense, machine.mains, bands)
    return name_bearing_orders(lines, machine)


def _drifting(laid: _Laid, seen: xr.Dataset, bands: list[Band], lines: tuple[Line, ...]) -> tuple[DriftingSwing, ...]:
    """Return the swings whose frequency drifts too much for a spectral line."""
    lacking = lacking_swings(bands, lines)
    if not lacking:
        return ()
    spectra = spectra_against_time(seen, laid.rotation.time, laid.rotation.hz)
    return drifting_swings(spectra, [str(end) for end in seen.end.values], lacking, lines)
