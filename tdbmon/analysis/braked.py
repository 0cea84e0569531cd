"""Test whether contacts can explain the deceleration of a run-down, or whether the drive brakes.

Contacts decelerate a rotor by friction only, whether it spins up the rings or rubs on them.  Averaged over bounces the rotor
loads its bearings with no more than its weight m g, unless it whirls; so friction at the journal radius r decelerates it by
mu m g r / I_p at most.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from tdbsim.machine import STANDARD_GRAVITY, Machine
from tdbsim.rotor import RotorModel

from tdbmon.analysis.rundown import RunDown
from tdbmon.estimate import Estimate

_STEEL = 0.5  # friction coefficient of dry steel on steel, about the highest


def most_friction(machine: Machine, rotor: RotorModel) -> tuple[float, float]:
    """Return the greatest friction torque of contacts on a rotor that does not whirl, N m, and the friction coefficient used."""
    friction = max(_STEEL, *(bearing.friction.high for bearing in machine.touchdown_bearings))
    radius = max(bearing.journal_radius for bearing in machine.touchdown_bearings)
    return friction * rotor.total_mass * STANDARD_GRAVITY * radius, friction


def beyond_contacts(rundown: RunDown, machine: Machine, rotor: RotorModel, release: float) -> RunDown:
    """Return the run-down of a rotor that did not whirl, with a doubt if it decelerates more than contacts can explain.

    Parameters
    ----------
    rundown : RunDown
    machine : Machine
    rotor : RotorModel
        Of the machine.
    release : float
        Instant of the release, s.
    """
    torque, friction = most_friction(machine, rotor)
    drag, lost = rundown.drag_torque, rundown.lost_speed
    if drag.low is not None and drag.low > torque:
        doubt = (
            f"a constant drag of {drag.value:.3g} N m exceeds the friction torque of contacts ({torque:.2g} N m at a friction"
            f" coefficient of {friction:g}, with the machine file's mass and polar inertia): does the drive brake?"
        )
        rundown = replace(rundown, doubt=rundown.doubt or doubt)
    if lost.low is None or rundown.fitted_from is None:
        return rundown
    seconds = rundown.fitted_from - release
    most = torque * seconds / (2 * np.pi * rotor.polar_inertia)
    if lost.low <= most:
        return rundown
    doubt = (
        f"in the first {seconds:.2g} s the rotor loses {lost.value:.3g} Hz more than by its later drag; contacts and rings"
        f" explain {most:.2g} Hz at most (at a friction coefficient of {friction:g}, with the machine file's mass and polar"
        " inertia): does the drive brake at first?"
    )
    return replace(rundown, lost_speed=Estimate.missing("Hz", doubt), doubt=doubt)
