"""A record that was computed is known by what it says of itself, whichever format it came in."""

from __future__ import annotations

import pytest
import xarray as xr

from tdbmon.record.read import read, write
from tdbmon.record.synthetic import is_synthetic, synthetic_note
from tdbmon.shipped import shipped


@pytest.mark.parametrize(
    ("attributes", "said"),
    [
        ({}, False),
        ({"title": "Dropdown from 100 Hz"}, False),
        ({"source_file": "synthetic_rubber.nc", "title": "Drop on a synthetic mount"}, False),
        ({"synthetic": 0}, False),
        ({"synthetic": False}, False),
        ({"synthetic": "false"}, False),
        ({"synthetic": "0"}, False),
        ({"synthetic": 1}, True),
        ({"synthetic": True}, True),
        ({"synthetic": "True"}, True),
        ({"title": "Synthetic dropdown from 75 Hz"}, True),
        ({"title": "simulated drop from 100 Hz"}, True),
    ],
)
def test_what_a_record_says_of_itself(attributes, said):
    assert is_synthetic(attributes) is said


def test_shipped_records_are_known_whatever_they_say():
    """The ten years' records say it; the others do not, and are known by the manifest."""
    said = {}
    for path in shipped("manifest.json").parent.glob("*/drop_*.nc"):
        said.setdefault(path.parent.name, set()).add(is_synthetic(read(path).attrs))
    assert said == {"years": {True}, "coastdown": {True}, "short": {True}, "loose": {True}}


def test_the_title_survives_a_file(tmp_path):
    record = xr.Dataset(
        {"DE_X": ("time", [0.0, 1e-6, 0.0, 1e-6], {"units": "m"})},
        {"time": [0.0, 1e-3, 2e-3, 3e-3]},
        {"title": "Simulated drop from 100 Hz"},
    )
    write(record, tmp_path / "drop.nc")
    assert is_synthetic(read(tmp_path / "drop.nc").attrs)


def test_one_sentence_for_one_and_for_several():
    assert synthetic_note(1) == "The record is synthetic: it was computed, not measured."
    assert synthetic_note(2).startswith("The records are")
