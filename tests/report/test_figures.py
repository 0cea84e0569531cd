"""Every figure on a short record: labelled with units, nothing clipped, honest where parts are missing."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from tdbsim.errors import InputError

from tdbmon.analysis.result import Analysis
from tdbmon.estimate import Estimate
from tdbmon.figures.bode import bode
from tdbmon.figures.cascade import cascade
from tdbmon.figures.centreline import centreline
from tdbmon.figures.filtered_orbit import filtered_orbit, settled_stretch
from tdbmon.figures.first_contact import first_contact
from tdbmon.figures.full_spectrum import full_spectrum
from tdbmon.figures.gap_map import gap_map
from tdbmon.figures.orbit_sequence import orbit_sequence
from tdbmon.figures.speed_decay import speed_decay
from tdbmon.figures.time_history import time_history
from tdbmon.figures.waterfall import waterfall
from tdbmon.report import document as report
from tdbmon.report.sections import orbit

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


def _rendered(figure: Figure) -> Figure:
    FigureCanvasAgg(figure).draw()
    return figure


def _texts(part: Figure | Axes) -> str:
    return "\n".join(text.get_text() for text in part.findobj(Text))


@pytest.mark.parametrize("name", DRAW)
def test_every_axis_has_a_label_with_its_unit(name: str, short: Analysis) -> None:
    for ax in DRAW[name](short).axes:
        if not ax.axison:
            continue
        # axes that share an axis say it once
        across, upright = ax.get_shared_x_axes().get_siblings(ax), ax.get_shared_y_axes().get_siblings(ax)
        labels = [max((a.get_xlabel() for a in across), key=len), max((a.get_ylabel() for a in upright), key=len)]
        if ax.get_label() == "<colorbar>":
            labels = [ax.get_ylabel() or ax.get_xlabel()]
        for label in labels:
            assert re.search(r"\[.+\]", label), f"{name}: '{label}' has no unit"


@pytest.mark.parametrize("which", ["short", "coastdown"])
@pytest.mark.parametrize("name", DRAW)
def test_nothing_is_clipped_by_the_edge_of_the_figure(name: str, which: str, request: pytest.FixtureRequest) -> None:
    figure = _rendered(DRAW[name](request.getfixturevalue(which)))
    box = figure.get_tightbbox(figure.canvas.get_renderer())  # type: ignore[attr-defined]
    width, height = figure.get_size_inches()
    assert box.x0 > -0.01 and box.y0 > -0.01 and box.x1 < width + 0.01 and box.y1 < height + 0.01, (name, box)


@pytest.mark.parametrize("which", ["short", "coastdown"])
@pytest.mark.parametrize("name", DRAW)
def test_no_axes_with_their_labels_cover_others(name: str, which: str, request: pytest.FixtureRequest) -> None:
    figure = _rendered(DRAW[name](request.getfixturevalue(which)))
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
    parts = [*(ax for ax in figure.axes if ax.axison), *figure.legends, *figure.texts]
    boxes = [part.get_tightbbox(renderer).padded(-1.5) for part in parts]
    for (i, a), (j, b) in itertools.combinations(enumerate(boxes), 2):
        assert not a.overlaps(b), f"{name}: {parts[i]} covers {parts[j]}"


@pytest.mark.parametrize("name", DRAW)
def test_displacement_says_its_plane_filter_and_runout(name: str, short: Analysis) -> None:
    if name == "speed_decay":
        return
    said = _texts(DRAW[name](short))
    assert "bearing plane" in said
    assert re.search(r"not filtered|mean over|tracked|window", said)
    assert "runout" in said


@pytest.mark.parametrize("name", sorted(EQUAL))
def test_orbits_and_centrelines_have_equal_axes(name: str, short: Analysis) -> None:
    figure = _rendered(DRAW[name](short))
    drawn = [ax for ax in figure.axes if ax.axison and ax.get_label() != "<colorbar>"]
    assert drawn
    for ax in drawn:
        box = ax.get_window_extent()
        (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
        assert box.width / (right - left) == pytest.approx(box.height / (high - low), rel=1e-6)


def test_the_gap_map_is_round(short: Analysis) -> None:
    figure = _rendered(gap_map(short))
    for ax in figure.axes[: len(short.ends)]:
        box = ax.get_window_extent()
        assert box.width / np.ptp(ax.get_xlim()) == pytest.approx(box.height / np.ptp(ax.get_ylim()), rel=1e-6)


def test_orbits_without_a_keyphasor_say_so(short: Analysis) -> None:
    assert "no keyphasor: no dots" in _texts(_rendered(orbit_sequence(replace(short, angle=None), "DE")))


def test_keyphasor_dots_lie_where_the_shaft_was_at_its_mark(short: Analysis) -> None:
    """On a circular orbit that turns with the shaft all dots fall on one point."""
    assert short.planes is not None and short.angle is not None
    angle = np.nan_to_num(short.angle, nan=0.0)
    phase = 0.4
    planes = short.planes.copy(deep=True)
    planes["displacement"].loc[{"end": "DE", "axis": "x"}] = 1e-4 * np.cos(angle + phase)
    planes["displacement"].loc[{"end": "DE", "axis": "y"}] = 1e-4 * np.sin(angle + phase)
    figure = orbit_sequence(replace(short, planes=planes), "DE")
    dots = [line for ax in figure.axes for line in ax.lines if line.get_label() == "keyphasor"]
    assert dots
    mark = short.machine.keyphasor.angle if short.machine.keyphasor else 0.0
    for line in dots:
        assert np.allclose(line.get_xdata(), 100 * np.cos(mark + phase), atol=0.5)
        assert np.allclose(line.get_ydata(), 100 * np.sin(mark + phase), atol=0.5)


def test_the_rotation_arrow_follows_the_machine(short: Analysis) -> None:
    def head(analysis: Analysis) -> tuple[float, float]:
        arrows = [
            t for t in orbit_sequence(analysis, "DE").axes[0].texts if getattr(t, "arrow_patch", None) is not None
        ]
        return arrows[0].xy[0] - arrows[0].xyann[0], arrows[0].xy[1] - arrows[0].xyann[1]  # type: ignore[attr-defined]

    against = replace(short, machine=short.machine.model_copy(update={"rotation": "cw"}))
    # the head stands left of the arc's centre when it turns counter-clockwise, and right of it when clockwise
    assert head(short)[1] < 0 and head(against)[0] < 0
    assert head(short) != head(against)


def _moved(analysis: Analysis, x: np.ndarray, y: np.ndarray) -> Analysis:
    """The record with another path of the DE end, m."""
    assert analysis.planes is not None
    planes = analysis.planes.copy(deep=True)
    planes["displacement"].loc[{"end": "DE", "axis": "x"}] = x
    planes["displacement"].loc[{"end": "DE", "axis": "y"}] = y
    return replace(analysis, planes=planes)


def _drawn_orbits(figure: Figure) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Path and keyphasor dots (2, n) of the DE end, µm, by the words of the panel's title."""
    found = {}
    for ax in figure.axes:
        end, words = ax.get_title().split("\n")[0].split(", ")
        if end == "DE":
            lines = {line.get_label(): np.array(line.get_data(), dtype=float) for line in ax.lines}
            found[words.split(" over")[0]] = lines["orbit"], lines["keyphasor"]
    return found


