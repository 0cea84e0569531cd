"""Orbits of each end and the shaft centreline."""

from __future__ import annotations

from functools import partial

from tdbmon.analysis.result import Analysis
from tdbmon.report.document import Block, Figure, Section


def section(analysis: Analysis) -> Section | None:
    """Return the orbits, an end a figure, and the centreline."""
    ends = [name for name, end in analysis.ends.items() if end.plane != "none"]
    if not ends:
        return None
    from tdbmon.figures.centreline import centreline
    from tdbmon.figures.orbit_sequence import orbit_sequence

    blocks: list[Block] = [
        Figure(
            f"orbits-{i + 1}",
            f"Orbits of {end} from the release on, equal axes, looking at the machine with x right and y up. Black: the"
            " clearance circle at the static load; the shaft goes beyond it while an impact deflects bearing and support."
            " The arrow turns as the rotor does; a dot marks each pulse of the keyphasor.",
            f"Six orbit panels of {end}: fall and first contact, following contacts, settled, and run-down.",
            partial(orbit_sequence, analysis, end),
        )
        for i, end in enumerate(ends)
    ]
    if any(analysis.ends[end].gap is not None for end in ends):
        blocks.append(
            Figure(
                "centreline",
                "Shaft centreline: the mean position over successive windows, coloured by the speed. The swing in the"
                " clearance raises the mean above the circle's bottom until it has died away.",
                "For each end the mean shaft position in the clearance circle, and magnified from settling on.",
                partial(centreline, analysis),
            )
        )
    return Section("Orbits", tuple(blocks))
