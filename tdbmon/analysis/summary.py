"""The few lines that the terminal shows of an analysis."""

from __future__ import annotations

from tdbmon.analysis.result import Analysis
from tdbmon.estimate import Estimate


def summary_lines(analysis: Analysis) -> list[str]:
    """Return the main numbers of an analysis as lines of text, with 95 % intervals."""
    rows: list[tuple[str, Estimate]] = []
    if analysis.release is not None:
        rows.append(("release", analysis.release.time))
        if analysis.release.force_decay.known:
            rows.append(("  magnetic force decays", analysis.release.force_decay))
    if analysis.rundown is not None:
        rows.append(("speed at the release", analysis.rundown.initial))
        rows.append(("speed decay time", analysis.rundown.decay_time))
        rows.append(("constant drag", analysis.rundown.drag_torque))
        rows.append(("standstill", analysis.rundown.standstill_time))
    if analysis.swing is not None:
        rows += [(f"swing {i + 1}, small", f) for i, f in enumerate(analysis.swing.frequencies)]
    failed = [c for c in analysis.checks if not c.passed]
    lines = [f"quality: {len(analysis.checks) - len(failed)} of {len(analysis.checks)} checks passed"]
    if failed:
        lines += [f"  failed: {c.check}{' ' + c.channel if c.channel else ''}: {c.detail}" for c in failed]
        lines.append("  what follows rests on these channels all the same: read it with the failed checks in mind")
    lines += [f"{name:<26}{value}" for name, value in rows]
    for name, end in analysis.ends.items():
        plane = {"bearing": "bearing plane", "probe": "probe plane"}.get(end.plane, "no orbit seen")
        lines.append(f"{name}  ({plane})")
        inner: list[tuple[str, Estimate]] = []
        if end.gap is not None:
            inner += [("radius at rest", end.gap.radius), ("  from the swing", end.gap_from_swing)]
        inner.append(("air gap", end.air_gap))
        if end.contacts is not None and end.contacts.first is not None:
            first = end.contacts.first
            inner += [("first contact", first.touch), ("  duration", first.duration), ("  rebound", first.rebound)]
        inner.append(("single-mass stiffness", end.stiffness))
        lines += [f"  {label:<24}{value}" for label, value in inner]
    return lines
