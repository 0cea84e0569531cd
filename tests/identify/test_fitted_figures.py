"""Figures of the fitted model: labelled with units, nothing clipped or covered, nothing drawn that is not told."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from tdbmon.figures.campbell import campbell
from tdbmon.figures.critical_speed_map import critical_speed_map
from tdbmon.figures.displacements_against_simulated import displacements_against_simulated
from tdbmon.figures.forces import forces
from tdbmon.figures.stress_outliers import stress_outliers
from tdbmon.identify.forces import ForceHistory
from tdbmon.identify.natural_frequencies import ORDERS
from tdbmon.report.document import Document, Figure, Paragraph
from tdbmon.report.sections.forces import section as forces_section
from tests.figure_checks import assert_readable, faults, rendered
from tests.identify.spectral_line import line


def of_model(document: Document) -> list[Figure]:
    wanted = ("Measured against simulated", "Forces and stresses", "Natural frequencies")
    found = [b for s in document.sections if s.title.startswith(wanted) for b in s.blocks if isinstance(b, Figure)]
    return found


def test_every_figure_is_readable(report: Document) -> None:
    assert len(of_model(report)) >= 6
    assert_readable(report)


def test_no_label_covers_the_numbers_of_its_axis(report: Document) -> None:
    for figure in of_model(report):
        drawing = rendered(figure.draw())
        renderer = drawing.canvas.get_renderer()  # type: ignore[attr-defined]
        for ax in (ax for ax in drawing.axes if ax.get_ylabel()):
            label = ax.yaxis.label.get_window_extent(renderer)
            for number in ax.get_yticklabels():
                box = number.get_window_extent(renderer)
                assert not label.overlaps(box), f"{figure.name}: '{ax.get_ylabel()}' covers {number.get_text()}"


def test_forces_are_drawn_as_far_as_they_are_told(fitted) -> None:
    """Members that part at a fifth of the time simulated leave four fifths of nothing; where they never part nothing says so."""

    def parting(history: ForceHistory, at: float) -> ForceHistory:
        shown = history.time < at
        columns = {name: getattr(history, name)[shown] for name in ("time", "force", "low", "high")}
        return replace(history, **columns, parted=at)

    whole = {
        name: replace(end, history=replace(end.history, parted=float(end.history.time[-1])))
        for name, end in fitted.forces.ends.items()
    }
    parts = {
        name: replace(end, history=parting(end.history, at))
        for (name, end), at in zip(whole.items(), (0.008, 0.01), strict=True)
    }
    for ends, right in ((whole, 1e3 * fitted.forces.seconds), (parts, 10.0)):
        figure = rendered(forces(replace(fitted.forces, ends=ends)))
        labels = {text.get_text() for text in figure.legends[0].get_texts()}
        assert ("members diverge" in labels) == (ends is parts)
        assert right <= figure.axes[0].get_xlim()[1] <= 1.1 * right


def test_an_end_whose_members_differ_from_the_release_on_has_no_curve(fitted) -> None:
    def never_together(end):
        nothing = np.empty(0)
        return replace(end, history=ForceHistory(nothing, nothing, nothing, nothing, parted=0.0))

    ends = dict(fitted.forces.ends)
    first, second = ends
    ends[first] = never_together(ends[first])
    figure = rendered(forces(replace(fitted.forces, ends=ends)))
    assert "diverge from the release" in figure.axes[0].texts[0].get_text()
    assert not any(label.get_text() for label in figure.axes[0].get_yticklabels())  # there was one of 0 to 1 kN
    assert figure.axes[1].lines
    ends[second] = never_together(ends[second])
    blocks = forces_section(replace(fitted, forces=replace(fitted.forces, ends=ends))).blocks
    assert not any(isinstance(block, Figure) and block.name == "forces" for block in blocks)
    assert any(isinstance(block, Paragraph) and "no force is drawn" in block.text for block in blocks)


def test_long_names_of_ends_have_room(fitted) -> None:
    """They were higher than the panels beside which they stand."""
    names = dict(zip(fitted.forces.ends, ("Nichtantriebsseite", "Antriebsseite"), strict=True))
    loads = {names[name]: end for name, end in fitted.forces.ends.items()}
    paths = {names[name]: replace(end, end=names[name]) for name, end in fitted.agreement.ends.items()}
    for drawing in (
        forces(replace(fitted.forces, ends=loads)),
        displacements_against_simulated(replace(fitted.agreement, ends=paths)),
    ):
        assert faults(drawing) == []


@pytest.mark.parametrize("count", [1, 2, 12])
def test_long_names_of_many_drops_have_room_below_their_stresses(fitted, count) -> None:
    drops_of = [replace(fitted.forces, name=f"2024-05-11_Auslauf_Größe_7_{k:02d}_ohne_Öl.tdms") for k in range(count)]
    drawing = rendered(stress_outliers(drops_of))
    assert faults(drawing) == []
    boxes = [label.get_window_extent() for label in drawing.axes[0].get_xticklabels()]
    slope = np.tan(np.radians(40.0))  # names aslant cover each other where they are nearer than their type is high
    type_high = 6.0 * drawing.dpi / 72
    assert all(slope * (b.x1 - a.x1) / np.hypot(1, slope) > type_high for a, b in itertools.pairwise(boxes))


def test_orbits_have_equal_axes(report: Document) -> None:
    figure = next(f for f in of_model(report) if f.name == "orbits-against-simulated")
    drawing = rendered(figure.draw())
    for ax in drawing.axes:
        box = ax.get_window_extent()
        assert box.width / np.ptp(ax.get_xlim()) == pytest.approx(box.height / np.ptp(ax.get_ylim()), rel=1e-6)


def test_names_of_lines_near_each_other_stand_apart_in_the_map(fitted, analysed) -> None:
    """Two swings as near as their bearings are alike stood on each other, and a line without a name had its frequency twice."""
    hz = fitted.natural_frequencies.modes[0].frequency.value
    lines = [line("swing 1", hz), line("swing 2", hz + 2.0), line("bounce", hz + 4.0), line("212.3 Hz", 212.3)]
    drawing = rendered(critical_speed_map(fitted.natural_frequencies, analysed, lines))
    names = [text for text in drawing.axes[0].texts if text.get_text()]
    assert [text.get_text() for text in names][-2:] == [f"bounce, {hz + 4:.1f} Hz", "212.3 Hz"]
    boxes = [text.get_window_extent() for text in names]
    assert len(boxes) == 4
    assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))


def test_every_order_in_the_campbell_diagram_has_its_critical_speeds(fitted, analysed) -> None:
    """3X was drawn through the modes without a mark."""
    drawing = rendered(campbell(fitted.natural_frequencies, analysed, ()))
    told = {order for mode in fitted.natural_frequencies.modes for order in zip(ORDERS, mode.critical, strict=True)}
    rays = {float(text.get_text()[:-1]) for text in drawing.axes[0].texts}
    assert rays == {order for order, critical in told if critical is not None}
    marks = [line for line in drawing.axes[0].lines if line.get_marker() == "o"]
    assert len(marks) == sum(critical is not None for _, critical in told)
