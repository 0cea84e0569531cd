"""Report section: the release and the phases of the drop, with the signals."""

from __future__ import annotations

from functools import partial

from tdbmon.analysis.result import NO_DROP, Analysis
from tdbmon.analysis.vibration_zone import ZONES, zone
from tdbmon.estimate import Estimate
from tdbmon.quantity import words
from tdbmon.record.slow_roll import runout_words
from tdbmon.report.document import Block, Figure, Paragraph, Row, Section, SignalViewer, Table, sentence
from tdbmon.report.signal import signals_of

_FIRST_S = 0.25


def section(analysis: Analysis) -> Section:
    """Return the release, the phases and the time histories."""
    blocks: list[Block] = []
    if not analysis.falls:
        blocks += [sentence(NO_DROP), *_levitated(analysis)]
    elif analysis.release is None:
        blocks.append(
            Paragraph(
                "The release was not found: the record holds no levitated stretch before the fall, or no displacement."
            )
        )
    else:
        blocks += _release(analysis)
    if analysis.phases:
        rows = tuple(Row((p.name, _time(p.start), _time(p.end), _time(p.end - p.start))) for p in analysis.phases)
        blocks.append(Table("Phases of the record", ("Phase", "From", "To", "Length"), rows))
    if analysis.planes is not None:
        blocks += _figures(analysis)
    signals = signals_of(analysis)
    if signals is not None:
        runout = runout_words(analysis.checks)
        blocks.append(SignalViewer(f"Displacement (not filtered, {runout}) and speed of the whole record", signals))
    return Section("Release and phases", tuple(blocks))


def _release(analysis: Analysis) -> list[Block]:
    release = analysis.release
    if release is None:
        return []
    if not release.time.known:
        return [Paragraph(f"The release is not estimated: {release.time.why}.")]
    decay = release.force_decay
    if not decay.known:
        soft = f"Force: {decay.why}."
    elif decay.low:
        soft = f"The magnetic force decayed with {words(decay)}."
    else:
        soft = f"The magnetic force may have decayed with {words(decay)} ({decay.method})."
    said = f"The magnetic bearings released the rotor at {words(release.time)} ({release.time.method}). {soft}"
    rows = []
    for end, state in release.states.items():
        noise = Estimate(
            state.noise, unit="um", method="residual of the fitted levitated orbit", why="no interval", kind="rms"
        )
        ax, ay = release.falls[end].acceleration
        rows.append(
            Row(
                (
                    end,
                    *(words(q) for q in (state.x, state.y, state.vx, state.vy)),
                    words(noise),
                    f"{ax:.2f}, {ay:.2f} m/s²".replace("-", "−"),
                )
            )
        )
    header = ("End", "x", "y", "Velocity x", "Velocity y", "Noise", "Fall x, y")
    gravity = analysis.machine.gravity
    caption = f"State at the release, from the probes' zero; a fall under gravity alone has 0, −{gravity:.2f} m/s²"
    return [Paragraph(said), Table(caption, header, tuple(rows)), *_levitated(analysis)]


def _levitated(analysis: Analysis) -> list[Block]:
    """Return position and vibration of the shaft before the release, with the zones of ISO 14839-2."""
    rows = []
    for end, found in analysis.levitation.items():
        told = (words(q) for q in (found.x, found.y, found.once, found.reach))
        rows.append(Row((end, *told, words(found.share) if found.share.known else "–", zone(found.share) or "–")))
    if not rows:
        return []
    origin = "the clearance centre" if analysis.falls else "the probes' zero"
    header = ("End", "x", "y", "1X, both axes", f"Farthest from {origin}", "Over C_min", "Zone")
    zones = ", ".join(f"{name} to {limit:g}" for name, limit in ZONES)
    said = (
        f"Zones of ISO 14839-2 by the share of the least radial clearance C_min: {zones}, D above. C_min is here the radial gap"
        " of the machine file. The standard applies to steady running; these values come from the record, in the plane of"
        " the bearing, with run-out and noise."
    )
    for end, found in analysis.levitation.items():
        if found.reach.known and not found.share.known:
            said += f" {end} has no zone: {found.share.why}."
    when = " before the release" if analysis.falls else ""
    return [Table(f"Levitation{when}; x and y from the probes' zero", header, tuple(rows)), Paragraph(said)]


def _figures(analysis: Analysis) -> list[Block]:
    from tdbmon.figures.time_history import time_history

    time = analysis.planes.time.to_numpy()  # type: ignore[union-attr]
    release = analysis.released
    begin = float(time[0]) if release is None else max(float(time[0]), release - 0.02)
    end = min(begin + _FIRST_S, float(time[-1]))
    first = Figure(
        "first-contacts",
        f"The first {end - begin:.2f} s of the drop.{_reading(analysis, begin, end)}",
        f"x and y of each end from {begin:.2f} s to {end:.2f} s: the fall and the bounces on the touchdown bearings.",
        partial(time_history, analysis, begin, end),
    )
    whole = Figure(
        "whole-record",
        f"The whole record.{_reading(analysis, float(time[0]), float(time[-1]))}",
        "x and y of each end over the whole record.",
        partial(time_history, analysis),
    )
    return [first, whole] if analysis.falls else [whole]


def _reading(analysis: Analysis, begin: float, end: float) -> str:
    """Return the explanation of the marks in a time history, only of those that it contains."""
    from tdbmon.figures.style import has_circle
    from tdbmon.figures.time_history import shows_touches

    ends = analysis.seen_ends
    words = ""
    if any(has_circle(analysis, name) for name in ends):
        words += " Dashed: distance of the shaft centre from the clearance centre at rest."
    events = [event for name in ends for event in analysis.ends[name].events]
    if shows_touches(begin, end) and any(begin <= event.start <= end for event in events):
        words += " Triangles: contacts of that end."
    return words + (" Shading: phases." if analysis.phases else "")


def _time(seconds: float) -> str:
    return f"{seconds:.4f} s"
