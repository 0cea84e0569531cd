"""Report section: the late record, after measured and simulated trajectories have diverged."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from tdbmon.diagnosis.evidence import Evidence
from tdbmon.diagnosis.held_out import LEAST_DROPS
from tdbmon.diagnosis.late_record import (
    IN_ONE_DROP,
    STAYS_ELSEWHERE,
    WHIRLS_OTHERWISE,
    LateRecord,
    departure_of,
    seen_in_all,
)
from tdbmon.quantity import signed
from tdbmon.report.document import Block, Figure, Paragraph, Row, Section, Table


def section(evidence: Evidence) -> Section | None:
    """Return 1X whirl and mean positions beside simulations; None if the drops do not permit it or no model is accepted."""
    diagnosis = evidence.diagnosis
    records = diagnosis.late
    probes = seen_in_all(records) if records else []
    if not records or not probes:
        return None
    accusing = diagnosis.late_before or records
    furthest = _furthest(accusing, probes)
    shown = evidence.shown_with(max(range(len(accusing)), key=lambda k: accusing[k].departure))
    if diagnosis.late_before is None:
        beside: tuple[Block, ...] = _beside(records, probes, furthest, "", "late-record", evidence, shown)
    else:
        beside = (
            Paragraph(
                f"With {diagnosis.best.causes[-1].words} the squared deviations of amplitude and position sum to"
                f" {departure_of(records):.1f}, without to {departure_of(diagnosis.late_before):.1f}. All are in units of the"
                " spread of the simulations without this cause, so that a wider spread is no advantage."
            ),
            *_beside(
                diagnosis.late_before,
                probes,
                furthest,
                " without the cause found here",
                "late-record-before",
                evidence,
                shown,
            ),
            *_beside(records, probes, furthest, " with it", "late-record", evidence, shown),
        )
    return Section(
        "The rest of the record",
        (
            Paragraph(
                "Neighbouring paths with impacts diverge, so later readings are not compared sample by sample. The 1X whirl of"
                " the shaft and its mean position are compared with simulations of each drop"
                f" ({len(records[0].whirls)}, from points drawn about the fit). {_would_tell(len(records))}"
            ),
            *beside,
        ),
    )


def _would_tell(drops: int) -> str:
    """Return the criteria by which a departure of the late record is significant."""
    if drops < LEAST_DROPS:
        return "A single drop is not judged by this."
    return (
        f"If the amplitude of the whirl (to one side) or its vector deviates by {WHIRLS_OTHERWISE:g} standard deviations in half"
        f" of the drops, or a probe's readings by {STAYS_ELSEWHERE:g} on average over the drops, or either by"
        f" {IN_ONE_DROP:g} in one of several drops, something acts that the model lacks."
    )


def _beside(
    records: Sequence[LateRecord],
    probes: Sequence[str],
    furthest: str,
    which: str,
    name: str,
    evidence: Evidence,
    shown: Sequence[int],
) -> tuple[Table, Figure]:
    """Return a table of departures from a model's simulations, and a figure of the probe with the greatest departure."""
    from tdbmon.figures.late_record import late_record

    rows = [
        Row(
            (
                each.name,
                signed(each.whirl_departure, 1),
                f"{each.vector_departure:.1f}",
                *(signed(_departure(each, probe), 1) for probe in probes),
            )
        )
        for each in records
    ]
    return (
        Table(
            f"Deviation from the simulations{which}, standard deviations, over the windows",
            ("Drop", "1X amplitude", "1X vector", *(f"Position, {probe}" for probe in probes)),
            tuple(rows),
        ),
        Figure(
            name,
            f"From {records[0].begins * 1e3:.0f} ms on, where the fit ends: 1X amplitude, and"
            f" mean reading of {furthest}, which deviates most, measured and simulated{which}."
            + evidence.selection_of(shown),
            "For some drops, whirl and position against time, measured, and the band of the simulations.",
            partial(late_record, records, shown, furthest),
        ),
    )


def _furthest(records: Sequence[LateRecord], probes: Sequence[str]) -> str:
    """Return the probe with the greatest departure summed over the drops."""
    return max(probes, key=lambda probe: abs(sum(_departure(each, probe) for each in records)))


def _departure(record: LateRecord, probe: str) -> float:
    return float(record.place_departures[record.probes.index(probe)])
