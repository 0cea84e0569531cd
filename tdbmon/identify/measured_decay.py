"""The decay time of a calibrated machine from its run-down, since some tens of milliseconds of contacts hardly determine it.

A rotor that rests on its touchdown bearings turns their inner rings with it, so it decays more slowly than alone, in
proportion to the total polar inertia.
"""

from __future__ import annotations

from dataclasses import replace

from tdbsim.machine import Machine
from tdbsim.rotor import build_rotor

from tdbmon.analysis.rundown import RunDown
from tdbmon.estimate import Estimate
from tdbmon.identify.calibration import Calibration
from tdbmon.identify.parameters import calibrated_machine

NAME = "rotor.speed_decay_time"


def decay_of_rotor(rundown: RunDown | None, machine: Machine) -> Estimate | None:
    """Return the decay time of a rotor without rings, s, from a run-down; None where that does not determine it.

    A machine's drag consists of its decay time and the drag of its rings, so a linear term fitted beside a quadratic one is not
    comparable.
    """
    if rundown is None or rundown.law is None or rundown.law.quadratic or rundown.doubt:
        return None
    found = rundown.decay_time
    if found.value is None or found.low is None or found.high is None:
        return None
    inertia = build_rotor(machine).polar_inertia
    share = inertia / (inertia + sum(bearing.inner_ring_inertia for bearing in machine.touchdown_bearings))
    return replace(found, value=found.value * share, low=found.low * share, high=found.high * share)


def with_measured_decay(calibration: Calibration, rundown: RunDown | None) -> tuple[Machine, str]:
    """Return the calibrated machine with the decay time from the run-down where more certain than the fit's, and a remark."""
    machine, fitted = calibration.calibrated, calibration.values.get(NAME)
    measured = decay_of_rotor(rundown, machine)
    if measured is None or fitted is None or measured.sigma is None or fitted.sigma is None:
        return machine, ""
    if measured.sigma >= fitted.sigma:
        return machine, ""
    remark = (
        f"{NAME} is from the run-down of {calibration.drops[0].name}: {measured.low:.4g} to {measured.high:.4g} s without the"
        f" rings (from the fit: {fitted.low:.4g} to {fitted.high:.4g} s)."
    )
    return calibrated_machine(machine, {NAME: float(measured.value or 0.0)}), remark
