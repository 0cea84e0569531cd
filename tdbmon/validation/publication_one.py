"""Publication I: ball stresses of the 6016 at the first contact, in nine arrangements of off-sized balls.

N. Neisi et al., Publication I of the dissertation (LUT University), tables 1 to 4 and figure 11.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tdbsim.ball_load import BallRow, off_sized
from tdbsim.hertz import BearingGeometry, Material, PointContact, series_stiffness

from tdbmon.validation.comparison import Comparison, grid, table

Array = NDArray[np.float64]

STEEL = Material(200e9, 0.3)
BEARING_6016 = BearingGeometry(19.05e-3, 110e-3, 0.52, 0.52, ball=STEEL, race=STEEL)
NOMINAL = BallRow(BEARING_6016, 10, 15e-6)
LOADED = (7, 8, 9, 10)  # balls, at 216, 252, 288 and 324 deg


@dataclass(frozen=True)
class Arrangement:
    """The off-sized balls, their deviations, m, and the stresses printed for `LOADED`, Pa."""

    name: str
    deviation: float
    balls: tuple[int, ...]
    printed: tuple[float, ...]

    @property
    def row(self) -> BallRow:
        """The balls of this arrangement."""
        return NOMINAL.with_oversize(self.deviation, *self.balls)


def _arrangement(name: str, deviation_um: float, balls: tuple[int, ...], *printed_mpa: float) -> Arrangement:
    return Arrangement(name, deviation_um * 1e-6, balls, tuple(1e6 * value for value in printed_mpa))


ARRANGEMENTS = (
    _arrangement("nominal", 0, (), 1353, 2014, 1986, 1240),
    _arrangement("+5 µm on 1, 6, 8", 5, (1, 6, 8), 1027, 2070, 1697, 977),
    _arrangement("+5 µm on 2, 5, 9", 5, (2, 5, 9), 1107, 1729, 2047, 890),
    _arrangement("+5 µm on 7, 8, 9", 5, (7, 8, 9), 1486, 1994, 1991, 897),
    _arrangement("+5 µm on 8", 5, (8,), 1027, 2071, 1698, 976),
    _arrangement("−2 µm on 7", -2, (7,), 1158, 2025, 1989, 1230),
    _arrangement("−2 µm on 8", -2, (8,), 1391, 1906, 2010, 1252),
    _arrangement("−2 µm on 9", -2, (9,), 1362, 2034, 1873, 1279),
    _arrangement("−2 µm on 10", -2, (10,), 1345, 2017, 1996, 1021),
)


def brewe_hamrock(contact: PointContact) -> tuple[float, float, float]:
    """Return kappa, F and E by the fits of D. E. Brewe and B. J. Hamrock (1977), which the paper prints."""
    ratio = contact.radius_y / contact.radius_x
    return 1.0339 * ratio**0.636, 1.5277 + 0.6023 * math.log(ratio), 1.0003 + 0.5968 / ratio


def fitted_stiffness(geometry: BearingGeometry) -> float:
    """Return the stiffness of a ball between both races by the fits, N/m^1.5."""
    found = []
    for contact in (geometry.inner, geometry.outer):
        kappa, first, second = brewe_hamrock(contact)
        found.append(math.pi * kappa * contact.modulus * math.sqrt(contact.radius * second / (4.5 * first**3)))
    return series_stiffness(*found)


def printed_pressure(geometry: BearingGeometry, load: Array) -> Array:
    """Return the stress on the paper's scale, Pa: with the fits, and with a factor 3 instead of 6 under the cube root."""
    kappa, _, second = brewe_hamrock(geometry.inner)
    contact = geometry.inner
    unit = (3 * kappa**2 * second * contact.radius / (math.pi * contact.modulus)) ** (1 / 3)
    return np.asarray(1.5 * kappa / (math.pi * unit**2) * np.cbrt(load))


class FittedRow(BallRow):
    """A row of balls with the stiffness from the Brewe-Hamrock fits, as in the paper."""

    @property
    def stiffness(self) -> Array:
        """Stiffness of each ball between both races (n,), N/m^1.5."""
        return np.array([fitted_stiffness(each) for each in self.geometries])


@dataclass(frozen=True)
class Found:
    """Computed stresses of an arrangement under the resultant of its printed stresses.

    Attributes
    ----------
    resultant : float
        Resultant force, N.
    printed_scale, printed_scale_exact : (4,) array
        Stress of `LOADED` on the paper's scale, Pa, with the fits' stiffness and with the exact one.
    stress : (4,) array
        Exact Hertz stress of `LOADED`, Pa.
    """

    arrangement: Arrangement
    resultant: float
    printed_scale: Array
    printed_scale_exact: Array
    stress: Array

    @property
    def deviation(self) -> float:
        """Greatest relative deviation of the stresses from the printed ones, with the paper's fits."""
        return float(np.abs(self.printed_scale / np.array(self.arrangement.printed) - 1).max())

    @property
    def deviation_exact(self) -> float:
        """The same with the exact stiffness."""
        return float(np.abs(self.printed_scale_exact / np.array(self.arrangement.printed) - 1).max())


