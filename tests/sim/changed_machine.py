"""Machines with some values changed, a plan followed exactly, and where a trajectory is at the touchdown bearings."""

from __future__ import annotations

from tdbsim import state_layout
from tdbsim.machine import Machine, Tolerant
from tdbsim.simulate import DropPlan

ADAPTIVE = DropPlan(150.0, 0.05, method="dormand_prince", tolerance=1e-10)


def changed(machine: Machine, rotor=None, ends=None, **fields) -> Machine:
    """Return the machine with some fields of itself, its rotor and both its touchdown bearings replaced."""
    if rotor:
        fields["rotor"] = machine.rotor.model_copy(update=rotor)
    if ends:
        fields["touchdown_bearings"] = tuple(each.model_copy(update=ends) for each in machine.touchdown_bearings)
    return machine.model_copy(update=fields)


def exactly(value):
    """A value without tolerance, as the machine holds it."""
    return Tolerant(nominal=value, low=value, high=value)


def at_ends(trajectory):
    """Shaft centres (k, 2), complex, at the touchdown bearings."""
    n, at = trajectory.model.n, trajectory.model.arrays.at_end
    modes = trajectory.state[:, state_layout.modes_x(n)] + 1j * trajectory.state[:, state_layout.modes_y(n)]
    return modes @ at.T
