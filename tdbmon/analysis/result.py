"""Result of the analysis of one record, from which figures, report and JSON are produced."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from tdbsim.machine import Machine
from tdbsim.rotor import RotorModel

from tdbmon.analysis.coast_down_times import CoastDownTimes
from tdbmon.analysis.contacts import Contacts
from tdbmon.analysis.first_contact import FirstContact
from tdbmon.analysis.gap import Gap
from tdbmon.analysis.levitation import Levitation
from tdbmon.analysis.phases import Phase
from tdbmon.analysis.release import Release
from tdbmon.analysis.rest import RestTravel
from tdbmon.analysis.swing import Swing
from tdbmon.estimate import Estimate, since

if TYPE_CHECKING:
    from tdbmon.analysis.contact_events import Contact
    from tdbmon.analysis.drifting_swings import DriftingSwing
    from tdbmon.analysis.lines import Line
    from tdbmon.analysis.rundown import RunDown
    from tdbmon.analysis.whirl import Whirl
    from tdbmon.record.finding import Check


NO_SPEED = "the record holds no usable speed signal or keyphasor (see quality)"
NO_DROP = "the shaft does not fall in this record (see drop)"


def falls(checks: Iterable[Check]) -> bool:
    """Return False if the checks of a record find that the shaft is levitated throughout."""
    return all(check.passed for check in checks if check.check == "drop")


@dataclass(frozen=True, kw_only=True)
class EndResult:
    """Results of one touchdown bearing (SI).

    Attributes
    ----------
    name : str
    plane : str
        ``"bearing"``, ``"probe"`` (no extrapolation to the bearing plane) or ``"none"`` (no orbit at this end).
    load : float
        Static load, N.
    travel : RestTravel
        Part of the radius at rest beyond the air gap, computed from the machine file.
    gap : Gap or None
        The clearance circle; None if it cannot be estimated, for the reason that `air_gap` then states.
    air_gap : Estimate
        Radial air gap: radius at rest less the travel, m.
    gap_from_swing : Estimate
        Path radius from the swing's frequency, m.
    contacts : Contacts or None
    stiffness : Estimate
        Single-mass stiffness of the first contact, N/m.
    deepest : Estimate
        Largest excursion from the clearance centre after the release, m.
    held : str
        Statement that the end stayed levitated while the other one fell; "" if it did not.
    """

    name: str
    plane: str
    load: float
    travel: RestTravel
    gap: Gap | None
    air_gap: Estimate
    gap_from_swing: Estimate
    contacts: Contacts | None
    stiffness: Estimate
    deepest: Estimate
    held: str = ""

    @classmethod
    def without_contact(cls, name: str, plane: str, load: float, travel: RestTravel, why: str) -> EndResult:
        """Return an end whose fall is not observed; all estimates from a fall are missing for the reason `why`."""
        um = Estimate.missing("um", why)
        return cls(
            name=name,
            plane=plane,
            load=load,
            travel=travel,
            gap=None,
            air_gap=um,
            gap_from_swing=um,
            contacts=None,
            stiffness=Estimate.missing("N/m", why),
            deepest=um,
        )

    @property
    def seen(self) -> bool:
        """True if the record contains the end's orbit."""
        return self.plane != "none"

    @property
    def unsettled(self) -> str:
        """Reason why there is no clearance circle, if there is none; contacts cannot be found then either."""
        return self.air_gap.why or "the clearance circle is not known"

    @property
    def circle(self) -> Gap:
        """Clearance circle, with missing estimates if there is none."""
        return self.gap or Gap.missing(self.unsettled)

    @property
    def events(self) -> tuple[Contact, ...]:
        """Contacts before settling, in order; empty if they cannot be found."""
        return () if self.contacts is None else self.contacts.events

    @property
    def first_contact(self) -> FirstContact | None:
        """First contact; None if its instants cannot be estimated."""
        return None if self.contacts is None else self.contacts.first

    @property
    def no_contact(self) -> str:
        """Reason why there is no first contact."""
        return self.unsettled if self.contacts is None else self.contacts.why or "no first contact was found"

    @property
    def first(self) -> FirstContact:
        """First contact, with missing estimates if there is none."""
        return self.first_contact or FirstContact.missing(self.no_contact)

    @property
    def contact_count(self) -> Estimate:
        """Number of contacts before the shaft settled."""
        return Estimate.missing("1", self.unsettled) if self.contacts is None else self.contacts.count


