"""The template of a machine file: it analyses a record as it stands, and what it leaves for forces changes no plain analysis."""

from __future__ import annotations

import json

import pytest
from pydantic import BaseModel
from tdbsim.machine import Tolerant, load_machine

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.contract import analysis_json
from tdbmon.machine_page import KEYS
from tdbmon.record.read import read
from tdbmon.shipped import shipped


@pytest.fixture(scope="module")
def template():
    return load_machine(shipped("machines/template.toml"))


@pytest.fixture(scope="module")
def record():
    return read(shipped("short/drop_100.nc"))


@pytest.fixture(scope="module")
def analysis(record, template):
    return analyse(record, template)


def test_the_template_analyses_a_record(analysis):
    true = json.loads(shipped("short/answer.json").read_text())["true"]
    for name, end in analysis.ends.items():
        assert end.air_gap.low <= true["ends"][name]["radial_gap_m"] <= end.air_gap.high
    release = analysis.release.time
    assert release.low <= true["release_time_s"] <= release.high


def test_what_is_said_to_serve_forces_only_changes_no_plain_analysis(record, template, analysis):
    other = with_other_forces(template)
    assert other.bearing("DE").support_mass == pytest.approx(1.5 * template.bearing("DE").support_mass)
    assert other.magnetic_bearings[0].damping.nominal == pytest.approx(1.5 * 4e3)
    assert json.dumps(analysis_json(analyse(record, other))) == json.dumps(analysis_json(analysis))


def with_other_forces(part: BaseModel) -> BaseModel:
    """Return a part of a machine with half as much again of each value that the page of machine files says is for forces."""
    update = {}
    for name, field in type(part).model_fields.items():
        value, key = getattr(part, name), KEYS[type(part)][field.alias or name]
        if isinstance(value, tuple(KEYS)):
            update[name] = with_other_forces(value)
        elif isinstance(value, tuple) and any(isinstance(each, tuple(KEYS)) for each in value):
            update[name] = tuple(with_other_forces(each) for each in value)
        elif key.used == "forces" and name != "position":  # a position is a node of the shaft's mesh too
            if isinstance(value, Tolerant):
                update[name] = Tolerant(nominal=1.5 * value.nominal, low=1.5 * value.low, high=1.5 * value.high)
            elif isinstance(value, float):
                update[name] = 1.5 * value
    return part.model_copy(update=update)
