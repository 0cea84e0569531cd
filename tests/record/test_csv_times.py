"""Times in tables: clocks, moments, and those of further columns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from record_samples import read_table
from tdbsim.errors import InputError

from tdbmon.record.inspect import inspect


def test_a_clock_that_passes_midnight(tmp_path: Path) -> None:
    record = read_table(tmp_path, "time,A\n23:59:59.5,1\n00:00:00.5,2\n00:00:01.5,3\n")
    np.testing.assert_allclose(record["time"].values, [0, 1, 2])


@pytest.mark.parametrize("row", ["{},{}", "3/31/2026 {},{}"])
def test_a_clock_of_twelve_hours_passes_noon_and_an_hour(row: str, tmp_path: Path) -> None:
    clocks = ["11:59:59.5 AM", "12:00:00 PM", "12:59:59.5 PM", "01:00:00 PM"]
    rows = "\n".join(row.format(clock, k) for k, clock in enumerate(clocks))
    record = read_table(tmp_path, f"time,A\n{rows}\n")
    np.testing.assert_allclose(record["time"].values, [0, 0.5, 3600, 3600.5])
    assert record.attrs["drop_time"] == ("2026-03-31T11:59:59.500000" if "2026" in row else "")


def test_a_clock_of_twelve_hours_passes_midnight(tmp_path: Path) -> None:
    record = read_table(tmp_path, "time,A\n11:59:59.5 PM,1\n12:00:00.5 AM,2\n12:00:01.5 AM,3\n")
    np.testing.assert_allclose(record["time"].values, [0, 1, 2])


def test_days_of_a_spreadsheet_are_times_where_their_unit_is_stated(tmp_path: Path) -> None:
    record = read_table(tmp_path, "Zeit [d];A\n46091,6250000000;1\n46091,6250000012;2\n46091,6250000023;3\n")
    np.testing.assert_allclose(record["time"].values, [0, 1e-4, 2e-4], atol=1e-5)


def _stamped(rate: float, stated: float) -> str:
    """A table of 0.1 s whose clock stamps are cut to ms."""
    stamps = (f"09:59:59.{int(1e3 * k / rate + 1e-9):03d},{k}" for k in range(int(0.1 * rate)))
    return "\n".join([f"Sample rate [Hz],{stated:g}", "Time,A (um)", *stamps, ""])


def test_stamps_that_repeat_give_way_to_the_stated_rate(tmp_path: Path) -> None:
    """At 20 kHz twenty samples have one stamp in ms."""
    record = read_table(tmp_path, _stamped(20e3, 20e3))
    assert np.allclose(np.diff(record["time"].values), 5e-5, rtol=1e-9)
    assert record["A"].size == 2000 and record["A"].values[-1] == pytest.approx(1999e-6)
    assert "counted" in record["time"].attrs
    fine = read_table(tmp_path, _stamped(500.0, 20e3))  # stamps that go on tell the time themselves
    assert np.allclose(np.diff(fine["time"].values), 2e-3) and "counted" not in fine["time"].attrs


def test_a_rate_that_stamps_contradict_is_not_taken(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="span 0.099 s, but 2000 samples at the stated 10000 Hz span 0.1999 s"):
        read_table(tmp_path, _stamped(20e3, 10e3))
    with pytest.raises(InputError, match="or state the true rate in the file"):
        read_table(tmp_path, _stamped(20e3, 20e3).partition("\n")[2])


def test_seconds_of_an_epoch_have_the_rate_that_they_were_sampled_at(tmp_path: Path) -> None:
    path = tmp_path / "epoch.csv"
    path.write_text("time;A\n" + "".join(f"{1773219600 + k * 50e-6:.6f};{k % 7}\n" for k in range(2000)))
    assert inspect(path).channels[0].rate_hz == pytest.approx(20000.0, rel=1e-5)


@pytest.mark.parametrize("second", ["Zeit B", "Time_speed"])
def test_a_second_column_of_moments_is_the_time_of_what_follows(second: str, tmp_path: Path) -> None:
    """The speed, sampled at another rate from 0.25 s on, had the probe's times."""
    rows = [f"Zeit A;NDE_A [um];{second};speed [Hz]"]
    for k in range(10):
        late = f"11.03.2026 09:00:00,{250 + 2 * k:03d};{90 + k}" if k < 5 else ";"
        rows.append(f"11.03.2026 09:00:00,{k:03d};{k};{late}")
    record = read_table(tmp_path, "\n".join(rows) + "\n")
    assert set(record.data_vars) == {"NDE_A", "speed"}
    np.testing.assert_allclose(record[record["speed"].dims[0]].values, 0.25 + 2e-3 * np.arange(5))
    np.testing.assert_allclose(record[record["NDE_A"].dims[0]].values, 1e-3 * np.arange(10))


def test_a_second_time_is_known_by_its_name_and_unit_between_channels(tmp_path: Path) -> None:
    rows = "".join(f"{k / 10},{k},{k / 5 + 3},{k},{k}\n" for k in range(10))
    record = read_table(tmp_path, f"t_probe [s],NDE_A [um],t_speed [s],speed [Hz],V\n{rows}")
    np.testing.assert_allclose(record[record["speed"].dims[0]].values, 3 + 0.2 * np.arange(10))
    # the time that a turn takes rises as well, but is measured
    record = read_table(tmp_path, f"time [s],NDE_A [um],turn [s],speed [Hz],V\n{rows}")
    np.testing.assert_allclose(record[record["speed"].dims[0]].values, 0.1 * np.arange(10))


def test_moments_of_one_form_are_read_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Half a minute went by over the stamps of a whole coast-down, since the form of each was guessed anew."""
    import pandas as pd

    forms = []
    plain = pd.to_datetime
    monkeypatch.setattr(pd, "to_datetime", lambda *args, **more: forms.append(more["format"]) or plain(*args, **more))
    record = read_table(tmp_path, "Zeit;A\n11.03.2026 23:59:59,5;1\n12.03.2026 00:00:00;2\n12.03.2026 00:00:00,25;3\n")
    np.testing.assert_allclose(record["time"].values, [0, 0.5, 0.75])
    assert "mixed" not in forms