@pytest.mark.parametrize("rotation", ["ccw", "cw"])
def test_filtered_orbits_take_apart_a_known_path(rotation: str, short: Analysis) -> None:
    """1X of 20 µm and 4X of 6 µm, that the shaft carries, on a swing of 150 µm that it does not."""
    assert short.planes is not None and short.angle is not None
    sense = 1 if rotation == "ccw" else -1
    angle = sense * short.angle
    turned = np.nan_to_num(short.angle, nan=0.0)
    machine = short.machine.model_copy(update={"rotation": rotation})
    stretch = settled_stretch(short)
    # whole periods of the swing in the revolutions drawn, so that it cancels
    swing = 150e-6 * np.sin(turned * 5 / stretch.revolutions)
    x = 20e-6 * np.cos(turned + 0.4) + 6e-6 * np.cos(4 * turned)
    y = sense * (20e-6 * np.sin(turned + 0.4) + 6e-6 * np.sin(4 * turned))
    moved = replace(_moved(short, x + swing, y - 250e-6), machine=machine, angle=angle)
    drawn = _drawn_orbits(filtered_orbit(moved))
    assert set(drawn) == {"not filtered", "1X filtered", "averaged"}
    raw, dots = drawn["not filtered"]
    assert dots.shape[1] == stretch.revolutions
    assert np.ptp(raw[0]) > 290
    first, dot = drawn["1X filtered"]
    # samples do not fall on whole revolutions: what is left of the swing is a sample's share of it
    assert np.allclose(np.hypot(first[0], first[1] + 250), 20, atol=0.5)
    mark = short.machine.keyphasor.angle if short.machine.keyphasor else 0.0
    step = 20 * 2 * np.pi * 100 / 20_000  # the shaft turns on for up to a sample
    place = [20 * np.cos(mark + 0.4), sense * 20 * np.sin(mark + 0.4) - 250]
    assert np.hypot(*(dot[:, 0] - place)) < step + 0.5
    mean, _ = drawn["averaged"]
    grid = 2 * np.pi * np.arange(mean.shape[1]) / mean.shape[1]
    assert np.allclose(mean[0], 20 * np.cos(grid + 0.4) + 6 * np.cos(4 * grid), atol=0.5)
    assert np.allclose(mean[1] + 250, sense * (20 * np.sin(grid + 0.4) + 6 * np.sin(4 * grid)), atol=0.5)


