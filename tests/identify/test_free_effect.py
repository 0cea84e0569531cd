"""Effects with parameters that a fit may move: what they change, the shaft's motion or how it is seen."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from tdbsim.columns import GAP
from tdbsim.effect import Effect, EffectDeclaration, Place, catalogue, parameter

from tdbmon.identify.free_effect import FreeEffect

HORIZON = 0.02


@dataclass(frozen=True)
class WornProbeSide(Effect):
    """A bearing worn where a probe is, which reads too much: `modify` and `sense` in one effect."""

    place: ClassVar = Place.BEARING
    wear: float = parameter("um", 0.0, (0.0, 50.0), 10.0, "gap worn away", si="m")

    def modify(self, draft):
        for end in self.ends(draft.machine):
            draft.arrays.end[end, GAP] += self.wear

    def sense(self, chain, machine, sampling):
        probe = machine.probes_at(self.where)[0].name
        link = chain.of(probe)
        return replace(chain, probes={**chain.probes, probe: replace(link, gain=link.gain * (1 + self.wear / 1e-4))})


BOTH = EffectDeclaration(WornProbeSide, sys.modules[__name__])


def test_effects_of_sensors_are_those_that_leave_the_motion_alone():
    found = {each.identifier for each in catalogue() if each.acts_on_sensors}
    assert found == {"probe_gain", "probe_angle", "probe_runout", "probe_crosstalk", "channel_lag"}
    assert not BOTH.acts_on_sensors


def test_slopes_of_an_effect_of_both_are_differences_of_residuals(problem):
    """The unchanged model, or the unchanged probes, would leave a part of them out."""
    free = FreeEffect(BOTH, "NDE", {}, {"wear": 5e-6})
    wider = replace(problem, shared=(*problem.shared, *free.shared), free=(free,))
    column, (wear,) = len(problem.shared), free.shared
    base, slopes = wider.slopes(wider.start, 0, HORIZON, among=[wear.name])
    near = wider.start.copy()
    near[column] += wear.nudge
    expected = (wider.residual(near, 0, HORIZON) - base) / wear.nudge
    np.testing.assert_allclose(slopes[:, column], expected, atol=1e-5 * np.abs(expected).max())
