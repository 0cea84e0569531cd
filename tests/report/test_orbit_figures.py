"""Orbits, filtered orbits and the centreline on a short record: what is drawn lies where the shaft was."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from tdbsim.errors import InputError

from tdbmon.analysis.result import Analysis
from tdbmon.figures.centreline import centreline
from tdbmon.figures.filtered_orbit import filtered_orbit, settled_stretch
from tdbmon.figures.orbit_sequence import orbit_sequence
from tdbmon.report import document as report
from tdbmon.report.sections import orbit
from tests.figure_checks import rendered, texts


def test_orbits_without_a_keyphasor_say_so(short: Analysis) -> None:
    assert "no keyphasor: no dots" in texts(rendered(orbit_sequence(replace(short, angle=None), "DE")))


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
    said = texts(rendered(filtered_orbit(short)))
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
    with pytest.raises(InputError, match=r"4\.\d consecutive revolutions"):
        filtered_orbit(replace(short, angle=lost))


def test_the_report_holds_filtered_orbits_or_says_why_not(short: Analysis) -> None:
    assert short.angle is not None
    turned = np.nan_to_num(short.angle, nan=0.0)
    swing = 100e-6 * np.sin(2 * np.pi * 28.6 * short.planes.time.to_numpy())  # type: ignore[union-attr]
    round_ = _moved(short, 20e-6 * np.cos(turned), 20e-6 * np.sin(turned) - 250e-6)
    whole, bare = orbit.section(round_), orbit.section(replace(short, angle=None))
    assert whole is not None and bare is not None
    drawn = [block for block in whole.blocks if isinstance(block, report.Figure) and block.name == "filtered-orbits"]
    assert len(drawn) == 1 and f"over {settled_stretch(short).revolutions} revolutions" in drawn[0].caption
    assert "no clearance circle" not in drawn[0].caption
    hidden = orbit.section(_moved(short, 2e-6 * np.cos(turned) + swing, 2e-6 * np.sin(turned) + 0.3 * swing - 250e-6))
    assert hidden is not None
    assert not any(isinstance(block, report.Figure) and block.name == "filtered-orbits" for block in hidden.blocks)
    assert any(isinstance(b, report.Paragraph) and "swing, which is not locked" in b.text for b in hidden.blocks)
    half = orbit.section(replace(round_, ends={**short.ends, "NDE": replace(short.ends["NDE"], gap=None)}))
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
    figure = rendered(filtered_orbit(replace(short, planes=planes)))
    silent = [ax.get_title()[:2] for ax in figure.axes if "samples are missing" in texts(ax)]
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
