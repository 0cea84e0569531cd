"""The drag that the machine file states of its inner rings, beside the constant drag of a run-down.

A rotor that rests on its touchdown bearings turns their inner rings with it, so that their drag is part of its constant drag;
other losses of the rotor that do not change with the speed are in that too.  Not all of the rings' drag is: the journal rolls in
a wider ring, on which the same force has the longer lever, and the rings coast on with the rotor by their own inertia.  With r
and b the radii of journal and bore, I the rotor's polar inertia and J a ring's, a rotor taken for I alone shows

    sum(T r/b)  I / (I + sum(J (r/b)^2))

A rolling bearing also resists in proportion to its load P, by mu P d/2 on a bore of the diameter d; bearing makers estimate so
with mu = 0.0015 for deep-groove and 0.002 for angular contact ball bearings.
"""

from __future__ import annotations

from collections.abc import Sequence

from tdbsim.effects.ring_drag import RingDrag
from tdbsim.machine import Machine
from tdbsim.quantity import Tolerant
from tdbsim.rotor import RotorModel
from tdbsim.stated_effects import all_effects

from tdbmon.estimate import Estimate

_LEAST_FRICTION, _GREATEST_FRICTION = 0.0007, 0.003  # of a ball bearing under load, by its kind and its grease


def stated_ring_drag(machine: Machine) -> Tolerant:
    """Return the drag of all inner rings together, by the machine file with its effects, N m."""
    return _added_up(machine, [1.0] * len(machine.touchdown_bearings))


def drag_on_rotor(machine: Machine, polar_inertia: float) -> Tolerant:
    """Return the part of it that a rotor shows by its own polar inertia, kg m^2, which is less by the formula above, N m."""
    rings = machine.touchdown_bearings
    gears = [ring.journal_radius / (ring.journal_radius + ring.radial_gap.nominal) for ring in rings]
    along = sum(ring.inner_ring_inertia * gear**2 for ring, gear in zip(rings, gears, strict=True))
    share = polar_inertia / (polar_inertia + along)
    return _added_up(machine, [share * gear for gear in gears])


def load_torque(machine: Machine, rotor: RotorModel) -> float:
    """Return the weight times the radius of the bores that it lies in, their mean, N m."""
    radii = [ring.journal_radius + ring.radial_gap.nominal for ring in machine.touchdown_bearings]
    return rotor.total_mass * machine.gravity * sum(radii) / len(radii)


def _added_up(machine: Machine, shares: Sequence[float]) -> Tolerant:
    """Return the sum of such a share of each ring's drag, N m."""
    drags = [bearing.inner_ring_drag for bearing in machine.touchdown_bearings]
    effects = [each for each in all_effects(machine) if isinstance(each, RingDrag)]
    added = sum(each.torque * shares[i] for each in effects for i in each.ends(machine))
    nominal, low, high = (
        sum(share * getattr(drag, name) for share, drag in zip(shares, drags, strict=True)) + added
        for name in ("nominal", "low", "high")
    )
    return Tolerant(nominal=nominal, low=low, high=high)


def against_stated(measured: Estimate, stated: Tolerant, whirled: bool, load: float) -> str:
    """Return in words how a constant drag that is known lies to what is stated (`drag_on_rotor`), and what that may mean.

    Parameters
    ----------
    measured : Estimate
        N m.
    stated : Tolerant
        N m.
    whirled : bool
        Whether the shaft went round its clearance, rubbing as it did.
    load : float
        `load_torque`, N m.
    """
    if measured.value is None:
        raise ValueError("no constant drag to compare")
    low = measured.value if measured.low is None else measured.low
    high = measured.value if measured.high is None else measured.high
    if low > stated.high and whirled:
        return "above: the shaft whirled around its clearance, and its friction on the rings is in it"
    if low > stated.high:
        said = (
            "above: it holds all losses of the rotor that do not change with the speed, not those of the rings alone, or"
            " the bearings turn harder than the machine file says"
        )
        friction = (measured.value - stated.nominal) / load
        if _LEAST_FRICTION < friction < _GREATEST_FRICTION:
            said += (
                f". What is more than stated is {friction:.2g} of the weight at the radius of the bores, where rolling bearings"
                " take 0.001 to 0.002 of their load: the stated drag may be that of unloaded rings"
            )
        return said
    if high < stated.low:
        return "below: the bearings turn more easily than the machine file says, or the shaft did not carry the rings with it"
    if stated.low <= low and high <= stated.high:
        return "within: though other losses of the rotor that do not change with the speed are in it too"
    return "where nothing is decided: its interval reaches over a limit of what is stated"
