"""Check of the fitted clearance circle against the levitated position, which lies near the centre of the clearance.

The settled shaft covers only an arc, which determines the curvature at the bottom.  In a bore that is not round this is not its
radius, and the centre of the circle then lies far from the levitated position.
"""

from __future__ import annotations

from collections.abc import Iterable

from tdbsim.machine import Machine

from tdbmon.analysis.release import Release
from tdbmon.analysis.result import EndResult
from tdbmon.record.finding import Check, um

_CHECK = "set point"
_NO_CENTRE = "the check of the set point failed: if the bore is not round, the centre of its circle is not the clearance centre"
_MOST = 0.25  # largest plausible offset of a set point from the centre, in gaps; the shipped machines stay within 0.2


def check_set_point(ends: dict[str, EndResult], release: Release, machine: Machine) -> list[Check]:
    """Check that the shaft levitated near the centre of the clearance circle, at each end that has one."""
    found = []
    for name, end in ends.items():
        state = release.states.get(name)
        if state is None or end.gap is None:
            continue
        away = end.gap.away(state.levitated, "mean levitated position, from the clearance centre")
        if away.value is None or away.high is None:
            continue
        apart, half = away.value, away.high - away.value
        gap = machine.bearing(name).radial_gap.nominal
        passed = apart - half < _MOST * gap
        detail = f"the shaft levitated {um(apart)} (± {um(half)}) from the centre of its clearance, {apart / gap:.2f} of the gap"
        if not passed:
            detail += (
                ": the bore is not round (then the arc gives only its curvature at the bottom, and radius and air gap are wrong),"
                " or the set point of the magnetic bearing is off"
            )
        found.append(Check(_CHECK, name, passed, detail))
    return found


def no_centre(checks: Iterable[Check], end: str) -> str:
    """Return why the circle of an end does not give the clearance centre; "" unless its set point check failed."""
    failed = any(check.check == _CHECK and check.channel == end and not check.passed for check in checks)
    return _NO_CENTRE if failed else ""