@dataclass(frozen=True, kw_only=True)
class Analysis:
    """All results that one record yields without fitting the simulation model.

    Attributes
    ----------
    machine, rotor
        Machine file of the record, and its rotor model.
    record : Dataset
        The record with the machine's channel names, SI.
    planes : Dataset or None
        ``displacement(end, axis, time)`` at the bearing planes, m; None if the record contains no orbit.
    checks : tuple of Check
        Quality checks.
    release : Release or None
    phases : tuple of Phase
    levitation : dict
        The levitated shaft by end name, over the whole record if it contains no drop; empty if the release is unknown, and
        without ends that have no orbit.
    ends : dict
        By end name; empty without displacement.
    swing : Swing or None
    rundown : RunDown or None
        None if the record contains no speed.
    speed_time, speed_hz : ndarray
        Speed at its own sample times, s and Hz; empty if there is none.
    angle : ndarray or None
        Shaft angle at the samples of `planes`, rad; NaN where there are no pulses.
    waterfall : Dataset or None
        Spectra against time.
    lines : tuple of Line
    drifting : tuple of DriftingSwing
        Swings that are not spectral lines because their frequency drifts.
    whirl : dict
        Whirl by end name.
    tracks : Dataset or None
        1X and 2X during the run-down.
    """

    machine: Machine
    rotor: RotorModel
    record: xr.Dataset
    planes: xr.Dataset | None = None
    checks: tuple[Check, ...]
    release: Release | None = None
    phases: tuple[Phase, ...] = ()
    levitation: dict[str, Levitation] = field(default_factory=dict)
    ends: dict[str, EndResult] = field(default_factory=dict)
    swing: Swing | None = None
    rundown: RunDown | None
    speed_time: np.ndarray
    speed_hz: np.ndarray
    angle: np.ndarray | None = None
    waterfall: xr.Dataset | None = None
    lines: tuple[Line, ...] = ()
    drifting: tuple[DriftingSwing, ...] = ()
    whirl: dict[str, Whirl] = field(default_factory=dict)
    tracks: xr.Dataset | None = None

    @property
    def falls(self) -> bool:
        """False if the shaft is levitated throughout the record."""
        return falls(self.checks)

    @property
    def seen_ends(self) -> list[str]:
        """Names of the ends whose orbit the record contains."""
        return [name for name, end in self.ends.items() if end.seen]

    @property
    def released(self) -> float | None:
        """Instant of the release, s; None if unknown."""
        return None if self.release is None else self.release.time.value

    @property
    def release_time(self) -> Estimate:
        """Instant of the release with its interval, or why it is missing."""
        if not self.falls:
            return Estimate.missing("s", NO_DROP)
        if self.release is None:
            return Estimate.missing("s", "the record starts after the release, or holds no displacement")
        return self.release.time

    @property
    def settled(self) -> Estimate:
        """Instant from which both ends, or the one that fell, stay in contact with their rings."""
        if not self.falls:
            return Estimate.missing("s", NO_DROP)
        fallen = [end for end in self.ends.values() if not end.held]
        times = [end.gap.settled_from for end in fallen if end.gap is not None]
        if not times or len(times) < len(fallen):
            return Estimate.missing("s", "not every end that fell has a clearance circle")
        rule = "end of the last bounce of more than a tenth of the gap"
        return Estimate(max(times), unit="s", method=rule, why="no interval: resolved to one sample")

    @property
    def settle_time(self) -> Estimate:
        """Time from the release to the end of the last bounce at any end that fell."""
        return since(self.settled, self.release_time)

    @property
    def coast_down(self) -> CoastDownTimes:
        """Coast-down times from the release to a half and to a tenth of the speed."""
        if self.rundown is None:
            return CoastDownTimes.missing(NO_SPEED)
        found = self.rundown.coast_down
        return CoastDownTimes(*(since(each, self.release_time, "s") for each in (found.half, found.tenth)))

    @property
    def no_swing(self) -> str:
        """Reason why no swing in the clearance was found, if there is none."""
        return next((end.gap_from_swing.why for end in self.ends.values()), "the record holds no orbit")

    @property
    def swings(self) -> tuple[Estimate, Estimate]:
        """Small-amplitude frequencies of both swings in the clearance, the lower one first."""
        if self.swing is not None:
            return self.swing.frequencies
        missing = Estimate.missing("Hz", self.no_swing)
        return missing, missing

    @property
    def has_speed(self) -> bool:
        """True if the speed is known at enough times (four or more) to be plotted and tracked."""
        return len(self.speed_time) > 3

    @property
    def forces_tell_contacts(self) -> bool:
        """True if only a fit of the simulation can find contacts: an end falls, but has no clearance circle.

        The fit needs no circle, but enough of the drop for both ends to have touched.
        """
        from tdbmon.identify.stages import stages_of

        if self.release is None or self.release.time.value is None or self.planes is None:
            return False
        if any(end.held for end in self.ends.values()):  # a fit takes contacts at both ends
            return False
        if float(self.planes.time[-1]) - self.release.time.value < stages_of(self.machine).least:
            return False
        return any(end.gap is None and end.seen for end in self.ends.values())
