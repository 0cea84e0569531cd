"""The page on how `tdbmon diagnose` does on blind cases, from kept outcomes, with one section per strangeness."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise

import numpy as np

from tests.blind.judge import Judgement
from tests.blind.outcome import Outcome

HEAD = """\
# Blind cases

Written by `{command}`; do not edit. Every case is **synthetic**: a machine, four drops of 0.5 s, with or without something
hidden, drawn from a seed by the generator in `tests/blind/`, which shares no code with `tdbsim`: quadratic Timoshenko
elements, 26 modes a plane, Runge-Kutta steps of 4 µs, laws and sensors of its own. True values lie within the tolerances of
the machine file. *Plain* cases have the laws that the machine file implies. In *strange* ones the contact's exponent (1.05
to 1.2) and damping, the rise of friction and its dependence on load, stiffnesses, masses and elastic modulus (by 0.5 to
5 %), the colour of the noise and the probes' zeros differ, as on real machines; with nothing hidden the right verdict
is still "none". Intervals in brackets are 95 % (Wilson).

A case is right if nothing hidden gives "none", something outside the catalogue "unknown", and if all hidden effects are
named and nothing else; "ambiguous" is right if its set contains them, and is counted separately.
"""

Judged = Sequence[tuple[Outcome, Judgement]]

KIND = {
    "none": "nothing hidden",
    "effect": "one effect",
    "pair": "two effects at once",
    "outside": "outside the catalogue",
}
SIGNAL_EDGES = (0.0, 30.0, 100.0, 300.0, 1000.0, 3000.0, math.inf)
LEVEL_EDGES = (0.0, 0.25, 0.5, 0.75, 1.0)
PLAIN_SIGNAL = 10.0  # standard deviations of the noise
STRONG_LEVEL = 0.5
ACCUSING = ("named", "ambiguous")
PROBABILITY_EDGES = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99, 1.0)


def wilson(hits: int, count: int) -> tuple[float, float]:
    """Return the 95 % interval of a share (E. B. Wilson, J. Am. Stat. Assoc. 22 (1927) 209)."""
    if count == 0:
        return 0.0, 1.0
    z, share = 1.959964, hits / count
    middle = share + z * z / (2 * count)
    spread = z * math.sqrt(share * (1 - share) / count + z * z / (4 * count * count))
    scale = 1 + z * z / count
    return max(0.0, (middle - spread) / scale), min(1.0, (middle + spread) / scale)


def share(hits: int, count: int) -> str:
    """Return a share with its count and 95 % interval as text."""
    if count == 0:
        return "no case"
    low, high = wilson(hits, count)
    return f"{hits}/{count} = {100 * hits / count:.0f} % ({100 * low:.0f} to {100 * high:.0f})"


def calibration_error(stated: Sequence[tuple[float, bool]]) -> float:
    """Return the expected calibration error: mean distance of stated from true shares, over classes of probability."""
    total = 0.0
    for chosen in _classes(stated):
        total += abs(sum(p for p, _ in chosen) - sum(true for _, true in chosen))
    return total / len(stated)


def page(outcomes: Sequence[Outcome], command: str, remark: str = "") -> str:
    """Return the page in Markdown, with a remark on how the cases were run."""
    lines = [HEAD.format(command=command)] + ([remark, ""] if remark else []) + _goals(outcomes)
    for title, chosen in (
        ("Plain laws", [o for o in outcomes if o.strangeness == 0.0]),
        ("Strange laws", [o for o in outcomes if o.strangeness > 0.0]),
    ):
        if chosen:
            lines += [f"## {title}", "", *_section(chosen)]
    return "\n".join(lines).rstrip() + "\n"


def _goals(outcomes: Sequence[Outcome]) -> list[str]:
    """The goals of the project and what was reached, over all cases."""
    judged = [(o, o.judgement) for o in outcomes if o.judgement is not None]
    plainly = [(o, j) for o, j in judged if j.kind == "effect" and o.signal >= PLAIN_SIGNAL]
    hidden = [(o, j) for o, j in judged if j.kind in ("effect", "pair")]
    outside = [(o, j) for o, j in judged if j.kind == "outside"]
    sizes = [size for o, j in judged if min(o.levels, default=0.0) >= STRONG_LEVEL for size in j.sizes]
    near = [abs(size.value / size.true - 1) <= 0.1 for size in sizes]
    gains = [o.gain for o, j in hidden if j.right and o.gain is not None]
    stated = [each for _, j in judged for each in j.stated]
    seconds = [o.processor_seconds for o in outcomes]
    rows = [
        (f"one effect, signal of {PLAIN_SIGNAL:g} times the noise or more: right", "95 %", _count(plainly, lambda j: j.right)),
        ("its place right too", "90 %", _count(plainly, lambda j: j.right and j.place)),
        ("the same: all hidden effects are among those named", "98 %", _count(plainly, lambda j: set(j.hidden) <= set(j.said))),
        ("nothing hidden, a cause named", "3 % at most", _count_of_kind(judged, "none", lambda j: j.verdict in ACCUSING)),
        ("outside the catalogue: unknown", "85 %", _count(outside, lambda j: j.verdict == "unknown")),
        ("outside the catalogue: a cause named", "8 % at most", _count(outside, lambda j: j.verdict == "named")),
        ("two at once: both", "80 %", _count_of_kind(judged, "pair", lambda j: j.right)),
        (f"sizes within 10 %, level {STRONG_LEVEL:g} or more", "all", share(sum(near), len(near))),
        ("median gain on a held-out drop, rightly named", "0.8", f"{np.median(gains):.2f}" if gains else "no case"),
        ("prediction made worse there", "2 % at most", share(sum(gain < 0 for gain in gains), len(gains))),
        ("calibration error of the probabilities", "0.05", f"{calibration_error(stated):.3f}" if stated else "no case"),
        ("processor time of a case, median and 90th percentile", "180 s (90 s on two cores)",
         f"{np.median(seconds):.0f} s, {np.quantile(seconds, 0.9):.0f} s"),
    ]  # fmt: skip
    return ["## Goals, all cases together", "", *_table(("what", "goal", "reached"), rows)]


def _count_of_kind(judged: Judged, kind: str, true: Callable[[Judgement], bool]) -> str:
    return _count([(o, j) for o, j in judged if j.kind == kind], true)


def _section(outcomes: Sequence[Outcome]) -> list[str]:
    judged = [(o, o.judgement) for o in outcomes if o.judgement is not None]
    failed = [o for o in outcomes if o.judgement is None]
    first, last = min(o.seed for o in outcomes), max(o.seed for o in outcomes)
    took = ""
    if judged:
        wall, processor = ([getattr(o, name) for o, _ in judged] for name in ("seconds", "processor_seconds"))
        took = (
            f" A diagnosis took {np.median(wall):.0f} s (longest {max(wall):.0f} s), of processor time"
            f" {np.median(processor):.0f} s (longest {max(processor):.0f} s)."
        )
    lines = [f"{len(outcomes)} cases, seeds {first} to {last}; the command failed on {len(failed)}.{took}", ""]
    lines += [f"- seed {o.seed}: {o.error}" for o in failed] + ([""] if failed else [])
    lines += _kinds(judged) + _confusion(judged) + _detection(judged) + _sizes(judged)
    lines += _probabilities([stated for _, j in judged for stated in j.stated]) + _gains(judged)
    return lines + _wrong(judged)


def _table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> list[str]:
    return [
        "| " + " | ".join(head) + " |",
        "|" + "---|" * len(head),
        *("| " + " | ".join(str(cell) for cell in row) + " |" for row in rows),
        "",
    ]


def _count(judged: Judged, true: Callable[[Judgement], bool]) -> str:
    return share(sum(true(j) for _, j in judged), len(judged))


def _kinds(judged: Judged) -> list[str]:
    rows = []
    for kind, title in KIND.items():
        chosen = [(o, j) for o, j in judged if j.kind == kind]
        if chosen:
            rows.append(
                (
                    title,
                    _count(chosen, lambda j: j.right),
                    _count(chosen, lambda j: j.right and j.place) if kind in ("effect", "pair") else "",
                    _count(chosen, lambda j: j.ambiguous),
                )
            )
    lines = _table(("hidden", "right", "place right too", "ambiguous"), rows)
    nothing = [(o, j) for o, j in judged if j.kind == "none"]
    outside = [(o, j) for o, j in judged if j.kind == "outside"]
    pairs = [(o, j) for o, j in judged if j.kind == "pair"]
    lines += [
        f"- False alarms, nothing hidden but a cause named: {_count(nothing, lambda j: j.verdict in ACCUSING)};"
        f" called unknown: {_count(nothing, lambda j: j.verdict == 'unknown')}.",
        f"- Outside the catalogue, called unknown: {_count(outside, lambda j: j.verdict == 'unknown')};"
        f" taken for an effect of the catalogue: {_count(outside, lambda j: j.verdict == 'named')}.",
        f"- Of two at once, at least one among the causes: {_count(pairs, lambda j: bool(set(j.said) & set(j.hidden)))}.",
        "",
    ]
    return lines


def _confusion(judged: Judged) -> list[str]:
    """One row per hidden effect; what was said instead follows with its count."""
    rows = []
    groups: dict[str, list[tuple[Outcome, Judgement]]] = {}
    for o, j in judged:
        if j.kind != "pair":
            groups.setdefault(j.hidden[0] if j.hidden else "nothing", []).append((o, j))
    for name in sorted(groups, key=lambda n: (n == "nothing", n.startswith("x_"), n)):
        chosen = groups[name]
        instead = Counter(" or ".join(j.said) for _, j in chosen if not j.right)
        rows.append(
            (
                f"`{name}`" if name != "nothing" else name,
                _count(chosen, lambda j: j.right),
                sum(j.right and j.ambiguous for _, j in chosen),
                sum(j.right and j.place for _, j in chosen),
                ", ".join(f"{said} {n}" for said, n in instead.most_common()),
            )
        )
    return [
        "### Confusion",
        "",
        *_table(("hidden", "right", "of these ambiguous", "place right", "said instead"), rows),
    ]


def _detection(judged: Judged) -> list[str]:
    chosen = [(o, j) for o, j in judged if j.kind == "effect"]
    lines = [
        "### Detection against size",
        "",
        "The signal is the change by the effect in the first 30 ms after the release of two of the drops, in standard deviations",
        "of the noise, less what calibration can compensate; an effect that acts later (drag of a ring, Stribeck friction, heat,",
        "windage) has a small one. The level is the size within the range drawn from, logarithmic, 0 weak to 1 strong.",
        "",
    ]
    for title, edges, value in (
        ("signal", SIGNAL_EDGES, lambda o: o.signal),
        ("level", LEVEL_EDGES, lambda o: o.levels[0]),
    ):
        rows = []
        for low, high in pairwise(edges):
            within = [(o, j) for o, j in chosen if low <= value(o) < high]
            rows.append(
                (
                    f"{low:g} to {high:g}" if high < math.inf else f"above {low:g}",
                    _count(within, lambda j: j.verdict != "none"),
                    _count(within, lambda j: j.right),
                )
            )
        lines += _table((title, "reported that something is missing", "right"), rows)
    return lines


def _sizes(judged: Judged) -> list[str]:
    rows = []
    sizes = [size for _, j in judged for size in j.sizes]
    for name in sorted({size.effect for size in sizes}):
        of = [size for size in sizes if size.effect == name]
        error = np.median([abs(size.value / size.true - 1) for size in of])
        rows.append((f"`{name}`", share(sum(s.inside for s in of), len(of)), f"{100 * error:.0f} %"))
    whole = share(sum(s.inside for s in sizes), len(sizes))
    return [
        "### Sizes",
        "",
        f"The 95 % interval contains the true size in {whole} of the effects that were named rightly and given a size.",
        "",
        *_table(("effect", "true size within the interval", "median error"), rows),
    ]


def _probabilities(stated: Sequence[tuple[float, bool]]) -> list[str]:
    if not stated:
        return []
    rows = [
        (f"{chosen[0][0]:.2g} to {chosen[-1][0]:.2g}", len(chosen), f"{np.mean([p for p, _ in chosen]):.2f}",
         share(sum(true for _, true in chosen), len(chosen)))
        for chosen in _classes(stated)
    ]  # fmt: skip
    return [
        "### Probabilities",
        "",
        f"Expected calibration error {calibration_error(stated):.3f} over {len(stated)} causes.",
        "",
        *_table(("stated", "causes", "mean stated", "really hidden"), rows),
    ]


def _classes(stated: Sequence[tuple[float, bool]]) -> list[list[tuple[float, bool]]]:
    classes = []
    for low, high in pairwise(PROBABILITY_EDGES):
        chosen = sorted((p, t) for p, t in stated if low <= p < high or p == high == 1.0)
        if chosen:
            classes.append(chosen)
    return classes


def _gains(judged: Judged) -> list[str]:
    lines = ["### Held-out gain", ""]
    lines += ["The share of the baseline's error on held-out drops, beyond the noise, that the effects remove.", ""]
    rows = []
    for title, right in (("rightly named", True), ("wrongly named", False)):
        gains = [o.gain for o, j in judged if j.kind in ("effect", "pair") and j.right == right and o.gain is not None]
        if gains:
            worse = sum(gain < 0 for gain in gains)
            rows.append((title, len(gains), f"{np.median(gains):.2f}", share(worse, len(gains))))
    return [*lines, *_table(("effects", "cases", "median gain", "prediction made worse"), rows)]


def _wrong(judged: Judged) -> list[str]:
    """A row for each wrong case, so that it can be run again."""
    rows = []
    for o, j in judged:
        if not j.right or not j.place:
            hidden = (
                ", ".join(f"`{name}` at {where}" for name, where in zip(j.hidden, o.where, strict=True)) or "nothing"
            )
            said = " or ".join(j.said) if j.ambiguous else ", ".join(j.said)
            level = ", ".join(f"{level:.2f}" for level in o.levels) or "-"
            rows.append((o.seed, hidden, level, f"{o.signal:.0f}", f"{said} (place)" if j.right else said))
    return (
        ["### Cases that were wrong", "", *_table(("seed", "hidden", "level", "signal", "said"), rows)] if rows else []
    )
