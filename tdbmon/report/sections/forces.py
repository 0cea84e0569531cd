"""Report section: forces and stresses of the fitted model, and the fitted values."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from tdbmon.identify.model_share import FORCES_HOLD
from tdbmon.quantity import number, why_no_interval, words
from tdbmon.remarks import and_more, grouped
from tdbmon.report.document import Block, Figure, Paragraph, Row, Section, Table, Verdict
from tdbmon.report.sections.fitted_values import fitted_values

if TYPE_CHECKING:
    from tdbmon.identify.calibration import Calibration
    from tdbmon.identify.fitted import FittedDrop
    from tdbmon.identify.forces import DropForces, EndForces
    from tdbmon.identify.stress import Stress

_TITLE = "Forces and stresses (fitted model)"
_LISTED = 12  # contacts of an end
_CONTACTS = (
    "A contact lasts here as long as the simulated force acts: one that is detected from the displacement may contain several."
    " The greatest peak of all is taken from all steps of the simulation, the others from its samples."
)
_STEEP = (
    "The greatest forces are taken from all steps of the simulation, since the first impact of an inner ring may be shorter than"
    f" a sample of the record. {FORCES_HOLD}."
)


def hardest(drop: DropForces) -> tuple[Row, ...]:
    """Return the greatest force and stress of each end as table rows."""
    ends, within = drop.ends.values(), f"first {drop.seconds:g} s"
    return (
        Row((f"Greatest normal force on the ring, {within}", *(words(end.peak) for end in ends))),
        Row((f"Greatest Hertz stress of a ball, {within}", *(words(end.stress.greatest) for end in ends))),
    )


def section(fitted: FittedDrop) -> Section:
    """Return the forces on both bearings with their intervals, and the calibrated values."""
    from tdbmon.figures.forces import forces
    from tdbmon.figures.stress_outliers import stress_outliers

    drop, calibration = fitted.forces, fitted.calibration
    if drop.withheld:
        return Section(_TITLE, (*_withheld(fitted), *(_drops(fitted) if fitted.others else ()), fitted_values(fitted)))
    ends = drop.ends.values()
    blocks: list[Block] = [
        Paragraph(
            f"No sensor measures these. The machine's model was fitted to the first {calibration.horizon * 1e3:.0f} ms after the"
            f" release{_of_several(calibration)} within the tolerances of the machine file; the residual"
            f" of the first contacts is {calibration.misfit:.2f} times the probes' noise (1 for noise alone)."
            f" Forces are those of an ensemble of {drop.members} simulations drawn from the fit's uncertainty, over"
            f" {drop.seconds:g} s."
        ),
        *_remarks(fitted),
        Table("Forces and stresses (95 % intervals of the fit)", ("Quantity", *drop.ends), _rows(drop)),
        Paragraph(_STEEP),
        Paragraph(
            f"{_assumptions(drop)}The rule of three standard deviations from the mean is that of the"
            " dissertation of N. Neisi (LUT University); Tukey's fence, 1.5 interquartile ranges above the box,"
            " is not influenced by the outliers."
        ),
        Figure(
            "stress-outliers",
            "Greatest Hertz stress among the balls while any is loaded. Box: quartiles with median; cross: mean; bars: least and"
            " greatest value within Tukey's fences. Dots and rings: peaks beyond the fence and beyond three standard deviations,"
            " where there are any.",
            "Box plots of the stress over time, a panel for each end and a box for each drop, with outliers by two rules.",
            partial(stress_outliers, [each for each in fitted.all_forces if not each.withheld]),
        ),
        *(_drops(fitted) if fitted.others else ()),
        Figure(
            "forces",
            "Normal force at each end. Paths with impacts diverge: from the dotted line on the ensemble's members no"
            " longer agree, and only statistics are stated.",
            "For each end, force against time after the release with its 95 % band.",
            partial(forces, drop),
        )
        if any(end.history.time.size for end in ends)
        else Paragraph("The simulations diverge from the release on: no force is drawn against time."),
        *((Paragraph(_CONTACTS),) if any(end.contacts for end in ends) else ()),
        *(_contacts(end) for end in ends if end.contacts),
        fitted_values(fitted),
    ]
    return Section(_TITLE, tuple(blocks))


_ROWS: tuple[tuple[str, Callable[[EndForces], str]], ...] = (
    ("Mean stress while loaded", lambda end: f"{end.stress.mean / 1e6:.0f} MPa"),
    ("Median (quartiles)", lambda end: _quartiles(end.stress)),
    ("Peaks beyond three standard deviations", lambda end: _beyond(end.stress.outliers, end.stress.outlier_level)),
    ("Peaks beyond Tukey's fence", lambda end: _beyond(end.stress.tukey, end.stress.tukey_level)),
    ("Impulse of the normal force, all contacts", lambda e: _impulse(e.impulse, e.impulse_low, e.impulse_high)),
    (
        "Inner ring at shaft speed, after the release",
        lambda end: words(end.ring_at_speed) + why_no_interval(end.ring_at_speed),
    ),
)


def _rows(drop: DropForces) -> tuple[Row, ...]:
    """Return forces and stresses of each end as table rows."""
    return (*hardest(drop), *(Row((name, *map(told, drop.ends.values()))) for name, told in _ROWS))


def _quartiles(stress: Stress) -> str:
    return f"{stress.median / 1e6:.0f} ({stress.q1 / 1e6:.0f} to {stress.q3 / 1e6:.0f}) MPa"


def _withheld(fitted: FittedDrop) -> list[Block]:
    """Return the reason why forces and stresses are withheld, and the result of the fit."""
    calibration = fitted.calibration
    return [
        Verdict(f"No forces and stresses are given: {fitted.forces.withheld}.", "attention"),
        *_remarks(fitted),
        Paragraph(
            f"The machine's model was fitted to the first {calibration.horizon * 1e3:.0f} ms after the release"
            f"{_of_several(calibration)} within the tolerances of the machine file, but does not follow the record. The"
            " values below are those at which the fit ended: they may help to find the error, but are not those of the machine."
        ),
    ]


def _remarks(fitted: FittedDrop) -> list[Block]:
    names = [each.name for each in fitted.all_forces]
    return [Verdict(remark, "attention") for remark in grouped(fitted.calibration.remarks, names)]


def _of_several(calibration: Calibration) -> str:
    count = len(calibration.drops)
    return f" of {count} drops at once" if count > 1 else ""


def _drops(fitted: FittedDrop) -> list[Block]:
    """Return a table of forces and stresses of all jointly fitted drops."""
    rows = []
    for fit, drop in zip(fitted.calibration.drops, fitted.all_forces, strict=True):
        cells = []
        for end in drop.ends.values():
            if drop.withheld:
                cells += ["withheld", "–", "–"]
                continue
            outliers = f"{len(end.stress.outliers)} / {len(end.stress.tukey)}"
            cells += [words(end.peak), f"{_greatest(end.stress)} / {end.stress.mean / 1e6:.0f} MPa", outliers]
        rows.append(Row((f"{drop.name}, {fit.speed:.0f} Hz", *cells)))
    header = tuple(
        f"{end}: {what}"
        for end in fitted.forces.ends
        for what in ("peak force", "stress, greatest / mean", "outliers, 3 deviations / Tukey")
    )
    return [Table("All drops that were fitted together", ("Drop", *header), tuple(rows))]


def _greatest(stress: Stress) -> str:
    return "–" if stress.greatest.value is None else f"{stress.greatest.value / 1e6:.0f}"


def _beyond(peaks: tuple[float, ...], level: float) -> str:
    return f"{len(peaks)} beyond {level / 1e6:.0f} MPa"


def _assumptions(drop: DropForces) -> str:
    """Return the assumptions of the stresses: one sentence if they are the same at all ends, else one for each end."""
    texts = {name: end.stress.assumption for name, end in drop.ends.items()}
    if len(set(texts.values())) == 1:
        texts = {"": next(iter(texts.values()))}
    return "".join(f"The stress{name and f' at {name}'} {text}. " for name, text in texts.items() if text)


def _impulse(value: float, low: float, high: float) -> str:
    width = high - low
    return f"{number(value, width)} N s ({number(low, width)} to {number(high, width)})"


def _contacts(end: EndForces) -> Table:
    """Return a table of peak force and impulse of each contact before the ensemble's simulations diverge."""
    rows = tuple(
        Row(
            (
                f"{k + 1}",
                f"{contact.start * 1e3:.2f} ms",
                f"{contact.seconds * 1e3:.2f} ms",
                words(contact.peak),
                _impulse(contact.impulse, contact.impulse_low, contact.impulse_high),
            )
        )
        for k, contact in enumerate(end.contacts[:_LISTED])
    )
    more = len(end.contacts) - _LISTED
    caption = (
        f"{end.end}: force of each contact until the simulations diverge, {end.history.parted * 1e3:.0f} ms after the release"
        " (95 % intervals)" + and_more(more)
    )
    return Table(caption, ("Contact", "Begins, from the release", "Duration", "Peak normal force", "Impulse"), rows)
