"""Forces and stresses of the fitted model, and what was fitted."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from tdbmon.report.document import Block, Figure, Paragraph, Row, Section, Table, Verdict
from tdbmon.report.quantity import words

if TYPE_CHECKING:
    from tdbmon.identify.fitted import FittedDrop


def section(fitted: FittedDrop) -> Section:
    """Return the forces on both bearings with their intervals, and the calibrated values."""
    from tdbmon.figures.forces import forces

    drop, calibration = fitted.forces, fitted.calibration
    ends = drop.ends.values()
    rows = [
        Row(("Greatest normal force on the ring", *(words(end.peak) for end in ends))),
        Row(("Greatest Hertz stress of a ball", *(words(end.stress.greatest) for end in ends))),
        Row(("Mean stress while loaded", *(f"{end.stress.mean / 1e6:.0f} MPa" for end in ends))),
        Row(
            (
                "Median (quartiles)",
                *(
                    f"{e.stress.median / 1e6:.0f} ({e.stress.q1 / 1e6:.0f} to {e.stress.q3 / 1e6:.0f}) MPa"
                    for e in ends
                ),
            )
        ),
        Row(("Peaks beyond three standard deviations", *(f"{len(end.stress.outliers)}" for end in ends))),
        Row(("Inner ring at shaft speed, after the release", *(words(end.ring_at_speed) for end in ends))),
    ]
    blocks: list[Block] = [
        Paragraph(
            "No sensor measures these. The machine's model was fitted to the first"
            f" {calibration.horizon * 1e3:.0f} ms after the release within the tolerances of the machine file; what is left"
            f" is {calibration.misfit:.2f} times the probes' noise (1 where nothing but noise is left). Forces are those of an"
            f" ensemble of {drop.members} simulations drawn from the fit's uncertainty, over {drop.seconds:g} s."
        ),
        *(Verdict(remark, "attention") for remark in calibration.remarks),
        Table("Forces and stresses (95 % intervals)", ("Quantity", *drop.ends), tuple(rows)),
        Paragraph(f"The stress {next(iter(ends)).stress.assumption}."),
        Figure(
            "forces",
            "Normal force at each end. Trajectories with impacts part: from the dotted line on the ensemble's members no"
            " longer agree, and only statistics are stated.",
            "For each end, force against time after the release with its 95 % band.",
            partial(forces, drop),
        ),
        _values(fitted),
    ]
    return Section("Forces and stresses (fitted model)", tuple(blocks))


def _values(fitted: FittedDrop) -> Table:
    """Return the fitted values, and which of them the drop does not determine."""
    calibration = fitted.calibration
    bound = {each.name for each in calibration.at_bound}
    loose = {each.name: each for each in calibration.undetermined}
    rows = []
    for name, value in calibration.values.items():
        remark = ""
        if name in bound:
            remark = "at the edge of its tolerance: the truth may lie beyond, or the model lacks something"
        elif name in loose:
            partners = ", ".join(partner for partner, _ in loose[name].partners)
            remark = "hardly determined by this drop" + (f"; goes with {partners}" if partners else "")
        rows.append(Row((name, words(value), remark)))
    return Table("Fitted values (95 % intervals)", ("Value", "Fitted", "Remark"), tuple(rows))
