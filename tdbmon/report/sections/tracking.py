"""1X through the run-down."""

from __future__ import annotations

from functools import partial

import numpy as np

from tdbmon.analysis.result import Analysis
from tdbmon.report.document import Block, Figure, Paragraph, Section


def section(analysis: Analysis) -> Section | None:
    """Return the Bode and polar plots of 1X."""
    if analysis.planes is None:
        return None
    title = "1X through the run-down"
    tracks = analysis.tracks
    if tracks is None:
        return Section(
            title, (Paragraph("Not tracked: the record holds no keyphasor pulses, so that there is no phase."),)
        )
    if tracks.sizes["time"] < 2:
        return Section(title, (Paragraph("Not tracked: the keyphasor covers fewer than 16 revolutions."),))
    if not np.isfinite(tracks.amplitude).any():
        return Section(title, (Paragraph("Not tracked: no window of it has all its samples."),))
    from tdbmon.figures.bode import bode

    window = tracks.attrs["window_revolutions"]
    blocks: tuple[Block, ...] = (
        Figure(
            "bode",
            f"1X against speed over windows of {window} revolutions: amplitude of x and y with their 95 % band, phase lag"
            " (positive against rotation) where the amplitude stands out of the noise, and the forward circle as a polar"
            " plot, grey where it is less than 3 standard deviations. Where a swing crosses 1X it is read as 1X: the band"
            " widens there. Runout is not taken off.",
            "Bode plot of amplitude and phase lag, and polar plot of 1X, for each end.",
            partial(bode, analysis),
        ),
    )
    return Section(title, blocks)
