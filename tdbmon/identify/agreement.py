"""Measured against simulated drop: displacement at both ends, contact times, residuals.

Both sets of readings are processed alike: a rigid line through the probes carries them to the bearing planes, and contacts
are detected by the same displacement threshold.  The contacts by the simulated normal force stand beside them.  The model was
fitted up to the fit's horizon only; beyond it the comparison is a prediction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tdbsim.machine import Machine
from tdbsim.observe import FORCES, observed

from tdbmon.analysis.axes import to_planes
from tdbmon.analysis.contact_events import Contact, contact_events
from tdbmon.identify.calibration import Calibration, Residual
from tdbmon.identify.drop import MeasuredDrop, bridged
from tdbmon.identify.prediction import centre
from tdbmon.record.sensor_effects import of_sound_sensors
from tdbmon.runs import runs_of

Array = NDArray[np.float64]

_SECONDS = 0.2  # shown after the release, as far as the record goes
_HORIZONS = (0.012, 0.025, 0.06, 0.1, 0.2)  # s after the release, to which the residual is stated


@dataclass(frozen=True)
class ContactPair:
    """A contact as measured and as simulated, s after the release; None where one of the two has no such contact.

    Attributes
    ----------
    measured, simulated : Contact or None
        Detected where the displacement exceeds the touching radius.
    force : tuple of float or None
        Start and end of the simulated normal force within that contact.
    """

    measured: Contact | None
    simulated: Contact | None
    force: tuple[float, float] | None


@dataclass(frozen=True, eq=False)
class EndAgreement:
    """One end (SI).

    Attributes
    ----------
    end : str
    plane : str
        ``"bearing"``, or ``"probe"`` where the rigid line could not be drawn.
    measured, simulated : (2, k) arrays
        x and y relative to the bearing's fitted centre, m.
    noise : (2,) array
        Standard deviation of the noise of x and y, m.
    gap, touching : float
        Fitted radial gap, and that plus the balls' play: the radius at which the shaft touches a ring that has dropped by its
        radial clearance, m.
    contacts : tuple of ContactPair
        In order of time, as far as the drop was simulated.
    """

    end: str
    plane: str
    measured: Array
    simulated: Array
    noise: Array
    gap: float
    touching: float
    contacts: tuple[ContactPair, ...]

    @property
    def residual(self) -> Array:
        """Measured less simulated (2, k), m."""
        return self.measured - self.simulated


@dataclass(frozen=True, eq=False)
class Agreement:
    """One drop.

    Attributes
    ----------
    name : str
        The record's file.
    fitted_to : float
        Horizon of the fit, s after the release.
    time : (k,) array
        s after the fitted release.
    ends : dict
        By the end's name; only ends whose orbit the probes determine.
    residuals : tuple of Residual
        Of the probes' readings, to increasing horizons.
    """

    name: str
    fitted_to: float
    time: Array
    ends: dict[str, EndAgreement]
    residuals: tuple[Residual, ...]


def agreement(calibration: Calibration, drop: int = 0, seconds: float = _SECONDS) -> Agreement:
    """Simulate a calibrated drop beyond its fitted horizon and compare the record with it.

    Parameters
    ----------
    calibration : Calibration
    drop : int
        Which of its drops.
    seconds : float
        After the release; less where the record ends before.

    Raises
    ------
    InputError
        If the drop cannot be simulated that far.
    """
    problem, machine = calibration.problem, calibration.calibrated
    measured = problem.drops[drop]
    shared, own = problem.values(calibration.point, drop)
    found = problem.simulated(calibration.point, drop, seconds)
    time, motion = found.since - own["release"], found.prediction.motion
    readings = measured.reading[:, found.span]
    whole = np.array([bridged(row) for row in readings])  # a contact whose peak is cut off is still one contact
    planes = [at_planes(rows, time, measured, machine) for rows in (readings, found.readings, whole)]
    shown = np.isfinite(planes[1].displacement.to_numpy()).any(axis=(0, 1))  # a lagging sensor lacks the last samples
    time, planes = time[shown], [each.isel(time=shown) for each in planes]
    forces = observed(motion).forces[:, FORCES.index("normal_force")]
    ends = {}
    for i, bearing in enumerate(machine.touchdown_bearings):
        plane = str(planes[0].plane[i].item())
        if plane == "none":
            continue
        weights = planes[0].weights[i].to_numpy()
        at = bearing.position if plane == "bearing" else _probe_plane(measured, bearing.name)
        origin = complex(centre(machine, shared, [at])[0])
        apart = np.array([[origin.real], [origin.imag]])
        seen, simulated, unbroken = (each.displacement[i].to_numpy() - apart for each in planes)
        touching = bearing.radial_gap.nominal + bearing.balls.play
        ends[bearing.name] = EndAgreement(
            end=bearing.name,
            plane=plane,
            measured=seen,
            simulated=simulated,
            noise=np.sqrt(weights**2 @ np.array([noise.sigma**2 for noise in measured.noise])),
            gap=bearing.radial_gap.nominal,
            touching=touching,
            contacts=_contacts(time, [unbroken, simulated], touching, forces[i][shown]),
        )
    return Agreement(
        name=measured.name,
        fitted_to=calibration.horizon,
        time=time,
        ends=ends,
        residuals=_residuals(found.since, found.left, measured, seconds),
    )


def at_planes(readings: Array, time: Array, drop: MeasuredDrop, machine: Machine) -> xr.Dataset:
    """Return readings (probes, k) carried to the bearing planes by `tdbmon.analysis.axes.to_planes`.

    They are first corrected for the sensor effects of the machine file; the last samples of a lagging sensor are then missing.
    """
    names = [probe.name for probe in drop.probes]
    channels = {name: ("time", row) for name, row in zip(names, readings, strict=True)}
    seen, upright = of_sound_sensors(xr.Dataset(channels, coords={"time": time}), machine)
    return to_planes(seen, upright, names)


def _probe_plane(drop: MeasuredDrop, end: str) -> float:
    return float(np.mean([probe.position for probe in drop.probes if probe.end == end]))


def _contacts(time: Array, paths: Sequence[Array], touching: float, force: Array) -> tuple[ContactPair, ...]:
    """Pair measured and simulated contacts that overlap in time, by the nearest start: a lift-off may split one of them."""
    after = time > 0
    t = time[after]
    seen = [contact_events(t, path[:, after].T, np.hypot(*path[:, after]), touching) for path in paths]
    spans = [(float(t[run][0]), float(t[run][-1])) for run in runs_of(force[after] > 0)]
    pairs: list[tuple[Contact | None, Contact | None]] = []
    left = list(seen[1])
    for contact in seen[0]:
        overlapping = [each for each in left if min(contact.end, each.end) > max(contact.start, each.start)]
        partner = min(overlapping, key=lambda each: abs(each.start - contact.start), default=None)
        if partner is not None:
            left.remove(partner)
        pairs.append((contact, partner))
    pairs += [(None, contact) for contact in left]
    rows = [ContactPair(a, b, None if b is None else _force_within(spans, b)) for a, b in pairs]
    return tuple(sorted(rows, key=_start))


def _start(pair: ContactPair) -> float:
    return min(contact.start for contact in (pair.measured, pair.simulated) if contact is not None)


def _force_within(spans: Sequence[tuple[float, float]], contact: Contact) -> tuple[float, float] | None:
    """Return start and end of the force within a contact, interruptions ignored."""
    inside = [(a, b) for a, b in spans if a < contact.end and b > contact.start]
    return (inside[0][0], inside[-1][1]) if inside else None


def _residuals(since: Array, left: Array, drop: MeasuredDrop, seconds: float) -> tuple[Residual, ...]:
    last = min(seconds, float(since[-1])) + 1.5 * drop.interval
    found = (Residual.of(left, since, drop, horizon) for horizon in _HORIZONS if horizon <= last)
    return tuple(each for each in found if each.rms)
