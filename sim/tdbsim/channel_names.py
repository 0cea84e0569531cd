"""The names of a machine's channels in a simulated record, beside which the record tells what no probe sees."""

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
    """Check that each channel of a simulated record keeps a place of its own.

    Raises
    ------
    InputError
        If two channels have one name in the file, or one has the name of what the simulation tells.
    """
    taken: dict[str, str] = {}
    for name in machine.channel_names():
        channel = machine.channel_in_file(name)
        if channel in RESERVED:
            raise InputError(
                f"channel '{channel}' of '{name}' is a name that a simulated record has for something else; give '{name}'"
                " another name in the machine file, there or in [channels]"
            )
        if channel in taken:
            raise InputError(
                f"'{taken[channel]}' and '{name}' are both channel '{channel}'; correct [channels] in the machine file"
            )
        taken[channel] = name