def check(arrangement: Arrangement) -> Found:
    """Return the stresses computed by distributing the resultant of the printed stresses over the balls."""
    row = arrangement.row
    index = [ball - 1 for ball in LOADED]
    unit = np.array([printed_pressure(row.geometries[i], np.array(1.0)) for i in index])
    load = (np.array(arrangement.printed) / unit) ** 3
    azimuth = row.azimuth()[index]
    force = np.array([load @ np.cos(azimuth), load @ np.sin(azimuth)])
    fitted = FittedRow(row.geometry, row.count, row.diametral_clearance, row.oversize).loaded(force)
    exact = row.loaded(force)
    return Found(
        arrangement,
        float(np.hypot(*force)),
        unit * np.cbrt(fitted.load[index]),
        unit * np.cbrt(exact.load[index]),
        row.peak_pressure(exact.load)[index],
    )


def stiffness_change(deviation: float, fits: bool) -> float:
    """Return the relative increase of a ball's contact stiffness by a deviation of its diameter, m."""
    geometry = off_sized(BEARING_6016, deviation)
    if fits:
        return fitted_stiffness(geometry) / fitted_stiffness(BEARING_6016) - 1
    return geometry.stiffness / BEARING_6016.stiffness - 1


def chapter() -> str:
    """Return the chapter of the report."""
    found = [check(each) for each in ARRANGEMENTS]
    body = []
    for each in found:
        for k, ball in enumerate(LOADED):
            printed, ours = each.arrangement.printed[k], each.printed_scale[k]
            body.append(
                [each.arrangement.name if k == 0 else "", str(ball), f"{printed * 1e-6:.0f}", f"{ours * 1e-6:.1f}",
                 f"{100 * (ours / printed - 1):+.2f} %", f"{100 * (each.printed_scale_exact[k] / printed - 1):+.2f} %",
                 f"{each.stress[k] * 1e-6:.0f}"]
            )  # fmt: skip
    worst, worst_exact = max(e.deviation for e in found), max(e.deviation_exact for e in found)
    load_8 = 794.0
    exact = float(BEARING_6016.inner.peak_pressure(load_8)) * 1e-6
    printed_8 = float(printed_pressure(BEARING_6016, np.array(load_8))) * 1e-6
    largest, least = max(e.resultant for e in found), min(e.resultant for e in found)
    rows = [
        Comparison("stress of ball 8 under 794 N, paper's scale", 2014, printed_8, "MPa", "fits, factor 2 missing in a³"),
        Comparison(
            "the same, exact Hertz",
            2014,
            exact,
            "MPa",
            f"our result; the printed scale is {printed_8 / exact:.3f} times it",
        ),
    ]
    for deviation, published in ((5e-6, 0.29), (-2e-6, -0.105)):
        name = f"change of contact stiffness, {deviation * 1e6:+.0f} µm"
        rows.append(Comparison(f"{name}, fits", published, 100 * stiffness_change(deviation, True), "%"))
        rows.append(Comparison(f"{name}, exact", published, 100 * stiffness_change(deviation, False), "%"))
    slope = -0.105 / -2
    return f"""## Publication I: stresses at the first contact of the 6016

The resultant of each row's printed stresses is applied to the balls; the stresses should come out as printed. Columns: the
stress on the paper's scale with the paper's fits for the stiffness; its deviation; the deviation with exact elliptic integrals;
the correct stress (exact Hertz). MPa.

{grid(["arrangement", "ball", "printed", "ours, printed scale", "deviation", "deviation, exact", "correct stress"], body)}

With the paper's fits the distribution agrees to {100 * worst:.2f} % in all nine arrangements; with exact integrals to
{100 * worst_exact:.2f} % (the fits are {100 * (fitted_stiffness(BEARING_6016) / BEARING_6016.stiffness - 1):.1f} % stiffer,
which affects the least loaded balls most).

{table(rows)}

- The printed stresses are Hertz's times 2^(2/3) = {2 ** (2 / 3):.3f}: the factor that results if 1/E' = Σ(1 − ν²)/E
  is used in a formula that needs 2/E' on its left side.
- The printed arrangements do not carry the same load, although the paper says so: their resultants range from
  {least:.0f} to {largest:.0f} N.
- The two printed changes of stiffness are inconsistent: {slope:.4f} % per micrometre of the smaller ball gives
  {5 * slope:+.2f} % for +5 µm, near ours, not the +0.29 % that the text reads from a figure. The fits reproduce the printed
  −0.105 % to {abs(100 * stiffness_change(-2e-6, True) + 0.105):.3f} points.
"""
