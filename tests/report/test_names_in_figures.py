"""Names written into figures can be read: none covers another, leaves its axes or lies bare on a line."""

from __future__ import annotations

import itertools
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.text import Text

from tdbmon.analysis.phases import Phase
from tdbmon.analysis.result import Analysis
from tdbmon.figures.bode import bode
from tdbmon.figures.cascade import cascade
from tdbmon.figures.differences import differences
from tdbmon.figures.drop_names import short_names
from tdbmon.figures.full_spectrum import full_spectrum
from tdbmon.figures.gap_map import gap_map
from tdbmon.figures.orbit_sequence import orbit_sequence
from tdbmon.figures.style import STYLE, clipped, new_figure, say, subplots
from tdbmon.figures.style import Margins as Room
from tdbmon.figures.time_history import time_history
from tdbmon.figures.waterfall import waterfall
from tdbmon.report import build_report
from tests.figure_checks import assert_readable, rendered
from tests.report.conftest import with_ends

LONG_ENDS = ("Nichtantriebsseite", "Antriebsseite")

NAMED = {"waterfall": waterfall, "cascade": cascade, "full_spectrum": full_spectrum, "bode": bode}


def _names(ax: Axes) -> list[Text]:
    return [text for text in ax.texts if text.get_text()]


@pytest.mark.parametrize(
    ("name", "which"),
    [*((name, "coastdown") for name in NAMED), ("waterfall", "short"), ("full_spectrum", "short")],
)
def test_no_name_covers_another_or_leaves_its_axes(name: str, which: str, request: pytest.FixtureRequest) -> None:
    figure = rendered(NAMED[name](request.getfixturevalue(which)))
    assert any(_names(ax) for ax in figure.axes)
    for ax in figure.axes:
        frame = ax.get_window_extent().padded(1.0)
        boxes = [text.get_window_extent() for text in _names(ax)]
        for text, box in zip(_names(ax), boxes, strict=True):
            assert frame.x0 < box.x0 and box.x1 < frame.x1 and frame.y0 < box.y0 and box.y1 < frame.y1, text
        for a, b in itertools.combinations(boxes, 2):
            assert not a.overlaps(b), (name, ax.get_title("left"))


@pytest.mark.parametrize("name", ["waterfall", "cascade"])
def test_names_in_a_map_stand_before_its_lines_on_a_patch(name: str, coastdown: Analysis) -> None:
    figure = NAMED[name](coastdown)
    for ax in figure.axes[:4]:
        said = [text.get_text() for text in _names(ax)]
        assert {"0.5X", "1X", "2X", "3X", "4X", "swing 1", "swing 2", "mains", "bounce"} <= set(said)
        for text in _names(ax):
            assert text.get_bbox_patch() is not None
            assert all(text.get_zorder() > line.get_zorder() for line in ax.lines)


def test_all_orders_of_a_slow_shaft_are_named_in_its_full_spectrum(coastdown: Analysis) -> None:
    later = [ax for ax in full_spectrum(coastdown).axes if "later run-down" in ax.get_title("left")]
    assert len(later) == 2
    for ax in later:
        assert {"1X", "2X", "3X"} <= {text.get_text() for text in _names(ax)}


@pytest.mark.parametrize("which", ["short", "coastdown"])
def test_nothing_is_written_over_the_traces_of_the_time_history(which: str, request: pytest.FixtureRequest) -> None:
    figure = rendered(time_history(request.getfixturevalue(which)))
    for ax in figure.axes:
        assert not any(ax.get_window_extent().overlaps(text.get_window_extent()) for text in _names(ax))
    assert "release" in [text.get_text() for text in figure.legends[0].get_texts()]


def test_nothing_is_written_over_an_orbit_without_a_keyphasor(short: Analysis, coastdown: Analysis) -> None:
    without = rendered(orbit_sequence(replace(short, angle=None), "NDE"))
    assert "no keyphasor: no dots" in without.texts[0].get_text()
    late = rendered(orbit_sequence(coastdown, "NDE"))  # its last panel is after the keyphasor's last pulse
    assert "no pulses" in late.axes[len(late.axes) - 1].get_title()
    for figure in (without, late):
        assert not any(_names(ax) for ax in figure.axes)


@pytest.mark.parametrize("which", ["short", "coastdown"])
def test_long_names_of_ends_have_room(which: str, request: pytest.FixtureRequest) -> None:
    """Beside low panels they stood on the neighbours' names, and above narrow ones they left the page."""
    assert_readable(build_report(with_ends(request.getfixturevalue(which), LONG_ENDS, "Kreiselverdichter")))


def test_of_a_long_name_beginning_and_end_are_kept() -> None:
    assert [clipped(name, 8) for name in LONG_ENDS] == ["Nich…ite", "Antr…ite"]
    assert clipped("NDE", 8) == "NDE" and clipped("Radiallager A", 2) == "R…"


def test_names_of_short_phases_cover_no_others(short: Analysis) -> None:
    """A name was written where its phase had a fourteenth of the axis, be it wide enough or not."""
    cuts = (0.0, 0.1, 0.14, 0.18, 0.3, 0.34, 0.5)
    names = ("levitated", "fall", "fall and contacts", "run-down", "levitated again", "rest")
    phases = tuple(Phase(*each) for each in zip(names, cuts, cuts[1:], strict=False))
    drawing = rendered(time_history(replace(short, phases=phases)))
    shown = [text for text in drawing.axes[0].texts if text.get_text() in names]
    assert {"levitated", "fall", "run-down", "rest"} <= {text.get_text() for text in shown}
    boxes = [text.get_window_extent() for text in shown]
    assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))