def test_filtered_orbits_say_filter_speed_and_span(short: Analysis) -> None:
    stretch = settled_stretch(short)
    said = _texts(_rendered(filtered_orbit(short)))
    assert f"not filtered / 1X filtered / averaged over {stretch.revolutions} revolutions" in said
    assert "runout not compensated" in said and "clearance circle" in said
    at, start, end = map(float, re.search(r"([\d.]+) Hz, ([\d.]+) to ([\d.]+) s", said).groups())  # type: ignore[union-attr]
    assert start >= max(r.gap.settled_from for r in short.ends.values() if r.gap is not None)
    assert at * (end - start) == pytest.approx(stretch.revolutions, abs=0.02)
    measured = short.speed_hz[(short.speed_time >= start) & (short.speed_time <= end)].mean()
    assert at == pytest.approx(measured, rel=0.01)


def test_filtered_orbits_are_refused_in_words(short: Analysis) -> None:
    assert short.planes is not None and short.angle is not None
    with pytest.raises(InputError, match="keyphasor"):
        filtered_orbit(replace(short, angle=None))
    with pytest.raises(InputError, match="no clearance circle is known"):
        filtered_orbit(replace(short, ends={end: replace(result, gap=None) for end, result in short.ends.items()}))
    time, settled = short.planes.time.to_numpy(), settled_stretch(short).start
    # pulses that fail 0.05 s after settling leave some 4 revolutions, though more follow
    lost = np.where((time > settled + 0.05) & (time < settled + 0.06), np.nan, short.angle)
    with pytest.raises(InputError, match=r"4\.\d revolutions on end"):
        filtered_orbit(replace(short, angle=lost))


def test_the_report_holds_filtered_orbits_or_says_why_not(short: Analysis) -> None:
    whole, bare = orbit.section(short), orbit.section(replace(short, angle=None))
    assert whole is not None and bare is not None
    drawn = [block for block in whole.blocks if isinstance(block, report.Figure) and block.name == "filtered-orbits"]
    assert len(drawn) == 1 and f"over {settled_stretch(short).revolutions} revolutions" in drawn[0].caption
    assert "no clearance circle" not in drawn[0].caption
    half = orbit.section(replace(short, ends={**short.ends, "NDE": replace(short.ends["NDE"], gap=None)}))
    assert half is not None
    assert any(
        isinstance(b, report.Figure) and "NDE has no clearance circle and is left out" in b.caption for b in half.blocks
    )
    assert not any(isinstance(block, report.Figure) and block.name == "filtered-orbits" for block in bare.blocks)
    assert any(isinstance(block, report.Paragraph) and "keyphasor" in block.text for block in bare.blocks)


def test_a_stretch_with_missing_samples_is_said_in_its_orbit(short: Analysis) -> None:
    assert short.planes is not None
    planes = short.planes.copy(deep=True)
    at = settled_stretch(short).start + 0.05
    planes["displacement"].loc[{"end": "DE", "axis": "x", "time": slice(at, at + 0.001)}] = np.nan
    figure = _rendered(filtered_orbit(replace(short, planes=planes)))
    silent = [ax.get_title()[:2] for ax in figure.axes if "samples are missing" in _texts(ax)]
    assert silent == ["DE", "DE", "DE"]


