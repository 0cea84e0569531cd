"""Figures of a drop's report: readable, drawn as the trade does, honest where parts are missing."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text
from tdbsim.errors import InputError

from tdbmon.analysis.result import Analysis
from tdbmon.estimate import Estimate
from tdbmon.figures.bode import bode
from tdbmon.figures.cascade import cascade
from tdbmon.figures.centreline import centreline
from tdbmon.figures.coast_down_orders import coast_down_orders
from tdbmon.figures.filtered_orbit import filtered_orbit
from tdbmon.figures.first_contact import first_contact
from tdbmon.figures.full_spectrum import full_spectrum
from tdbmon.figures.gap_map import gap_map
from tdbmon.figures.orbit_sequence import orbit_sequence
from tdbmon.figures.speed_decay import _binned, speed_decay
from tdbmon.figures.time_history import time_history
from tdbmon.figures.waterfall import waterfall
from tdbmon.identify.coast_down import CoastDown
from tdbmon.identify.coast_down_comparison import Resonance
from tdbmon.report.document import Figure as Drawn
from tdbmon.report.document import Paragraph
from tdbmon.report.sections import spectra, tracking
from tests.figure_checks import assert_readable, faults, figures_of, rendered, texts
from tests.report.conftest import with_ends

DRAW: dict[str, Callable[[Analysis], Figure]] = {
    "time_history": time_history,
    "orbit_sequence": lambda a: orbit_sequence(a, next(iter(a.ends))),
    "filtered_orbit": filtered_orbit,
    "centreline": centreline,
    "gap_map": gap_map,
    "first_contact": first_contact,
    "speed_decay": speed_decay,
    "waterfall": waterfall,
    "cascade": cascade,
    "full_spectrum": full_spectrum,
    "bode": bode,
}
EQUAL = {"orbit_sequence", "filtered_orbit", "centreline"}


@pytest.mark.parametrize("count", [40, 3499, 2957])
def test_a_run_down_is_drawn_to_its_last_value(count: int) -> None:
    """Of one value a turn the last ones take most of the time: they were left out where they filled no bin."""
    time = np.cumsum(np.geomspace(0.007, 0.1, count))
    speed = 1 / np.geomspace(0.007, 0.1, count)
    mean, (low, high), at = _binned(time, speed)
    edges = np.linspace(0, count, len(at) + 1).astype(int)
    np.testing.assert_allclose(at[-1], time[edges[-2] :].mean())
    np.testing.assert_allclose(mean[0], speed[: edges[1]].mean())
    assert time[-1] - at[-1] < 0.02 * time[-1] if count > 40 else True
    assert (low <= mean).all() and (mean <= high).all()


@pytest.mark.parametrize("which", ["short_report", "coastdown_report"])
def test_every_figure_of_a_report_is_readable(which: str, request: pytest.FixtureRequest) -> None:
    assert_readable(request.getfixturevalue(which))


def test_what_makes_a_figure_unreadable_is_found() -> None:
    figure = Figure(figsize=(4, 3))
    one = figure.add_axes((0.2, 0.2, 0.7, 0.7), xlabel="Time [s]", ylabel="Displacement [um]")
    one.plot([0, 1], [0, 1])
    assert faults(figure) == []
    one.set_ylabel("Displacement")
    assert faults(figure) == ["'Displacement' has no unit"]
    one.set_yticks([0, 1], ["NDE", "DE"])
    assert faults(figure) == []
    words = figure.text(0.5, 0.5, "on the axes")
    assert [fault.rpartition(" covers ")[2] for fault in faults(figure)] == [str(words)]
    words.set(position=(0.95, 0.02), text="over the edge")
    assert [fault.partition(":")[0] for fault in faults(figure)] == ["reaches over its edge"]


@pytest.mark.parametrize("which", ["short_report", "coastdown_report"])
def test_displacement_says_its_plane_filter_and_runout(which: str, request: pytest.FixtureRequest) -> None:
    drawn = {each.name: each.draw() for each in figures_of(request.getfixturevalue(which))}
    for name in drawn.keys() - {"speed-decay"}:  # which shows none
        _says_plane_filter_and_runout(drawn[name], name)


def test_a_filtered_orbit_says_them_too(coastdown: Analysis) -> None:
    _says_plane_filter_and_runout(filtered_orbit(coastdown), "filtered orbit")


def _says_plane_filter_and_runout(figure: Figure, name: str) -> None:
    said = texts(figure)
    assert "bearing plane" in said, name
    assert re.search(r"not filtered|mean over|tracked|window", said), name
    assert "runout" in said, name


@pytest.mark.parametrize("name", sorted(EQUAL))
def test_orbits_and_centrelines_have_equal_axes(name: str, short: Analysis) -> None:
    figure = rendered(DRAW[name](short))
    drawn = [ax for ax in figure.axes if ax.axison and ax.get_label() != "<colorbar>"]
    assert drawn
    for ax in drawn:
        box = ax.get_window_extent()
        (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
        assert box.width / (right - left) == pytest.approx(box.height / (high - low), rel=1e-6)


def test_the_gap_map_is_round(short: Analysis) -> None:
    figure = rendered(gap_map(short))
    for ax in figure.axes[: len(short.ends)]:
        box = ax.get_window_extent()
        assert box.width / np.ptp(ax.get_xlim()) == pytest.approx(box.height / np.ptp(ax.get_ylim()), rel=1e-6)


@pytest.mark.parametrize("name", ["time_history", "orbit_sequence"])
def test_figures_can_do_without_release_gap_and_contacts(name: str, short: Analysis) -> None:
    figure = rendered(DRAW[name](_bare(short, *short.ends)))
    assert any(text.get_text() for text in figure.findobj(Text))


@pytest.mark.parametrize("name", ["centreline", "gap_map", "first_contact"])
def test_an_end_without_a_circle_leaves_no_empty_axes(name: str, coastdown: Analysis) -> None:
    both, one = rendered(DRAW[name](coastdown)), rendered(DRAW[name](_bare(coastdown, "NDE")))
    assert all(ax.has_data() for ax in (*both.axes, *one.axes))
    assert "NDE" in texts(both) and "NDE" not in texts(one) and "DE" in texts(one)
    with pytest.raises(InputError, match=r"clearance circle|first contact"):
        DRAW[name](_bare(coastdown, "NDE", "DE"))


def _bare(analysis: Analysis, *ends: str) -> Analysis:
    """Without release and speed, and without circles and contacts of some ends."""
    unknown = {end: replace(analysis.ends[end], gap=None, contacts=None) for end in ends}
    return replace(
        analysis, ends={**analysis.ends, **unknown}, release=None, phases=(), swing=None, rundown=None, angle=None
    )


@pytest.mark.parametrize(("tone", "speed"), [(150.0, 100.0), (700.0, 20.0)])
def test_the_waterfall_reaches_as_far_as_there_is_something_in_it(tone: float, speed: float, short: Analysis) -> None:
    """Neither is what is loud cut off, nor are most of its colours those of nothing."""
    assert short.waterfall is not None
    rng = np.random.default_rng(1)
    frequency = short.waterfall.frequency.to_numpy()
    noise = rng.rayleigh(1e-8, short.waterfall.amplitude.shape)
    made = short.waterfall.copy()
    made["amplitude"] = made.amplitude.dims, noise + 1e-5 * np.exp(-(((frequency - tone) / 16) ** 2))
    loud = replace(short, waterfall=made, lines=(), speed_hz=np.full_like(short.speed_hz, speed))
    right = waterfall(loud).axes[0].get_xlim()[1]
    assert tone + 16 < right < 1.5 * tone


def test_names_in_a_waterfall_stand_on_their_own_lines(coastdown: Analysis) -> None:
    """Beside them, "swing 2" covered the line of the mains 6 Hz away, and "mains" stood on the one after it."""
    figure = waterfall(coastdown)
    figure.canvas.draw()
    ax = figure.axes[0]
    at = {line.name: line.frequency.value for line in coastdown.lines if line.kind != "order"}
    shown = [text for text in ax.texts if text.get_text() in at]
    assert {"swing 1", "swing 2", "mains", "bounce"} <= {text.get_text() for text in shown}
    for text in shown:
        box = text.get_window_extent().transformed(ax.transData.inverted())
        covered = [name for name, hz in at.items() if box.x0 <= hz <= box.x1]
        assert covered == [text.get_text()]


def test_spectra_of_a_speed_that_hardly_changes_are_not_drawn_against_it(short: Analysis, coastdown: Analysis) -> None:
    """Orders move by less than a line is wide: within 0.4 s there are no other speeds to compare with."""
    for draw, slow, name in ((cascade, spectra.section(short), "cascade"), (bode, tracking.section(short), "bode")):
        with pytest.raises(InputError, match=r"the speed changes by only \d"):
            draw(short)
        assert slow is not None
        assert not any(isinstance(block, Drawn) and block.name == name for block in slow.blocks)
        assert any(isinstance(block, Paragraph) and "speed changes by" in block.text for block in slow.blocks)
        assert rendered(draw(coastdown)).axes


def test_a_circle_of_1x_within_the_noise_leaves_no_empty_polar_plot(coastdown: Analysis) -> None:
    assert coastdown.tracks is not None
    noisy = coastdown.tracks.copy(deep=True)
    noisy["forward_sigma"] = noisy.forward_sigma * 1e6
    quiet = replace(coastdown, tracks=noisy)
    assert [len(rendered(bode(each)).axes) for each in (coastdown, quiet)] == [6, 4]
    section = tracking.section(quiet)
    assert section is not None and isinstance(section.blocks[0], Drawn)
    assert "no polar plot" in section.blocks[0].caption


def test_a_speed_without_a_law_still_has_a_time_axis(short: Analysis) -> None:
    assert short.rundown is not None
    figure = rendered(speed_decay(replace(short, rundown=replace(short.rundown, law=None))))
    assert len(figure.axes) == 1
    assert any(tick.get_text() and tick.get_visible() for tick in figure.axes[0].get_xticklabels())


@pytest.mark.parametrize("name", ["waterfall", "cascade", "full_spectrum", "bode"])
def test_spectra_say_that_there_is_no_speed(name: str, short: Analysis) -> None:
    none = np.empty(0)
    bare = replace(short, speed_time=none, speed_hz=none, rundown=None, lines=(), tracks=None, angle=None)
    try:
        figure = rendered(DRAW[name](bare))
    except InputError as error:
        assert re.search("speed|keyphasor", str(error))
    else:
        assert "no speed" in texts(figure)


@pytest.mark.parametrize("name", ["time_history", "waterfall", "cascade", "full_spectrum"])
def test_a_record_without_displacement_is_refused_in_words(name: str, short: Analysis) -> None:
    with pytest.raises(InputError, match="displacement"):
        DRAW[name](replace(short, planes=None, waterfall=None, ends={}, tracks=None))


def test_a_law_that_is_far_off_before_its_stretch_leaves_room_for_the_label(coastdown: Analysis) -> None:
    """A drive that brakes at first: five figures of mHz and a sign stand beside the axis."""
    time, run = coastdown.speed_time, coastdown.rundown
    assert run is not None and run.fitted_from is not None
    off = replace(coastdown, speed_hz=coastdown.speed_hz - 55.0 * (time < run.fitted_from))
    figure = speed_decay(off)
    assert faults(figure) == []
    assert re.search("−[1-5]0000", texts(figure))


def test_a_law_that_leaves_hertz_is_drawn_in_hertz(coastdown: Analysis) -> None:
    noisy = coastdown.speed_hz + 2.0 * np.sin(coastdown.speed_time)
    figure = speed_decay(replace(coastdown, speed_hz=noisy))
    assert faults(figure) == []
    assert "residual [Hz]" in texts(figure)


def test_a_speed_decay_without_speed_is_refused_in_words(short: Analysis) -> None:
    with pytest.raises(InputError, match="no speed"):
        speed_decay(replace(short, rundown=None))


def test_the_speeds_that_a_mean_is_of_are_a_whole_number(coastdown: Analysis) -> None:
    """It was "1.21e+03 values"."""
    said = re.search(r"mean over (\S+) values", texts(speed_decay(coastdown)))
    assert said is not None and said[1] == f"{len(coastdown.speed_time) / 700:.0f}"


@pytest.mark.parametrize("which", ["short", "coastdown"])
def test_what_the_law_leaves_stays_within_its_axes(which: str, request: pytest.FixtureRequest) -> None:
    figure = rendered(speed_decay(request.getfixturevalue(which)))
    lower = figure.axes[1]
    low, high = lower.get_ylim()
    left = max(lower.lines, key=lambda line: len(line.get_xdata())).get_ydata()
    assert low < np.min(left) and np.max(left) < high
    assert "logarithmic beyond ±" in texts(lower)


def test_the_standstill_is_not_called_a_95_percent_interval(coastdown: Analysis) -> None:
    stood = replace(
        coastdown.rundown, standstill_time=Estimate(61.0, 60.0, 62.0, "s", "below what the signal resolves")
    )
    figure = speed_decay(replace(coastdown, rundown=stood))
    assert "standstill, with its range" in texts(figure)
    assert "95 % interval" not in texts(figure)


def test_a_dollar_sign_in_a_name_is_a_dollar_sign(short: Analysis) -> None:
    dollars = with_ends(short, ("$\\pi$ 1", "$\\pi$ 2"), "dollars")
    for end in dollars.ends:
        assert end in texts(rendered(orbit_sequence(dollars, end)))


def test_a_spike_survives_the_thinning_of_the_whole_record(coastdown: Analysis) -> None:
    assert coastdown.planes is not None
    planes = coastdown.planes.copy(deep=True)
    planes["displacement"].loc[{"end": "DE", "axis": "y"}][700_001] = 1.7e-3
    figure = time_history(replace(coastdown, planes=planes))
    highest = max(
        float(np.nanmax(line.get_ydata())) for ax in figure.axes for line in ax.lines if len(line.get_ydata()) > 10
    )
    assert highest == pytest.approx(1700.0)


def test_a_stretch_with_missing_samples_is_said_in_its_spectrum(short: Analysis) -> None:
    assert short.planes is not None
    planes = short.planes.copy(deep=True)
    planes["displacement"][:, :, 5000:5010] = np.nan
    assert "samples are missing in this stretch" in texts(rendered(full_spectrum(replace(short, planes=planes))))


def test_a_rotor_that_never_turned_has_spectra_but_no_cascade(short: Analysis) -> None:
    still = replace(short, speed_hz=np.zeros_like(short.speed_hz))
    assert rendered(waterfall(still)).axes
    with pytest.raises(InputError, match="stands still"):
        cascade(still)


def test_a_shaft_that_stands_has_no_orders_no_colours_of_its_speed_and_a_standstill(short: Analysis) -> None:
    """Orders stood in a heap at 0 Hz, speeds reached from -0.1 to 0.1 Hz, and its standstill was not estimated."""
    assert short.rundown is not None
    rundown = replace(short.rundown, law=None, standstill_time=Estimate.missing("s", "it stands"))
    still = replace(short, speed_hz=np.zeros_like(short.speed_hz), rundown=rundown)
    assert not {"1X", "2X", "3X"} & set(texts(rendered(full_spectrum(still))).split("\n"))
    drawing = rendered(speed_decay(still))
    assert "standstill: throughout" in texts(drawing)
    assert [label.get_text() for label in drawing.axes[0].get_yticklabels()] == ["0"]


def test_probes_that_show_nothing_at_all_have_a_dark_waterfall(short: Analysis) -> None:
    """Its least was above its greatest, and no report was written."""
    assert short.waterfall is not None
    silent = short.waterfall.copy(data={"amplitude": np.zeros(short.waterfall.amplitude.shape)})
    drawing = rendered(waterfall(replace(short, waterfall=silent, lines=())))
    image = drawing.axes[0].images[0]
    assert float(np.max(image.norm(image.get_array()))) <= 0


def test_spectra_to_a_thousand_hertz_have_room_for_their_numbers(coastdown: Analysis) -> None:
    drawing = rendered(full_spectrum(replace(coastdown, speed_hz=np.full_like(coastdown.speed_hz, 900.0), lines=())))
    assert drawing.axes[0].get_xlim()[1] == pytest.approx(1000)
    assert faults(drawing) == []


def test_a_row_of_spectra_without_samples_has_no_scale_of_amplitudes(short: Analysis) -> None:
    """It had one of 0 to 1 dB."""
    assert short.planes is not None
    planes = short.planes.copy(deep=True)
    planes["displacement"][:, :, 5000:5010] = np.nan
    drawing = rendered(full_spectrum(replace(short, planes=planes)))
    empty = [ax for ax in drawing.axes if "samples are missing" in texts(ax)]
    assert empty and not any(label.get_text() for ax in empty for label in ax.get_yticklabels())


def test_orders_that_were_not_tracked_have_no_scale(short: Analysis) -> None:
    """It had one of 1 to 10 µm."""
    bare = replace(short, tracks=None)
    passed = [Resonance(0, 1.0, 30.0, None, None)]
    for ax in rendered(coast_down_orders(CoastDown(bare, bare, 0.0), passed)).axes:
        assert "not tracked" in texts(ax)
        assert not any(label.get_text() for label in ax.get_yticklabels(which="both"))
