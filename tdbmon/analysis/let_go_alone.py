"""Release by one magnetic bearing while the other one holds: the rotor tilts, and the released end falls faster or slower.

At first the held bearing still carries its static load, so that the net force on the rigid rotor is the missing force F alone,
the share of the weight that the released bearing had carried.  At position z from the centre of mass the shaft then falls with
the acceleration F (1 / M + z_F z / I).
"""

from __future__ import annotations

from collections.abc import Iterable

from tdbsim.machine import Machine
from tdbsim.rotor import RotorModel


def let_go_alone(machine: Machine, rotor: RotorModel, held: Iterable[str]) -> Machine:
    """Return the machine with gravity replaced by the acceleration of its released end while the other one is held.

    The machine itself if no end or every end is held, or if its magnetic bearings cannot be matched with the ends by name.

    Parameters
    ----------
    machine : Machine
    rotor : RotorModel
    held : iterable of str
        The ends that stay levitated.
    """
    place = {bearing.name: bearing.position for bearing in machine.magnetic_bearings}
    stays = set(machine.ends) & set(held)
    if len(stays) != 1 or set(place) != set(machine.ends):
        return machine
    (holds,), (falls,) = stays, set(machine.ends) - stays
    share, _ = rotor.shares(place[falls], place[holds])
    lever, end = (position - rotor.centre_of_mass for position in (place[falls], machine.bearing(falls).position))
    faster = share * (1 + rotor.total_mass * lever * end / rotor.diametral_inertia)
    return machine.model_copy(update={"gravity": faster * machine.gravity}) if faster > 0 else machine
