"""The named quantities of a drop, as used by the summary and the list of quantities not estimated."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from tdbmon.analysis.result import Analysis, EndResult
from tdbmon.estimate import Estimate, since

RESTITUTION = "Restitution (velocity after over before the contact)"
FIRST_TOUCH = "First touch, after the release [time in the record]"
ABOVE_ONE = "; above 1: the impact at the other end adds energy"
_NO_SPEED = "the record holds no speed"


@dataclass(frozen=True)
class Finding:
    """A quantity: its name, its end ("" for the rotor), its estimate, the unit for display, and a text shown after it."""

    name: str
    end: str
    estimate: Estimate
    unit: str | None = None
    beside: str = ""


def above_one(restitutions: Iterable[Estimate]) -> str:
    """Return the explanation, after the name of the restitution, why one of them exceeds one; "" if none does."""
    return ABOVE_ONE if any((estimate.value or 0.0) > 1 for estimate in restitutions) else ""


def all_findings(analysis: Analysis) -> list[Finding]:
    """Return the quantities of the rotor and of all ends."""
    return rotor_findings(analysis) + [f for end in analysis.ends.values() for f in end_findings(analysis, end)]


def rotor_findings(analysis: Analysis) -> list[Finding]:
    """Return the quantities of the whole rotor."""
    rundown = analysis.rundown
    release = analysis.release_time
    found = [Finding("Release, from the record's first sample", "", release)]
    if analysis.release is not None and analysis.release.force_decay.known:
        found.append(Finding("Decay time of the magnetic force", "", analysis.release.force_decay))
    for name, attribute, unit in (
        ("Speed at the release" if analysis.falls else "Speed as the record ends", "initial", "Hz"),
        ("Speed lost to contacts and ring spin-up", "lost_speed", "Hz"),
        ("Decay time of the speed", "decay_time", "s"),
        ("Torque of constant drag", "drag_torque", "N m"),
    ):
        estimate = Estimate.missing(unit, _NO_SPEED) if rundown is None else getattr(rundown, attribute)
        found.append(Finding(name, "", estimate))
    still = Estimate.missing("s", _NO_SPEED) if rundown is None else rundown.standstill_time
    unsure = f"; {still.why}" if still.known and still.low is None else ""
    found.append(Finding("Standstill, from the record's first sample", "", still, beside=unsure))
    found.append(Finding("Settled on the rings, after the release", "", analysis.settle_time))
    ways = ("", "") if analysis.swing is None else analysis.swing.ways
    for name, way, frequency in zip(("Lower", "Higher"), ways, analysis.swings, strict=True):
        shape = f" ({way})" if way else ""
        found.append(Finding(f"{name} swing in the clearance{shape}, small amplitude", "", frequency))
    return found


def end_findings(analysis: Analysis, end: EndResult) -> list[Finding]:
    """Return the quantities of one end."""
    circle, first = end.circle, end.first
    rows: list[tuple[str, Estimate, str | None]] = [
        ("Air gap", end.air_gap, None),
        ("Radius at rest", circle.radius, None),
        ("Settled radius, lower limit", circle.lower, None),
        ("Settled radius, upper limit", circle.upper, None),
        ("Radius at rest from the swing", end.gap_from_swing, None),
        ("Out-of-roundness of the settled arc", circle.oval, None),
        (FIRST_TOUCH, since(first.touch, analysis.release_time), None),
        ("First contact, duration", first.duration, "ms"),
        ("Rebound", first.rebound, None),
        (RESTITUTION, first.restitution, None),
        ("Deepest excursion", end.deepest, None),
        ("Single-mass stiffness", end.stiffness, None),
    ]
    return [
        Finding(name, end.name, estimate, unit, record_time(first.touch) if name == FIRST_TOUCH else "")
        for name, estimate, unit in rows
    ]


def record_time(instant: Estimate) -> str:
    """Return an instant as record time in brackets, to follow its time after the release."""
    return "" if instant.value is None else f" [{instant.value:.5f} s]"
