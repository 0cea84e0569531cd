"""Report section: the whole coast-down simulated with the calibrated values, compared with the record."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from tdbmon.estimate import Estimate
from tdbmon.quantity import off_by, percent, short, words
from tdbmon.record.slow_roll import COMPENSATED, runout_words
from tdbmon.remarks import and_more
from tdbmon.report.document import Block, Figure, Paragraph, Row, Section, Table

if TYPE_CHECKING:
    from tdbmon.analysis.lines import Line
    from tdbmon.identify.coast_down import CoastDown
    from tdbmon.identify.coast_down_comparison import Course, Resonance
    from tdbmon.identify.natural_frequencies import NaturalFrequencies

_LISTED = 16  # lines


def section(whole: CoastDown, natural: NaturalFrequencies, fitted_to: float) -> Section:
    """Return features, resonances, time courses and waterfalls of the record and of its simulation.

    Parameters
    ----------
    whole : CoastDown
    natural : NaturalFrequencies
        Source of the critical speeds.
    fitted_to : float
        End of the fitted interval, s after the release.
    """
    from tdbmon.figures.coast_down import coast_down
    from tdbmon.figures.coast_down_orders import coast_down_orders
    from tdbmon.figures.coast_down_waterfalls import coast_down_waterfalls
    from tdbmon.identify.coast_down_comparison import course, resonances

    found, passed = course(whole), resonances(whole, natural)
    runout = f"{COMPENSATED if runout_words(whole.measured.checks) == COMPENSATED else 'runout'} in both"
    blocks: list[Block] = [
        Paragraph(
            f"The calibrated model, simulated to the record's end and recorded by sensors with the same noise; both records"
            f" went through the same analysis. Only the first {fitted_to * 1e3:.0f} ms were fitted: all that follows is a"
            " prediction. Paths with impacts diverge within the first tenths of a second, so that later amplitudes agree in"
            f" size at best. The simulation took {whole.took:.0f} s of processor time."
        ),
        Paragraph(parting(found)),
        _scalars(whole),
        _lines(whole),
    ]
    if passed:
        blocks.append(_resonances(passed))
    blocks += [
        Figure(
            "coast-down",
            "Speed, difference between simulation and measurement (in Hz and in percent), and rms displacement at each"
            " end. Its final level is noise and runout.",
            "Speed and rms displacement against time, measured and simulated.",
            partial(coast_down, found, runout),
        ),
        Figure(
            "coast-down-waterfalls",
            "Waterfalls of the measured and of the simulated record with one scale of colours. Vertical lines are swings,"
            " other modes of the resting rotor and their combinations; curved lines follow the speed. The mains and all else that"
            " only the record contains is missing on the right.",
            "Maps of amplitude over frequency and time, measured on the left and simulated on the right.",
            partial(coast_down_waterfalls, whole),
        ),
    ]
    if whole.measured.tracks is not None:
        blocks.append(
            Figure(
                "coast-down-orders",
                "1X and 2X through the run-down. Peaks at the dotted speeds are resonances of the resting rotor.",
                "Amplitude of 1X and 2X against speed, measured and simulated, for each end.",
                partial(coast_down_orders, whole, passed),
            )
        )
    return Section("The whole coast-down, simulated (fitted model)", tuple(blocks))


def parting(found: Course) -> str:
    """Return a text on the times at which simulation and record diverge in speed and motion."""
    from tdbmon.identify.coast_down_comparison import MOTION_APART, SPEED_APART

    said = []
    left = found.simulated_speed - found.measured_speed
    if np.isfinite(left).any():
        at = int(np.nanargmax(np.abs(left)))
        said.append(
            f"The speeds differ by at most {left[at]:+.2f} Hz (simulated less measured, {found.time[at]:.1f} s after the"
            " release)".replace("-", "−")
            + (
                f" and by more than {percent(SPEED_APART)} for the first time {found.speed_parts:.0f} s after it."
                if found.speed_parts is not None
                else f" and nowhere by more than {percent(SPEED_APART)}."
            )
        )
    said.append(
        f"The rms of the motion in windows of a second differs by more than a factor of {MOTION_APART:g} for the first time"
        f" {found.motion_parts:.0f} s after the release."
        if found.motion_parts is not None
        else f"The rms of the motion in windows of a second nowhere differs by more than a factor of {MOTION_APART:g}."
    )
    return " ".join(said)


def _scalars(whole: CoastDown) -> Table:
    from tdbmon.identify.coast_down_comparison import scalars

    rows = tuple(Row((name, words(a), words(b), _apart(a, b))) for name, a, b in scalars(whole))
    header = ("Quantity", "Measured", "Simulated", "Error of the simulation")
    return Table("Both records, analysed in the same way (95 % intervals of the analysis)", header, rows)


def _apart(measured: Estimate, simulated: Estimate) -> str:
    if not measured.value or simulated.value is None:
        return "–"
    return off_by(simulated.value / measured.value)


def _lines(whole: CoastDown) -> Table:
    from tdbmon.identify.coast_down_comparison import paired_lines

    pairs = paired_lines(whole)
    rows = []
    for name, a, b in pairs[:_LISTED]:
        apart = "–" if a is None or b is None else _place_apart(a, b)
        rows.append(Row((name, _place(a), _place(b), apart, _height(a), _height(b))))
    more = len(pairs) - _LISTED
    caption = "Lines of both spectra" + and_more(more)
    header = ("Line", "Measured", "Simulated", "Error", "Amplitude measured", "Amplitude simulated")
    return Table(caption, header, tuple(rows))


def _place(line: Line | None) -> str:
    if line is None:
        return "none"
    return f"{line.order:.4g}X" if line.kind == "order" and line.order is not None else short(line.frequency)


def _place_apart(a: Line, b: Line) -> str:
    if a.kind == "order" and a.order is not None and b.order is not None:
        return off_by(b.order / a.order)
    return _apart(a.frequency, b.frequency)


def _height(line: Line | None) -> str:
    return "–" if line is None else short(line.amplitude)


def _resonances(passed: tuple[Resonance, ...]) -> Table:
    rows = tuple(
        Row(
            (
                f"{each.order:g}X meets mode {each.mode + 1}",
                f"{each.critical:.1f} Hz",
                *(
                    "no peak" if peak is None else f"{peak[0]:.1f} Hz, {peak[1] * 1e6:.2g} µm 0-pk"
                    for peak in (each.measured, each.simulated)
                ),
            )
        )
        for each in passed
    )
    caption = "Resonances passed: computed speed, and the peak of the order's circular amplitude within a tenth of it"
    return Table(caption, ("Resonance", "Computed", "Measured", "Simulated"), rows)
