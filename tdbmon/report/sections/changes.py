"""Report section: differences of every feature from the earlier drops, as a figure and a table."""

from __future__ import annotations

from functools import partial

from tdbmon.history.change import Change
from tdbmon.history.compare import Comparison
from tdbmon.history.not_compared import by_reason
from tdbmon.history.summary import seen_from, values_of
from tdbmon.report.document import Block, Figure, Paragraph, Row, Section, Table


def section(comparison: Comparison) -> Section | None:
    """Return the section on the differences; None if nothing was compared."""
    compared = [c for c in comparison.changes if c.difference is not None]
    if not compared:
        return None
    from tdbmon.figures.differences import differences

    rows = tuple(
        Row(_cells(change, comparison), "attention" if change.flag or change.noted else "plain") for change in compared
    )
    blocks: list[Block] = []
    if any(c.difference is not None and c.difference.error for c in compared):
        blocks.append(
            Figure(
                "differences",
                "Difference of this drop from the earlier ones, in standard errors of the prediction of a new drop, with its"
                " 95 % interval. Filled, and on top: changed after correction for the number of quantities. A wide interval"
                " means few earlier drops, not a large change.",
                "A forest plot: one line for each quantity, the interval of its difference against zero.",
                partial(differences, comparison),
            )
        )
    header = ("Quantity", "This drop", "Before", "n", "Difference (95 %)", "Seen from", "p, corrected")
    blocks.append(Table("Every quantity against the drops before", header, rows))
    blocks.append(
        Paragraph(
            "“Before” is the mean of the n earlier drops that serve as reference, or from fifteen on Tukey's biweight,"
            " which outliers do not shift; drifting quantities are first extrapolated along their slope to this drop. “Seen"
            " from” is the smallest difference that can be detected with this number of drops and this scatter: a smaller change"
            " may exist undetected. An interval that excludes zero is no proof of a change: of"
            f" {comparison.tested} quantities one in twenty does so by chance. p is the probability of so large a difference if"
            " nothing has changed, corrected for that number. Levitation, the ratios of the speeds and of the probes, the speed"
            " at the release and fatigue do not count towards the verdict; their p is corrected for their own number."
        )
    )
    missing = by_reason(c for c in (*comparison.changes, *comparison.untold) if c.difference is None)
    if missing:
        untold = tuple(Row(("; ".join(change.title for change in alike), why)) for why, alike in missing.items())
        blocks.append(Table("Not compared", ("Quantities", "Why"), untold))
    return Section("What differs", tuple(blocks))


def _cells(change: Change, comparison: Comparison) -> tuple[str, ...]:
    found = change.difference
    if found is None:
        raise ValueError(f"{change.title} was not compared")
    p = "–" if change.p_adjusted is None else f"{change.p_adjusted:.2g}"
    this, before, difference = values_of(change)
    return change.title, this, before, f"{found.before.n}", difference, seen_from(change, comparison), p
