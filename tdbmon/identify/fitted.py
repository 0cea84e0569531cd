"""One drop with the model fitted to it: what `tdbmon analyse --forces` adds to the analysis."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import xarray as xr
from tdbsim.machine import Machine

from tdbmon.analysis.result import Analysis
from tdbmon.identify.agreement import Agreement, agreement
from tdbmon.identify.calibrate import Progress, fit_drops
from tdbmon.identify.calibration import Calibration
from tdbmon.identify.coast_down import CoastDown, coast_down
from tdbmon.identify.forces import DropForces, forces_of
from tdbmon.identify.friction_choice import FrictionChoice, choose_friction
from tdbmon.identify.natural_frequencies import NaturalFrequencies, natural_frequencies


@dataclass(frozen=True, eq=False)
class FittedDrop:
    """A calibration to one drop, and the forces of that drop.

    Attributes
    ----------
    calibration : Calibration
    forces : DropForces
    coast_down : CoastDown or None
        The drop simulated to its record's end; None where that was not asked for, or the record holds no coast-down.
    """

    calibration: Calibration
    forces: DropForces
    coast_down: CoastDown | None = None

    def with_coast_down(self, measured: Analysis) -> FittedDrop:
        """Return the same with the whole coast-down simulated, for the analysis of its record."""
        return replace(self, coast_down=coast_down(self.calibration, measured))

    @cached_property
    def agreement(self) -> Agreement:
        """The drop as measured against the drop as simulated."""
        return agreement(self.calibration)

    @cached_property
    def friction(self) -> FrictionChoice | None:
        """The friction as the source chooses it; None where the probes show the orbit of no end."""
        return choose_friction(self.calibration) if self.agreement.ends else None

    @cached_property
    def natural_frequencies(self) -> NaturalFrequencies:
        """Of the calibrated rotor at rest on its touchdown bearings."""
        return natural_frequencies(self.calibration)


def fit_drop(machine: Machine, record: xr.Dataset, progress: Progress) -> FittedDrop:
    """Fit the machine's model to one drop and simulate its forces.

    Raises
    ------
    InputError
        If the record cannot be used for it (see `tdbmon.identify.calibrate.fit_drops`).
    """
    calibration = fit_drops(machine, [record], progress=progress)
    progress("simulating the forces")
    return FittedDrop(calibration, forces_of(calibration)[0])
