"""How far a drop has come: instants, s after the release, up to which models are fitted and judged one after the other.

They were chosen on machines with gaps of 150 to 400 um, whose shafts fall for 5.5 to 9 ms.  Wider gaps stretch them as they
stretch the time of the fall, sqrt(2 gap / g): by 18 ms a shaft in a gap of 600 um has met its bearings but once, and what
differs there says little of why.  Narrower ones do not shorten them: more contacts tell more, and none is missed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from tdbsim.machine import STANDARD_GRAVITY, Machine

_USUAL_GAP = 250e-6  # m
_WIDEST = 400e-6  # m: up to which nothing is stretched
_MOST = 2.0  # what a shaft meets that hardly falls, is not told by its weight
_STEP = 0.05  # of a stretch, which keeps the instants neat
# s at a usual gap, in small steps: a fit that is right to one leads into the right minimum of the next
_EARLY = (0.006, 0.01, 0.014, 0.018, 0.022, 0.027, 0.033, 0.04)
_CALIBRATION = (*_EARLY, 0.05, 0.06, 0.075, 0.09)
_DIAGNOSIS = (*_EARLY, 0.047, 0.055, 0.065)


@dataclass(frozen=True)
class Stages:
    """Instants of the drops of a machine, all in s after the release.

    Attributes
    ----------
    stretch : float
        Times those of a usual gap.
    """

    stretch: float = 1.0

    def at(self, usual: float) -> float:
        """Return when drops have come as far as those in a usual gap by `usual`."""
        return round(self.stretch * usual, 4)

    def all_at(self, usual: Sequence[float]) -> tuple[float, ...]:
        """Return `at` of several."""
        return tuple(self.at(each) for each in usual)

    @property
    def calibration(self) -> tuple[float, ...]:
        """To which values are calibrated, one after the other."""
        return self.all_at(_CALIBRATION)

    @property
    def diagnosis(self) -> tuple[float, ...]:
        """To which models with causes are compared, one after the other."""
        return self.all_at(_DIAGNOSIS)

    @property
    def first_contacts(self) -> tuple[float, ...]:
        """Past a first contact, and no more than takes a second or two."""
        return self.all_at(_EARLY[1:4])

    @property
    def fall(self) -> float:
        """Nothing touches so far, or only just, but in narrow gaps."""
        return self.at(0.006)

    @property
    def flight(self) -> float:
        """The fall through the gap is over, and paths begin to part."""
        return self.at(0.008)

    @property
    def least(self) -> float:
        """Both ends are past their first contact: so much of a record is needed for a fit."""
        return self.at(0.025)

    @property
    def loaded(self) -> float:
        """Before it the cages' angles do nothing."""
        return self.at(0.009)

    @property
    def met(self) -> float:
        """One end has met its bearing at least."""
        return self.at(0.01)

    @property
    def touched(self) -> float:
        """Both ends have met their bearings."""
        return self.at(0.014)

    @property
    def sound(self) -> float:
        """Paths have hardly parted: a model that held so far is judged there, if it fails further on."""
        return self.at(0.018)

    @property
    def bounced(self) -> float:
        """Both ends have touched, and mostly twice."""
        return self.at(0.022)

    @property
    def late(self) -> float:
        """A plain model that holds so far lacks no more than its laws do, more often than not."""
        return self.at(0.033)

    @property
    def followed(self) -> float:
        """As far as all models are followed."""
        return self.at(0.04)


def stages_of(machine: Machine) -> Stages:
    """Return the instants for a machine's gaps by its file."""
    gaps = [each.radial_gap.nominal for each in machine.touchdown_bearings]
    falls_like = sum(gaps) / len(gaps) * STANDARD_GRAVITY / machine.gravity  # m: the gap with the same time of fall
    if falls_like <= _WIDEST:
        return Stages()
    stretch = min(math.sqrt(falls_like / _USUAL_GAP), _MOST)
    return Stages(round(_STEP * round(stretch / _STEP), 2))
