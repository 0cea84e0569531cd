"""A speed that counts a revolution of the levitated shaft twice or thrice, or only every second or third one.

Keyphasor and speed signal may do so alike, as both come from one counter; the shaft does not.  Unbalance and runout draw lines
at whole multiples of its turning.  Twice per revolution may be the strongest, on an elliptical surface, but nothing on a shaft
stands at parts of a revolution: a strong line at half the stated speed is once per revolution of a shaft that turns at that half.
"""

from __future__ import annotations

from dataclasses import dataclass

from tdbmon.record.levitated_lines import LevitatedLines

_COUNTS = (2, 3)
_CLEARLY = 4.0  # times the power at the stated speed: twice the amplitude, as 1X has over 2X
_SEEN = 0.25  # the same, of a line that raises doubt: half the amplitude
_FAINT = 0.01  # the same, of a line that its next multiple confirms: a tenth of the amplitude
_ALONE = 25.0  # the same, of a multiple where once per revolution does not show at all
_TEETH = range(4, 49)  # pulses a revolution that a toothed wheel may give
_WORDS = {2.0: "twice", 1 / 2: "half", 1 / 3: "a third of"}


@dataclass(frozen=True)
class Miscounted:
    """A speed as it is stated beside that of the shaft.

    Attributes
    ----------
    times : float
        Stated speed over that of the shaft: 2, 3 or more, 1/2 or 1/3.
    hz : float
        Speed of the shaft, Hz.
    sure : bool
        False where a line contradicts the stated speed, but something else may draw it.
    """

    times: float
    hz: float
    sure: bool

    def __str__(self) -> str:
        shaft = "at which the levitated shaft turns" if self.sure else "of a strong line of the levitated shaft"
        return f"{_WORDS.get(self.times, f'{self.times:.0f} times')} the {self.hz:.4g} Hz {shaft}"

    @property
    def cause(self) -> str:
        """What makes a speed be counted so."""
        if self.times > 1:
            kept = f" (in a keyphasor: pulses_per_revolution = {self.times:.0f})"
            return f"{self.times:.0f} marks or pulses a revolution, each counted as one{kept}"
        return f"one pulse counted of {1 / self.times:.0f}"


def miscounted(lines: LevitatedLines, stated: float, mains_hz: float) -> Miscounted | None:
    """Hold a speed against the lines of the levitated shaft.

    Counted twice or thrice is sure where the line of the part is clearly the stronger, or where the next multiple of that part
    stands too (3/2 of the stated speed beside 1/2).  More often is never sure: some part of a speed is near any line.  Nor is
    counted too rarely: magnets that do not answer once per revolution
    leave the elliptical surface to be seen alone.

    Parameters
    ----------
    lines : LevitatedLines
    stated : float
        Speed before the shaft falls, Hz.
    mains_hz : float
        Its harmonics are no lines of the shaft.

    Returns
    -------
    Miscounted or None
        None where nothing contradicts the stated speed.
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
            # twice a revolution of a shaft that turns at half or a third of it: six pulses look like three at first
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
