"""The drag that the machine file states of its inner rings, beside the constant drag of a run-down.

A rotor that rests on its touchdown bearings turns their inner rings with it, so that their drag is part of its constant drag;
other losses of the rotor that do not change with the speed are in that too.
"""

from __future__ import annotations

from tdbsim.effects.ring_drag import RingDrag
from tdbsim.machine import Machine
from tdbsim.quantity import Tolerant
from tdbsim.stated_effects import all_effects

from tdbmon.estimate import Estimate


def stated_ring_drag(machine: Machine) -> Tolerant:
    """Return the drag of all inner rings together, by the machine file with its effects, N m."""
    drags = [bearing.inner_ring_drag for bearing in machine.touchdown_bearings]
    added = sum(each.torque * len(each.ends(machine)) for each in all_effects(machine) if isinstance(each, RingDrag))
    nominal, low, high = (sum(getattr(drag, name) for drag in drags) + added for name in ("nominal", "low", "high"))
    return Tolerant(nominal=nominal, low=low, high=high)


def against_stated(measured: Estimate, stated: Tolerant, whirled: bool) -> str:
    """Return in words how a constant drag that is known lies to what is stated, and what that may mean.

    `whirled` says that the shaft went round its clearance, rubbing as it did.
    """
    if measured.value is None:
        raise ValueError("no constant drag to compare")
    low = measured.value if measured.low is None else measured.low
    high = measured.value if measured.high is None else measured.high
    if low > stated.high and whirled:
        return "above: the shaft whirled around its clearance, and its friction on the rings is in it"
    if low > stated.high:
        return (
            "above: it holds all losses of the rotor that do not change with the speed, not those of the rings alone, or"
            " the bearings turn harder than the machine file says"
        )
    if high < stated.low:
        return "below: the bearings turn more easily than the machine file says, or the shaft did not carry the rings with it"
    if stated.low <= low and high <= stated.high:
        return "within: though other losses of the rotor that do not change with the speed are in it too"
    return "where nothing is decided: its interval reaches over a limit of what is stated"
