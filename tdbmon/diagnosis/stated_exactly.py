"""Values that a machine file states exactly though no fit follows drops unless they are free; then the file is at fault."""

from __future__ import annotations

from tdbsim.machine import Machine

_NEEDED = ("radial_gap", "support_stiffness", "friction")  # of each bearing: they determine the first contacts


def stated_exactly(machine: Machine) -> list[str]:
    """Return, in words, the `_NEEDED` values without tolerance, and the unbalance if no plane of it is stated."""
    found = [
        f"{field.replace('_', ' ')} of {bearing.name}"
        for bearing in machine.touchdown_bearings
        for field in _NEEDED
        if getattr(bearing, field).is_exact
    ]
    if not machine.rotor.unbalance:
        found.append("unbalance (no plane is stated)")
    return found


def exact_remarks(machine: Machine) -> tuple[str, ...]:
    """Return the remark that lists `stated_exactly`, if there are any."""
    stated = stated_exactly(machine)
    if not stated:
        return ()
    return (
        f"the machine file states no tolerance for {'; '.join(stated)}: the fit cannot correct an error in these values,"
        " and a cause may seem to explain it",
    )
