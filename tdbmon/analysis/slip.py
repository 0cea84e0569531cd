"""Detection of inner rings that still slip in a short record, where their drag looks like the rotor's own drag."""

from __future__ import annotations

from tdbmon.analysis.drag_law import Coast, LawFit
from tdbmon.estimate import Z95

_SHORT_S = 1.0  # a shorter fit cannot separate the drag of slipping rings from that of the run-down,
SLIPPING = 0.03  # except by comparison with levitation: a relative deceleration larger by this share is slip
FALLING = 4.0  # standard deviations by which a deceleration must differ from zero
HIDDEN = (
    f"with less than {_SHORT_S:g} s after the contacts, the rotor's own run-down can be separated from the drag of the bearings"
    " only by a levitated run-down, which this record does not show well enough; a longer record is needed"
)


def is_short(stretch: Coast) -> bool:
    """Return True if a stretch is too short to separate the drag of slipping rings."""
    return bool(stretch.end[-1] - stretch.begin[0] <= _SHORT_S)


def coasting(stretch: Coast, before: LawFit | None) -> LawFit | None:
    """Return the levitated run-down for comparison with a short stretch; None unless the rotor already coasts before release."""
    if not is_short(stretch) or before is None:
        return None
    return before if before.law.linear > FALLING * before.sigma("linear") else None


def slip_in(stretch: Coast, fit: LawFit, levitated: LawFit) -> str:
    """Return why a short stretch is unreliable (faster relative deceleration than in levitation: rings slip); "" if it is not."""
    middle = float(fit.law.speed_at(0.5 * (stretch.begin[0] + stretch.end[-1])))
    now, then = float(fit.law.deceleration(middle)) / middle, levitated.law.linear
    if now - then < SLIPPING * then + Z95 * levitated.sigma("linear"):
        return ""
    return (
        f"the rings still slip when the record ends: the rotor loses {100 * now:.3g} % of its speed per second,"
        f" in levitation {100 * then:.3g} %; a longer record is needed"
    )
