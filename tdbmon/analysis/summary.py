"""Summary of an analysis in a few lines of text for the terminal."""

from __future__ import annotations

from tdbsim.quantity import Tolerant
from tdbsim.rotor import static_loads

from tdbmon.analysis.coast_down_times import how_told
from tdbmon.analysis.result import Analysis, EndResult
from tdbmon.analysis.vibration_zone import zone
from tdbmon.estimate import Estimate, since
from tdbmon.quantity import printed, why_no_interval

FORCES_TELL = "fall and first contacts are in the record: --forces fits a simulation to them, without a clearance circle"
_SHOWN_IN = {"  duration": "ms"}
_HALF = (0.4, 0.65)  # measured over stated gap: about a half suggests that the diametral clearance was stated
_BY_INERTIA = ", with the machine file's polar inertia; the interval includes only the speed's noise"


def summary_lines(analysis: Analysis, fitted: bool = False) -> list[str]:
    """Return the main results of an analysis as lines of text, with 95 % intervals; `fitted` is whether --forces is given."""
    rows: list[tuple[str, Estimate, str]] = []
    if analysis.release is not None:
        rows.append(("release", analysis.release.time, ""))
        if analysis.release.force_decay.known:
            rows.append(("  magnetic force decays", analysis.release.force_decay, ""))
    if analysis.rundown is not None and not analysis.falls:
        rows.append(("speed at the record's end", analysis.rundown.initial, ""))
    elif analysis.rundown is not None:
        rows.append(("speed at the release", analysis.rundown.initial, ""))
        rows.append(("speed decay time", analysis.rundown.decay_time, ""))
        rows.append(("constant drag", analysis.rundown.drag_torque, _BY_INERTIA))
        rows.append(("standstill", analysis.rundown.standstill_time, ""))
        times = analysis.coast_down
        named = (("coast-down to a half", times.half), ("coast-down to a tenth", times.tenth))
        rows += [(name, time, f", {how_told(time)}") for name, time in named if time.known]
    if analysis.swing is not None:
        rows += [(f"swing {i + 1}, small", f, "") for i, f in enumerate(analysis.swing.frequencies) if f.known]
    failed = [c for c in analysis.checks if not c.passed]
    lines = [f"quality: {len(analysis.checks) - len(failed)} of {len(analysis.checks)} checks passed"]
    if failed:
        lines += [f"  failed: {c.check}{' ' + c.channel if c.channel else ''}: {c.detail}" for c in failed]
        lines.append(
            "  the results below use these channels, except those left out: read them with the failed checks in mind"
        )
    lines += _whirls(analysis)
    lines.append(f"{'rotor':<26}{weight(analysis)}")
    lines += [f"{name:<26}{printed(value)}{_beside(value, holds)}" for name, value, holds in rows]
    for name, end in analysis.ends.items():
        plane = {"bearing": "bearing plane", "probe": "probe plane"}.get(end.plane, "no orbit seen")
        released = None if analysis.release is None else analysis.release.time
        lines += [f"{name}  ({plane})", *_levitated(analysis, name)]
        if end.held:
            lines.append(f"  {end.held}")
            continue
        if not analysis.falls:
            lines += _orbit_lines(analysis, name)
            continue
        lines += _end_lines(end, analysis.machine.bearing(name).radial_gap, released)
    return lines + [f"  {FORCES_TELL}"] * (analysis.forces_tell_contacts and not fitted)


def _beside(value: Estimate, holds: str) -> str:
    """Return why an estimate has no interval, or else the note on what its interval covers."""
    return why_no_interval(value) or (holds if value.known else "")


def weight(analysis: Analysis) -> str:
    """Return mass and static loads of the machine file's rotor, in which a wrong dimension shows first.

    Loads are omitted without probes, since such a shaft may be vertical and rest on no radial bearing.
    """
    mass = f"{analysis.rotor.total_mass:.4g} kg by the machine file"
    if not analysis.machine.probes:
        return mass
    loads = static_loads(analysis.machine, analysis.rotor)
    resting = ", ".join(f"{loads[end]:.0f} N on {end}" for end in analysis.machine.ends)
    return f"{mass}, {resting}"


