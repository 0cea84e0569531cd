"""Subsets of a problem's drops, with the shared values held at those of the whole problem."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tdbmon.identify.parameters import Parameter
from tdbmon.identify.problem import Problem

Array = NDArray[np.float64]


def only(problem: Problem, drops: Sequence[int]) -> Problem:
    """Return the problem restricted to some of its drops."""
    free = tuple(
        replace(
            each,
            each_start=tuple(each.each_start[d] for d in drops) if each.each_start else (),
            each_held=tuple(each.each_held[d] for d in drops) if each.each_held else (),
        )
        for each in problem.free
    )
    return replace(
        problem, drops=tuple(problem.drops[d] for d in drops), own=tuple(problem.own[d] for d in drops), free=free
    )


def coordinates(problem: Problem, drops: Sequence[int]) -> NDArray[np.intp]:
    """Return the indices of some drops' coordinates in the vector of the whole problem, the shared ones first."""
    count = len(problem.shared)
    return np.concatenate([np.arange(count), *(problem.columns(drop)[count:] for drop in drops)])


def frozen(problem: Problem, shared: Array) -> Problem:
    """Return a problem with the shared values fixed at given coordinates, which become its nominal ones."""

    def stay(p: Parameter, z: float) -> Parameter:
        value = p.nominal + p.scale * z
        return replace(p, nominal=value, low=value, high=value, span=p.scale)

    return replace(problem, shared=tuple(stay(p, float(z)) for p, z in zip(problem.shared, shared, strict=True)))
