"""Comparison of published with computed numbers, and Markdown tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Comparison:
    """A quantity with its published value (None if the source gives only a trend) and its computed value."""

    quantity: str
    published: float | None
    ours: float
    unit: str
    remark: str = ""

    @property
    def difference(self) -> str:
        """Computed minus published value, in per cent of the published one."""
        if self.published is None or self.published == 0:
            return ""
        share = 100 * (self.ours / self.published - 1)
        return f"{share:+.0f} %" if abs(share) >= 10 else f"{share:+.2g} %"


def table(rows: Sequence[Comparison]) -> str:
    """Return comparisons as a Markdown table."""
    lines = ["| quantity | published | ours | difference | remark |", "|---|---:|---:|---:|---|"]
    for row in rows:
        published = "" if row.published is None else f"{row.published:.4g} {row.unit}"
        lines.append(f"| {row.quantity} | {published} | {row.ours:.4g} {row.unit} | {row.difference} | {row.remark} |")
    return "\n".join(lines)


def grid(head: Sequence[str], body: Sequence[Sequence[str]]) -> str:
    """Return rows of text as a Markdown table."""
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in body)])
