"""Report section: spectral lines, a table of those found and the maps that show them."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from tdbsim.errors import InputError

from tdbmon.analysis.result import Analysis
from tdbmon.analysis.swing import predicted_ways
from tdbmon.quantity import short, words
from tdbmon.report.document import Block, Figure, Paragraph, Row, Section, Table

if TYPE_CHECKING:
    from tdbmon.analysis.lines import Line

_DRAWN = 4  # least turns of a whirl that shows in a spectrum
_LISTED = 24
_TITLE = "Spectra and lines"


def section(analysis: Analysis) -> Section | None:
    """Return lines, waterfall, cascade and full spectra; None without displacement."""
    if analysis.planes is None:
        return None
    from tdbmon.figures.cascade import cascade, slowing_spectra
    from tdbmon.figures.full_spectrum import full_spectrum
    from tdbmon.figures.spectral_map import spectra_of
    from tdbmon.figures.waterfall import waterfall

    try:
        spectra = spectra_of(analysis)
    except InputError as error:
        return Section(_TITLE, (Paragraph(f"None: {error}."),))
    blocks: list[Block] = [_lines(analysis), *_drifting(analysis), *_whirling(analysis)]
    reading = (
        "Colour: amplitude in dB re 1 µm 0-pk, dark below the noise."
        + (" Dashed: orders of the speed." if analysis.has_speed else " Without a speed there are no orders.")
        + (
            " Dotted: lines of constant frequency that were found (unnamed if sums or multiples of others)."
            if any(line.kind != "order" for line in analysis.lines)
            else ""
        )
    )
    if not np.isfinite(spectra.amplitude).all():
        reading += " White: samples are missing."
    turning = "A line along a dashed one is an order of the speed; a" if analysis.has_speed else "A"
    blocks.append(
        Figure(
            "waterfall",
            f"Waterfall, vertical and horizontal at each end. {reading} {turning}"
            " vertical line is a swing, a bounce, a conical or a bending mode of the rotor on its touchdown bearings, or the"
            " mains.",
            "Maps of amplitude over frequency and time for each end and direction.",
            partial(waterfall, analysis),
        )
    )
    try:
        slowing_spectra(analysis)
    except InputError as error:
        blocks.append(Paragraph(f"The cascade is not drawn: {error}."))
    else:
        blocks.append(
            Figure(
                "cascade",
                f"Cascade: the same spectra against speed, where orders are straight rays. {reading}",
                "Maps of amplitude over frequency and speed for each end and direction, with straight order rays.",
                partial(cascade, analysis),
            )
        )
    blocks.append(
        Figure(
            "full-spectrum",
            "Full spectra of parts of the record: amplitude of the forward circle, with the rotation (right, blue), and of the"
            " backward one (left, orange). Equal peaks on both sides are motion along a line; a peak on the left alone is"
            " backward whirl.",
            "For each end and part of the record, amplitude over frequency from backward to forward.",
            partial(full_spectrum, analysis),
        )
    )
    return Section(_TITLE, tuple(blocks))


def _lines(analysis: Analysis) -> Block:
    if not analysis.lines:
        why = (
            "none stands out"
            if analysis.has_speed
            else "without a speed, orders cannot be distinguished from constant frequencies"
        )
        return Paragraph(f"No lines are listed: {why}.")
    strongest = sorted(analysis.lines, key=lambda line: -(line.amplitude.value or 0.0))[:_LISTED]
    rows = tuple(
        _row(line)
        for line in sorted(strongest, key=lambda line: (line.kind, line.order or 0.0, line.frequency.value or 0.0))
    )
    more = len(analysis.lines) - len(strongest)
    caption = "Lines found (95 % intervals). Amplitude: the greatest; for an order, only where no constant line crosses it"
    caption += f"; {more} weaker ones are left out" if more > 0 else ""
    return Table(caption, ("Line", "Kind", "End", "Frequency or order", "Direction", "Amplitude", "Seen"), rows)


def _whirling(analysis: Analysis) -> list[Block]:
    """Return a remark on whirl around the clearance, whose spectral line is no natural frequency of the resting rotor."""
    turns = [
        f"{end} at {short(whirl.frequency)}, {'against' if whirl.worst.turns < 0 else 'with'} the rotation"
        for end, whirl in analysis.whirl.items()
        if whirl.worst is not None and whirl.frequency.known and abs(whirl.worst.turns) >= _DRAWN
    ]
    return [Paragraph(f"The shaft's whirl around its clearance gives a line too: {'; '.join(turns)}.")] if turns else []


def _drifting(analysis: Analysis) -> list[Block]:
    """Return a table of strong swings whose drifting frequency gives no line, with the range of the frequency."""
    if not analysis.drifting:
        return []
    ways = predicted_ways(analysis.machine, analysis.rotor)
    named = {f"swing {number}": way for number, way in enumerate(ways, start=1)}
    rows = tuple(
        Row(
            (
                f"{swing.name} ({named[swing.name]})",
                swing.end,
                f"{short(swing.lowest)} to {short(swing.highest)}",
                words(swing.amplitude),
                f"{swing.first_s:.1f} to {swing.last_s:.1f} s",
            )
        )
        for swing in analysis.drifting
    )
    caption = (
        "Swings in the clearance that give no line, since their frequency changes with their own and each other's amplitude."
        " Amplitude: the greatest horizontal one, at the end where it is larger"
    )
    return [Table(caption, ("Swing", "End", "Frequency, lowest to highest", "Amplitude", "Seen"), rows)]


def _row(line: Line) -> Row:
    place = f"{line.order:.4g}X" if line.kind == "order" and line.order is not None else words(line.frequency)
    seen = f"{line.first_s:.1f} to {line.last_s:.1f} s"
    return Row((line.name, line.kind, line.end, place, line.direction, words(line.amplitude), seen))
