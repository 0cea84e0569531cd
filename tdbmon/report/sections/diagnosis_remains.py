"""Report sections: the residual of the most probable model, and the most informative next test."""

from __future__ import annotations

from functools import partial

import numpy as np

from tdbmon.diagnosis.contender import EXPLAINED
from tdbmon.diagnosis.evidence import EXTENDED, PLAIN, Evidence
from tdbmon.diagnosis.left_over import Line, spectra
from tdbmon.diagnosis.unexplained import Unexplained, unexplained
from tdbmon.report.document import Block, Figure, Paragraph, Section, Verdict, sentence
from tdbmon.report.sections.diagnosis_force import table


def remains(evidence: Evidence) -> Section:
    """Return the section on the size of the residual, where it is greatest, and the equivalent residual force."""
    best = evidence.diagnosis.best
    left = unexplained(best)
    name = PLAIN if evidence.extended is None else f"model with {best.words}"
    blocks: list[Block] = []
    if best.ratio <= EXPLAINED:
        said = (
            f"The misfit of the {name} is {best.times_noise} times that of noise alone, with the allowance for how simulations"
            " diverge: no more than is expected of a complete model."
        )
        blocks.append(Verdict(said, "good"))
    else:
        blocks.append(Verdict(f"The misfit of the {name} is {best.times_noise} times that of noise alone.", "attention"))
    blocks.append(Paragraph(_loudest(left)))
    lines = _lines(evidence)
    if lines:
        peaks = "; ".join(
            f"{line.end}, {line.drop}: {line.words} (order {line.order_words}), {line.amplitude * 1e6:.2f} µm 0-pk,"
            f" {line.amplitude / line.noise:.0f} times"
            " the noise"
            for line in lines
        )
        nearest = max(line.resolution for line in lines)
        blocks.append(
            Paragraph(
                f"Highest peak of the residual's spectrum at each end, over all drops: {peaks}. In so short a time a frequency"
                f" is known to ± {nearest / 2:.0f} Hz."
            )
        )
    elif any(spectra(left, evidence.diagnosis.machine) for left in evidence.best_left):
        blocks.append(Paragraph("No peak of the residual's spectra exceeds the level of noise alone."))
    if evidence.extended is not None:
        blocks.append(_force(evidence))
        blocks.append(table(EXTENDED, evidence.extended_force, evidence.diagnosis.machine.ends))
        blocks.append(Paragraph(_against_contacts(evidence)))
    blocks += [Paragraph(f"In addition to the verdict: {sentence(each).text}") for each in evidence.diagnosis.aside]
    return Section("What remains unexplained", tuple(blocks))


def _loudest(left: Unexplained) -> str:
    return (
        f"Greatest residual relative to noise: probe {left.probe} in {left.drop}, {left.rms * 1e6:.2f} µm rms from the release"
        f" on, with a noise of {left.noise * 1e6:.2f} µm; most of it from {left.since * 1e3:.1f} to {left.until * 1e3:.1f} ms,"
        f" {_strongest(left)}."
    )


def _strongest(left: Unexplained) -> str:
    """Return the frequency of the residual as text, with the resolution of so short a stretch."""
    if left.frequency < left.resolution:
        return f"strongest below {left.resolution:.0f} Hz, too slow to be resolved in so short a time"
    return f"strongest near {left.frequency:.0f} Hz (± {left.resolution / 2:.0f})"


def _lines(evidence: Evidence) -> list[Line]:
    """Return the highest spectral peak at each end over all drops."""
    machine = evidence.diagnosis.machine
    found = [line for left in evidence.best_left for each in spectra(left, machine) for line in each.lines(1)]
    return [
        max(there, key=lambda line: line.amplitude)
        for end in machine.ends
        if (there := [line for line in found if line.end == end])
    ]


def _force(evidence: Evidence) -> Figure:
    from tdbmon.figures.residual_force import force_against_time

    shown = evidence.shown
    forces = [evidence.extended_force[k] for k in shown]
    speeds = [evidence.extended_left[k].speed for k in shown]
    return Figure(
        "remaining-force",
        "The force that is still missing with the extended model, found as above. A force within its band cannot be"
        f" distinguished from noise.{evidence.selection}",
        "For each end, x and y of the force that is still missing, against time, for some drops side by side.",
        partial(force_against_time, forces, evidence.diagnosis.machine.ends, speeds, EXTENDED),
    )


def _against_contacts(evidence: Evidence) -> str:
    """Return a comparison of the remaining residual force with the contact forces as text.

    Noise alone exceeds the 95 % band 5 % of the time.
    """
    forces = evidence.extended_force
    peak = max(float(np.abs(each.simulated).max()) for each in forces)
    found = [
        each.summary(e, within)
        for each in forces
        for e in range(len(each.stands_out))
        for within in (each.fall, ~each.fall)
    ]
    most = max((each.rms for each in found if each is not None), default=0.0)
    return (
        "Noise alone is outside the band 5 % of the time. What is outside more often is a force that acts, or an error of the"
        " simulation itself, which grows as paths diverge; the misfit allows for this error. The greatest of these"
        f" forces is {most:.0f} N rms, compared with contact forces of up to {peak:.0f} N."
    )


def next_test(evidence: Evidence) -> Section:
    """Return the section with the recommended next test."""
    text = evidence.diagnosis.next_test
    return Section("What to do next", (sentence(text),))
