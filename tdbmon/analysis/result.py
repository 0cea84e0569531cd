"""The result of analysing one record: what figures, report and JSON are made from."""

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
    """False where checks of a record say that the shaft levitates throughout."""
    return all(check.passed for check in checks if check.check == "drop")


@dataclass(frozen=True, kw_only=True)
class EndResult:
    """What was found at one touchdown bearing (SI).

    Attributes
    ----------
    name : str
    plane : str
        ``"bearing"``, ``"probe"`` (the rigid line could not be drawn) or ``"none"`` (no orbit at this end).
    load : float
        Static load, N.
    travel : RestTravel
        What the rest radius holds beyond the air gap, from the machine file.
    gap : Gap or None
        The clearance circle; None where none can be told, for the reason that `air_gap` then states.
    air_gap : Estimate
        Radial air gap proper: radius at rest less the travel, m.
    gap_from_swing : Estimate
        Radius of the swing's path, m.
    contacts : Contacts or None
    stiffness : Estimate
        Single-mass stiffness of the first contact, N/m.
    deepest : Estimate
        Largest excursion from the clearance centre after the release, m.
    held : str
        That the end stayed levitated while the other one fell; "" where it did not.
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
        """Return an end that is not seen to fall; what a fall would tell is missing for the reason `why`."""
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
        """True where the record holds the end's orbit."""
        return self.plane != "none"

    @property
    def unsettled(self) -> str:
        """Why there is no clearance circle, where there is none; no contact can be told then either."""
        return self.air_gap.why or "the clearance circle is not known"

    @property
    def circle(self) -> Gap:
        """The clearance circle, its numbers missing where there is none."""
        return self.gap or Gap.missing(self.unsettled)

    @property
    def events(self) -> tuple[Contact, ...]:
        """Contacts before settling, in order; none where they cannot be told."""
        return () if self.contacts is None else self.contacts.events

    @property
    def first_contact(self) -> FirstContact | None:
        """The first of them, where its instants can be told."""
        return None if self.contacts is None else self.contacts.first

    @property
    def no_contact(self) -> str:
        """Why there is no first contact."""
        return self.unsettled if self.contacts is None else self.contacts.why or "no first contact was found"

    @property
    def first(self) -> FirstContact:
        """The first contact, its numbers missing where none is told."""
        return self.first_contact or FirstContact.missing(self.no_contact)

    @property
    def contact_count(self) -> Estimate:
        """How many contacts there were before the shaft settled."""
        return Estimate.missing("1", self.unsettled) if self.contacts is None else self.contacts.count


@dataclass(frozen=True, kw_only=True)
class Analysis:
    """Everything that one record yields without a fitted model.

    Attributes
    ----------
    machine, rotor
        What the record was laid over.
    record : Dataset
        The record in the machine's names, SI.
    planes : Dataset or None
        ``displacement(end, axis, time)`` at the bearing planes, m; None where the record holds no orbit.
    checks : tuple of Check
        The quality gate.
    release : Release or None
    phases : tuple of Phase
    levitation : dict
        The levitated shaft by the end's name, of the whole record where it holds no drop; empty where the release is not told,
        without the ends that are not seen.
    ends : dict
        By the end's name; empty without displacement.
    swing : Swing or None
    rundown : RunDown or None
        None where the record holds no speed.
    speed_time, speed_hz : ndarray
        Speed on its own samples; empty where there is none.
    angle : ndarray or None
        Shaft angle on the samples of `planes`, rad; NaN where no pulses are.
    waterfall : Dataset or None
        Spectra against time.
    lines : tuple of Line
    drifting : tuple of DriftingSwing
        The swings that are no lines, since their frequency moves.
    whirl : dict
        Whirl by the end's name.
    tracks : Dataset or None
        1X and 2X through the run-down.
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
        """False where the shaft levitates throughout the record."""
        return falls(self.checks)

    @property
    def seen_ends(self) -> list[str]:
        """Ends whose orbit the record holds."""
        return [name for name, end in self.ends.items() if end.seen]

    @property
    def released(self) -> float | None:
        """Instant of the release, s; None where it is not known."""
        return None if self.release is None else self.release.time.value

    @property
    def release_time(self) -> Estimate:
        """Instant of the release."""
        if not self.falls:
            return Estimate.missing("s", NO_DROP)
        if self.release is None:
            return Estimate.missing("s", "the record starts after the release, or holds no displacement")
        return self.release.time

    @property
    def settled(self) -> Estimate:
        """Instant from which both ends, or the one that fell, stay on their rings."""
        if not self.falls:
            return Estimate.missing("s", NO_DROP)
        fallen = [end for end in self.ends.values() if not end.held]
        times = [end.gap.settled_from for end in fallen if end.gap is not None]
        if not times or len(times) < len(fallen):
            return Estimate.missing("s", "not both ends have a clearance circle")
        rule = "last bounce of more than a tenth of the gap"
        return Estimate(max(times), unit="s", method=rule, why="stated to the sample")

    @property
    def settle_time(self) -> Estimate:
        """Time from the release to the end of the last bounce of either end, of those that fell."""
        return since(self.settled, self.release_time)

    @property
    def coast_down(self) -> CoastDownTimes:
        """Times from the release until the speed has fallen to a half and to a tenth."""
        if self.rundown is None:
            return CoastDownTimes.missing(NO_SPEED)
        found = self.rundown.coast_down
        return CoastDownTimes(*(since(each, self.release_time, "s") for each in (found.half, found.tenth)))

    @property
    def no_swing(self) -> str:
        """Why no swing in the clearance is told, where none is."""
        return next((end.gap_from_swing.why for end in self.ends.values()), "the record holds no orbit")

    @property
    def swings(self) -> tuple[Estimate, Estimate]:
        """Small-amplitude frequency of both swings in the clearance, the lower one first."""
        if self.swing is not None:
            return self.swing.frequencies
        missing = Estimate.missing("Hz", self.no_swing)
        return missing, missing

    @property
    def has_speed(self) -> bool:
        """True where the speed is known at enough times to be drawn and followed."""
        return len(self.speed_time) > 3

    @property
    def forces_tell_contacts(self) -> bool:
        """True where an end that is seen to fall has no circle to touch: a fit of the simulation needs none.

        It needs so much of the drop that both ends have touched.
        """
        from tdbmon.identify.stages import stages_of

        if self.release is None or self.release.time.value is None or self.planes is None:
            return False
        if any(end.held for end in self.ends.values()):  # a fit takes contacts at both ends
            return False
        if float(self.planes.time[-1]) - self.release.time.value < stages_of(self.machine).least:
            return False
        return any(end.gap is None and end.seen for end in self.ends.values())
