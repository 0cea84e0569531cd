"""Natural frequencies of the calibrated rotor at rest on its touchdown bearings, against support stiffness and speed.

The critical speed map of N. Neisi (dissertation, LUT University, fig. 4.23), with the support modelled as here: a mass on a
spring, under balls and contact.  Both supports are stiffened by the same factor, so the factor 1 gives the machine's own
frequencies.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from tdbsim.machine import Machine
from tdbsim.modes import Modes
from tdbsim.rotor import RotorModel, build_rotor

from tdbmon.analysis.resting_modes import RestingEnd, RestingModes, resting_basis, resting_ends, resting_modes
from tdbmon.estimate import Estimate
from tdbmon.identify.calibration import Calibration
from tdbmon.identify.draws import root_of
from tdbmon.identify.model_share import band
from tdbmon.identify.parameters import calibrated_machine

Array = NDArray[np.float64]

_MODES = 6
ORDERS = (1.0, 2.0)  # of rotation, of the excitation
_FACTORS = np.geomspace(1e-2, 1e2, 81)  # of the fitted support stiffness
_SPEEDS = 41
_MEMBERS = 64  # drawn from the covariance
_BEYOND = 1.2  # times the speed at the release, shown


@dataclass(frozen=True)
class RestingMode:
    """One natural frequency.

    Attributes
    ----------
    frequency : Estimate
        At standstill, Hz.
    sideways : float
        Share of horizontal motion in the mode.
    massless : float or None
        Frequency with massless supports and rings, Hz; None where that mode does not exist.
    critical : tuple of float or None
        Critical speed of each of `ORDERS`, Hz; None where there is none up to the speed at the release.
    """

    frequency: Estimate
    sideways: float
    massless: float | None
    critical: tuple[float | None, ...]

    @property
    def direction(self) -> str:
        """ "sideways" or "up and down"."""
        return "sideways" if self.sideways > 0.5 else "up and down"


@dataclass(frozen=True, eq=False)
class NaturalFrequencies:
    """The resting rotor of a calibration (SI).

    Attributes
    ----------
    ends : tuple of RestingEnd
    modes : tuple of RestingMode
    support : dict
        Fitted support stiffness by the end's name.
    speed : float
        Greatest speed at the release among the drops, Hz.
    factors : (k,) array
        Of the map: support stiffness over the fitted one.
    still, turning : RestingModes
        The map at standstill and at `speed`.
    speeds : (s,) array
        Of the Campbell diagram, Hz.
    against_speed : RestingModes
    """

    ends: tuple[RestingEnd, ...]
    modes: tuple[RestingMode, ...]
    support: dict[str, Estimate]
    speed: float
    factors: Array
    still: RestingModes
    turning: RestingModes
    speeds: Array
    against_speed: RestingModes


def natural_frequencies(calibration: Calibration) -> NaturalFrequencies:
    """Return the natural frequencies of a calibrated machine, with intervals from the calibration's covariance."""
    machine = calibration.calibrated
    rotor = build_rotor(machine)
    basis, ends = resting_basis(machine, rotor), resting_ends(machine, rotor)
    drawn = [_of_drawn(each, rotor, basis, machine) for each in _machines(calibration)]
    speed = max(fit.speed for fit in calibration.drops)
    speeds = np.linspace(0.0, _BEYOND * speed, _SPEEDS)
    against_speed = resting_modes(basis, ends, speeds, _MODES)
    return NaturalFrequencies(
        ends=ends,
        modes=_named(basis, ends, drawn, speeds, against_speed, speed),
        support={
            bearing.name: calibration.value(
                f"{bearing.name}.support_stiffness", bearing.support_stiffness.nominal, "N/m"
            )
            for bearing in machine.touchdown_bearings
        },
        speed=speed,
        factors=_FACTORS,
        still=_map(basis, ends, 0.0),
        turning=_map(basis, ends, speed),
        speeds=speeds,
        against_speed=against_speed,
    )


def _of_drawn(drawn: Machine, rotor: RotorModel, basis: Modes, fitted: Machine) -> RestingModes:
    """Return the modes of a drawn machine from the fitted shaft, whose shapes stay and frequencies scale with sqrt(modulus)."""
    stiffer = math.sqrt(drawn.rotor.elastic_modulus / fitted.rotor.elastic_modulus)
    shaft = replace(basis, frequencies=basis.frequencies * stiffer)
    return resting_modes(shaft, resting_ends(drawn, rotor), n=2 * _MODES)


def _machines(calibration: Calibration) -> Iterator[Machine]:
    """Yield machines with values drawn from the calibration's covariance, within their bounds."""
    problem, rng = calibration.problem, np.random.default_rng(0)
    count = len(problem.shared)
    root = root_of(calibration.covariance[:count, :count])
    for _ in range(_MEMBERS):
        point = calibration.point.copy()
        point[:count] += root @ rng.standard_normal(count)
        shared, _ = problem.values(np.clip(point, problem.low, problem.high), 0)
        yield calibrated_machine(calibration.machine, shared)


def _map(basis: Modes, ends: tuple[RestingEnd, ...], speed: float) -> RestingModes:
    found = [
        resting_modes(basis, tuple(replace(end, support=factor * end.support) for end in ends), speed, _MODES)
        for factor in _FACTORS
    ]
    return RestingModes(
        np.concatenate([each.frequencies for each in found]), np.concatenate([each.sideways for each in found])
    )


def _named(
    basis: Modes,
    ends: tuple[RestingEnd, ...],
    drawn: list[RestingModes],
    speeds: Array,
    against_speed: RestingModes,
    speed: float,
) -> tuple[RestingMode, ...]:
    still, sideways = against_speed.frequencies[0], against_speed.sideways[0]
    bare = resting_modes(basis, tuple(replace(end, ring_mass=0.0, support_mass=0.0) for end in ends), n=2 * _MODES)
    rule = f"rotor at rest on the calibrated bearings; {len(drawn)} draws from the calibration"
    modes = []
    for k, (frequency, share) in enumerate(zip(still, sideways, strict=True)):
        rank = int(np.sum((sideways[:k] > 0.5) == (share > 0.5)))
        of_draws = [same[rank] for each in drawn if len(same := _of_direction(each, share > 0.5)) > rank]
        low, _, high = band(np.array(of_draws)).tolist()
        massless = _of_direction(bare, share > 0.5)
        modes.append(
            RestingMode(
                frequency=Estimate(float(frequency), min(low, frequency), max(high, frequency), "Hz", rule),
                sideways=float(share),
                massless=float(massless[rank]) if len(massless) > rank else None,
                critical=tuple(
                    _crossing(speeds, against_speed.frequencies[:, k] - order * speeds, speed) for order in ORDERS
                ),
            )
        )
    return tuple(modes)


def _of_direction(found: RestingModes, level: bool) -> Array:
    """Return the frequencies at standstill of the sideways (`level`) or else the up-and-down modes, Hz.

    At standstill the two directions are uncoupled, so their frequencies may be in any order.
    """
    return np.asarray(found.frequencies[0][(found.sideways[0] > 0.5) == level])


def _crossing(speeds: Array, above: Array, highest: float) -> float | None:
    """Return the speed at which a difference falls through zero; None where it does not up to the highest speed."""
    at = np.flatnonzero((above[:-1] > 0) & (above[1:] <= 0))
    if not at.size:
        return None
    i = int(at[0])
    found = float(speeds[i] + (speeds[i + 1] - speeds[i]) * above[i] / (above[i] - above[i + 1]))
    return found if found <= highest else None
