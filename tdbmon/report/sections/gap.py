"""Report section: the clearance circle of each end, and its parts: air gap, ball clearance and deflection."""

from __future__ import annotations

from functools import partial

from tdbmon.analysis.result import Analysis, EndResult
from tdbmon.estimate import Estimate
from tdbmon.quantity import percent, words
from tdbmon.report.document import Block, Figure, Paragraph, Row, Section, Table
from tdbmon.report.sections.left_out import left_out


def section(analysis: Analysis) -> Section | None:
    """Return the section on the gap of each end; None if no end is measured or there is no drop."""
    ends = [end for end in analysis.ends.values() if end.seen]
    if not ends or not analysis.falls:
        return None
    from tdbmon.figures.gap_map import gap_map
    from tdbmon.figures.style import circled_ends

    words_ = (
        "The radius of the shaft centre at rest is the sum of the air gap, the balls' travel (half of their clearance, and"
        " their deflection under the weight), the contact and the support. The circle through the settled"
        " positions gives that radius; the swing frequency in the clearance gives it independently. The air gap is"
        " this radius less the travel, which is computed from the machine file with its tolerances."
    )
    blocks: list[Block] = [Paragraph(words_)]
    header = ("Quantity", *(end.name for end in ends))
    told: list[set[str]] = [set() for _ in ends]
    rows = [_row(name, [pick(end) for end in ends], told) for name, pick in _PARTS]
    blocks.append(Table("Parts of the radius at rest (95 % intervals)", header, tuple(rows)))
    agreement = tuple(Row((end.name, _agreement(end))) for end in ends)
    blocks.append(
        Table("The same radius by two independent methods", ("End", "Arc of settled positions, and swing"), agreement)
    )
    if circled := circled_ends(analysis):
        caption = (
            "Above: settled positions, the circle fitted to them with its interval (dashed), the air gap inside it and the"
            " gap of the drawing about the same centre. Below: the settled radius less the fitted one against the angle,"
            " since the deviations are micrometres. The shaft rolls only on an arc about the bottom: above it the circle"
            f" is extrapolated.{_beyond(analysis, circled)}{left_out(analysis, circled, 'no clearance circle')}"
        )
        alt = "For each end a circle with settled positions at its bottom, and a strip of radial deviations over the angle."
        blocks.append(Figure("gap-map", caption, alt, partial(gap_map, analysis)))
    return Section("The gap", tuple(blocks))


def _beyond(analysis: Analysis, ends: list[str]) -> str:
    """Return the number of positions beyond the scale of the residual plot as text; "" if there are none."""
    from tdbmon.figures.gap_map import MIDDLE, residual_radius

    strips = {end: found for end in ends if (found := residual_radius(analysis, end)) is not None}
    if not any(strip.beyond for strip in strips.values()):
        return ""
    told = ", ".join(f"{strip.beyond} of {len(strip.residual)} at {end}" for end, strip in strips.items())
    return (
        f" The scale of the residual covers all bars and the middle {percent(MIDDLE)} of the positions; triangles at its edge"
        f" mark those beyond ({told})."
    )


def _computed(value: float, sigma: float | None = None) -> Estimate:
    if sigma is None:
        return Estimate(value, unit="um", method="machine file's nominal values", why="nominal")
    return Estimate.from_sigma(value, sigma, "um", "machine file with its tolerances")


_PARTS = (
    ("Radius at rest (measured)", lambda end: end.circle.radius),
    ("less travel in the balls (nominal)", lambda end: _computed(end.travel.balls)),
    ("less contact of shaft and ring (nominal)", lambda end: _computed(end.travel.contact)),
    ("less support (nominal)", lambda end: _computed(end.travel.support)),
    ("total travel, with tolerances", lambda end: _computed(end.travel.total, end.travel.sigma)),
    ("= air gap", lambda end: end.air_gap),
    ("Clearance centre x", lambda end: end.circle.centre[0]),
    ("Clearance centre y", lambda end: end.circle.centre[1]),
    ("Settled radius, 2.5 % quantile", lambda end: end.circle.lower),
    ("Settled radius, 97.5 % quantile", lambda end: end.circle.upper),
    ("Second harmonic of the radius", lambda end: end.circle.oval),
)


def _row(name: str, values: list[Estimate], told: list[set[str]]) -> Row:
    """Return a table row; a reason already given for that end in an earlier row is not repeated."""
    cells = []
    for value, above in zip(values, told, strict=True):
        cells.append("not estimated, as above" if value.why in above and not value.known else words(value))
        above.add(value.why)
    return Row((name, *cells))


def _agreement(end: EndResult) -> str:
    if end.gap is None:
        return f"no circle: {end.unsettled}"
    arc, swing = words(end.gap.from_arc), words(end.gap_from_swing)
    if end.gap.agrees is None:
        return f"arc only: {arc}; swing: {swing}"
    return f"arc {arc}, swing {swing}: they agree, and both determine the circle"
