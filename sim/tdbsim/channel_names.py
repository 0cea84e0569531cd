"""Channel names of a machine in a simulated record, which must not clash with the record's unmeasured variables."""

from __future__ import annotations

from tdbsim.errors import InputError
from tdbsim.machine import Machine

# dimensions and variables of `tdbsim.drop_record` and `tdbsim.heat_record`
RESERVED = frozenset(
    (
        "time", "probe", "end", "ball", "energy_kind", "work_kind", "heat_end", "node", "part",
        "shaft_x", "shaft_y", "rotor_x", "rotor_y", "ring_x", "ring_y", "support_x", "support_y",
        "force_x", "force_y", "normal_force", "friction_force", "slip_speed", "depth", "peak_normal_force", "ball_load",
        "ring_speed", "cage_angle", "ring_angle", "shaft_angle", "rotor_speed", "energy", "work",
        "load_torque", "speed_torque", "spin_torque", "rub_heat", "inner_race_heat", "outer_race_heat",
        "warm_gap", "warm_clearance", "heat_supplied", "heat_lost", "heat_stored", "growth", "temperature_rise",
    )
)  # fmt: skip


def check_channel_names(machine: Machine) -> None:
    """Check that each channel of a simulated record has a unique name.

    Raises
    ------
    InputError
        If two channels have the same name in the file, or one has the name of an unmeasured variable.
    """
    taken: dict[str, str] = {}
    for name in machine.channel_names():
        channel = machine.channel_in_file(name)
        if channel in RESERVED:
            raise InputError(
                f"channel '{channel}' of '{name}' is a name that simulated records use for something else; give '{name}'"
                " another name in the machine file, in its own table or in [channels]"
            )
        if channel in taken:
            raise InputError(
                f"'{taken[channel]}' and '{name}' are both channel '{channel}'; correct [channels] in the machine file"
            )
        taken[channel] = name
