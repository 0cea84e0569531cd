"""Report section: where the residual exceeds the noise, by phase, probe, direction, order and frequency."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

from tdbmon.diagnosis.evidence import Evidence
from tdbmon.diagnosis.left_over import DIRECTIONS, PHASES, LeftOver, Line, by_direction, by_phase, spectra
from tdbmon.report.document import Block, Figure, Paragraph, Row, Section, Table

_STANDS_OUT = 2.0  # times the noise
_LINES = 2  # peaks of each spectrum that are listed


def section(evidence: Evidence) -> Section:
    """Return maps, tables and spectra of the plain model's residual."""
    from tdbmon.figures.residual_map import residual_map
    from tdbmon.figures.residual_spectrum import residual_spectrum

    machine = evidence.diagnosis.machine
    blocks: list[Block] = [
        Figure(
            "residual-map",
            "When the residual of each probe rises out of the noise. A late and gradual rise comes from the divergence of"
            " simulations with impacts; an early rise, or one at a single end or probe, shows an effect.",
            "A heat map: one row per probe and drop, one column per half millisecond, colour: residual over noise.",
            partial(residual_map, evidence.left),
        ),
        *(phase_table(model, drops, evidence) for model, drops in evidence.left.items()),
    ]
    told = [left for left in evidence.plain_left if left.sees_ends]
    if not told:
        blocks.append(
            Paragraph("The usable probes do not give both directions at both ends: no directions, no full spectra.")
        )
        return Section(_TITLE, tuple(blocks))
    blocks.append(_directions(evidence))
    found = [each for left in told for each in spectra(left, machine)]
    if not found:
        blocks.append(Paragraph("No drop has a stretch without missing samples that is long enough for a spectrum."))
        return Section(_TITLE, tuple(blocks))
    lines, resolution = [line for each in found for line in each.lines(_LINES)], max(each.resolution for each in found)
    blocks += [
        Figure(
            "residual-spectrum",
            "Residual of the plain model, as forward and backward whirl. Dotted: the level that noise alone exceeds in one"
            " spectrum of a hundred. Peaks of several drops that coincide on the left have a common frequency, on the right a"
            f" common order. Drops are short: the frequency of a peak is known only to ± {resolution / 2:.0f} Hz.",
            "For each end, amplitude of the residual against frequency and against order, one line per drop.",
            partial(residual_spectrum, found),
        ),
        _lines(lines, resolution),
    ]
    return Section(_TITLE, tuple(blocks))


_TITLE = "Where and when the residual exceeds the noise"


def phase_table(model: str, drops: Sequence[LeftOver], evidence: Evidence) -> Table:
    """Return a table of the whitened residual rms of each probe by phase, over all drops."""
    machine = evidence.diagnosis.machine
    rows = []
    for probe, values in by_phase(drops, machine).items():
        end = machine.probes[[p.name for p in machine.probes].index(probe)].end
        loud = "attention" if any(value > _STANDS_OUT for value in values) else "plain"
        rows.append(Row((f"{probe} ({end})", *(_times(value) for value in values)), loud))  # type: ignore[arg-type]
    header = ("Probe (end)", *(phase.capitalize() for phase in PHASES))
    caption = f"Residual of the {model} by phase, times the noise (whitened rms; marked beyond {_STANDS_OUT:g})"
    return Table(caption, header, tuple(rows))


def _directions(evidence: Evidence) -> Table:
    header = ("End, model", *DIRECTIONS)
    rows = []
    for model, drops in evidence.left.items():
        for end, values in zip(evidence.diagnosis.machine.ends, by_direction(drops), strict=True):
            rows.append(Row((f"{end}, {model.removesuffix(' model')}", *(_times(value) for value in values))))
    caption = (
        "Residual by direction from the release on, rms over that of the noise (x right, y up; radial away from the"
        " bearing's centre, tangential a quarter turn counter-clockwise from it)"
    )
    return Table(caption, header, tuple(rows))


def _lines(lines: Sequence[Line], resolution: float) -> Table | Paragraph:
    if not lines:
        return Paragraph("No peak of the residual's spectra exceeds the level of noise alone.")
    rows = tuple(
        Row(
            (
                line.drop,
                line.end,
                line.words,
                line.order_words,
                f"{line.amplitude * 1e6:.2f} µm",
                f"{line.amplitude / line.noise:.0f}",
            )
        )
        for line in lines
    )
    caption = f"Highest peaks of the plain model's residual (0-pk; frequencies within ± {resolution / 2:.0f} Hz)"
    return Table(caption, ("Drop", "End", "Frequency", "Order", "Amplitude", "Times the noise"), rows)


def _times(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.1f}"
