"""Inner-ring drag stated in the machine file, compared with the constant drag of a run-down.

A rotor resting on its touchdown bearings drives their inner rings, so that their drag torque T is part of its constant drag,
together with its other losses that do not depend on speed.  The rotor does not see all of it: the journal rolls in a wider bore,
where the same force has a longer lever arm, and the inertia of the rings coasts with the rotor.  With r and b the radii of
journal and bore, I the rotor's polar inertia and J that of a ring, a torque computed with I alone contains

    sum(T r/b)  I / (I + sum(J (r/b)^2))

A rolling bearing also has a friction torque proportional to its load P, mu P d/2 with the bore diameter d; bearing makers
estimate it with mu = 0.0015 for deep-groove and 0.002 for angular contact ball bearings.
"""

from __future__ import annotations

from collections.abc import Sequence

from tdbsim.effects.ring_drag import RingDrag
from tdbsim.machine import Machine
from tdbsim.quantity import Tolerant
from tdbsim.rotor import RotorModel
from tdbsim.stated_effects import all_effects

from tdbmon.estimate import Estimate

_LEAST_FRICTION, _GREATEST_FRICTION = 0.0007, 0.003  # friction coefficient of a loaded ball bearing, by type and grease


def stated_ring_drag(machine: Machine) -> Tolerant:
    """Return the total drag torque of all inner rings, by the machine file with its effects, N m."""
    return _added_up(machine, [1.0] * len(machine.touchdown_bearings))


def drag_on_rotor(machine: Machine, polar_inertia: float) -> Tolerant:
    """Return the part of it in a torque computed with the rotor's polar inertia, kg m^2, alone (see the module), N m."""
    rings = machine.touchdown_bearings
    gears = [ring.journal_radius / (ring.journal_radius + ring.radial_gap.nominal) for ring in rings]
    along = sum(ring.inner_ring_inertia * gear**2 for ring, gear in zip(rings, gears, strict=True))
    share = polar_inertia / (polar_inertia + along)
    return _added_up(machine, [share * gear for gear in gears])


def load_torque(machine: Machine, rotor: RotorModel) -> float:
    """Return the weight of the rotor times the mean radius of the bores in which it lies, N m."""
    radii = [ring.journal_radius + ring.radial_gap.nominal for ring in machine.touchdown_bearings]
    return rotor.total_mass * machine.gravity * sum(radii) / len(radii)


def _added_up(machine: Machine, shares: Sequence[float]) -> Tolerant:
    """Return the sum of the drag of the rings, each multiplied by its share, N m."""
    drags = [bearing.inner_ring_drag for bearing in machine.touchdown_bearings]
    effects = [each for each in all_effects(machine) if isinstance(each, RingDrag)]
    added = sum(each.torque * shares[i] for each in effects for i in each.ends(machine))
    nominal, low, high = (
        sum(share * getattr(drag, name) for share, drag in zip(shares, drags, strict=True)) + added
        for name in ("nominal", "low", "high")
    )
    return Tolerant(nominal=nominal, low=low, high=high)


def against_stated(measured: Estimate, stated: Tolerant, whirled: bool, load: float) -> str:
    """Return a statement that compares a measured constant drag with the stated one (`drag_on_rotor`), and its likely cause.

    Parameters
    ----------
    measured : Estimate
        N m.
    stated : Tolerant
        N m.
    whirled : bool
        Whether the shaft whirled around its clearance, rubbing on the rings.
    load : float
        Result of `load_torque`, N m.

    Raises
    ------
    ValueError
        If `measured` is missing.
    """
    if measured.value is None:
        raise ValueError("no constant drag to compare")
    low = measured.value if measured.low is None else measured.low
    high = measured.value if measured.high is None else measured.high
    if low > stated.high and whirled:
        return "above: it includes the friction of the shaft on the rings, as the shaft whirled around its clearance"
    if low > stated.high:
        said = (
            "above: it includes all losses of the rotor that do not change with the speed, not only those of the rings, or"
            " the bearings have more drag than the machine file says"
        )
        friction = (measured.value - stated.nominal) / load
        if _LEAST_FRICTION < friction < _GREATEST_FRICTION:
            said += (
                f". The excess is {friction:.2g} of the weight, at the radius of the bores; rolling bearings have a friction of"
                " 0.001 to 0.002 of their load: the stated drag may be that of unloaded rings"
            )
        return said
    if high < stated.low:
        return "below: the bearings have less drag than the machine file says, or the shaft did not drive the rings"
    if stated.low <= low and high <= stated.high:
        return "within, though it also includes other losses of the rotor that do not change with the speed"
    return "across a limit of the stated range with its interval: the comparison is inconclusive"
