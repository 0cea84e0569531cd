"""What `tdbmon diagnose --reference` adds to the JSON and the lines on a terminal."""

from __future__ import annotations

from typing import Any

from tdbmon.diagnosis.contract import causes_json, value_and_interval
from tdbmon.diagnosis.reference import APART, Reference
from tdbmon.quantity import counted, plain
from tdbmon.remarks import alike


def reference_json(reference: Reference) -> dict[str, Any]:
    """Return the content under ``reference``."""
    before = reference.before
    return {
        "drops": [drop.name for drop in before.plain.problem.drops],
        "verdict": str(before.verdict.kind),
        "causes": causes_json(before),
        "changed": [
            {"name": each.name, "before": each.before.to_json(), "since": each.since.to_json()}
            for each in reference.changes
        ],
        "not_compared": reference.not_compared,
        "remarks": list(reference.remarks),
    }


def reference_lines(reference: Reference) -> list[str]:
    """Return the command's lines on the earlier drops."""
    before = reference.before
    named = " or ".join(dict.fromkeys(each.words for each in before.verdict.accused))
    out = [
        f"reference ({counted(len(before.plain.problem.drops), 'drop')}): {before.verdict.kind}{f' - {named}' if named else ''}"
    ]
    for each in reference.changes:
        out.append(
            f"  changed since: {each.name} {value_and_interval(each.before)} before, {value_and_interval(each.since)} since"
        )
    if reference.not_compared:
        out.append(f"  not compared: {reference.not_compared}")
    if reference.compares and not reference.changes:
        out.append(
            f"  no {'other ' if reference.not_compared else ''}value of the machine has changed by more than {APART:g} times the"
            " half widths of both intervals and by half of its tolerance (a ball clearance: by all of it)"
        )
    drops = [drop.name for drop in before.plain.problem.drops]
    return [plain(line) for line in (*out, *(f"remark: {each}" for each in alike(reference.remarks, drops)))]
