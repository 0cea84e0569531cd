"""Report section: measured against simulated motion, and the time from which the fitted model departs from the record."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from tdbmon.quantity import number, why_no_interval, words
from tdbmon.record.slow_roll import COMPENSATED, NOT_COMPENSATED
from tdbmon.report.document import Block, Figure, Paragraph, Row, Section, Table

if TYPE_CHECKING:
    from tdbmon.analysis.contact_events import Contact
    from tdbmon.identify.agreement import Agreement, EndAgreement
    from tdbmon.identify.fitted import FittedDrop
    from tdbmon.identify.friction_choice import FrictionChoice

_LISTED = 8  # contacts of an end


def section(fitted: FittedDrop) -> Section:
    """Return displacements, orbits, contact times and residuals, and the friction chosen by sensitivity as in the source."""
    from tdbmon.figures.displacements_against_simulated import displacements_against_simulated
    from tdbmon.figures.orbits_against_simulated import orbits_against_simulated

    found, problem = fitted.agreement, fitted.calibration.problem
    runout = COMPENSATED if problem.drops[0].compensated else NOT_COMPENSATED
    rate = problem.drops[0].divergence
    horizon = f"{found.fitted_to * 1e3:.0f} ms"
    blocks: list[Block] = [
        Paragraph(
            f"The fitted model, simulated from its state at the release. Up to {horizon} it was fitted to the record;"
            f" what follows was not fitted. Neighbouring paths with impacts diverge exponentially, here by a factor of e every"
            f" {1e3 / rate:.0f} ms. Beyond the first contacts a small error of the model or of a fitted"
            " value grows into a different path, and only statistics of the two can be compared."
        ),
        _residuals(found),
    ]
    if found.ends:
        blocks += [
            Figure(
                "displacements-against-simulated",
                "Displacement at each end as measured and as simulated, and below it the residual, measured less simulated. Its"
                " scale differs from panel to panel.",
                "For each end, x and y against time, measured and simulated, with the difference below.",
                partial(displacements_against_simulated, found),
            ),
            Figure(
                "orbits-against-simulated",
                "The same as orbits, with the fitted clearance circle and the sense of rotation.",
                "For each end, the measured and the simulated orbit, up to the end of the fit and beyond.",
                partial(orbits_against_simulated, found, fitted.calibration.machine.sense, runout),
            ),
            *(_contacts(end, found.fitted_to) for end in found.ends.values()),
        ]
    if fitted.friction is not None:
        blocks += _friction(fitted.friction)
    return Section("Measured against simulated", tuple(blocks))


def _residuals(found: Agreement) -> Table:
    probes = list(found.residuals[-1].rms)
    rows = []
    for each in found.residuals:
        cells = [
            f"{each.rms[p] * 1e6:.2f} µm, {each.rms[p] / each.noise[p]:.2f}" if p in each.rms else "–" for p in probes
        ]
        scope = "" if each.horizon <= found.fitted_to + 1e-9 else " (not fitted)"
        rows.append(Row((f"{each.horizon * 1e3:.0f} ms{scope}", f"{each.ratio:.2f}", *cells)))
    caption = "Residual from the release on: rms, and its ratio to the noise of the probe (1 for noise alone)"
    return Table(caption, ("To, after the release", "All probes", *probes), tuple(rows))


def _contacts(end: EndAgreement, fitted_to: float) -> Table:
    rows = []
    for k, pair in enumerate(end.contacts[:_LISTED]):
        apart = "–"
        if pair.measured is not None and pair.simulated is not None:
            apart = f"{number((pair.simulated.start - pair.measured.start) * 1e3, 0.1)} ms"
        force = "–" if pair.force is None else f"{pair.force[0] * 1e3:.2f} to {pair.force[1] * 1e3:.2f} ms"
        late = min(c.start for c in (pair.measured, pair.simulated) if c is not None) > fitted_to
        cells = (
            f"{k + 1}{' (not fitted)' if late else ''}",
            _span(pair.measured),
            _span(pair.simulated),
            apart,
            force,
        )
        rows.append(Row(cells))
    more = len(end.contacts) - _LISTED
    caption = (
        f"{end.end}: contacts after the release, both detected where the displacement exceeds {end.touching * 1e6:.1f} µm, at"
        " which the shaft touches a ring that hangs at the bottom of its balls; the force is that of the model"
        + (f"; {more} more follow" if more > 0 else "")
    )
    return Table(caption, ("Contact", "Measured", "Simulated", "Simulated later by", "Simulated force"), tuple(rows))


def _span(contact: Contact | None) -> str:
    return "none" if contact is None else f"{contact.start * 1e3:.2f} to {contact.end * 1e3:.2f} ms"


def _friction(choice: FrictionChoice) -> list[Block]:
    from tdbmon.figures.friction_choice import friction_choice

    beside = "; ".join(f"{words(value)}{why_no_interval(value)} at {end}" for end, value in choice.fitted.items())
    fitted = any(value.low is not None for value in choice.fitted.values())
    rule = "Least squares, each end separately" if fitted else "Least squares held the friction at its stated value"
    at = list(choice.tried).index(choice.chosen)
    edge = (
        f" It is the {'least' if at == 0 else 'greatest'} one tried: the best may lie beyond." if choice.at_edge else ""
    )
    near = "; ".join(
        f"{end}: {choice.distance[end][at] * 1e6:.1f} µm rms apart, deepest {choice.deepest[end][at] * 1e6:.0f} µm against"
        f" {choice.measured_deepest[end] * 1e6:.0f} µm measured"
        for end in choice.distance
    )
    return [
        Paragraph(
            f"Friction by sensitivity: of {len(choice.tried)} coefficients, the same at both ends, {choice.chosen:.3f} brings"
            f" the orbits of the first {choice.seconds * 1e3:.0f} ms nearest to the measured ones ({near}).{edge} This is the"
            " method of N. Neisi's dissertation (sec. 3.1). It has no interval, and it is no independent proof, since all other"
            f" values stay as fitted. {rule}: {beside}."
        ),
        Figure(
            "friction-choice",
            "Distance between simulated and measured orbit, and deepest excursion, against the coefficient of friction. Away"
            " from the best coefficient the contacts shift in time, and the curves are rough; the deepest excursion may hardly"
            " depend on friction.",
            "For each end, distance of the orbits and deepest excursion against the coefficient of friction.",
            partial(friction_choice, choice),
        ),
    ]
