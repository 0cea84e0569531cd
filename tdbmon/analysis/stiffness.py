"""Equivalent stiffness of an end from its first contact, by the single-mass model.

The end's share M of the rotor mass oscillates on a spring about its position at rest.  From passing that position inwards
(t1) to passing it outwards (t2) is half a period: w_k = pi / (t2 - t1), K_eq = M w_k^2 (N. Neisi, dissertation, LUT
University, Eq. 3.3 and Sec. 4.3.1).  It represents bearing and support in series and is the initial guess for a fit of
the whole first contact.

The model neglects the support's mass and the other end, whose impact lengthens or shortens this contact.  On 80 simulated
first contacts of the shipped machine (four speeds, random set-points) it gave 0.40 to 1.05 times the stiffness defined as
peak force over travel (2.5 % and 97.5 % quantile); the interval includes that.
"""

from __future__ import annotations

import numpy as np

from tdbmon.analysis.first_contact import FirstContact
from tdbmon.estimate import Z95, Estimate

_MODEL = (0.40, 1.05)  # ratio to peak force over travel, 2.5 % and 97.5 % quantile (see above)


def single_mass_stiffness(first: FirstContact | None, mass: float) -> Estimate:
    """Return K_eq, N/m, for the end's share of the rotor mass, kg.

    The interval is that of bearing and support in series, with the uncertainty of the instants and the model error.  As all
    drops of a machine share the model error, `scatter` of the estimate excludes it.
    """
    if first is None:
        return Estimate.missing("N/m", "no first contact was found")
    t1, t2 = first.static_in, first.static_out
    if t1.value is None or t2.value is None:
        return Estimate.missing("N/m", t1.why or t2.why)
    half = t2.value - t1.value
    if half <= 0 or t1.sigma is None or t2.sigma is None:
        return Estimate.missing("N/m", "the shaft does not pass its position at rest twice")
    # an error of the rest position moves the instants in opposite directions: their errors add
    apart = Z95 * (t1.sigma + t2.sigma)
    value, low, high = (
        float(mass * (np.pi / each) ** 2) for each in (half, half + apart, max(half - apart, 0.1 * half))
    )
    rule = "half a period of a single mass about the position at rest"
    return Estimate(
        value,
        low / _MODEL[1],
        high / _MODEL[0],
        "N/m",
        f"{rule}; interval: bearing and support in series",
        scatter=Estimate(value, low, high, "N/m", rule),
    )
