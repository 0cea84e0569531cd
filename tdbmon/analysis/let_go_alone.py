"""One magnetic bearing lets go while the other one holds: the rotor turns about a point, and its end falls faster or slower.

At first the held bearing carries what it carried, so that the rigid rotor is moved by the missing force F alone, the share of
the weight that the bearing which lets go had carried.  At z, from the centre of mass, the shaft then falls with
F (1 / M + z_F z / I).
"""

from __future__ import annotations

from collections.abc import Iterable

from tdbsim.machine import Machine
from tdbsim.rotor import RotorModel


def let_go_alone(machine: Machine, rotor: RotorModel, held: Iterable[str]) -> Machine:
    """Return the machine with the acceleration in place of gravity with which its end falls while the other one is held.

    The machine itself where no end is held, or where its magnetic bearings do not tell whose is whose.

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
