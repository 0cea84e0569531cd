"""Stages of a drop: horizons, s after the release, to which models are fitted and judged one after the other.

They were chosen on machines with gaps of 150 to 400 um, whose shafts fall for 5.5 to 9 ms.  In wider gaps they are stretched in
proportion to the time of fall, sqrt(2 gap / g): at 18 ms a shaft in a gap of 600 um has touched its bearings only once, and
residuals there say little about their cause.  In narrower gaps they are not shortened: more contacts contain more information.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from tdbsim.machine import STANDARD_GRAVITY, Machine

_USUAL_GAP = 250e-6  # m
_WIDEST = 400e-6  # m: gap up to which nothing is stretched
_MOST = 2.0  # greatest stretch: a shaft under very low gravity is not driven into contact by its weight
_STEP = 0.05  # rounding of the stretch, for neat horizons
# s in a usual gap, in small steps: a right fit to one horizon leads into the right minimum of the next
_EARLY = (0.006, 0.01, 0.014, 0.018, 0.022, 0.027, 0.033, 0.04)
_CALIBRATION = (*_EARLY, 0.05, 0.06, 0.075, 0.09)
_DIAGNOSIS = (*_EARLY, 0.047, 0.055, 0.065)


@dataclass(frozen=True)
class Stages:
    """Stages of the drops of a machine, all in s after the release.

    Attributes
    ----------
    stretch : float
        Factor on those of a usual gap.
    """

    stretch: float = 1.0

    def at(self, usual: float) -> float:
        """Return the instant that corresponds to `usual`, s, in a usual gap."""
        return round(self.stretch * usual, 4)

    def all_at(self, usual: Sequence[float]) -> tuple[float, ...]:
        """Return `at` of several instants."""
        return tuple(self.at(each) for each in usual)

    def until_touched(self, horizons: Sequence[float]) -> list[float]:
        """Return the horizons until both ends have touched, or else the first: for a wrong set-up, as later fits take long."""
        return [h for h in horizons if h <= self.touched] or list(horizons[:1])

    @property
    def calibration(self) -> tuple[float, ...]:
        """Horizons of the calibration."""
        return self.all_at(_CALIBRATION)

    @property
    def diagnosis(self) -> tuple[float, ...]:
        """Horizons at which models with causes are compared."""
        return self.all_at(_DIAGNOSIS)

    @property
    def first_contacts(self) -> tuple[float, ...]:
        """Horizons just after the first contacts, to which a fit takes only a second or two."""
        return self.all_at(_EARLY[1:4])

    @property
    def fall(self) -> float:
        """End of the free fall: no contact yet, or hardly, except in narrow gaps."""
        return self.at(0.006)

    @property
    def flight(self) -> float:
        """The fall through the gap is over, and paths begin to diverge."""
        return self.at(0.008)

    @property
    def least(self) -> float:
        """Both ends are past their first contact: least length of record for a fit."""
        return self.at(0.025)

    @property
    def loaded(self) -> float:
        """Before it the cage angles have no effect."""
        return self.at(0.009)

    @property
    def met(self) -> float:
        """At least one end has touched its bearing."""
        return self.at(0.01)

    @property
    def touched(self) -> float:
        """Both ends have touched their bearings."""
        return self.at(0.014)

    @property
    def sound(self) -> float:
        """Paths have hardly diverged: a model that held so far and fails later is judged here."""
        return self.at(0.018)

    @property
    def bounced(self) -> float:
        """Both ends have touched, and mostly twice."""
        return self.at(0.022)

    @property
    def late(self) -> float:
        """A plain model that holds so far usually lacks nothing but exact laws."""
        return self.at(0.033)

    @property
    def followed(self) -> float:
        """Horizon to which all models are followed."""
        return self.at(0.04)


def stages_of(machine: Machine) -> Stages:
    """Return the stages for the gaps in a machine's file."""
    gaps = [each.radial_gap.nominal for each in machine.touchdown_bearings]
    falls_like = sum(gaps) / len(gaps) * STANDARD_GRAVITY / machine.gravity  # m: the gap with the same time of fall
    if falls_like <= _WIDEST:
        return Stages()
    stretch = min(math.sqrt(falls_like / _USUAL_GAP), _MOST)
    return Stages(round(_STEP * round(stretch / _STEP), 2))
