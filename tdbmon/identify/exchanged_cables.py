"""Exchanged probe cables: the model follows the drops only after their readings are put back.

The signs of two exchanged probes in the readings alone (backward 1X whirl, no circular motion at either end) may have other
causes; and with all probes of both ends exchanged, or positions counted from the other end of the shaft, both ends still move
on circles.  So the decision is by fits to the fall and the first contacts, which depend on loads, supports and mode shapes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from tdbsim.errors import InputError
from tdbsim.machine import Machine

from tdbmon.identify.drop import MeasuredDrop
from tdbmon.identify.first_fits import STAGES, few_drops, first_fits, of_which
from tdbmon.identify.least_squares import Fit
from tdbmon.identify.problem import Problem, build_problem

_FAILS = 3.0  # misfit ratio of a plain model that lacks something
# least ratio of the misfits as recorded and put back; in 12 correctly connected synthetic cases, with a hidden effect or none,
# an exchange never lowered the misfit
_CLEARLY = 3.0
# times the least misfit ratio: exchanges up to here are as likely, as on a shaft that is symmetric end for end
_ALIKE = 1.5

Pairs = tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class _Exchange:
    """Pairs of probes whose cables may be exchanged, that exchange in words, and the question to the user."""

    pairs: Pairs
    words: str
    question: str

    def put_back(self, drop: MeasuredDrop) -> MeasuredDrop | None:
        """Return a drop with the readings assigned to the right probes; None where it lacks one of them."""
        names = [probe.name for probe in drop.probes]
        partner = {a: b for pair in self.pairs for a, b in (pair, pair[::-1])}
        if not partner.keys() <= set(names):
            return None
        order = [names.index(partner.get(name, name)) for name in names]
        return replace(drop, reading=drop.reading[order], noise=tuple(drop.noise[k] for k in order))


def exchanged_cables(problem: Problem, plain: Mapping[float, Fit]) -> str | None:
    """Return a message naming the probes that look exchanged, where the model then fits far better; None where none do.

    Parameters
    ----------
    problem : Problem
        Of the machine, at its nominal values.
    plain : mapping of float to Fit
        Its `first_fits`.
    """
    as_recorded = plain.get(STAGES.touched)
    if as_recorded is None or as_recorded.ratio < _FAILS:
        return None
    drops = few_drops(problem).drops
    tried = [(_ratio(problem, drops, each), each) for each in _exchanges(problem.model.machine, drops)]
    left = [(ratio, each) for ratio, each in tried if ratio is not None]
    if not left:
        return None
    left.sort(key=lambda each: each[0])
    ratio, best = left[0]
    if ratio * _CLEARLY > as_recorded.ratio:
        return None
    words = " or, as good, ".join(each.words for other, each in left if other < _ALIKE * ratio)
    return (
        f"the misfit of the plain model is {as_recorded.ratio:.3g} times that of noise alone in the first"
        f" {STAGES.touched * 1e3:g} ms{of_which(problem)}, and"
        f" {ratio:.2g} times with {words}: {best.question}"
    )


def _ratio(problem: Problem, drops: Sequence[MeasuredDrop], exchange: _Exchange) -> float | None:
    """Return the plain model's misfit ratio with the readings of an exchange put back; None where it cannot be computed."""
    put_back = tuple(drop for drop in map(exchange.put_back, drops) if drop is not None)
    if len(put_back) < len(drops):
        return None
    try:
        exchanged = replace(build_problem(problem.model.machine, put_back, problem.crew), standing=problem.standing)
        otherwise = first_fits(exchanged).get(STAGES.touched)
    except InputError:
        return None
    return None if otherwise is None else otherwise.ratio


def _exchanges(machine: Machine, drops: Sequence[MeasuredDrop]) -> Iterator[_Exchange]:
    """Yield the exchanges to try: all probes of both ends, paired by angle, and those suspected by the checks of every drop."""
    one, other = (sorted((p for p in drops[0].probes if p.end == end), key=lambda p: p.angle) for end in machine.ends)
    first, second = machine.ends
    if len(one) == len(other):
        yield _Exchange(
            tuple((a.name, b.name) for a, b in zip(one, other, strict=True)),
            f"the probes of {first} taken for those of {second}",
            "are the cables of both ends exchanged, or the positions in the machine file counted from the other end of the"
            " shaft?",
        )
    common = set.intersection(*(set(drop.whirls_backward) for drop in drops))
    ends = [end for end in machine.ends if end in common]
    pairs = tuple((a.name, b.name) for probes in (one, other) if (a := probes[0]).end in ends for b in probes[1:])
    if ends and len(pairs) == len(ends):
        words = " and of ".join(" and ".join(pair) for pair in pairs)
        turns = ", or 'rotation' in the machine file wrong" if len(ends) == len(machine.ends) else ""
        yield _Exchange(
            pairs,
            f"the readings of {words} exchanged",
            f"are their cables exchanged, or their angles in the machine file{turns}?",
        )
    if all(drop.crossed == drops[0].crossed for drop in drops):
        for pair in drops[0].crossed:
            yield _Exchange(
                (pair,),
                f"the readings of {' and '.join(pair)} exchanged",
                "are their cables exchanged between the ends?",
            )
