"""Analysed records that the tests of figures and reports share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tdbsim.machine import parse_machine

from tdbmon.analysis.result import Analysis
from tdbmon.report import Document, build_report
from tests.shipped_drops import analysed

# ends a script element, opens another, and holds what HTML, SVG, typst, matplotlib's mathtext and JSON might act on
HOSTILE = "</script><script>alert(1)</script><b>&amp; $\\frac{1}$ #sys.inputs *b* _i_ @ref \\u003c"


@pytest.fixture(scope="session")
def short() -> Analysis:
    """A short record: 0.5 s at 20 kHz, which ends long before standstill."""
    return analysed("short/drop_100")


@pytest.fixture(scope="session")
def hostile(short: Analysis) -> Analysis:
    """The short record with hostile names in every place that a file gives one."""
    renamed = with_ends(short, tuple(f"{HOSTILE}{i}" for i in range(2)), HOSTILE)  # which differ by their last letter
    record = short.record.copy()
    record.attrs = {**record.attrs, "title": HOSTILE, "source_file": f"{HOSTILE}.nc", "drop_time": HOSTILE}
    return replace(
        renamed,
        record=record,
        checks=tuple(replace(c, channel=HOSTILE, detail=HOSTILE, passed=i > 0) for i, c in enumerate(short.checks)),
        lines=tuple(replace(line, name=HOSTILE) for line in renamed.lines),
    )


def with_ends(analysis: Analysis, names: tuple[str, ...], title: str) -> Analysis:
    """Return an analysis of a machine of another name, with other names of its ends."""
    machine = parse_machine(_renamed(analysis.machine.model_dump(by_alias=True), names, title))
    rename = dict(zip(analysis.machine.ends, machine.ends, strict=True))
    planes = analysis.planes
    assert planes is not None and analysis.release is not None
    release = replace(
        analysis.release,
        **{
            name: {rename[end]: value for end, value in getattr(analysis.release, name).items()}
            for name in ("states", "falls")
        },
    )
    return replace(
        analysis,
        machine=machine,
        release=release,
        planes=planes.assign_coords(end=[rename[str(end)] for end in planes.end.values]),
        waterfall=None if analysis.waterfall is None else _ends_renamed(analysis.waterfall, rename),
        tracks=None if analysis.tracks is None else _ends_renamed(analysis.tracks, rename),
        levitation={rename[name]: found for name, found in analysis.levitation.items()},
        ends={rename[name]: replace(end, name=rename[name]) for name, end in analysis.ends.items()},
        lines=tuple(replace(line, end=rename.get(line.end, line.end)) for line in analysis.lines),
        whirl={rename[end]: whirl for end, whirl in analysis.whirl.items()},
    )


@pytest.fixture(scope="session")
def short_report(short: Analysis) -> Document:
    """Report of the short record; its figures are drawn once for all tests."""
    return build_report(short, note="This record is synthetic.")


@pytest.fixture(scope="session")
def coastdown_report(coastdown: Analysis) -> Document:
    """Report of the whole drop."""
    return build_report(coastdown)


@pytest.fixture(scope="session")
def hostile_report(hostile: Analysis) -> Document:
    """Report in which every name is hostile."""
    return build_report(hostile, note=hostile.machine.name)


def _ends_renamed(dataset, rename):  # type: ignore[no-untyped-def]
    return dataset.assign_coords(end=[rename[str(end)] for end in np.atleast_1d(dataset.end.values)])


def _renamed(data: dict, names: tuple[str, ...], title: str) -> dict:  # type: ignore[type-arg]
    """The machine with other names of itself and of its ends."""
    data = _without_none(data)
    ends = {bearing["name"]: name for bearing, name in zip(data["touchdown_bearing"], names, strict=True)}
    for bearing in data["touchdown_bearing"]:
        bearing["name"] = ends[bearing["name"]]
    for probe in data["probe"]:
        probe["end"] = ends[probe["end"]]
    return {**data, "name": title}


def _without_none(value):  # type: ignore[no-untyped-def]
    """A dump of a machine as its file would be written: nothing that is not set, a tolerance as a half-width."""
    if isinstance(value, dict):
        if set(value) == {"nominal", "low", "high"}:
            return {"nominal": value["nominal"], "tolerance": (value["high"] - value["low"]) / 2}
        return {key: _without_none(item) for key, item in value.items() if item is not None}
    if isinstance(value, list | tuple):
        return [_without_none(item) for item in value]
    return value
