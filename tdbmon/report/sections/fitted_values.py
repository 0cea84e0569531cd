"""Table of the fitted values beside those of the machine file, marking those that the drops hardly determine."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tdbsim.machine import Machine
from tdbsim.power_law import LINE_CONTACT, REFERENCE_DEPTH, scaled_stiffness

from tdbmon.estimate import Estimate
from tdbmon.identify.parameters import file_values, sensor_parameters, stated_parameters
from tdbmon.quantity import short, toleranced, words
from tdbmon.report.document import Row, Table

if TYPE_CHECKING:
    from tdbmon.identify.calibration import Calibration
    from tdbmon.identify.fitted import FittedDrop

_UNBALANCE = {
    "amount": "amount of the unbalance",
    "phase": "phase of the unbalance",
    "along": "unbalance along its stated phase",
    "across": "unbalance across its stated phase",
}
_OTHER_LAW = 1e-3  # least difference from the exponent of a line contact that is reported


def fitted_values(fitted: FittedDrop) -> Table:
    """Return the table of the fitted values."""
    calibration = fitted.calibration
    machine = calibration.machine
    loose = {each.name: each for each in calibration.undetermined}
    untold = {p.name for p in (*stated_parameters(machine), *sensor_parameters(machine))}
    stated = file_values(machine)
    rows = []
    for name, value in calibration.values.items():
        remarks = [law] if (law := _law(calibration, name)) else []
        if name in calibration.at_bound:
            edge = "at the limit of its range" if name in untold else "at the limit of its tolerance"
            remarks.append(f"{edge}: the true value may lie beyond, or the model lacks something")
        elif name in loose:
            partners = ", ".join(value_words(partner, machine) for partner, _ in loose[name].partners)
            drops = "these drops" if fitted.others else "this drop"
            remarks.append(f"hardly determined by {drops}" + (f"; correlated with {partners}" if partners else ""))
        in_file = toleranced(stated[name], value.unit) if name in stated else "–"
        rows.append(Row((value_words(name, machine), words(value), in_file, "; ".join(remarks))))
    header = ("Value", "Fitted", "Machine file (tolerance)", "Remark")
    return Table("Fitted values (95 % intervals) and values of the machine file", header, tuple(rows))


def value_words(name: str, machine: Machine) -> str:
    """Return the readable name of a fitted value: ``NDE: support stiffness`` for ``NDE.support_stiffness``."""
    owner, _, field = name.rpartition(".")
    if owner in {plane.name for plane in machine.rotor.unbalance}:
        return f"{owner}: {_UNBALANCE.get(field, field)}"
    if field in ("centre_x", "centre_y"):
        return f"{owner}: bearing's centre {field[-1]} from the probes' zero"
    if field == "contact_stiffness":
        return f"{owner}: contact stiffness from the force at {REFERENCE_DEPTH * 1e6:.0f} µm"
    if owner.startswith("magnet "):
        owner = f"magnetic bearing {owner.removeprefix('magnet ')}"
    return f"{owner}: {field.replace('_', ' ')}"


def _law(calibration: Calibration, name: str) -> str:
    """Return the contact law as text if its exponent differs from that in the unit of the stiffness; else ""."""
    owner, _, field = name.rpartition(".")
    if field != "contact_stiffness":
        return ""
    bearing = calibration.calibrated.bearing(owner)
    exponent = bearing.contact_exponent
    if abs(exponent - LINE_CONTACT) < _OTHER_LAW:
        return ""
    stiffness = short(Estimate(scaled_stiffness(bearing.contact_stiffness, exponent)))
    return f"with the exponent {exponent:.3f} the force is {stiffness} N/m^{exponent:.3f} times depth^{exponent:.3f}"