def test_the_centreline_is_the_mean_over_each_window(coastdown: Analysis) -> None:
    """A path that stays at one place for each window, with a 50 Hz swing about it, is drawn at these places."""
    assert coastdown.planes is not None and coastdown.release is not None and coastdown.release.time.value is not None
    time = coastdown.planes.time.to_numpy()
    release = time[np.searchsorted(time, coastdown.release.time.value)]
    window = np.floor((time - release) / 0.2 + 1e-6)
    swing = 40e-6 * np.sin(2 * np.pi * 50 * (time - release))
    figure = centreline(_moved(coastdown, window * 0.1e-6 + swing, window * -0.2e-6))
    whole = next(ax for ax in figure.axes if ax.get_title("left") == "DE: clearance")
    places = np.asarray(whole.collections[0].get_offsets())
    assert len(places) > 300
    assert np.allclose(places[:, 0], 0.1 * np.arange(len(places)), atol=1e-6)
    assert np.allclose(places[:, 1], -0.2 * np.arange(len(places)), atol=1e-6)


@pytest.mark.parametrize("name", ["time_history", "orbit_sequence", "centreline", "gap_map", "first_contact"])
def test_figures_can_do_without_release_gap_and_contacts(name: str, short: Analysis) -> None:
    ends = {end: replace(result, gap=None, contacts=None) for end, result in short.ends.items()}
    bare = replace(short, ends=ends, release=None, phases=(), swing=None, rundown=None, angle=None)
    figure = _rendered(DRAW[name](bare))
    assert any(text.get_text() for text in figure.findobj(Text))
    if name in ("gap_map", "first_contact", "centreline"):
        assert re.search(r"no clearance circle|first contact is not known", _texts(figure))


@pytest.mark.parametrize("name", ["waterfall", "cascade", "full_spectrum", "bode"])
def test_spectra_say_that_there_is_no_speed(name: str, short: Analysis) -> None:
    none = np.empty(0)
    bare = replace(short, speed_time=none, speed_hz=none, rundown=None, lines=(), tracks=None, angle=None)
    try:
        figure = _rendered(DRAW[name](bare))
    except InputError as error:
        assert re.search("speed|keyphasor", str(error))
    else:
        assert "no speed" in _texts(figure)


@pytest.mark.parametrize("name", ["time_history", "waterfall", "cascade", "full_spectrum"])
def test_a_record_without_displacement_is_refused_in_words(name: str, short: Analysis) -> None:
    with pytest.raises(InputError, match="displacement"):
        DRAW[name](replace(short, planes=None, waterfall=None, ends={}, tracks=None))


def test_a_speed_decay_without_speed_is_refused_in_words(short: Analysis) -> None:
    with pytest.raises(InputError, match="no speed"):
        speed_decay(replace(short, rundown=None))


@pytest.mark.parametrize("which", ["short", "coastdown"])
def test_what_the_law_leaves_stays_within_its_axes(which: str, request: pytest.FixtureRequest) -> None:
    figure = _rendered(speed_decay(request.getfixturevalue(which)))
    lower = figure.axes[1]
    low, high = lower.get_ylim()
    left = max(lower.lines, key=lambda line: len(line.get_xdata())).get_ydata()
    assert low < np.min(left) and np.max(left) < high
    assert "logarithmic beyond ±" in _texts(lower)


def test_the_standstill_is_not_called_a_95_percent_interval(coastdown: Analysis) -> None:
    stood = replace(
        coastdown.rundown, standstill_time=Estimate(61.0, 60.0, 62.0, "s", "below what the signal resolves")
    )
    figure = speed_decay(replace(coastdown, rundown=stood))
    assert "standstill, and the range that it lies in" in _texts(figure)
    assert "95 % interval" not in _texts(figure)


def test_a_dollar_sign_in_a_name_is_a_dollar_sign(hostile: Analysis) -> None:
    for end in hostile.ends:
        assert "$" in _texts(_rendered(orbit_sequence(hostile, end)))


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
    assert "samples are missing in this stretch" in _texts(_rendered(full_spectrum(replace(short, planes=planes))))


def test_a_rotor_that_never_turned_has_spectra_but_no_cascade(short: Analysis) -> None:
    still = replace(short, speed_hz=np.zeros_like(short.speed_hz))
    assert _rendered(waterfall(still)).axes
    with pytest.raises(InputError, match="stands still"):
        cascade(still)
