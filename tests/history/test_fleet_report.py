"""The report of a fleet: its figure, and its tables of life and stress."""

from __future__ import annotations

import itertools
import re
import shutil
from dataclasses import replace

import pytest

from tdbmon.estimate import Estimate
from tdbmon.figures.fleet import fleet as fleet_figure
from tdbmon.figures.style import VERMILION
from tdbmon.history.archive import open_archive
from tdbmon.history.fleet import fleet
from tdbmon.quantity import words
from tdbmon.report.document import Table
from tdbmon.report.fleet_report import build_fleet_report
from tdbmon.report.html import render_html
from tests.figure_checks import faults, rendered
from tests.history.made import ENDS, add, files, filing, fill


def test_a_fleet_has_life_stress_and_the_limit_of_growth(stressed, tmp_path):
    folder = tmp_path / "archive"
    shutil.copytree(stressed.folder, folder)
    settings = folder / "archive.toml"
    settings.write_text(settings.read_text().replace("# agreed_drops = 20", "agreed_drops = 20"))
    members = fleet(open_archive(folder))
    (_, table) = [b for b in build_fleet_report(members).sections[0].blocks if isinstance(b, Table)]
    told = dict(zip(table.header, table.rows[0].cells, strict=True))
    life = members[0].latest.comparison.life
    assert (told["Full drops"], told["Agreed"]) == ("12", "20")
    assert re.fullmatch(r"[\d.]+ at (NDE|DE)", told["Damage, drops"])
    assert told["Margin, drops"] == words(life.margin)
    assert told["Greatest stress (of the limit)"] in {f"2220 MPa at {end} (53 %)" for end in ENDS}
    drawing = fleet_figure(members)
    (limit,) = [text for text in drawing.axes[0].texts if text.get_text().startswith("limit ")]
    end = limit.get_text().split()[1]
    assert min(members[0].gap_limits.values()) == pytest.approx(members[0].gap_limits[end], rel=0.05)
    assert faults(drawing) == []
    assert VERMILION not in {line.get_color() for line in drawing.axes[0].lines}  # that of an alarm's frame


@pytest.mark.parametrize("counts", [(1, 1, 1), (2, 1, 12)])
def test_the_drops_of_a_fleet_are_whole_numbers_clear_of_the_neighbours(empty, tmp_path, counts):
    for machine, count in enumerate(counts):
        for i in range(count):
            raw, plan = files(tmp_path, 100 * machine + i)
            made = filing(raw, plan, name=f"machine {machine}", seed=100 * machine + i, dropped=f"2020-01-{i + 1:02d}")
            empty.add(made, raw, plan)
    drawing = rendered(fleet_figure(fleet(empty)))
    labels = [
        label
        for ax in drawing.axes
        if ax.get_visible()
        for label, at in zip(ax.get_xticklabels(), ax.get_xticks(), strict=True)
        if ax.get_xlim()[0] <= at <= ax.get_xlim()[1]
    ]
    assert len(labels) >= len(counts)
    assert all(label.get_text().isdigit() for label in labels)
    boxes = [label.get_window_extent() for label in labels]
    assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))


def test_a_name_above_a_panel_of_a_fleet_is_whole_in_two_lines(empty, tmp_path):
    names = (
        "Generator rotor on two radial magnetic bearings",
        "Compressor",
        f"{'Pump train of the second line ' * 3}no. 4",
    )
    for seed, name in enumerate(names):
        add(empty, tmp_path / str(seed), seed, name=name)
    drawing = fleet_figure(fleet(empty))
    titles = [ax.get_title(loc="left").split("\n") for ax in drawing.axes if ax.get_visible()]
    assert {" ".join(title[:-1]) for title in titles} >= set(names[:2])
    (cut,) = [title for title in titles if "…" in title[1]]
    assert cut[0].startswith("Pump train") and cut[1].endswith("second line no. 4")
    assert not faults(drawing)


def test_a_fleet_lists_the_worst_first(empty, tmp_path):
    fill(empty, tmp_path / "a", 6, name="steady")
    for i in range(6):
        raw, machine = files(tmp_path / "b", 100 + i)
        worn = {("gap_um", "DE"): 1.3} if i == 5 else {}
        empty.add(
            filing(raw, machine, name="worn", seed=100 + i, dropped=f"2020-01-{i + 1:02d}", values=worn), raw, machine
        )
    raw, machine = files(tmp_path / "c", 200)
    empty.add(filing(raw, machine, name="new", seed=200, dropped="2020-01-01"), raw, machine)
    members = fleet(empty)
    assert [(m.machine, m.verdict.word) for m in members] == [
        ("worn", "inspect"),
        ("new", "too few drops"),
        ("steady", "as before"),
    ]
    document = build_fleet_report(members)
    assert "1 of 3 machines needs attention; 1 has too few matching drops for a verdict." in render_html(document)


def test_the_intervals_of_a_fleet_lie_in_their_panels(empty, tmp_path):
    for i in range(2):
        raw, machine = files(tmp_path, i)
        made = filing(raw, machine, seed=i, dropped=f"2020-01-{i + 1:02d}")
        radius = Estimate(250e-6 + 20e-6 * i, 230e-6 + 20e-6 * i, 280e-6 + 20e-6 * i, "um")
        made = replace(
            made, features=tuple(replace(f, estimate=radius) if f.name == "gap_um" else f for f in made.features)
        )
        empty.add(made, raw, machine)
    ax = fleet_figure(fleet(empty)).axes[0]
    assert max(max(line.get_ydata()) for line in ax.lines) <= ax.get_ylim()[1]
