"""A line of a spectrum that stands at a frequency."""

from tdbmon.analysis.lines import Line
from tdbmon.estimate import Estimate


def line(name: str, hz: float, kind: str = "constant") -> Line:
    return Line(
        kind=kind,  # type: ignore[arg-type]
        order=None,
        frequency=Estimate(hz, hz - 0.1, hz + 0.1, "Hz"),
        direction="both",
        end="both",
        amplitude=Estimate(1e-6, unit="um", kind="0-pk"),
        first_s=0.09,
        last_s=0.14,
        name=name,
        combined=" x " in name,
    )
