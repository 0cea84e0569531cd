"""Report section: 1X through the run-down."""

from __future__ import annotations

from functools import partial

from tdbsim.errors import InputError

from tdbmon.analysis.result import Analysis
from tdbmon.record.slow_roll import runout_sentence
from tdbmon.report.document import Figure, Paragraph, Section


def section(analysis: Analysis) -> Section | None:
    """Return the Bode and polar plots of 1X."""
    if analysis.planes is None:
        return None
    from tdbmon.figures.bode import bode, has_polar, tracked_1x

    title = "1X through the run-down"
    try:
        first = tracked_1x(analysis)
    except InputError as error:
        return Section(title, (Paragraph(f"Bode and polar plots are not drawn: {error}."),))
    polar, drawn = " No forward circle exceeds the noise: there is no polar plot.", "Bode plot"
    if has_polar(first.sel(end=analysis.seen_ends)):
        polar = " Below: the forward circle as a polar plot, grey below 3 standard deviations."
        drawn = "Bode plot and polar plot"
    caption = (
        f"1X against speed over windows of {first.attrs['window_revolutions']} revolutions: amplitude of x and y with their"
        f" 95 % band, and phase lag (positive against rotation) where the amplitude exceeds the noise.{polar} Where a"
        f" swing crosses 1X it is taken as 1X: the band is wider there. {runout_sentence(analysis.checks)}"
    )
    alt = f"{drawn} of amplitude and phase lag of 1X, for each end."
    return Section(title, (Figure("bode", caption, alt, partial(bode, analysis)),))
