"""The date of a drop, as the header of a table or its times state it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from record_samples import read_table

from tdbmon.record.inspect import inspect
from tdbmon.record.read import read, write


@pytest.mark.parametrize(
    ("first", "last", "day"),
    [
        ("03/11/2026 09:00:00.0", "03/11/2026 09:00:00.1", ""),  # March or November: the file does not say
        ("03/13/2026 09:00:00.0", "03/13/2026 09:00:00.1", "2026-03-13T09:00:00"),
        ("13/03/2026 09:00:00.0", "13/03/2026 09:00:00.1", "2026-03-13T09:00:00"),
        ("03.11.2026 09:00:00.0", "03.11.2026 09:00:00.1", "2026-11-03T09:00:00"),
        ("03/11/2026 23:59:59.95", "03/12/2026 00:00:00.05", "2026-03-11T23:59:59.950000"),
        ("05/05/2026 09:00:00.0", "05/05/2026 09:00:00.1", "2026-05-05T09:00:00"),
    ],
)
def test_a_day_that_may_be_two_is_left_open(first: str, last: str, day: str, tmp_path: Path) -> None:
    record = read_table(tmp_path, f"time,A\n{first},1\n{last},2\n")
    np.testing.assert_allclose(record["time"].values, [0.0, 0.1])
    assert record.attrs["drop_time"] == day


@pytest.mark.parametrize(
    ("stated", "read"),
    [
        ("2026/03/10 09:15:00", "2026-03-10T09:15:00"),
        ("10.03.2026 09:15:00.5", "2026-03-10T09:15:00.500000"),
        ("10-Mar-2026", "2026-03-10"),
        ("10.03.2026", "2026-03-10"),  # and no time of day that nobody stated
        ("10 Mar 2026 09:15", "2026-03-10T09:15:00"),
        ("Tue Mar 10 09:15:00 2026", "2026-03-10T09:15:00"),
        ("2026-03-10 09:15:00 UTC", "2026-03-10 09:15:00Z"),
        ("10.03.2026 09:15:00 GMT", "2026-03-10T09:15:00Z"),
        ("31/03/2026 09:15:00", "2026-03-31T09:15:00"),
        ("03/31/2026", "2026-03-31"),
        ("03/31/2026 06:12:33 AM", "2026-03-31T06:12:33"),
        ("03/31/2026 12:12:33 AM", "2026-03-31T00:12:33"),
        ("3/31/2026 6:12 p.m.", "2026-03-31T18:12:00"),
        ("31.03.26 06:12:33", "2026-03-31T06:12:33"),
        ("03/31/26", "2026-03-31"),
        ("31/12/99", "1999-12-31"),
        ("Mar 31, 2026 06:12:33", "2026-03-31T06:12:33"),
        ("Tuesday, March 31, 2026 6:12:33 PM", "2026-03-31T18:12:33"),
        ("31. März 2026, 06:12 Uhr", "2026-03-31T06:12:00"),
        ("06:12:33 31-Dez-2026", "2026-12-31T06:12:33"),
        ("Tue, 31 Mar 2026 06:12:33 +0530", "2026-03-31T06:12:33+05:30"),
        ("2026-03-31 06:12:33 CET", "2026-03-31T06:12:33+01:00"),
        ("31.03.2026 06:12:33 MESZ", "2026-03-31T06:12:33+02:00"),
        ("2026-03-31 06:12:33 UTC-3", "2026-03-31T06:12:33-03:00"),
        ("2026-03-31 06:12:33 CST", ""),  # Chicago or Shanghai
        ("31.03.2026 18:12:33 PM", ""),
        ("26/03/31", ""),  # 1931 or 2026
        ("03/10/2026 09:15:00", ""),  # two dates at two places
        ("31/31/2026", ""),
        ("yesterday", ""),
    ],
)
def test_a_date_in_the_header_is_read_where_it_is_one(stated: str, read: str, tmp_path: Path) -> None:
    record = read_table(tmp_path, f"# date: {stated}\ntime [s],A [um],B,C\n0,1,2,3\n0.001,2,3,4\n0.002,3,4,5\n")
    assert record.attrs["drop_time"] == read


@pytest.mark.parametrize(
    ("line", "says"),
    [
        (
            "Date,03/04/2026 06:12:33",
            "'03/04/2026 06:12:33' as its date, which may be 2026-04-03T06:12:33 or 2026-03-04T06",
        ),
        ("Date,31.03.2026 06:12:33 XYZ", "'31.03.2026 06:12:33 XYZ' as its date, which is not understood"),
        ("Date,yesterday", "'yesterday' as its date, which is not understood"),
    ],
)
def test_a_date_that_is_not_understood_is_quoted_with_the_cure(line: str, says: str, tmp_path: Path) -> None:
    """It was dropped without a word, and the drop became the latest of its machine."""
    path = tmp_path / "a.csv"
    path.write_text(f"{line}\ntime [s],A [um],B [um]\n0,1,2\n0.001,2,3\n0.002,3,4\n")
    write(read(path), tmp_path / "b.nc")
    for each in (path, tmp_path / "b.nc"):  # written again, it is as little understood
        found = inspect(each)
        assert found.drop_time == ""
        (said,) = [row for row in found.lines() if "date" in row]
        assert says in said
        assert "--dropped TIME" in said


@pytest.mark.parametrize("line", ["start time,0.5", "timestamp,1773219600", "Date,2026-03-31"])
def test_a_number_is_no_date_and_a_date_needs_no_remark(line: str, tmp_path: Path) -> None:
    record = read_table(tmp_path, f"{line}\ntime [s],A [um],B [um]\n0,1,2\n0.001,2,3\n0.002,3,4\n")
    assert "drop_time_unread" not in record.attrs


def test_a_day_of_two_readings_in_the_time_column_is_quoted(tmp_path: Path) -> None:
    record = read_table(tmp_path, "time,A\n03/11/2026 09:00:00.0,1\n03/11/2026 09:00:00.1,2\n")
    assert record.attrs["drop_time_unread"] == "03/11/2026 09:00:00.0"


@pytest.mark.parametrize(
    ("above", "read"),
    [
        ("Date;03/31/2026\nTime;06:12:33 PM\n", "2026-03-31T18:12:33"),
        ("Date;2026-03-10\nTime;0.5\n", "2026-03-10"),
        ("Datum;10.03.2026\nUhrzeit;09:15:07\n", "2026-03-10T09:15:07"),
        ("Date;2026-03-10\nTime;09:15:07,5\n", "2026-03-10 09:15:07.5"),
        ("Date;2026-03-10\nTime;morning\n", "2026-03-10"),
        ("Uhrzeit;09:15:07\n", ""),
    ],
)
def test_a_day_and_a_clock_above_the_table_are_one_moment(above: str, read: str, tmp_path: Path) -> None:
    """Drops of one day would else have no order."""
    record = read_table(tmp_path, f"{above}time [s];A [um];B [um]\n0;1;2\n0.001;2;3\n0.002;3;4\n")
    assert record.attrs["drop_time"] == read


@pytest.mark.parametrize(
    ("first", "last", "dropped"),
    [
        ("2026-03-10;09:00:00.25", "2026-03-10;09:00:00.35", "2026-03-10 09:00:00.25"),
        ("10.03.2026;09:00:00,2500000", "10.03.2026;09:00:00,3500000", "2026-03-10T09:00:00.250000"),
        ("03/11/2026;09:00:00.25", "03/11/2026;09:00:00.35", ""),  # two days at two places
        ("31/03/2026;23:59:59.95", "01/04/2026;00:00:00.05", "2026-03-31T23:59:59.950000"),
    ],
)
def test_a_day_beside_the_clock_dates_the_drop(first: str, last: str, dropped: str, tmp_path: Path) -> None:
    record = read_table(tmp_path, f"Date;Time;A [um]\n{first};1\n{last};2\n")
    np.testing.assert_allclose(record["time"].values, [0.0, 0.1])
    assert list(record.data_vars) == ["A"]
    assert record.attrs["drop_time"] == dropped
