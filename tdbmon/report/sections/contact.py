"""Report section: the first contact of each end, and the contacts after it."""

from __future__ import annotations

from functools import partial

from tdbmon.analysis.contact_events import Contact
from tdbmon.analysis.result import Analysis, EndResult
from tdbmon.analysis.summary import FORCES_TELL
from tdbmon.estimate import Estimate, since
from tdbmon.quantity import whole_degrees, words
from tdbmon.report.document import Block, Figure, Paragraph, Row, Section, Table, sentence
from tdbmon.report.sections.findings import RESTITUTION, above_one, record_time
from tdbmon.report.sections.left_out import left_out

_LISTED = 10


def section(analysis: Analysis, fitted: bool = False) -> Section | None:
    """Return the section on contacts; if the simulation is `fitted`, its own sections follow and the hint to it is left out."""
    ends = list(analysis.ends.values())
    if not any(end.events for end in ends):
        return None
    release = analysis.release_time
    blocks: list[Block] = [
        Paragraph(f"The first contact at {end.name} is not estimated: {end.no_contact}.")
        for end in ends
        if end.first_contact is None
    ]
    blocks += [sentence(FORCES_TELL)] * (analysis.forces_tell_contacts and not fitted)
    told = [end for end in ends if end.first_contact is not None]
    if told:
        blocks = _first(analysis, told, blocks)
    blocks += [_list(end.name, end.events, release) for end in ends if end.events]
    return Section("First contact" if told else "Contacts", tuple(blocks))


def _first(analysis: Analysis, ends: list[EndResult], missing: list[Block]) -> list[Block]:
    """Return the table of quantities of the first contacts and their figure."""
    from tdbmon.figures.first_contact import first_contact, touched_ends

    rows = []
    for name, unit, pick in _QUANTITIES:
        found: list[Estimate] = [getattr(end.first_contact, pick) for end in ends]
        if unit == "release":
            cells = [words(since(each, analysis.release_time)) + record_time(each) for each in found]
        else:
            cells = [words(each, unit) for each in found]
        name += above_one(found) if pick == "restitution" else ""
        rows.append(Row((name, *cells)))
    rows.append(Row(("Single-mass stiffness π² M/(t₂ − t₁)²", *(words(end.stiffness) for end in ends))))
    rows.append(Row(("Static load", *(f"{end.load:.0f} N (from the machine file)" for end in ends))))
    header = ("Quantity", *(end.name for end in ends))
    blocks: list[Block] = [
        Paragraph(
            "A contact begins when the shaft centre passes the touching radius, which is the radius at rest less the"
            " elastic part of the travel; t₁ and t₂ are the instants at which it passes the radius at rest, on its way"
            " out and back. The single-mass stiffness assumes that the time between them is half a period of the end's share of"
            " the rotor mass. It is a rough estimate for bearing and support in series; its interval includes the"
            " error of this simple model, as found on simulated contacts."
        ),
        *missing,
        Table("The first contact (95 % intervals; times from the release [in the record])", header, tuple(rows)),
    ]
    if touched := touched_ends(analysis):
        caption = (
            "Displacement along the direction of the first contact, outwards from the clearance centre. The free fall is"
            " computed from the state at the release without any fit. The half sine is the motion that the single-mass"
            f" stiffness assumes: its misfit shows how far to trust it.{left_out(analysis, touched, 'no first contact')}"
        )
        alt = "For each end, displacement against time through the fall, the first contact and the rebound."
        blocks.append(Figure("first-contact", caption, alt, partial(first_contact, analysis)))
    return blocks


_QUANTITIES = (
    ("First touch", "release", "touch"),
    ("Duration", "ms", "duration"),
    ("t₁: radius at rest passed on the way out", "release", "static_in"),
    ("t₂: radius at rest passed on the way back", "release", "static_out"),
    ("Rebound from the touching radius", "um", "rebound"),
    (RESTITUTION, "1", "restitution"),
)


def _list(end: str, events: tuple[Contact, ...], release: Estimate) -> Table:
    origin = release.value or 0.0
    rows = tuple(
        Row(
            (
                f"{i + 1}",
                f"{(c.start - origin) * 1e3:.2f} ms",
                f"{(c.end - c.start) * 1e3:.2f} ms" if c.seen else "incomplete",
                whole_degrees(c.angle),
                f"{c.depth * 1e6:.0f} µm",
            )
        )
        for i, c in enumerate(events[:_LISTED])
    )
    more = f"; {len(events) - _LISTED} more follow" if len(events) > _LISTED else ""
    start = "from the release" if release.known else "from the first sample"
    header = ("Contact", f"Begins, {start}", "Duration", "Direction from +x", "Depth beyond the touching radius")
    return Table(f"{end}: contacts before settling{more}", header, rows)
