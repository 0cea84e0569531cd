"""Stepwise integration of a drop by the method of its plan; with the splitting, several calls give the same as one."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from tdbsim import dormand_prince, hooks, splitting, state_layout
from tdbsim.columns import GAP, SHAPE_REACH
from tdbsim.drop_model import Array, DropModel
from tdbsim.effect import declaration
from tdbsim.errors import InputError
from tdbsim.first_use import compile_apart
from tdbsim.mode_rows import ROW as MOST_MODES
from tdbsim.usual_step import usual_step

if TYPE_CHECKING:
    from tdbsim.simulate import DropPlan


class Integration:
    """Stepwise integration of a drop without heat.

    Attributes
    ----------
    model : DropModel
        Its arrays may be changed between calls of `through`.
    plan : DropPlan
    state : (size,) array
        At `time`; may be changed between calls.
    time : float
        s after the release.
    """

    def __init__(self, model: DropModel, plan: DropPlan, start: Array, peak: Array) -> None:
        """Begin with a state at the release; `peak` (2,) is updated to the greatest normal forces, N.

        Raises
        ------
        InputError
            If the rotor has more modes than the method supports.
        """
        if plan.method == "splitting":
            check_modes(model.n)
        compile_apart(plan.method, model, plan)
        self.model, self.plan, self.time = model, plan, 0.0
        self.state = start.copy()
        self._peak = peak
        self._adaptive_step = 1e-6
        self._step = longest_step(model, plan)
        self._pace = np.array(splitting.START)

    def through(self, times: Array, out: Array) -> None:
        """Fill `out` (k, size) with the states at ascending instants (k,), s after the release.

        Raises
        ------
        InputError
            If the integration does not converge, or frictional heat closes the gap.
        """
        if not len(times):
            return
        if self.plan.method == "dormand_prince":
            self._through_adaptive(times, out)
            return
        t = splitting.integrate(
            self.model.arrays, self.state, self.time, self._step, times, out, self._peak, self._pace
        )
        check_open(self.model, t, times, out)
        check_finite(t, times, out)
        self.time = t

    def _through_adaptive(self, times: Array, out: Array) -> None:
        scale = error_scale(self.model.n)
        code, t, step, _ = dormand_prince.integrate(
            self.model.arrays, self.state, self.time, self._adaptive_step, 5e-4, self.plan.tolerance, scale, times, out
        )
        check_open(self.model, t, times, out)
        if code != dormand_prince.DONE:
            raise InputError(f"the integration does not converge {t:.6g} s after the release; raise 'tolerance'")
        # the last step went beyond the last instant
        self.state, self.time, self._adaptive_step = out[-1].copy(), float(times[-1]), step


def longest_step(model: DropModel, plan: DropPlan) -> float:
    """Return the greatest usual step of the splitting for a drop, s."""
    return usual_step(model) if plan.step is None else plan.step


def check_modes(n: int) -> None:
    """Raise InputError where a rotor has more modes per plane than the splitting supports."""
    if n > MOST_MODES:
        raise InputError(
            f"{n} modes per plane are more than 'splitting' supports ({MOST_MODES}); reduce 'bending' by {n - MOST_MODES}"
        )


def check_finite(reached: float, times: Array, out: Array) -> None:
    """Raise InputError where the splitting did not reach the last instant, or its last state is not finite."""
    if reached < times[-1] or not math.isfinite(out[-1].sum()):  # a non-finite state stays so
        raise InputError(
            f"the integration diverged {reached:.6g} s after the release; make 'step' smaller if it is"
            " given, or check the machine's stiffnesses, masses and dampings"
        )


def check_open(model: DropModel, reached: float, times: Array, out: Array) -> None:
    """Raise InputError where an effect of frictional heat closed the gap by the time reached: the rotor is then stuck."""
    for end in np.flatnonzero(np.isinf(model.arrays.end[:, SHAPE_REACH])):
        row, gap = model.arrays.effect[end], float(model.arrays.end[end, GAP])
        heat = out[times <= reached, state_layout.work(model.n) + state_layout.HEAT + end]
        for effect in model.effects:
            kind = declaration(effect.identifier())
            if end not in effect.ends(model.machine) or not hooks.has_hook(kind, "gap"):
                continue
            law, start = kind.module.gap, hooks.offsets()[kind.identifier]
            cold = law(0.0, 0.0, row, start)[0]
            if not len(heat) or not gap + law(0.0, float(heat.max()), row, start)[0] <= cold:
                continue
            closed = next(k for k, each in enumerate(heat) if gap + law(0.0, float(each), row, start)[0] <= cold)
            raise InputError(
                f"touchdown_bearing '{model.machine.ends[end]}': {kind.identifier} has closed the gap of {gap * 1e6:.4g} um by"
                f" {times[closed]:.4g} s after the release, with {heat[closed]:.3g} J of frictional heat in the bearing;"
                " make the effect smaller, or simulate a shorter time"
            )


def error_scale(n: int) -> Array:
    """Return the scale of each component of the state for the error control."""
    scale = np.ones(state_layout.size(n))  # of modal velocities, of angles, of the rings' speeds and of work
    bodies, angles, rates = state_layout.bodies(n, 0), state_layout.shaft_angle(n), state_layout.positions(n)
    scale[:bodies], scale[bodies:angles] = 1e-3, 1e-4
    scale[rates + bodies : rates + angles] = 0.1
    scale[state_layout.omega(n)] = 1e-2
    return scale
