"""The first page of a comparison: the verdict, its reasons, and the drops that were compared."""

from __future__ import annotations

from collections.abc import Sequence

from tdbmon.estimate import Estimate
from tdbmon.history.change import Change
from tdbmon.history.compare import Comparison
from tdbmon.history.feature import NO_FORCES
from tdbmon.history.life import Life
from tdbmon.history.matching import Conditions
from tdbmon.history.not_compared import not_compared_sentences
from tdbmon.history.sight import Sight, sights
from tdbmon.history.speed_class import STANDSTILL, stood
from tdbmon.history.standing import Judged
from tdbmon.quantity import decapitalised, percent, short, stated_percent
from tdbmon.quantity import words as quantity
from tdbmon.report.document import Block, Paragraph, Row, Section, Table, Tone, sentence
from tdbmon.report.document import Verdict as Finding
from tdbmon.report.sections import next_steps

_HARDEST = ("peak_force_n", "stress_max_mpa")

WORDS: dict[str, tuple[str, Tone]] = {
    "as before": ("As before.", "good"),
    "changed": ("Changed against the drops before.", "attention"),
    "inspect": ("Inspect the touchdown bearings before the next start.", "attention"),
    "no drop": ("There is no drop in this record.", "attention"),
    "too few drops": ("Too few matching drops for a verdict.", "plain"),
}

STANDING = (
    "An alarm stands until later drops of the same assembly at about the same speed show all that it is about, or the assembly"
    " is given another word after an overhaul. Drops at another speed, and ones that do not show the end well enough, do not"
    " clear it."
)


def standing_blocks(standing: Sequence[Judged]) -> list[Block]:
    """Return the standing alarms of earlier drops with their reasons."""
    blocks: list[Block] = []
    for each in standing:
        word = WORDS[each.verdict.word][0]
        blocks.append(Finding(f"The alarm of {each.name} stands: {decapitalised(word)}", "attention"))
        blocks += map(sentence, each.verdict.reasons)
    return [*blocks, Paragraph(STANDING)] if blocks else []


def section(judged: Judged, standing: Sequence[Judged]) -> Section:
    """Return the section with the verdict and the standing alarms of earlier drops."""
    comparison, verdict = judged.comparison, judged.verdict
    words, tone = WORDS[verdict.word]
    wanted, entry = comparison.conditions, comparison.entry
    blocks: list[Block] = [Finding(words, tone), *map(sentence, verdict.reasons)]
    blocks += map(sentence, not_compared_sentences(comparison))
    blocks += next_steps.blocks(judged)
    blocks += standing_blocks(standing)
    blocks += _hit(comparison)
    rows = [
        Row(("Drop", f"{entry.id} ({entry.raw_name})")),
        Row(("Machine", wanted.machine)),
        Row(("Assembly", wanted.assembly or "no name given: drops of all assemblies without one are compared")),
        Row(("Speed at the release", speed_wanted(wanted))),
        Row(("Matching drops before", f"{len(comparison.matched)}")),
        *(Row((f"Drops before that {each.end} is compared with", _sight(each))) for each in sights(comparison)),
        Row((f"Full drops of this assembly, {included(comparison)}", _full_drops(comparison.life))),
        Row(("Quantities compared", f"{comparison.tested}, corrected for that number together")),
    ]
    blocks.append(Table("What was compared", ("What", "Value"), tuple(rows)))
    if comparison.matched:
        listed = tuple(Row((e.id, e.raw_name, e.when, e.speed_words)) for e in (*comparison.matched[-20:], entry))
        more = len(comparison.matched) - 20
        caption = "The drops, this one last" + (f" ({more} older ones not listed)" if more > 0 else "")
        blocks.append(Table(caption, ("Drop", "Record", "Time", "Speed"), listed))
    return Section("Verdict", tuple(blocks))


def speed_wanted(wanted: Conditions) -> str:
    """Return the speed, with tolerance, at which drops match, as text."""
    if stood(wanted.speed):
        return STANDSTILL
    return (
        "unknown" if wanted.speed is None else f"{wanted.speed:.4g} Hz, at most {stated_percent(wanted.tolerance)} off"
    )


def included(comparison: Comparison) -> str:
    """Return a text that says whether the drop, named by its record, is counted, and if not, why."""
    record = comparison.entry.raw_name
    if comparison.no_drop:
        return f"without {record}, which holds no drop"
    return f"without {record}, which names another machine" if comparison.foreign else f"{record} included"


def _sight(sight: Sight) -> str:
    seen = (
        "no growth of the radius at rest"
        if sight.growth is None
        else f"growth of the radius at rest from {sight.seen_from} on"
    )
    return f"{sight.drops}; {seen} would have been detected"


def _full_drops(life: Life) -> str:
    return f"{life.full_drops}, {'no number agreed' if life.agreed is None else f'{life.agreed} agreed'}"


def _hit(comparison: Comparison) -> list[Block]:
    """Return peak force and stress against the earlier drops and the limit; a sentence if no model was fitted."""
    asked = [c for c in comparison.changes if c.kind.name in _HARDEST and c.estimate.known]
    limit, rows = comparison.settings.inspect.stress, []
    for change in asked:
        low, high = (f([e.value or 0.0 for _, e in change.earlier], default=None) for f in (min, max))
        before = "–"
        if low is not None and high is not None:
            unit = change.kind.unit
            before = (
                f"{short(Estimate(low, unit=unit))} to {short(Estimate(high, unit=unit))}{_out_of(change, low, high)}"
            )
        against = ""
        if change.kind.name == "stress_max_mpa" and change.estimate.value is not None:
            against = f"{percent(change.estimate.value / limit)} of {limit * 1e-6:.0f} MPa"
        rows.append(Row((change.title, quantity(change.estimate), before, against or "–")))
    if not asked:
        hardest = [c.estimate.why for c in comparison.changes if c.kind.name in _HARDEST]
        if withheld := next((why for why in hardest if why != NO_FORCES), ""):
            return [Finding(f"Force and stress are not known: {withheld}.", "attention")]
        said = (
            "Force and stress were not computed: compare the record, or add it to the archive, with --forces to have them."
        )
        return [Paragraph(said)]
    return [
        Table(
            "How hard the bearings were hit: the fitted model, with 95 % intervals",
            ("Quantity", "This drop", "Least to greatest before", "Against the limit"),
            tuple(rows),
        )
    ]


def _out_of(change: Change, low: float, high: float) -> str:
    """Return a remark if a drop lies outside the range of the earlier ones, as one drop after ten often does by chance."""
    value = change.estimate.value
    if value is None or low <= value <= high:
        return ""
    return "; this drop lies outside, " + ("beyond chance" if change.differs else "by no more than chance")
