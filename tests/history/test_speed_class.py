"""Classes of speed, from file to class."""

from __future__ import annotations

import numpy as np

from tdbmon.history.batch import add_all
from tdbmon.history.speed_class import speed_classes
from tdbmon.history.study import Order
from tdbmon.record.formats.netcdf import write_netcdf
from tdbmon.record.read import read
from tests.history.conftest import YEARS


def test_drops_from_standstill_are_of_one_class_and_those_of_a_broken_tachometer_of_none(empty, tmp_path):
    orders = []
    for number, noise in enumerate((0.05, 0.05, 0.0)):
        record = read(YEARS / f"drop_{number + 1:02d}.nc")
        rng = np.random.default_rng(number)
        record["speed"] = record["speed"].copy(data=noise * rng.standard_normal(record["speed"].size))
        record["keyphasor"] = 0 * record["keyphasor"]
        write_netcdf(record, tmp_path / f"{number}.nc")
        orders.append(Order(YEARS / "machine.toml", tmp_path / f"{number}.nc"))
    assert [outcome.state for outcome in add_all(empty, orders)] == ["filed"] * 3
    entries = sorted(empty.entries(), key=lambda entry: entry.raw_name)
    assert [entry.speed_words for entry in entries] == ["standstill", "standstill", "speed unknown"]
    assert speed_classes([entry.speed for entry in entries], 0.05) == [0, 0, 1]
