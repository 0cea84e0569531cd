"""Which effects of a machine file can stand in the model of several drops.

An angle that differs from drop to drop (lobes, waves and runout that turn with what they are on) is in the file as it was in one
drop.  In other drops such an effect would stand at a wrong angle, and keep its like from being a suspect at its place.  So it is
left out and sought again.  The number of a ball stays: it is relative to the cage's angle, which is fitted to each drop.
"""

from __future__ import annotations

from tdbsim.effect import Effect
from tdbsim.machine import Machine
from tdbsim.stated_effects import from_setting

from tdbmon.identify.free_effect import place_in_words


def standing_in_all_drops(machine: Machine) -> tuple[Machine, tuple[str, ...]]:
    """Return the machine without effects at an angle that differs from drop to drop, and a remark on each of these."""
    kept, remarks = [], []
    for setting in machine.effects:
        effect = from_setting(setting)
        if not _at_own_angle(effect):
            kept.append(setting)
            continue
        remarks.append(
            f"{setting.name} at {place_in_words(setting.where)} is in the machine file at the angle of one drop, which differs"
            " from drop to drop: it is left out of the model and sought again; if it is named again, it is not new"
        )
    return machine.model_copy(update={"effects": tuple(kept)}) if remarks else machine, tuple(remarks)


def _at_own_angle(effect: Effect) -> bool:
    turns = any(each.per_drop and not each.whole for each in effect.parameters())
    return turns and not effect.stands_still(effect.values)
