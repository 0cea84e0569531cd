"""Detection of a speed that counts each revolution of the levitated shaft two or three times, or only every second or third.

Keyphasor and speed signal may agree on this error, as both may come from one counter.  The shaft's lines from unbalance and
runout, however, are at integer orders.  2X may be the strongest, with an elliptical surface, but no line is subsynchronous:
a strong line at half the stated speed is the 1X line of a shaft that turns at half the stated speed.
"""

from __future__ import annotations

from dataclasses import dataclass

from tdbmon.record.levitated_lines import LevitatedLines

_COUNTS = (2, 3)
_CLEARLY = 4.0  # times the power at the stated speed: twice the amplitude, as 1X relative to 2X
_SEEN = 0.25  # the same for a line that raises doubt: half the amplitude
_FAINT = 0.01  # the same for a line confirmed by its next multiple: a tenth of the amplitude
_ALONE = 25.0  # the same for a multiple if there is no 1X line at all
_TEETH = range(4, 49)  # pulses per revolution of possible toothed wheels
_WORDS = {2.0: "twice", 1 / 2: "half", 1 / 3: "a third of"}


@dataclass(frozen=True)
class Miscounted:
    """A miscounted speed compared with that of the shaft.

    Attributes
    ----------
    times : float
        Ratio of the stated speed to that of the shaft: 2, 3 or more, 1/2 or 1/3.
    hz : float
        Speed of the shaft, Hz.
    sure : bool
        False if a line contradicts the stated speed but may have another cause.
    """

    times: float
    hz: float
    sure: bool

    def __str__(self) -> str:
        shaft = "at which the levitated shaft turns" if self.sure else "of a strong spectral line of the levitated shaft"
        return f"{_WORDS.get(self.times, f'{self.times:.0f} times')} the {self.hz:.4g} Hz {shaft}"

    @property
    def cause(self) -> str:
        """The likely cause of the miscount, in words."""
        if self.times > 1:
            kept = f" (for a keyphasor: pulses_per_revolution = {self.times:.0f})"
            return f"{self.times:.0f} marks or pulses per revolution, each counted as a revolution{kept}"
        return f"only one of {1 / self.times:.0f} pulses counted"


def miscounted(lines: LevitatedLines, stated: float, mains_hz: float) -> Miscounted | None:
    """Compare a speed with the lines of the levitated shaft.

    Double or triple counting is certain if the line at that fraction of the stated speed is clearly stronger, or if its next
    multiple is also present (3/2 of the stated speed beside 1/2).  Higher counts are never certain, as any line is close to
    some fraction of a speed.  Nor is counting too few: with magnets that do not respond at 1X, only the 2X line of an
    elliptical surface may be visible.

    Parameters
    ----------
    lines : LevitatedLines
    stated : float
        Speed before the shaft falls, Hz.
    mains_hz : float
        Mains frequency, Hz; its harmonics are not lines of the shaft.

    Returns
    -------
    Miscounted or None
        None if nothing contradicts the stated speed.
    """

    def of_the_shaft(hz: float) -> bool:
        return lines.bears_out(hz) and not lines.is_hum(hz, mains_hz)

    for count in _COUNTS:
        part = stated / count
        if not of_the_shaft(part):
            continue
        confirmed = of_the_shaft(part * (3 if count == 2 else 2))
        sure = lines.outdoes_in_most(part, stated, _FAINT if confirmed else _CLEARLY)
        if sure or lines.outdoes_in_most(part, stated, _SEEN):
            # repeat for the lower speed: six pulses per revolution first look like two or three
            again = miscounted(lines, part, mains_hz)
            more = again.times if again is not None and again.times > 1 else 1.0
            return Miscounted(count * more, part / more, sure)
    if lines.bears_out(stated) or not lines.resolves(stated):
        return None
    strongest = lines.strongest(mains_hz)
    teeth = round(stated / strongest) if strongest > 0 else 0
    if teeth in _TEETH and lines.bears_out(stated / teeth) and lines.outdoes_in_most(stated / teeth, stated, _ALONE):
        return Miscounted(float(teeth), stated / teeth, False)
    for count in _COUNTS:
        whole, other = stated * count, stated * (5 - count)
        if of_the_shaft(whole) and not of_the_shaft(other) and lines.outdoes_in_most(whole, stated, _ALONE):
            return Miscounted(1 / count, whole, False)
    return None
