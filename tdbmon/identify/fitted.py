"""A drop with the model fitted to it: what `tdbmon analyse --forces` adds to the analysis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain

import xarray as xr
from tdbsim.machine import Machine

from tdbmon.analysis.result import Analysis
from tdbmon.identify.agreement import Agreement, agreement
from tdbmon.identify.calibrate import fit_drops
from tdbmon.identify.calibration import Calibration
from tdbmon.identify.coast_down import CoastDown, coast_down
from tdbmon.identify.excursions import astray_remarks, later_remarks
from tdbmon.identify.forces import DropForces, forces_of
from tdbmon.identify.friction_choice import FrictionChoice, choose_friction
from tdbmon.identify.natural_frequencies import NaturalFrequencies, natural_frequencies
from tdbmon.progress import Progress
from tdbmon.quantity import printed


@dataclass(frozen=True, eq=False)
class FittedDrop:
    """A drop with its calibration, which may be on other drops too, and its forces.

    Attributes
    ----------
    calibration : Calibration
        Its first drop is this one.
    forces : DropForces
    coast_down : CoastDown or None
        The drop simulated to its record's end; None where not requested, or where the record has no coast-down.
    others : tuple of DropForces
        Of the drops that were fitted together with this one.
    notes : tuple of str
        Remarks for the first page, beside the forces: later blows, contradictory gaps.
    """

    calibration: Calibration
    forces: DropForces
    coast_down: CoastDown | None = None
    others: tuple[DropForces, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def all_forces(self) -> tuple[DropForces, ...]:
        """Forces of this drop and the others, in the order of the calibration's drops."""
        return (self.forces, *self.others)

    def beside(self, measured: Analysis) -> FittedDrop:
        """Return the same with a remark on each end whose fitted gap contradicts the analysis of the record."""
        if self.forces.withheld:
            return self
        found = gap_contradictions(self.calibration, measured)
        calibration = replace(self.calibration, remarks=(*self.calibration.remarks, *found))
        return replace(self, calibration=calibration, notes=(*self.notes, *found))

    def with_coast_down(self, measured: Analysis) -> FittedDrop:
        """Return the same with the whole coast-down simulated, for the analysis of its record."""
        return replace(self, coast_down=coast_down(self.calibration, measured))

    @cached_property
    def agreement(self) -> Agreement:
        """The measured against the simulated drop."""
        return agreement(self.calibration)

    @cached_property
    def friction(self) -> FrictionChoice | None:
        """The friction chosen by sensitivity; None where the probes determine the orbit of no end."""
        return choose_friction(self.calibration) if self.agreement.ends else None

    @cached_property
    def natural_frequencies(self) -> NaturalFrequencies:
        """Natural frequencies of the calibrated rotor at rest on its touchdown bearings."""
        return natural_frequencies(self.calibration)


def fit_drop(
    machine: Machine, record: xr.Dataset, progress: Progress, also: Sequence[xr.Dataset] = (), workers: int = 1
) -> FittedDrop:
    """Fit the machine's model to a drop and simulate its forces.

    Parameters
    ----------
    machine : Machine
    record : Dataset
    progress : callable
        Called with the name of each step as it begins.
    also : sequence of Dataset, optional
        Other drops of the machine in the same condition, fitted together with this one.
    workers : int
        Number of worker processes (see `tdbmon.identify.crew.Crew`).

    Raises
    ------
    InputError
        If a record cannot be used for a fit (see `tdbmon.identify.calibrate.fit_drops`).
    """
    calibration = fit_drops(machine, [record, *also], progress=progress, workers=workers)
    measured = calibration.problem.drops
    faults = [fault for drop in measured[1:] for fault in drop.faults]  # those of the first are in its analysis
    progress("simulating the forces")
    told = forces_of(calibration)
    notes = [
        (*astray_remarks(calibration, k, each), *later_remarks(drop, machine))
        for k, (drop, each) in enumerate(zip(measured, told, strict=True))
    ]
    calibration = replace(calibration, remarks=(*faults, *calibration.remarks, *chain.from_iterable(notes)))
    return FittedDrop(calibration, told[0], others=told[1:], notes=notes[0])


def gap_contradictions(calibration: Calibration, measured: Analysis) -> tuple[str, ...]:
    """Return remarks on ends where the gaps by the clearance circle of the settled shaft and by the fit exclude each other.

    The two are independent: the circle rests on an arc about the bottom and a straight line through the probes, the fit on
    falls and impacts and on the machine file.
    """
    found = []
    for name, end in measured.ends.items():
        circle, fit = end.air_gap, calibration.values.get(f"{name}.radial_gap")
        if fit is None or circle.low is None or circle.high is None or fit.low is None or fit.high is None:
            continue
        if circle.low > fit.high or fit.low > circle.high:
            found.append(
                f"{name}: the clearance circle gives an air gap of {printed(circle)}, the fit {printed(fit)}: they exclude each"
                " other. The circle is based on the settled arc and a straight line through the probes, the fit on falls and"
                f" impacts, with a residual of {calibration.misfit:.2f} times the noise: check the probes' positions and"
                " sensitivities and the balls' clearance"
            )
    return tuple(found)
