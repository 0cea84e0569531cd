"""Report section: methods of the comparison and their limits."""

from __future__ import annotations

from tdbmon.history.compare import Comparison
from tdbmon.quantity import stated_percent
from tdbmon.report.document import Paragraph, Section


def section(comparison: Comparison) -> Section:
    """Return methods and limits."""
    compare = comparison.settings.compare
    correction = (
        "Holm's method: the chance of any false flag on a drop like those before is at most"
        if compare.correction == "holm"
        else "the method of Benjamini and Hochberg: the expected share of false flags among the flags is at most"
    )
    n = len(comparison.matched)
    honest = f" With {n} drops before there is no control chart: only gross changes can be detected." if n < 5 else ""
    return Section(
        "Methods and limits",
        (
            Paragraph(
                "Each value is compared with a prediction from the earlier drops: their mean and standard deviation below 15"
                " drops, Tukey's biweight location and scale from 15 on, and Student's t with the degrees of freedom of this"
                " number of drops. Where a quantity drifts, centre and scatter are those about its slope."
                " A drop in which a quantity was itself flagged is no reference for later drops and is left out for"
                f" that quantity.{honest} Probabilities are corrected by {correction}"
                f" {stated_percent(compare.significance)}. Leaving drops out has its price: instead of 5 % it was 7 to 8 % in a"
                " count of quantities with large scatter."
            ),
            Paragraph(
                "The same condition means the same machine, assembly and speed at the release. Temperature, set-point and"
                " the angles of rotor, ring and cage at the release are not known; their effect from drop to drop is"
                " part of the scatter. A cause named beside a difference is a possible cause of such a change, not a"
                " finding: tdbmon diagnose searches for causes."
            ),
        ),
    )
