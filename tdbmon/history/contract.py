"""JSON of a comparison, a fleet and a drop.  The names are a contract: they are added to, never renamed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tdbmon.estimate import OUTSIDE, Estimate
from tdbmon.history.catalogue import Entry
from tdbmon.history.change import Change
from tdbmon.history.compare import Comparison
from tdbmon.history.filing import StressBox
from tdbmon.history.fleet import Member
from tdbmon.history.sight import Sight, sights
from tdbmon.history.standing import Judged


def comparison_json(judged: Judged, standing: Sequence[Judged] = ()) -> dict[str, Any]:
    """Return a comparison with its verdict and the standing alarms of earlier drops as plain dictionaries."""
    comparison, verdict = judged.comparison, judged.verdict
    wanted = comparison.conditions
    return {
        "verdict": verdict.word,
        "reasons": list(verdict.reasons),
        "standing": [_judged(each) for each in standing],
        "drop": comparison.entry.id,
        "matched": [entry.id for entry in comparison.matched],
        "matching": {
            "machine": wanted.machine,
            "assembly": wanted.assembly,
            "speed_hz": wanted.speed,
            "speed_tolerance": wanted.tolerance,
        },
        "ends": {each.end: _sight(each) for each in sights(comparison)},
        "features": [_change(change, comparison) for change in comparison.changes],
        "stress": {end: [_box(drop, box) for drop, box in rows] for end, rows in sorted(comparison.stress.items())},
        "stress_why": "" if comparison.stress else "no drop was filed with forces (tdbmon archive add --forces)",
        "life": {
            "full_drops": comparison.life.full_drops,
            "partial_drops": comparison.life.partial_drops,
            "agreed": comparison.life.agreed,
            "damage": comparison.life.damage.to_json(),
            "damages": {end: each.to_json() for end, each in comparison.life.damages.items()},
            "margin": comparison.life.margin.to_json(),
        },
        "another_machine": {
            "flag": comparison.likeness.strange,
            "far": list(comparison.likeness.far),
            "compared": list(comparison.likeness.compared),
            "named": comparison.foreign,
        },
        "remarks": list(comparison.remarks),
    }


def fleet_json(folder: Path, members: Sequence[Member]) -> dict[str, Any]:
    """Return the machines of an archive, worst first, each with its standing verdict and that of its latest drop."""
    return {
        "archive": str(folder),
        "machines": [
            {
                "machine": member.machine,
                "drops": member.drops,
                "undated": member.undated,
                "synthetic": member.synthetic,
                **_judged(member.judged),
                "alarm": member.verdict.alarm,
                "latest": _judged(member.latest),
                "standing": [_judged(each) for each in member.standing],
            }
            for member in members
        ],
    }


def entry_json(entry: Entry) -> dict[str, Any]:
    """Return a drop of the catalogue."""
    return {
        "drop": entry.id,
        "sha256": entry.sha256,
        "file": entry.raw_name,
        "machine": entry.machine,
        "assembly": entry.assembly,
        "dropped": entry.dropped or None,
        "filed": entry.filed,
        "speed_hz": entry.speed,
        "synthetic": entry.synthetic,
        "failed_checks": list(entry.failed_checks),
    }


def _judged(judged: Judged) -> dict[str, Any]:
    verdict = judged.verdict
    return {"drop": judged.comparison.entry.id, "verdict": verdict.word, "reasons": list(verdict.reasons)}


def _sight(sight: Sight) -> dict[str, Any]:
    return {"drops": sight.drops, "growth_seen_from": sight.growth, "enough": sight.enough, "lost": sight.lost}


def _box(drop: str, box: StressBox) -> dict[str, Any]:
    """Return box statistics of a stress in MPa."""
    factor = OUTSIDE["MPa"]
    return {
        "drop": drop,
        "max": factor * box.greatest,
        "mean": factor * box.mean,
        "median": factor * box.median,
        "q1": factor * box.q1,
        "q3": factor * box.q3,
        "outliers": [factor * x for x in box.outliers],
    }


def _change(change: Change, comparison: Comparison) -> dict[str, Any]:
    kind, factor, trend = change.kind, OUTSIDE[change.kind.unit], change.trend
    smallest = comparison.detectable(change)
    slope = Estimate.missing(kind.unit, "a trend needs four drops") if trend is None else trend.slope
    return {
        "name": kind.name,
        "end": change.end,
        "title": kind.title,
        "value": change.estimate.to_json(),
        "before": _before(change),
        "left_out": list(change.left_out),
        "difference": _difference(change).to_json(),
        "p_adjusted": change.p_adjusted,
        "flag": change.flag,
        "noted": change.noted,
        "as_in": list(change.as_in),
        "detectable": None if smallest is None else factor * smallest,
        "trend_per_drop": slope.to_json(),
        "trend_p": None if trend is None else trend.p,
        "trend_p_adjusted": change.p_drift,
        "drifts": change.drifts,
        "change_point": _change_point(change, comparison),
    }


def _before(change: Change) -> dict[str, Any]:
    """Return number, centre and range of the baseline."""
    if change.difference is None:
        return {"n": len(change.earlier), **dict.fromkeys(("centre", "median", "low", "high", "slope"))}
    before, factor = change.difference.before, OUTSIDE[change.kind.unit]
    values = [e.value for each, e in change.earlier if e.value is not None and each not in change.left_out]
    return {
        "n": before.n,
        "centre": factor * before.centre,
        "median": factor * before.median,
        "low": factor * min(values),
        "high": factor * max(values),
        "slope": None if before.slope is None else factor * before.slope,
    }


def _difference(change: Change) -> Estimate:
    found, unit = change.difference, change.kind.unit
    if found is None:
        return Estimate.missing(unit, change.why or "not compared")
    why = "" if found.low is not None else "one drop before shows no scatter between drops"
    return Estimate(found.value, found.low, found.high, unit, "drop minus the centre of those before", why)


def _change_point(change: Change, comparison: Comparison) -> dict[str, Any] | None:
    if change.trend is None or change.trend.change is None:
        return None
    point, factor = change.trend.change, OUTSIDE[change.kind.unit]
    return {
        "drop": comparison.drop_at(change, point.index),
        "before": factor * point.before,
        "after": factor * point.after,
        "p": point.p,
    }
