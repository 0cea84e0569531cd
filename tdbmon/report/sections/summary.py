"""The first page: what happened, whether the record can be trusted, the results, and their comparison with the drawing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from tdbsim.machine import Tolerant

from tdbmon.analysis.result import NO_DROP, Analysis
from tdbmon.analysis.summary import FORCES_TELL
from tdbmon.estimate import Estimate
from tdbmon.identify.model_share import FORCES_HOLD
from tdbmon.quantity import counted, decapitalised, moment, number, percent, rpm, words
from tdbmon.report.document import Block, Paragraph, Row, Section, Table, Tone, Verdict, sentence
from tdbmon.report.sections.findings import (
    RESTITUTION,
    Finding,
    above_one,
    end_findings,
    rotor_findings,
)
from tdbmon.report.sections.forces import hardest

if TYPE_CHECKING:
    from tdbmon.identify.fitted import FittedDrop

_SCALE = (
    "Intervals of lengths do not include an error of the probes' scale factor, for which API 670 allows 5 %. The radius from the"
    " swing is computed from frequencies and does not depend on it."
)
_FEW = 2  # most quantities named as exceptions ("all but ...") instead of a full list


def section(analysis: Analysis, fitted: FittedDrop | None = None) -> Section:
    """Return the summary; with a fitted model, peak forces and stresses precede the other results."""
    blocks: list[Block] = [Paragraph(_story(analysis, fitted)), _trust(analysis)]
    against = _against_drawing(analysis)
    blocks += [_gap_verdict(row) for row in against if row.tone == "attention"]
    blocks += _whirl_verdicts(analysis)
    if fitted is not None:
        blocks += _hardest(fitted, analysis)
    blocks += _rotor_table(analysis)
    if analysis.rundown is not None and (analysis.rundown.decay_time.known or analysis.rundown.drag_torque.known):
        blocks.append(
            Paragraph(
                "Decay time: the interval includes a possible error of the drag law. Drag: from that law and the polar inertia in"
                " the machine file; its interval includes only the noise of the speed signal. Standstill: between the last"
                " certain rotation and the first certain rest, or from the law."
            )
        )
    if analysis.ends:
        blocks += _ends_table(analysis)
    blocks += _not_estimated(analysis)
    blocks += [sentence(FORCES_TELL)] * (analysis.forces_tell_contacts and fitted is None)
    if against:
        header = ("Quantity", "The record says", "The drawing says", "Verdict")
        blocks.append(Table("The record against the drawing", header, tuple(against)))
    return Section("Summary", tuple(blocks))


def _story(analysis: Analysis, fitted: FittedDrop | None) -> str:
    """Return a plain description of the drop."""
    attributes = analysis.record.attrs
    when = f" on {moment(str(attributes['drop_time']))}" if attributes.get("drop_time") else ""
    parts = []
    speed = (
        "an unknown speed"
        if analysis.rundown is None or not analysis.rundown.initial.known
        else rpm(analysis.rundown.initial)
    )
    if not analysis.falls:
        return f"The rotor of “{analysis.machine.name}” levitates throughout the record{when}, at {speed}: {NO_DROP}."
    parts.append(f"The rotor of “{analysis.machine.name}” was dropped{when} from {speed}.")
    parts += [f"End {end.name} {end.held}." for end in analysis.ends.values() if end.held]
    parts += _contacts_made(analysis, fitted)
    if analysis.rundown is not None and (still := analysis.rundown.standstill_time).known:
        verb = "stood still" if still.low is not None else "would stand still, if the fitted law held down to rest,"
        parts.append(f"It {verb} {words(still)} after the record's first sample.")
    elif analysis.rundown is not None:
        parts.append(f"Its standstill is not known: {analysis.rundown.standstill_time.why}.")
    if not (release := analysis.release_time).known:
        parts.append(f"When it was released is not known ({release.why}), so that times count from the first sample.")
    return " ".join(parts)


def _contacts_made(analysis: Analysis, fitted: FittedDrop | None) -> list[str]:
    """Return sentences on the number of contacts and the time of settling, or that contacts are not counted."""
    counts, untold = [], []
    for end in analysis.ends.values():
        if end.held:
            continue
        if end.contacts is None or not end.contacts.events:
            untold.append(end.name)
            continue
        count = end.contacts.count
        reach = "" if count.low == count.high else f" ({count.low:g} to {count.high:g})"
        seen = "" if count.known else " that were seen"
        number = len(end.contacts.events)
        noun = "contact" if number == 1 and not reach else "contacts"
        counts.append(f"{number}{reach} {noun}{seen} at {end.name}")
    settle = analysis.settle_time
    if counts:
        rings = "the ring" if any(end.held for end in analysis.ends.values()) else "both rings"
        after = f" until it stayed on {rings} {words(settle)} after the release" if settle.known else ""
        lost = f"; those at {untold[0]} are not known, for the reason below" if untold else ""
        return [f"It made {' and '.join(counts)}{after}{lost}."]
    if analysis.ends:
        return ["Contacts are not counted from the displacement alone, for the reason below." + _in_the_fit(fitted)]
    return []


def _in_the_fit(fitted: FittedDrop | None) -> str:
    """Return the number of contacts according to the fitted gaps, which need no clearance circle; "" if the fit is withheld."""
    if fitted is None or fitted.forces.withheld:
        return ""
    found = fitted.agreement
    counts = {name: sum(p.measured is not None for p in end.contacts) for name, end in found.ends.items()}
    if not any(counts.values()):
        return ""
    told = " and ".join(f"{counted(number, 'contact')} at {name}" for name, number in counts.items())
    seconds = min(fitted.forces.seconds, float(found.time[-1]))
    return (
        f" By the fitted gaps it shows {told} within {seconds:.3g} s of the release (see Measured against simulated)."
    )


def _trust(analysis: Analysis) -> Verdict:
    failed = [check for check in analysis.checks if not check.passed]
    if not failed:
        return Verdict(f"All {len(analysis.checks)} checks of the record passed.", "good")
    named = "; ".join(f"{c.check}{f' ({c.channel})' if c.channel else ''}: {c.detail}" for c in failed[:4])
    more = f"; and {len(failed) - 4} more" if len(failed) > 4 else ""
    return Verdict(f"{len(failed)} of {len(analysis.checks)} checks of the record failed. {named}{more}.", "attention")


def _gap_verdict(row: Row) -> Verdict:
    return Verdict(f"{row.cells[0]}: {row.cells[1]}; the drawing says {row.cells[2]}: {row.cells[3]}.", "attention")


def _whirl_verdicts(analysis: Analysis) -> list[Block]:
    """Return the verdicts on whirl, found or not: backward whirl destroys touchdown bearings, so the first page reports it."""
    if not analysis.whirl:
        return []
    found: list[Block] = []
    for end, whirl in analysis.whirl.items():
        if whirl.backward:
            onset = words(whirl.backward_onset)
            found.append(Verdict(f"{end}: backward whirl around the clearance, from {onset}.", "attention"))
        elif whirl.full:
            found.append(
                Verdict(f"{end}: whirl right round the clearance, from {words(whirl.full_onset)}.", "attention")
            )
        elif whirl.hidden:
            found.append(Verdict(f"{end}: whirl around the clearance is not judged: {whirl.hidden}.", "attention"))
    if found:
        return found
    where = "" if len(analysis.whirl) == len(analysis.ends) else f" at {' and '.join(analysis.whirl)}"
    return [
        Verdict(f"The shaft did not whirl around the clearance{where}: it made no whole turn in either sense.", "good")
    ]


def _hardest(fitted: FittedDrop, analysis: Analysis) -> list[Block]:
    """Return the simulated peak forces and stresses, relative to the static load and to the stress that dents a race."""
    from tdbsim.fatigue import STATIC_LIMIT

    ends, within = fitted.forces.ends, f"first {fitted.forces.seconds:g} s"
    if fitted.forces.withheld:
        return [Verdict(f"How hard the bearings were hit is not known: {fitted.forces.withheld}.", "attention")]
    loads = [analysis.ends[name].load if name in analysis.ends else 0.0 for name in ends]
    dented = [end.stress.greatest.high or 0.0 for end in ends.values()]
    hybrid = any(each.geometry.ball != each.geometry.race for each in analysis.machine.touchdown_bearings)
    steel = ", steel balls; ISO 20056-2 permits hybrid bearings slightly more" if hybrid else ""
    rows = (
        *hardest(fitted.forces),
        Row(
            (
                f"Greatest force over the load at rest, {within}",
                *(_over(end.peak, load) for end, load in zip(ends.values(), loads, strict=True)),
            )
        ),
        Row(
            (
                f"Greatest stress, {within}, against {STATIC_LIMIT * 1e-6:.0f} MPa, where a ball dents its race (ISO 76{steel})",
                *(_against_denting(end.stress.greatest) for end in ends.values()),
            ),
            "attention" if max(dented) > STATIC_LIMIT else "plain",
        ),
    )
    calibration = fitted.calibration
    doubts = [
        Verdict(
            "The fitted model does not follow the first contacts: forces and stresses may be wrong by more than their intervals"
            " (see Forces and stresses).",
            "attention",
        )
    ]
    return [
        *([] if calibration.explains else doubts),
        *(Verdict(f"{note}.", "attention") for note in fitted.notes),
        Table(
            "How hard the bearings were hit: the fitted model, with 95 % intervals of the fit",
            ("Quantity", *ends),
            rows,
        ),
        sentence(FORCES_HOLD),
        Paragraph(
            f"No sensor measures forces. The simulation was fitted to the first {calibration.horizon * 1e3:.0f} ms after"
            f" the release; the residual of the first contacts is {calibration.misfit:.2f} times the probes' noise."
            f"{_later(fitted.forces.seconds, analysis.settle_time)}"
        ),
    ]


def _later(seconds: float, settled: Estimate) -> str:
    """Return a remark that impacts follow after the simulated time `seconds`, s; "" if the shaft has settled by then."""
    if settled.value is not None and settled.value <= seconds:
        return ""
    then = f"settles only {words(settled)} after the release" if settled.known else "has not settled by then"
    return (
        f" All values are of the first {seconds:g} s after the release; the shaft {then}, and later impacts are not included."
    )


def _over(force: Estimate, load: float) -> str:
    if force.value is None or not load > 0:
        return "–"
    low, high = (None if x is None else x / load for x in (force.low, force.high))
    return words(Estimate(force.value / load, low, high, "1"))


def _against_denting(stress: Estimate) -> str:
    from tdbsim.fatigue import STATIC_LIMIT

    if stress.value is None or stress.low is None or stress.high is None:
        return words(stress)
    side = "below" if stress.high < STATIC_LIMIT else "above" if stress.low > STATIC_LIMIT else "not decided"
    share, low, high = (percent(each / STATIC_LIMIT) for each in (stress.value, stress.low, stress.high))
    return f"{side}: {share} ({low} to {high})"


def _rotor_table(analysis: Analysis) -> list[Block]:
    findings = rotor_findings(analysis)
    rows = tuple(Row((f.name, words(f.estimate, f.unit) + f.beside)) for f in findings if f.estimate.known)
    return [Table("The rotor: values with 95 % intervals", ("Quantity", "Value"), rows)] if rows else []


def _ends_table(analysis: Analysis) -> list[Block]:
    columns = {name: end_findings(analysis, end) for name, end in analysis.ends.items()}
    rows = []
    for findings in zip(*columns.values(), strict=True):
        if any(f.estimate.known for f in findings):
            cells = (words(f.estimate, f.unit) + f.beside if f.estimate.known else "–" for f in findings)
            name = findings[0].name
            name += above_one(f.estimate for f in findings) if name == RESTITUTION else ""
            rows.append(Row((name, *cells)))
    if not rows:
        return []
    planes = {end.plane for end in analysis.ends.values()}
    where = "at the bearing planes" if planes == {"bearing"} else "at the planes that the probes allow"
    header = ("Quantity", *analysis.ends)
    caption = f"The touchdown bearings: values with 95 % intervals, {where}"
    return [Table(caption, header, tuple(rows)), Paragraph(_SCALE)]


def _not_estimated(analysis: Analysis) -> list[Block]:
    """Return a table of quantities without a value, one row per reason; the section What is not estimated names each."""
    owners = {"rotor": rotor_findings(analysis)}
    owners |= {name: end_findings(analysis, end) for name, end in analysis.ends.items()}
    reasons: dict[str, dict[str, list[str]]] = {}
    for owner, findings in owners.items():
        missing = [finding for finding in findings if not finding.estimate.known]
        for why in dict.fromkeys(finding.estimate.why for finding in missing):
            what = _named([finding.name for finding in missing if finding.estimate.why == why], findings)
            reasons.setdefault(why, {}).setdefault(what, []).append(owner)
    rows = [
        Row(("; ".join(f"{' and '.join(owners)}: {what}" for what, owners in told.items()), why))
        for why, told in reasons.items()
    ]
    return [Table("Not estimated", ("Quantities", "Why"), tuple(rows))] if rows else []


def _named(names: Sequence[str], findings: Sequence[Finding]) -> str:
    """Return a list of names as text, or "all but" the missing ones if these are few."""
    others = [finding.name for finding in findings if finding.name not in names]
    if len(names) > _FEW >= len(others):
        return f"all{f' but {_listed(others)}' if others else ''}"
    return _listed(names)


def _listed(names: Sequence[str]) -> str:
    return ", ".join(map(decapitalised, names))


def _against_drawing(analysis: Analysis) -> list[Row]:
    rows = []
    for name, end in analysis.ends.items():
        rows.append(_compare(f"Air gap, {name}", end.air_gap, analysis.machine.bearing(name).radial_gap, "µm", 1e6))
    drawn = analysis.machine.rotor.speed_decay_time
    if analysis.rundown is not None and drawn is not None:
        rows.append(_compare("Decay time of the speed", analysis.rundown.decay_time, drawn, "s", 1.0))
    return rows


def _compare(name: str, measured: Estimate, drawn: Tolerant, unit: str, factor: float) -> Row:
    nominal, low, high = (
        number(x * factor, abs(drawn.nominal) * factor * 0.02) for x in (drawn.nominal, drawn.low, drawn.high)
    )
    limits = f"{nominal} {unit}" + ("" if drawn.is_exact else f" ({low} to {high})")
    verdict, tone = _verdict(measured, drawn)
    return Row((name, words(measured) if measured.known else "–", limits, verdict), tone)


def _verdict(measured: Estimate, drawn: Tolerant) -> tuple[str, Tone]:
    """Return whether the measured value lies inside or outside the tolerance, or is undecided, with its tone."""
    if measured.value is None:
        return "not estimated", "plain"
    low = measured.value if measured.low is None else measured.low
    high = measured.value if measured.high is None else measured.high
    if drawn.is_exact:
        agrees = low <= drawn.nominal <= high
        return ("agrees" if agrees else "differs; the drawing states no tolerance"), (
            "plain" if agrees else "attention"
        )
    if drawn.low <= low and high <= drawn.high:
        return "inside the tolerance", "good"
    if high < drawn.low or low > drawn.high:
        return "outside the tolerance", "attention"
    return "not decided: the interval reaches over the limit of the tolerance", "attention"