def _whirls(analysis: Analysis) -> list[str]:
    """Return one line per whirling end, shown before all results since backward whirl destroys touchdown bearings."""
    lines = []
    for end, whirl in analysis.whirl.items():
        longest = whirl.worst
        if longest is None:
            continue
        name, onset = ("backward whirl", whirl.backward_onset) if whirl.backward else ("full whirl", whirl.full_onset)
        begin = f"{onset.value:.4f} s"
        if (after := since(onset, analysis.release_time)).known:
            begin = f"{printed(after)} after the release [{begin}]"
        about = ", with the drawing's gap" if whirl.drawn else ""
        told = f"from {begin}; the longest lasts {longest.duration_s:.3g} s at {printed(longest.frequency)}{about}"
        lines.append(f"{f'{name}, {end}':<26}{told}")
    return lines


def _levitated(analysis: Analysis, end: str) -> list[str]:
    """Return the largest distance of the levitated shaft from the clearance centre, if known, and its zone by ISO 14839-2."""
    found = analysis.levitation.get(end)
    if found is None:
        return []
    name = "levitated, from centre" if analysis.falls else "levitated, from zero"
    if not found.reach.known:
        return [f"  {name:<24}{printed(found.reach)}"]
    beside = f", no zone of ISO 14839-2: {found.share.why}"
    if found.share.known:
        beside = f", {found.share.value:.2f} of the machine file's gap: zone {zone(found.share)} of ISO 14839-2"
    if not analysis.falls:
        beside += f" ({found.reach.why})"
    return [f"  {name:<24}{printed(found.reach)}{beside}"]


def _orbit_lines(analysis: Analysis, end: str) -> list[str]:
    """Return position, orbit and noise of a shaft that is levitated throughout the record."""
    found = analysis.levitation.get(end)
    if found is None:
        return []
    rows = (("  x", found.x), ("  y", found.y), ("  once per revolution", found.once), ("  noise", found.noise))
    return [f"  {label:<24}{printed(estimate)}" for label, estimate in rows]


def _end_lines(end: EndResult, drawn: Tolerant, released: Estimate | None) -> list[str]:
    """Return the results of one end; a reason for missing ones is given in full only with the first of them."""
    rows = [
        ("radius at rest", end.circle.radius),
        ("  from the swing", end.gap_from_swing),
        ("air gap", end.air_gap),
        ("first contact", end.first.touch),
        ("  duration", end.first.duration),
        ("  rebound", end.first.rebound),
        ("single-mass stiffness", end.stiffness),
    ]
    lines: list[str] = []
    told: dict[str, str] = {}
    for label, estimate in rows:
        above = None if estimate.known else told.setdefault(estimate.why, label.strip())
        same = above is not None and above != label.strip()
        beside = _beside_the_drawing(estimate, drawn) if label == "air gap" else ""
        if label == "first contact" and estimate.known and released is not None and released.known:
            estimate, beside = since(estimate, released), f" after the release [{estimate.value:.5f} s]"
        lines.append(
            f"  {label:<24}{f'not estimated (as {above})' if same else printed(estimate, _SHOWN_IN.get(label))}{beside}"
        )
    return lines


def _beside_the_drawing(gap: Estimate, drawn: Tolerant) -> str:
    """Return a note if the whole interval of a gap lies outside the tolerance, as with a wrong sensitivity too; "" if not."""
    if gap.low is None or gap.high is None or drawn.is_exact or (gap.low <= drawn.high and gap.high >= drawn.low):
        return ""
    tolerance = f"{drawn.low * 1e6:g} to {drawn.high * 1e6:g} um"
    cause = "worn, or " if gap.low > drawn.high else ""  # wear does not make a gap narrower
    share = (gap.low + gap.high) / (2 * drawn.nominal)
    twice = " (radial_gap is half of the diametral clearance)" if _HALF[0] < share < _HALF[1] else ""
    return (
        f", outside the tolerance ({tolerance}): {cause}wrong gap in the machine file{twice}, wrong sensitivity or"
        " wrong weight of the rotor"
    )
