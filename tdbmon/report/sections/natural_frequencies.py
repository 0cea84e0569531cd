"""Report section: natural frequencies of the resting rotor, with critical speed map, Campbell diagram and matching lines."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from tdbmon.identify.natural_frequencies import ORDERS, RestingMode
from tdbmon.quantity import off_by, why_no_interval, words
from tdbmon.report.document import Block, Figure, Paragraph, Row, Section, Table

if TYPE_CHECKING:
    from tdbmon.analysis.lines import Line
    from tdbmon.analysis.result import Analysis
    from tdbmon.identify.fitted import FittedDrop

_NEAR = 0.03  # relative distance within which a line is attributed to a mode


def section(analysis: Analysis, fitted: FittedDrop) -> Section:
    """Return the natural frequencies of the calibrated machine beside the record's spectral lines of constant frequency."""
    from tdbmon.figures.campbell import campbell
    from tdbmon.figures.critical_speed_map import critical_speed_map

    found = fitted.natural_frequencies
    lines = own_lines(analysis.lines)
    stiffness = "; ".join(f"{end} {words(value)}{why_no_interval(value)}" for end, value in found.support.items())
    series = "; ".join(f"{end.end} {end.series / 1e6:.1f} MN/m" for end in found.ends)
    blocks: list[Block] = [
        Paragraph(
            "The rotor at rest at the bottom of its clearances: vertically on contact, balls and support with the support's"
            " mass, linearised about the static load; sideways a pendulum. No line of the record was used: supports"
            f" and clearances are those fitted to the first contacts (support stiffness {stiffness}; with balls and contact in"
            f" series {series})."
        ),
        _modes(found.modes, lines),
        Figure(
            "critical-speed-map",
            "Natural frequencies against support stiffness. Dots: the fitted stiffness, whose interval is drawn in blue where"
            " it is wide enough to be seen. Horizontal lines in the spectra on the right have a constant frequency;"
            " dashed white: 1X and 2X. The support's mass adds modes even for soft supports: where two curves approach each"
            " other, rotor and support exchange their parts.",
            "Curves of natural frequencies over support stiffness on a logarithmic axis, with the spectra of the record beside.",
            partial(critical_speed_map, found, analysis, lines),
        ),
        Figure(
            "campbell",
            "Campbell diagram. A line of the record is drawn over the speeds at which it stood out. Vertical and sideways"
            " motion are coupled by the gyroscopic moment alone, which is small here where the curves are level.",
            "Natural frequencies over speed, with rays of the orders of rotation and the measured lines.",
            partial(campbell, found, analysis, lines),
        ),
    ]
    if fitted.calibration.machine.effects:
        blocks.append(Paragraph("These frequencies do not include the effects in the machine file."))
    return Section("Natural frequencies on the touchdown bearings (fitted model)", tuple(blocks))


def own_lines(lines: Sequence[Line]) -> list[Line]:
    """Return the lines of constant frequency that are neither sums or multiples of others nor the mains."""
    known = [line for line in lines if line.kind == "constant" and line.frequency.value is not None]
    return [line for line in known if not line.combined]


def nearest(mode: RestingMode, lines: Sequence[Line]) -> Line | None:
    """Return the line nearest to a natural frequency; None if none is within 3 %."""
    frequency = mode.frequency.value or 0.0
    near = [line for line in lines if abs((line.frequency.value or 0.0) / frequency - 1) < _NEAR]
    return min(near, key=lambda line: abs((line.frequency.value or 0.0) - frequency), default=None)


def _modes(modes: Sequence[RestingMode], lines: Sequence[Line]) -> Table:
    rows = []
    for k, mode in enumerate(modes):
        line = nearest(mode, lines)
        measured, apart = "none", "–"
        if line is not None and line.frequency.value is not None and mode.frequency.value is not None:
            measured = f"{line.name}: {words(line.frequency)}"
            apart = off_by(mode.frequency.value / line.frequency.value)
        massless = "–" if mode.massless is None else f"{mode.massless:.1f} Hz"
        critical = " / ".join("–" if each is None else f"{each:.1f} Hz" for each in mode.critical)
        rows.append(Row((f"{k + 1}, {mode.direction}", words(mode.frequency), massless, measured, apart, critical)))
    header = (
        "Mode",
        "Computed, standstill",
        "Massless supports",
        "Line of the record",
        "Error of computation",
        "Speed where met by " + " / ".join(f"{order:g}X" for order in ORDERS),
    )
    caption = "Natural frequencies (95 % intervals of the calibration alone, without simplifications of the model)"
    return Table(caption, header, tuple(rows))
