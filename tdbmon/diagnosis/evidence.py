"""Residuals, residual forces and slowing of the models behind a verdict, for readers to judge by themselves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tdbmon.diagnosis.contender import Contender
from tdbmon.diagnosis.diagnose import Diagnosis
from tdbmon.diagnosis.left_over import LeftOver, left_over
from tdbmon.diagnosis.residual_force import ResidualForce, residual_force
from tdbmon.diagnosis.slows_otherwise import slowings_of
from tdbmon.identify.slowing import Slowing

PLAIN, EXTENDED = "plain model", "extended model"  # what they are called in figures and tables
_SHOWN = 3  # drops in a figure


@dataclass(frozen=True, eq=False, kw_only=True)
class Evidence:
    """A diagnosis with the residuals of its models.

    Attributes
    ----------
    diagnosis : Diagnosis
    extended : Contender or None
        The likeliest model, where it has causes.
    plain_left : tuple of LeftOver
        Residuals of the plain model, one per drop.
    extended_left : tuple of LeftOver
        The same of the extended model, to the same horizon; empty without one.
    plain_force, extended_force : tuple of ResidualForce
    plain_slowing, extended_slowing : tuple of Slowing or None
        None if unknown, or without such a model.
    """

    diagnosis: Diagnosis
    extended: Contender | None
    plain_left: tuple[LeftOver, ...]
    extended_left: tuple[LeftOver, ...]
    plain_force: tuple[ResidualForce, ...]
    extended_force: tuple[ResidualForce, ...]
    plain_slowing: tuple[Slowing, ...] | None
    extended_slowing: tuple[Slowing, ...] | None

    @property
    def left(self) -> dict[str, tuple[LeftOver, ...]]:
        """What each model leaves, by what it is called."""
        return {PLAIN: self.plain_left} | ({} if self.extended is None else {EXTENDED: self.extended_left})

    @property
    def best_left(self) -> tuple[LeftOver, ...]:
        """Residuals of the likeliest model."""
        return self.extended_left or self.plain_left

    @property
    def shown(self) -> tuple[int, ...]:
        """Indices of the drops that figures show: the slowest, one between and the fastest."""
        return chosen([abs(left.omega) for left in self.plain_left])

    def shown_with(self, drop: int) -> tuple[int, ...]:
        """Indices of the drops in a figure about one of them, which takes the place of the one between."""
        return self.shown if drop in self.shown else (self.shown[0], drop, self.shown[-1])

    @property
    def selection(self) -> str:
        """Which drops the figures show and why, as a sentence after their captions; "" if they show all."""
        return self.selection_of(self.shown)

    def selection_of(self, shown: Sequence[int]) -> str:
        """Return the same sentence for other drops (see `shown_with`)."""
        if len(shown) == len(self.plain_left):
            return ""
        between = "one between" if tuple(shown) == self.shown else "the one that deviates most"
        names = ", ".join(self.plain_left[k].name for k in shown)
        return f" Of the {len(self.plain_left)} drops, the slowest, {between} and the fastest are shown here: {names}."


def evidence_of(diagnosis: Diagnosis) -> Evidence:
    """Simulate the fitted models once more and collect their residuals.

    Raises
    ------
    InputError
        If a model cannot be simulated to the horizon of the likeliest one.
    """
    best, plain = diagnosis.best, diagnosis.plain
    extended = best if best.causes else None
    plain_left = left_over(plain, best.horizon)
    extended_left = left_over(extended, best.horizon) if extended is not None else ()
    return Evidence(
        diagnosis=diagnosis,
        extended=extended,
        plain_left=plain_left,
        extended_left=extended_left,
        plain_force=tuple(residual_force(left) for left in plain_left),
        extended_force=tuple(residual_force(left) for left in extended_left),
        plain_slowing=slowings_of(plain),
        extended_slowing=slowings_of(extended) if extended is not None else None,
    )


def chosen(speeds: Sequence[float]) -> tuple[int, ...]:
    """Return the indices of at most three speeds, evenly spaced in the sorted order, the slowest first."""
    order = np.argsort(speeds, kind="stable")
    if len(order) <= _SHOWN:
        return tuple(int(k) for k in order)
    return tuple(int(order[k]) for k in np.linspace(0, len(order) - 1, _SHOWN).round().astype(int))