def test_an_interval_of_the_radius_is_drawn_as_wide_as_it_is_to_either_side(short: Analysis) -> None:
    """Its lower half was taken to be as wide as the upper one."""
    end = short.ends["NDE"]
    assert end.gap is not None and end.gap.radius.value is not None
    value = end.gap.radius.value
    radius = replace(end.gap.radius, low=value - 4e-6, high=value + 1e-6)
    one = replace(short, ends={**short.ends, "NDE": replace(end, gap=replace(end.gap, radius=radius))})
    (band,) = [patch for patch in gap_map(one).axes[2].patches if patch.get_label().startswith("95 %")]
    assert (band.get_y(), band.get_y() + band.get_height()) == pytest.approx((-4.0, 1.0))


@pytest.mark.parametrize("which", ["short", "coastdown"])
def test_every_95_percent_range_of_the_gap_is_drawn_whole(which: str, request: pytest.FixtureRequest) -> None:
    figure = rendered(gap_map(request.getfixturevalue(which)))
    bars = 0
    for ax in figure.axes:
        low, high = ax.get_ylim()
        for part in ax.collections:
            if isinstance(part, LineCollection):
                ends = np.concatenate(part.get_segments())[:, 1]
                bars += len(ends)
                assert low < ends.min() and ends.max() < high
    assert bars > 4


def test_the_whole_band_and_the_greatest_circle_of_1x_are_drawn(coastdown: Analysis) -> None:
    figure = rendered(bode(coastdown))
    assert coastdown.tracks is not None
    first = coastdown.tracks.sel(order=1.0)
    for column, end in enumerate(("NDE", "DE")):
        part = first.sel(end=end)
        amplitude, polar = figure.axes[column], figure.axes[4 + column]
        assert amplitude.get_ylim()[1] > float((part.amplitude + 1.96 * part.sigma).max()) * 1e6
        greatest = int(np.argmax(part.forward.to_numpy()))
        reach = float(part.forward[greatest]) * 1e6
        assert polar.get_xlim()[1] > reach
        drawn = max(float(np.nanmax(np.hypot(*np.array(line.get_data(), float)))) for line in polar.lines[:1])
        assert drawn == pytest.approx(reach)
        assert f"{float(part.speed[greatest]):.0f} Hz" in [text.get_text() for text in _names(polar)]


def test_words_in_narrow_axes_are_broken_and_empty_axes_have_no_scale() -> None:
    from matplotlib import rc_context

    with rc_context(STYLE):
        figure = new_figure(40)
        empty, full = subplots(figure, 1, 2, Room(60, 60, 5, 5, across=10))[0]
        full.plot([1, 2], [3, 4])
        for ax in (empty, full):
            say(ax, "not estimated, for the reason that the record says nothing of it")
        rendered(figure)
        for ax in (empty, full):
            box, frame = ax.texts[0].get_window_extent(), ax.get_window_extent()
            assert frame.x0 < box.x0 and box.x1 < frame.x1
        assert not any(label.get_visible() and label.get_text() for label in _ticks(empty))
        assert any(label.get_visible() and label.get_text() for label in _ticks(full))


def _ticks(ax: Axes) -> list[Text]:
    return [
        label
        for axis in (ax.xaxis, ax.yaxis)
        for tick in axis.get_major_ticks()
        for label in (tick.label1, tick.label2)
    ]


def test_a_long_note_above_a_figure_is_broken() -> None:
    figure = rendered(new_figure(60, " · ".join(["Displacement of one end at the probe plane"] * 5)))
    assert figure.texts[0].get_window_extent().x1 < figure.bbox.width


@pytest.mark.parametrize("side", [1, -1])
def test_what_changed_much_is_drawn_whole(side: int) -> None:
    """Changes of 2, 30 and 300 standard errors with their intervals in one axis, the changed ones first."""

    def change(value: float, flag: bool) -> SimpleNamespace:
        found = SimpleNamespace(error=1.0, value=value, low=value - 3, high=value + 3, before=SimpleNamespace(n=9))
        return SimpleNamespace(difference=found, kind=SimpleNamespace(judged=True), flag=flag, title="a quantity")

    flagged = [change(300.0 * side, True), change(30.0 * side, True)]
    comparison = SimpleNamespace(changes=[change(2.0 * side, False), *flagged], flagged=flagged, matched=[None] * 9)
    (ax,) = rendered(differences(comparison)).axes  # type: ignore[arg-type]
    left, right = ax.get_xlim()
    lines = [(list(line.get_xdata()), list(line.get_ydata())) for line in ax.lines]
    bars = {y[0]: x for x, y in lines if len(y) == 2 and y[0] == y[1]}
    points = [float(line.get_xdata()[0]) for line in ax.lines if line.get_marker() == "o"]
    assert points == [300.0 * side, 30.0 * side, 2.0 * side]
    for row, value in enumerate(points):
        assert bars[row] == [value - 3, value + 3]
        assert left < value - 3 and value + 3 < right


def test_of_long_names_of_records_figures_show_where_they_differ() -> None:
    long = [f"2024-05-11_Auslauf_Größe_7_Versuch_{k}_ohne_Öl.tdms" for k in (9, 10, 12)]
    assert short_names(long) == ["…9…", "…10…", "…12…"]
    assert short_names(["drop_060.nc", "drop_100.nc"]) == ["drop_060", "drop_100"]
    assert short_names(["2024-05-11 drop.nc", "2023-06-12 drop.nc"]) == ["…24-05-11…", "…23-06-12…"]
    assert short_names(["only_one_of_that_name.csv"]) == ["…that_name"]
    assert short_names(["Versuchsreihe.nc", "Versuchsreihe_A.nc"]) == ["…uchsreihe", "…_A"]
    assert short_names([]) == []
