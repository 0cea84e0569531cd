"""Frequency bands of lines predicted from the drawing: both swings, and the modes on touchdown bearings under the weight."""

from __future__ import annotations

from tdbsim.machine import Machine
from tdbsim.modes import supported
from tdbsim.rotor import RotorModel, static_loads

from tdbmon.analysis.line_names import Band
from tdbmon.analysis.mode_names import mode_names
from tdbmon.analysis.rest import rest_travel
from tdbmon.analysis.swing import Swing, predicted_swing

_MEASURED, _PREDICTED = (0.97, 1.03), (0.85, 1.15)  # relative band of a swing: measured, from the drawing alone
# relative to the bearing stiffness under the weight: lower limit of a mode's band, nominal mode, upper limit
_STIFFNESS = (0.7, 1.0, 1.5)


def expected_lines(machine: Machine, rotor: RotorModel, swing: Swing | None) -> list[Band]:
    """Return the frequency bands of named lines; those of the swings are centred on the measured `swing`, if any."""
    bands = []
    for i, predicted in enumerate(predicted_swing(machine, rotor)):
        measured = swing.frequencies[i].value if swing is not None else None
        low, high = _MEASURED if measured is not None else _PREDICTED
        centre = predicted if measured is None else measured
        bands.append(Band(f"swing {i + 1}", low * centre, high * centre, swing=True))
    loads = static_loads(machine, rotor)
    stiffness = {b.name: loads[b.name] / rest_travel(b, loads[b.name]).per_load for b in machine.touchdown_bearings}
    soft, nominal, stiff = (
        supported(machine, rotor, {end: share * k for end, k in stiffness.items()}) for share in _STIFFNESS
    )
    names = mode_names(nominal, [b.position for b in machine.touchdown_bearings])
    lowest, highest = (modes.frequencies[::2].tolist() for modes in (soft, stiff))
    return bands + [Band(*band) for band in zip(names, lowest, highest, strict=True)]
