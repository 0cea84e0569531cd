"""What a machine file states exactly though drops need it free: no fit follows them then, and only the file is wrong."""

from __future__ import annotations

from tdbsim.machine import Machine

_NEEDED = ("radial_gap", "support_stiffness", "friction")  # of each bearing: what the first contacts are made of


def stated_exactly(machine: Machine) -> list[str]:
    """Return, in words, what a file gives no tolerance that nobody knows so well; unbalance where it has no plane of it."""
    found = [
        f"{field.replace('_', ' ')} of {bearing.name}"
        for bearing in machine.touchdown_bearings
        for field in _NEEDED
        if getattr(bearing, field).is_exact
    ]
    if not machine.rotor.unbalance:
        found.append("unbalance, of which no plane is stated")
    return found


def exact_remarks(machine: Machine) -> tuple[str, ...]:
    """Return what there is to say of them."""
    stated = stated_exactly(machine)
    if not stated:
        return ()
    return (
        f"the machine file gives no tolerance to {'; '.join(stated)}: no fit makes up for what is off in what it states of them,"
        " and a cause may seem to",
    )
