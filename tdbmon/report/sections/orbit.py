"""Report section: orbits of each end, filtered orbits and the shaft centreline."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from tdbsim.errors import InputError

from tdbmon.analysis.result import Analysis
from tdbmon.record.slow_roll import runout_sentence
from tdbmon.report.document import Block, Figure, Paragraph, Section
from tdbmon.report.sections.left_out import left_out

if TYPE_CHECKING:
    from tdbmon.figures.centreline import Courses


def section(analysis: Analysis) -> Section | None:
    """Return the orbits (one figure per end), the filtered orbits and the centreline; None if no end is measured."""
    ends = analysis.seen_ends
    if not ends:
        return None
    from tdbmon.figures.centreline import centreline, courses_of
    from tdbmon.figures.orbit_sequence import orbit_sequence

    blocks: list[Block] = [
        Figure(
            f"orbits-{i + 1}",
            _orbits_caption(analysis, end),
            f"Orbit panels of {end}, to the end of the record.",
            partial(orbit_sequence, analysis, end),
        )
        for i, end in enumerate(ends)
    ]
    blocks.append(_filtered(analysis))
    try:
        courses = courses_of(analysis)
    except InputError as error:
        blocks.append(Paragraph(f"The shaft centreline is not drawn: {error}."))
    else:
        blocks.append(
            Figure(
                "centreline",
                _centreline_caption(analysis, courses),
                "For each end the mean shaft position in the clearance circle.",
                partial(centreline, analysis),
            )
        )
    return Section("Orbits", tuple(blocks))


def _orbits_caption(analysis: Analysis, end: str) -> str:
    from tdbmon.figures.style import has_circle

    if has_circle(analysis, end):
        circle = "the clearance circle at the static load; the shaft goes beyond it while an impact deflects bearing and support"
    else:
        circle = (
            "the gap of the drawing about the probes' zero, since no clearance circle was found; where the shaft really"
            " touches is not known"
        )
    start = "the record's first sample" if analysis.release is None else "the release"
    whirl = analysis.whirl.get(end)
    turns = ""
    if not has_circle(analysis, end) and whirl is not None and whirl.worst is not None:
        turns = " The panel beside it shows some turns of the longest whirl."
    dots = "; a dot marks each pulse of the keyphasor" if analysis.angle is not None else ""
    return (
        f"Orbits of {end} from {start} on, equal axes, looking at the machine with x right and y up. Black: {circle}."
        f" The arrow shows the rotor's sense of rotation{dots}.{turns}"
    )


def _centreline_caption(analysis: Analysis, courses: Courses) -> str:
    from tdbmon.figures.centreline import any_settled, turns

    why = "the shaft stands still" if analysis.has_speed else "no speed is known"
    colour = "speed" if turns(analysis) else f"time, since {why}"
    missing = left_out(analysis, courses, "no clearance circle, or too short a motion in it,")
    below = " Below: after settling, magnified." if any_settled(analysis, courses) else ""
    return (
        f"Shaft centreline: the mean position over successive windows, coloured by the {colour}.{below} The swing in the"
        f" clearance raises the mean above the circle's bottom until it has died away.{missing}"
    )


def _filtered(analysis: Analysis) -> Block:
    from tdbmon.figures.filtered_orbit import filtered_orbit, telling_stretch

    try:
        stretch = telling_stretch(analysis)
    except InputError as error:
        return Paragraph(f"Filtered orbits are not drawn: {error}.")
    return Figure(
        "filtered-orbits",
        f"The settled orbit over {stretch.revolutions} revolutions: unfiltered, its 1X (fitted over these revolutions, about"
        " the mean position), and the mean over the revolutions at equal shaft angles, with the standard deviation of one"
        " revolution about it. The swing in the clearance is not locked to the shaft but does not cancel completely over so"
        " few revolutions: if the averaged orbit does not close, a part of the swing remains. A dot marks the pulse of the"
        " keyphasor."
        f" {runout_sentence(analysis.checks)}{left_out(analysis, stretch.ends, 'no clearance circle')}",
        "For each end three panels of the settled orbit: not filtered, filtered to 1X, and averaged over revolutions.",
        partial(filtered_orbit, analysis),
    )
