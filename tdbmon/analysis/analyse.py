"""One record, analysed: from channels laid over a machine to everything they yield without a fitted model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr
from tdbsim.errors import InputError
from tdbsim.machine import Machine
from tdbsim.modes import supported
from tdbsim.rotor import RotorModel, build_rotor, static_loads

from tdbmon.analysis.axes import at_own_probes, differ, seen_ends, to_planes
from tdbmon.analysis.bearing_orders import name_bearing_orders
from tdbmon.analysis.ends import analyse_ends
from tdbmon.analysis.exchanged_probes import check_exchanged
from tdbmon.analysis.free_fall import check_free_fall, check_probe_scales, undated
from tdbmon.analysis.levitation import Levitation, levitation, levitation_alone
from tdbmon.analysis.lines import Line, find_lines
from tdbmon.analysis.mode_names import mode_names
from tdbmon.analysis.order import track
from tdbmon.analysis.orientation import check_orientation
from tdbmon.analysis.phases import Phase, split_phases
from tdbmon.analysis.release import Release, not_told, release_of, springing_back
from tdbmon.analysis.rest import rest_travel
from tdbmon.analysis.result import NO_DROP, Analysis, EndResult, falls
from tdbmon.analysis.returned import returned
from tdbmon.analysis.rundown import RunDown, fit_rundown, speed_alone
from tdbmon.analysis.set_point import check_set_point
from tdbmon.analysis.spectrum import waterfall
from tdbmon.analysis.swing import Swing, predicted_swing
from tdbmon.analysis.whirl import Whirl, find_whirl, whirl_about_drawing
from tdbmon.progress import Progress, silent
from tdbmon.record.assign import assign
from tdbmon.record.clock_jumps import without_clock_jumps
from tdbmon.record.keyphasor import Pulses, pulses, shaft_angle
from tdbmon.record.keyphasor import speed as pulse_speed
from tdbmon.record.lost_samples import without_flat_tops, without_lost_samples
from tdbmon.record.misread import misread
from tdbmon.record.quality import Check, check, left_out, repair_gaps, usable
from tdbmon.record.sensor_effects import freed, sensor_chain
from tdbmon.record.skipped_samples import with_skipped_samples
from tdbmon.record.speed_checks import without_refuted

_LEAST_HZ = 500.0  # sampling rate of probes, below which no contact is more than a sample


def analyse(record: xr.Dataset, machine: Machine, progress: Progress = silent) -> Analysis:
    """Analyse one dropdown record.

    Parameters
    ----------
    record : Dataset
        As `tdbmon.record.read` gives it.
    machine : Machine
    progress : callable, optional
        Is told the name of each step as it begins.

    Returns
    -------
    Analysis
        What the record lacks (a speed signal, the keyphasor, an end's probes) is left out of it and listed in its
        checks; nothing is invented.

    Raises
    ------
    InputError
        If the record holds neither an orbit nor a speed of this machine.
    """
    progress("checking the channels")
    record = assign(record, machine)
    checks = list(check(record, machine))
    checks += _effects(machine)
    record, jumps = without_clock_jumps(without_refuted(record, machine), machine)
    checks += jumps
    record = with_skipped_samples(record)
    record = _bridged(without_lost_samples(record, machine), machine)
    rotor = build_rotor(machine)
    key = pulses(record, machine) if "keyphasor" in record else None
    speed = _speed(record, key)
    unused = left_out(record, machine, tuple(checks))
    planes = _planes(record, machine, checks, speed)
    if planes is None:
        return _speed_only(record, machine, rotor, checks, speed, key)

    if not falls(checks):
        return _levitated_only(planes, record, machine, rotor, checks, speed, key)

    progress("finding the release and the contacts")
    seen = planes.sel(end=seen_ends(planes))
    time = planes.time.to_numpy()
    angle = _angle(key, time, machine)
    release = _release(planes, record, machine, rotor, speed, checks)
    released = None if release is None else release.time.value
    unscaled = ""
    if release is not None:
        checks += check_free_fall(release, machine)
        unscaled = undated(release, machine)
        if unscaled:  # about when it was is known all the same: what lies before is levitation
            release = not_told(release, unscaled)
            released = released if released is not None and time[0] < released < time[-1] else None
    wrong = misread(record, machine, float(time[0]) if released is None else released, checks)
    planes = _apart(planes, record, machine, wrong, checks)
    seen = planes.sel(end=seen.end)
    sound = freed(record, machine)
    back = {end: returned(planes, end, machine, released) for end in machine.ends}
    drawn = _drawn_whirl(planes, machine, released)
    checks += check_orientation(planes, *sound, released, back, checks, drawn)
    checks += check_exchanged(planes, *sound, released)
    ends, swing = analyse_ends(planes, machine, rotor, released, back, checks, drawn, wrong, unused, unscaled)
    if release is not None:
        checks += check_set_point(ends, release, machine)
        if all(each.passed for each in checks if each.check == "machine and record"):
            checks += check_probe_scales(release, machine)  # by how the rotor of the machine file bends

    progress("fitting the run-down")
    rundown = _rundown(speed, released, rotor, key, checks)

    progress("looking for lines and whirl")
    settled = [e.gap.settled_from for e in ends.values() if e.gap is not None]
    touched = [e.contacts.events[0].start for e in ends.values() if e.contacts is not None and e.contacts.events]
    standstill = rundown.standstill_time.value if rundown is not None else None
    phases = split_phases(
        float(time[0]),
        float(time[-1]),
        None if unscaled else released,
        min(touched) if touched else None,
        max(settled) if settled and len(settled) == sum(end.plane != "none" for end in ends.values()) else None,
        standstill,
    )
    return Analysis(
        machine=machine,
        rotor=rotor,
        record=record,
        planes=planes,
        checks=tuple(checks),
        release=release,
        phases=phases,
        levitation=_levitation(planes, machine, released, speed.before(released), ends),
        ends=ends,
        swing=swing,
        rundown=rundown,
        speed_time=speed.time,
        speed_hz=speed.hz,
        angle=angle,
        waterfall=_spectra(seen),
        lines=_lines(seen, speed, machine, rotor, swing),
        whirl=_whirl(planes, machine, ends, released, drawn),
        tracks=track(seen, angle, sense=machine.sense) if angle is not None else None,
    )


@dataclass(frozen=True)
class _Speed:
    """Speed on its own samples, from the speed channel or else revolution by revolution from the keyphasor.

    `sampled` are the times of the keyphasor's samples in the latter case, None in the former.
    """

    time: np.ndarray
    hz: np.ndarray
    sampled: np.ndarray | None = None

    @property
    def known(self) -> bool:
        return len(self.time) > 3

    def before(self, release: float | None) -> float | None:
        """Median speed up to the release (of the first 20 ms where that is not known)."""
        if not self.known:
            return None
        head = self.time < (self.time[0] + 0.02 if release is None else release)
        head[:3] = True
        value = float(np.nanmedian(self.hz[head]))
        return value if value > 1.0 else None


def _bridged(record: xr.Dataset, machine: Machine) -> xr.Dataset:
    """Return the record with short runs of missing samples of its probes filled: one would blot out a whole spectrum."""
    probes = [probe.name for probe in machine.probes if probe.name in record]
    return record.assign(dict(repair_gaps(record[probes]).data_vars))


def _effects(machine: Machine) -> list[Check]:
    """Say what becomes of the effects that the machine file carries."""
    if not machine.effects:
        return []
    _, sensors = sensor_chain(machine, 1.0)
    others = [told for each in machine.effects if (told := f"{each.name} at {each.where}") not in sensors]
    said = [f"{', '.join(sensors)}: readings are freed of it before anything is told from them"] if sensors else []
    if others:
        said.append(
            f"{', '.join(others)}: the simulation has it (--forces); what is told from readings alone does not know it"
        )
    return [Check("effects", "machine file", True, "; ".join(said))]


def _speed(record: xr.Dataset, key: Pulses | None) -> _Speed:
    if "speed" in record:
        channel = record["speed"]
        hz = channel.to_numpy()
        finite = np.isfinite(hz)
        return _Speed(record[channel.dims[0]].to_numpy()[finite], hz[finite])
    if key is not None and len(key.times) > 3:
        time, hz, _ = pulse_speed(key)
        return _Speed(time, hz, record[record["keyphasor"].dims[0]].to_numpy())
    return _Speed(np.empty(0), np.empty(0))


def _planes(record: xr.Dataset, machine: Machine, checks: list[Check], speed: _Speed) -> xr.Dataset | None:
    """Displacement at the bearing planes, or None (with a failed check) where a record with speed holds no orbit.

    Where a probe's peaks are cut off it is NaN, and `cut_off` (end, time) says so.
    """
    fit = usable(record, machine, tuple(checks))
    try:
        planes = to_planes(*freed(record, machine), fit)
        time = planes.time.to_numpy()
        # holes count: where they are a hundred times the rest, the clock is damaged
        rate = (len(time) - 1) / (time[-1] - time[0])
        if rate < _LEAST_HZ:
            raise InputError(
                f"the probes are sampled at {rate:.3g} Hz, where a contact lasts some 2 ms; record at"
                " 2 kHz or more, or mend the sampling interval or the times in the file"
            )
    except InputError as error:
        if not speed.known:
            told = next((f" ({c.channel}: {c.detail})" for c in checks if not c.passed), "")
            raise InputError(f"{record.attrs.get('source_file', 'record')}: {error}{told}") from None
        checks.append(Check("orbit", "", False, f"{error}; only the speed is analysed"))
        return None
    seen = to_planes(*freed(without_flat_tops(record, machine), machine), fit)
    seen["cut_off"] = _cut_off(seen, planes)
    return seen


def _apart(
    planes: xr.Dataset, record: xr.Dataset, machine: Machine, wrong: Mapping[str, str], checks: list[Check]
) -> xr.Dataset:
    """Take an end whose own probes read well apart from the rigid line that probes elsewhere misread."""
    used = [str(name) for name in planes.probe.values]
    along = [end for end in machine.ends if str(planes.plane.sel(end=end).item()) == "bearing"]
    faulty = [name for name in used if name in wrong]
    own = {end: [probe for probe in machine.probes_at(end) if probe.name in used] for end in along}
    sound = [
        end
        for end, probes in own.items()
        if not any(probe.name in faulty for probe in probes) and differ([probe.angle for probe in probes])
    ]
    if not faulty or not sound:
        return planes
    for end in sound:
        why = " and ".join(f"{name} (see {wrong[name]})" for name in faulty)
        checks.append(Check("orbit", end, True, f"taken at its own probes' plane: {why} would spoil it at the bearing"))
    planes = at_own_probes(planes, *freed(without_flat_tops(record, machine), machine), used, sound)
    whole = at_own_probes(planes, *freed(record, machine), used, sound)
    return planes.assign(cut_off=planes.cut_off.where(~planes.end.isin(sound), _cut_off(planes, whole)))


def _cut_off(planes: xr.Dataset, whole: xr.Dataset) -> xr.DataArray:
    """Return where (end, time) displacement is missing that is there as long as no peak is left out."""
    return (planes.displacement.isnull() & whole.displacement.notnull()).any("axis")


def _speed_only(
    record: xr.Dataset, machine: Machine, rotor: RotorModel, checks: list[Check], speed: _Speed, key: Pulses | None
) -> Analysis:
    return Analysis(
        machine=machine,
        rotor=rotor,
        record=record,
        rundown=_rundown(speed, None, rotor, key, checks) if falls(checks) else _without_drop(speed, key),
        checks=tuple(checks),
        speed_time=speed.time,
        speed_hz=speed.hz,
    )


def _levitated_only(
    planes: xr.Dataset,
    record: xr.Dataset,
    machine: Machine,
    rotor: RotorModel,
    checks: list[Check],
    speed: _Speed,
    key: Pulses | None,
) -> Analysis:
    """Return what a record without a drop tells: how the shaft levitates, and how fast it turns."""
    time = planes.time.to_numpy()
    loads = static_loads(machine, rotor)
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
    seen = planes.sel(end=seen_ends(planes))
    return Analysis(
        machine=machine,
        rotor=rotor,
        record=record,
        planes=planes,
        checks=tuple(checks),
        phases=(Phase("levitated", float(time[0]), float(time[-1])),),
        levitation={
            name: levitation_alone(
                planes, name, speed.before(None), machine.mains, machine.bearing(name).radial_gap.nominal
            )
            for name in map(str, seen.end.values)
        },
        ends=ends,
        rundown=_without_drop(speed, key),
        speed_time=speed.time,
        speed_hz=speed.hz,
        angle=_angle(key, time, machine),
        waterfall=_spectra(seen),
        lines=_lines(seen, speed, machine, rotor, None),
    )


def _angle(key: Pulses | None, time: np.ndarray, machine: Machine) -> np.ndarray | None:
    return shaft_angle(key, time, machine) if key is not None and len(key.times) > 2 else None


def _without_drop(speed: _Speed, key: Pulses | None) -> RunDown | None:
    if not speed.known:
        return None
    time, hz = (speed.time, speed.hz) if speed.sampled is None else (speed.sampled, None)
    return speed_alone(time, hz, pulses=key, why=NO_DROP)


def _release(
    planes: xr.Dataset, record: xr.Dataset, machine: Machine, rotor: RotorModel, speed: _Speed, checks: list[Check]
) -> Release | None:
    sound = freed(without_flat_tops(record, machine), machine)
    release = release_of(*sound, planes, speed.before(None), springing_back(rotor))
    if release is None:
        detail = (
            "the record starts after the release, or less than 5 ms before it: no levitated stretch to tell it from; times"
            " count from the first sample"
        )
        checks.append(Check("levitated stretch", "", False, detail))
    return release


def _levitation(
    planes: xr.Dataset, machine: Machine, released: float | None, speed_hz: float | None, ends: dict[str, EndResult]
) -> dict[str, Levitation]:
    if released is None:
        return {}
    return {
        name: levitation(
            planes, name, released, speed_hz, machine.mains, end.gap, machine.bearing(name).radial_gap.nominal
        )
        for name, end in ends.items()
        if end.plane != "none"
    }


def _spectra(seen: xr.Dataset) -> xr.Dataset | None:
    """Return the waterfall; None where no window of the record has all its samples."""
    spectra = waterfall(seen)
    return spectra if bool(np.isfinite(spectra.amplitude).any()) else None


def _rundown(
    speed: _Speed, released: float | None, rotor: RotorModel, key: Pulses | None, checks: list[Check]
) -> RunDown | None:
    if not speed.known:
        return None
    # revolutions are no samples of a signal: their means would be taken for its values, and confirm themselves
    time, hz = (speed.time, speed.hz) if speed.sampled is None else (speed.sampled, None)
    if released is not None and not time[0] <= released < time[-1]:
        told = f"known from {time[0]:.4g} to {time[-1]:.4g} s only, not at the release ({released:.4g} s): no run-down is told"
        checks.append(Check("speed", "", False, told))
        return None
    return fit_rundown(
        time,
        hz,
        release_time=float(speed.time[0]) if released is None else released,
        polar_inertia=rotor.polar_inertia,
        pulses=key,
    )


def _lines(
    seen: xr.Dataset, speed: _Speed, machine: Machine, rotor: RotorModel, swing: Swing | None
) -> tuple[Line, ...]:
    if not speed.known:
        return ()
    bands = _expected(machine, rotor, swing)
    lines = find_lines(seen, speed.time, speed.hz, machine.sense, machine.mains, bands)
    return name_bearing_orders(lines, machine)


def _expected(machine: Machine, rotor: RotorModel, swing: Swing | None) -> list[tuple[str, float, float]]:
    """Bands in which lines have a name: both swings, and the modes on the touchdown bearings loaded by the weight."""
    bands = []
    for i, predicted in enumerate(predicted_swing(machine, rotor)):
        measured = swing.frequencies[i].value if swing is not None and i < len(swing.frequencies) else None
        low, high = (0.97, 1.03) if measured is not None else (0.85, 1.15)
        centre = predicted if measured is None else measured
        bands.append((f"swing {i + 1}", low * centre, high * centre))
    loads = static_loads(machine, rotor)
    stiffness = {b.name: loads[b.name] / rest_travel(b, loads[b.name]).per_load for b in machine.touchdown_bearings}
    soft, nominal, stiff = (
        supported(machine, rotor, {end: share * k for end, k in stiffness.items()}) for share in (0.7, 1.0, 1.5)
    )
    names = mode_names(nominal, [b.position for b in machine.touchdown_bearings])
    lowest, highest = (modes.frequencies[::2].tolist() for modes in (soft, stiff))
    return bands + list(zip(names, lowest, highest, strict=True))


def _drawn_whirl(planes: xr.Dataset, machine: Machine, released: float | None) -> dict[str, Whirl]:
    """Whirl of the ends that are seen, by the drawing: what goes right round does not rest, and tells no circle at rest."""
    start = float(planes.time[0]) if released is None else released
    return {end: whirl_about_drawing(planes, machine, end, start) for end in seen_ends(planes)}


def _whirl(
    planes: xr.Dataset,
    machine: Machine,
    ends: dict[str, EndResult],
    released: float | None,
    drawn: dict[str, Whirl],
) -> dict[str, Whirl]:
    start = float(planes.time[0]) if released is None else released
    out = dict(drawn)
    for end, result in ends.items():
        gap = result.gap
        if gap is None or gap.radius.value is None or gap.centre[0].value is None or gap.centre[1].value is None:
            continue
        centre = (gap.centre[0].value, gap.centre[1].value)
        out[end] = find_whirl(planes, end, centre, gap.radius.value, machine.sense, start)
    return out
