"""Report section: trends of the main quantities over the drops."""

from __future__ import annotations

from functools import partial

from tdbmon.history.change import Change
from tdbmon.history.compare import Comparison
from tdbmon.quantity import words
from tdbmon.report.document import Figure, Paragraph, Row, Section, Table

_SHOWN = 8
_FIRST = (
    "gap_um",
    "stiffness_n_per_m",
    "v_rms",
    "rebound_um",
    "decay_time_s",
    "lost_speed_hz",
    "peak_force_n",
    "friction",
)


def section(comparison: Comparison) -> Section | None:
    """Return the section on trends; None if no judged quantity has one (it takes four drops)."""
    with_trend = [c for c in comparison.changes if c.trend is not None and c.kind.judged]
    if not with_trend:
        return None
    from tdbmon.figures.trends import trends

    shown = chosen(with_trend)
    rows = []
    for change in with_trend:
        trend = change.trend
        if trend is None:
            continue
        point = "–"
        if trend.step is not None:
            drop = comparison.drop_at(change, trend.step.index)
            point = f"from {comparison.record(drop)} on, p = {trend.step.p:.2g}"
        rows.append(Row((change.title, words(trend.slope), f"{trend.p:.2g}", point)))
    return Section(
        "Trends",
        (
            Figure(
                "trends",
                "Values over the matching drops in their order with 95 % intervals where they are known, this drop in"
                " orange. Dashed steps: the levels before and after a change point (permutation test, p ≤ 5 %, not"
                " corrected), unless a slope describes the drops better (Schwarz's criterion). Line, where there is no such"
                " point: the median slope (Theil, Sen), if Kendall's test finds a trend (p ≤ 5 %, not corrected)."
                " The line named limit: limit of growth of the radius at rest. Grey, at the lower edge: not estimated from"
                " this drop.",
                "For each quantity, its value in each drop.",
                partial(trends, comparison, shown),
            ),
            Table(
                "Slope from drop to drop, and change points",
                ("Quantity", "Slope (95 %)", "p of a trend", "Change point"),
                tuple(rows),
            ),
            Paragraph(
                "These probabilities are not corrected for the number of quantities: one in twenty is below 0.05 by chance."
                " They do not enter the verdict; drifts after a correction are stated beside it."
            ),
        ),
    )


def chosen(changes: list[Change]) -> list[Change]:
    """Return the quantities to draw, at most eight: the flagged ones first, then the usual ones."""

    def rank(change: Change) -> tuple[bool, int]:
        name = change.kind.name
        return not change.flag, _FIRST.index(name) if name in _FIRST else len(_FIRST)

    return sorted(changes, key=rank)[:_SHOWN]
