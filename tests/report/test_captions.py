"""Captions say what is drawn beside them, and words on numbers that surprise stand beside these."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from tdbsim.machine import Machine

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.result import Analysis
from tdbmon.figures.centreline import centreline
from tdbmon.figures.full_spectrum import full_spectrum
from tdbmon.figures.gap_map import gap_map
from tdbmon.figures.orbit_sequence import orbit_sequence
from tdbmon.figures.stress_outliers import stress_outliers
from tdbmon.figures.style import BLUE, VERMILION
from tdbmon.record.read import read
from tdbmon.remarks import grouped
from tdbmon.report.document import Figure, Paragraph, Section, Table
from tdbmon.report.sections import contact, gap, orbit, release, rundown, spectra, summary, tracking
from tdbmon.report.sections.findings import ABOVE_ONE
from tdbmon.shipped import shipped


def _figure(section: Section | None, name: str) -> Figure:
    assert section is not None
    return next(block for block in section.blocks if isinstance(block, Figure) and block.name == name)


def _without_circle(analysis: Analysis, end: str) -> Analysis:
    bare = replace(analysis.ends[end], gap=None, contacts=None)
    return replace(analysis, ends={**analysis.ends, end: bare})


def test_the_caption_of_orbits_speaks_of_dots_only_with_a_keyphasor(short: Analysis) -> None:
    assert "a dot marks each pulse" in _figure(orbit.section(short), "orbits-1").caption
    assert "dot" not in _figure(orbit.section(replace(short, angle=None)), "orbits-1").caption


def test_the_caption_of_orbits_names_the_circle_that_the_legend_names(short: Analysis) -> None:
    half = _without_circle(short, "NDE")
    captions = [_figure(orbit.section(half), name).caption for name in ("orbits-1", "orbits-2")]
    for end, caption, words, others in (
        ("NDE", captions[0], "gap of the drawing", "clearance circle at the static load"),
        ("DE", captions[1], "clearance circle at the static load", "gap of the drawing"),
    ):
        labels = [text.get_text() for text in orbit_sequence(half, end).legends[0].get_texts()]
        assert any(label in (words, "clearance circle", f"{words} about the probes' zero") for label in labels)
        assert words in caption and others not in caption


def test_the_caption_of_full_spectra_names_the_colours_that_are_drawn(short: Analysis) -> None:
    caption = _figure(spectra.section(short), "full-spectrum").caption
    ax = full_spectrum(short).axes[0]
    forward, backward = (line.get_color() for line in ax.lines[:2])
    assert "right, blue" in caption and forward == BLUE
    assert "left, orange" in caption and backward == VERMILION


def test_few_orbits_leave_no_large_blank(short: Analysis) -> None:
    whole, one = orbit_sequence(short, "NDE"), orbit_sequence(_without_circle(short, "NDE"), "NDE")
    assert [len(figure.axes) for figure in (whole, one)] == [4, 1]
    assert one.get_figheight() < 0.7 * whole.get_figheight()
    assert all(ax.axison for figure in (whole, one) for ax in figure.axes)


def test_the_centreline_draws_what_there_is_and_its_caption_says_so(short: Analysis, coastdown: Analysis) -> None:
    for analysis, panels in ((short, 2), (coastdown, 4), (_without_circle(coastdown, "DE"), 2)):
        figure = centreline(analysis)
        FigureCanvasAgg(figure).draw()
        drawn = [ax for ax in figure.axes if ax.get_label() != "<colorbar>"]
        assert len(drawn) == panels
        caption = _figure(orbit.section(analysis), "centreline").caption
        assert ("magnified" in caption) == (analysis is not short)
        assert ("DE has no clearance circle" in caption) == (analysis not in (short, coastdown))
        assert all(ax.has_data() for ax in drawn)


def test_a_record_too_short_for_a_centreline_says_so(short: Analysis) -> None:
    assert short.planes is not None
    brief = replace(short, planes=short.planes.isel(time=slice(0, 8000)), angle=None)  # 0.3 s after the release
    section = orbit.section(brief)
    assert section is not None
    assert not any(isinstance(block, Figure) and block.name == "centreline" for block in section.blocks)
    assert any(isinstance(block, Paragraph) and "centreline is not drawn" in block.text for block in section.blocks)


def test_without_a_release_nothing_is_said_to_begin_with_it(short: Analysis) -> None:
    late = replace(short, release=None)
    assert "from the record's first sample on" in _figure(orbit.section(late), "orbits-1").caption
    assert not any(re.search("release|fall", ax.get_title()) for ax in orbit_sequence(late, "NDE").axes)


def test_white_of_a_map_is_told(short: Analysis) -> None:
    assert short.waterfall is not None
    holed = short.waterfall.copy(deep=True)
    holed["amplitude"][..., 5, :] = np.nan
    captions = [_figure(spectra.section(a), "waterfall").caption for a in (short, replace(short, waterfall=holed))]
    assert ["White: samples are missing" in caption for caption in captions] == [False, True]


def test_the_centreline_is_coloured_by_what_its_caption_says(short: Analysis) -> None:
    bare = replace(short, speed_time=np.empty(0), speed_hz=np.empty(0))
    still = replace(short, speed_hz=np.zeros_like(short.speed_hz))
    for analysis, words in ((short, "speed"), (bare, "time"), (still, "time")):
        bar = next(ax for ax in centreline(analysis).axes if ax.get_label() == "<colorbar>")
        assert bar.get_ylabel().startswith(words)
        assert f"coloured by the {words}" in _figure(orbit.section(analysis), "centreline").caption


def test_the_caption_of_the_polar_plot_says_what_is_grey(coastdown: Analysis) -> None:
    assert "grey below 3 standard deviations" in _figure(tracking.section(coastdown), "bode").caption


def test_a_velocity_greater_after_the_contact_is_explained_where_it_first_stands(coastdown: Analysis) -> None:
    for section in (summary.section(coastdown), contact.section(coastdown)):
        assert section is not None
        rows = [row for block in section.blocks if isinstance(block, Table) for row in block.rows]
        row = next(row for row in rows if row.cells[0].startswith("Restitution (velocity after over"))
        assert row.cells[1].startswith("1.5") and row.cells[0].endswith(ABOVE_ONE)


def test_captions_tell_only_of_marks_that_are_drawn(short: Analysis, coastdown: Analysis) -> None:
    bare = replace(short, speed_time=np.empty(0), speed_hz=np.empty(0), lines=(), phases=())
    bare = replace(bare, ends={name: replace(end, gap=None, contacts=None) for name, end in bare.ends.items()})
    for analysis in (short, coastdown, bare):
        for name in ("first-contacts", "whole-record"):
            shown = _figure(release.section(analysis), name)
            labels = [text.get_text() for text in shown.draw().legends[0].get_texts()]
            assert ("Triangles" in shown.caption) == ("contact begins" in labels), name
            assert ("Dashed" in shown.caption) == ("clearance circle at static load" in labels)
            assert ("Shading" in shown.caption) == bool(analysis.phases)
        caption = _figure(spectra.section(analysis), "waterfall").caption
        assert ("Dashed" in caption) == ("dashed" in caption) == (len(analysis.speed_time) > 3)
        assert ("Dotted" in caption) == any(line.kind != "order" for line in analysis.lines)


def test_the_legend_of_stresses_holds_only_what_is_drawn() -> None:
    known = SimpleNamespace(known=True, value=2e9)
    box = SimpleNamespace(
        greatest=known,
        median=1e9,
        q1=0.5e9,
        least=0.2e9,
        q3=1.2e9,
        mean=1e9,
        tukey=(),
        outliers=(),
        tukey_level=2.3e9,
        outlier_level=2.4e9,
    )
    for beyond in ((), (2.35e9,)):
        end = SimpleNamespace(stress=SimpleNamespace(**{**vars(box), "tukey": beyond}))
        figure = stress_outliers([SimpleNamespace(name="drop", seconds=0.2, ends={"DE": end})])  # type: ignore[list-item]
        labels = [text.get_text() for text in figure.legends[0].get_texts()]
        assert ("beyond Tukey's fence" in labels) == bool(beyond)
        assert "beyond three deviations" not in labels


def test_remarks_of_one_kind_are_one() -> None:
    def cut(count: int) -> str:
        return f"{count} samples are at -{count / 10} um, between {count / 1e3} s and 0.3 s: peaks are cut off"

    remarks = [f"{drop}.nc: {probe}: {cut(k)}" for k, drop in enumerate("abc", 1) for probe in ("NDE_A", "DE_A")]
    remarks += ["the drops part early: 25 ms", "b.nc: samples are missing: 3 of 'DE_A'"]
    joined = grouped(remarks, ["a.nc", "b.nc", "c.nc"])
    assert len(joined) == 3
    assert (
        joined[0]
        == f"a.nc: NDE_A: {cut(1)}. The same, with other numbers, for a.nc DE_A; b.nc NDE_A, DE_A; c.nc NDE_A, DE_A."
    )
    assert joined[1:] == ["The drops part early: 25 ms.", "b.nc: samples are missing: 3 of 'DE_A'."]
    assert grouped(["a.nc, b.nc hardly match c.nc"], ["a.nc", "b.nc"]) == ["a.nc, b.nc hardly match c.nc."]
    assert grouped(["a.nc: cables?", "b.nc: cables?"], ["a.nc", "b.nc"]) == ["a.nc: cables? The same for b.nc."]


def test_where_no_law_of_drag_is_used_the_table_says_why(machine: Machine) -> None:
    record = read(shipped("short/drop_100.nc")).sel(time=slice(0, 0.2))
    section = rundown.section(analyse(record, machine))
    table = next(
        block for block in section.blocks if isinstance(block, Table) and block.caption.startswith("Laws tried")
    )
    assert "none is used: the rings still slip" in table.caption
    assert not any(cell in ("worse", "chosen") for row in table.rows for cell in row.cells)


def test_laws_that_are_not_chosen_state_no_interval(short: Analysis) -> None:
    """Of a law that does not hold, an interval of the noise alone was 11.60089 to 11.60098 s."""
    table = next(
        b for b in rundown.section(short).blocks if isinstance(b, Table) and b.caption.startswith("Laws tried")
    )
    for row in table.rows:
        assert (" to " in row.cells[1] or "interval above" in row.cells[1]) == (row.cells[-1] == "chosen")
        assert not re.search(r"[1-9]\d*\.\d{5}", row.cells[1])


def test_the_decay_time_of_the_chosen_law_is_told_as_in_the_table_above(coastdown: Analysis) -> None:
    """11.81461 s (11.81450 to 11.81472) stood beneath 11.81 s (11.78 to 11.85), and a term within its noise was "0.0 ×10⁻⁶"."""
    above, laws = (block for block in rundown.section(coastdown).blocks if isinstance(block, Table))
    (stated,) = [row.cells[1] for row in above.rows if row.cells[0].startswith("Decay time")]
    (chosen,) = [row.cells[1] for row in laws.rows if row.cells[-1] == "chosen"]
    assert f"decay time {stated.partition(' (')[0]} (interval above)" in chosen and " to " in chosen
    (more,) = [row.cells[1] for row in laws.rows if row.cells[-1].startswith("no better than")]
    assert more.endswith("loss per revolution zero within its noise")


def test_the_scale_of_the_residual_radius_is_not_that_of_a_few_far_off(short: Analysis) -> None:
    end = short.ends["NDE"]
    assert end.gap is not None
    points = end.gap.points.copy()
    points[:3] *= 1.5  # three of some hundred, 150 um off
    analysis = replace(short, ends={**short.ends, "NDE": replace(end, gap=replace(end.gap, points=points))})
    strips = [next(ax for ax in gap_map(a).axes if ax.get_ylabel().startswith("residual")) for a in (short, analysis)]
    usual, robust = (ax.get_ylim() for ax in strips)
    assert robust[1] - robust[0] < 1.3 * (usual[1] - usual[0])
    marked = sum(len(line.get_xdata()) for line in strips[1].lines if line.get_marker() in (6, 7))
    assert marked >= 3
    assert f"those beyond ({marked} of {len(points)} at NDE" in _figure(gap.section(analysis), "gap-map").caption
