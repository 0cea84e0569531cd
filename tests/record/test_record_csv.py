"""Tables as text, as loggers and spreadsheets write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from record_samples import read_table
from tdbsim.errors import InputError

SAME = {
    "comma": "time,A,B\n0,1.5,-2\n0.001,2.5,-3\n0.002,1e1,-4\n",
    "brackets": "time [s],A [um],B [V]\n0,1.5,-2\n0.001,2.5,-3\n0.002,1e1,-4\n",
    "parentheses": "Time (ms),A (um),B (V)\n0,1.5,-2\n1,2.5,-3\n2,1e1,-4\n",
    "unit row": "time,A,B\ns,um,V\n0,1.5,-2\n0.001,2.5,-3\n0.002,1e1,-4\n",
    "bracketed unit row": "time,A,B\n[s],[um],[V]\n0,1.5,-2\n0.001,2.5,-3\n0.002,1e1,-4\n",
    "semicolon and decimal comma": "Zeit;A;B\ns;µm;V\n0;1,5;-2\n0,001;2,5;-3\n0,002;1e1;-4\n",
    "tab": "time\tA\tB\n0\t1.5\t-2\n0.001\t2.5\t-3\n0.002\t1e1\t-4",
    "tab and decimal comma": "time\tA\tB\n0\t1,5\t-2\n0,001\t2,5\t-3\n0,002\t1e1\t-4",
    "blanks": "  time   A    B\n  0.0   1.5   -2.0\n  0.001   2.5  -3.0\n  0.002  1e1  -4.0\n",
    "blanks and decimal comma": "t A B\n0,0 1,5 -2,0\n0,001 2,5 -3,0\n0,002 1e1 -4,0\n",
    "quotes": '"time","A","B"\n"0","1.5","-2"\n"0.001","2.5","-3"\n"0.002","1e1","-4"\n',
    "quoted decimal comma": '"time","A","B"\n"0","1,5","-2"\n"0,001","2,5","-3"\n"0,002","1e1","-4"\n',
    "comments": "# made by a logger\n# operator: nobody\ntime,A,B\n0,1.5,-2\n# a remark\n0.001,2.5,-3\n0.002,1e1,-4\n",
    "remarks of other loggers among the numbers": "% by a logger\ntime,A,B\n0,1.5,-2\n% a remark\n0.001,2.5,-3\n"
    "// another\n  ! and one more, with commas\n0.002,1e1,-4\n",
    "commented header": "# time, A, B\n0,1.5,-2\n0.001,2.5,-3\n0.002,1e1,-4\n",
    "preamble": "Logger X;\nSerial;17\nDate;10.03.2026\n\ntime;A;B\n0;1.5;-2\n0.001;2.5;-3\n0.002;1e1;-4\n",
    "rate in the preamble": "Sampling rate [Hz];1000\nA;B\n1.5;-2\n2.5;-3\n1e1;-4\n",
    "trailing separators": "time;A;B;\n0;1.5;-2;\n0.001;2.5;-3;\n0.002;1e1;-4;\n",
    "old Mac line ends": "time,A,B\r0,1.5,-2\r0.001,2.5,-3\r0.002,1e1,-4\r",
    "clock": "time,A,B\n09:00:00.000,1.5,-2\n09:00:00.001,2.5,-3\n09:00:00.002,1e1,-4\n",
    "moments": "time,A,B\n2026-03-10T09:00:00.000,1.5,-2\n2026-03-10T09:00:00.001,2.5,-3\n2026-03-10T09:00:00.002,1e1,-4\n",
    "day and clock": "Date,Time,A,B\n"
    "10.03.2026,09:00:00.000,1.5,-2\n10.03.2026,09:00:00.001,2.5,-3\n10.03.2026,09:00:00.002,1e1,-4\n",
    "labelled rows, one of units": "Title,Run 1\nPoint Id,,A,B\nDirection,,S,S\nUnit,s,um,V\n"
    ",0,1.5,-2\n,0.001,2.5,-3\n,0.002,1e1,-4\n",
    "bars": "time|A|B\n0|1.5|-2\n0.001|2.5|-3\n0.002|1e1|-4\n",
    "exponents of Fortran": "time,A,B\n0,1.5D0,-2\n0.001,2.5D0,-3\n0.002,1D+1,-4\n",
    "minutes and seconds": "time,A,B\n59:59.999,1.5,-2\n60:00.000,2.5,-3\n60:00.001,1e1,-4\n",
    "clock with its form for a unit": "time;A;B\nhh:mm:ss.fff;um;V\n"
    "09:00:00,000;1,5;-2\n09:00:00,001;2,5;-3\n09:00:00,002;1e1;-4\n",
    "end of DOS": "time,A,B\n0,1.5,-2\n0.001,2.5,-3\n0.002,1e1,-4\n\x1a",
    "empty end of a disk block": "time,A,B\n0,1.5,-2\n0.001,2.5,-3\n0.002,1e1,-4\n" + 600 * "\0",
    "hours of the afternoon": "time,A,B\n03:00:00.000 PM,1.5,-2\n03:00:00.001 PM,2.5,-3\n03:00:00.002 PM,1e1,-4\n",
    "day and hours of the morning": "time,A,B\n"
    "3/31/2026 9:00:00.000 a.m.,1.5,-2\n3/31/2026 9:00:00.001 a.m.,2.5,-3\n3/31/2026 9:00:00.002 a.m.,1e1,-4\n",
    "whole numbers": "time,A,B\n0,1.5,-2\n0.001,2.5,-3\n0.002,10,-4\n",
}


@pytest.mark.parametrize(
    "rate",
    ["Samples/s: 20000", "Samples/s;20000", "Samples/sec = 20000", "Sample rate: 20 kS/s", "Sample rate: 20000 Sa/s",
     "Abtastrate: 20.000 Hz", "Abtastrate;20.000", "Abtastrate [kHz];20", "Abtastrate [kHz];20.000", "dt [us];50",
     "Abtastrate: 20,0 kHz", "Abtastrate [kHz];20,0", "dt [us];50,0", "Scan rate;20,000", "fs (S/s);20000"],
)  # fmt: skip
def test_a_rate_in_many_dresses(rate: str, tmp_path: Path) -> None:
    record = read_table(tmp_path, f"{rate}\nA;B\n1,5;-2\n2,5;-3\n")
    np.testing.assert_allclose(record["time"].values, [0.0, 50e-6])


@pytest.mark.parametrize("name", ["Messzeit [ms]", "X (ms)"])
def test_a_time_by_another_name_is_known_by_its_unit(name: str, tmp_path: Path) -> None:
    record = read_table(tmp_path, f"{name};A [um]\n0,5;1,5\n1,5;2\n2,5;1\n")
    assert set(record.data_vars) == {"A"}
    np.testing.assert_allclose(record["time"].values, [0.0, 1e-3, 2e-3])


@pytest.mark.parametrize("kind", SAME)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252", "utf-16"])
def test_the_same_table_in_many_dresses(kind: str, encoding: str, tmp_path: Path) -> None:
    record = read_table(tmp_path, SAME[kind].encode(encoding))
    assert set(record.data_vars) == {"A", "B"}
    scale = 1e-6 if record["A"].attrs["units"] == "m" else 1.0
    np.testing.assert_array_equal(record["A"].values, np.array([1.5, 2.5, 10.0]) * scale)
    np.testing.assert_array_equal(record["B"].values, [-2.0, -3.0, -4.0])
    np.testing.assert_allclose(record["time"].values, [0.0, 0.001, 0.002], atol=1e-12)
    stated = any(word in kind for word in ("bracket", "parenth", "unit", "semicolon"))
    assert (record["A"].attrs["units"], record["B"].attrs["units"]) == (("m", "V") if stated else ("", ""))


@pytest.mark.parametrize(
    "rows",
    [
        "0,0;998,5;1\n0,1;1.798,38;2\n0,2;12.345.678,5;3\n0,3;2.000;4",
        '0.0,998.5,1\n0.1,"1,798.38",2\n0.2,"12,345,678.5",3\n0.3,"2,000",4',
    ],
)
def test_thousands_are_known_by_the_decimals_behind_them(rows: str, tmp_path: Path) -> None:
    header = "time;A;B" if ";" in rows else "time,A,B"
    for first in (rows, rows.partition("\n")[2]):  # with decimals alone, and with thousands, in the first row
        record = read_table(tmp_path, f"{header}\n{first}\n")
        np.testing.assert_array_equal(record["A"].values[-3:], [1798.38, 12345678.5, 2000.0])


def test_empty_cells_and_words_for_nothing_are_missing(tmp_path: Path) -> None:
    record = read_table(tmp_path, "time,A,B\n0,1,2\n0.1,,NaN\n0.2,nan,n/a\n0.3,4,inf\n")
    np.testing.assert_array_equal(record["A"].values, [1, np.nan, np.nan, 4])
    np.testing.assert_array_equal(record["B"].values, [2, np.nan, np.nan, np.inf])


def test_columns_with_their_own_times(tmp_path: Path) -> None:
    text = "Time - A,A,Time - B,B\n" + "".join(
        f"{k / 100},{k},{k / 10 if k < 3 else ''},{10 * k if k < 3 else ''}\n" for k in range(10)
    )
    record = read_table(tmp_path, text)
    assert record["A"].size == 10
    np.testing.assert_array_equal(record["B"].values, [0, 10, 20])
    np.testing.assert_allclose(record[record["B"].dims[0]].values, [0, 0.1, 0.2])


def test_one_sample_is_a_record(tmp_path: Path) -> None:
    record = read_table(tmp_path, "time,A\n0,1\n")
    assert record["A"].values.tolist() == [1.0]


def test_a_last_line_that_may_lack_digits_is_told(tmp_path: Path) -> None:
    rows = "".join(f"{k / 1000:.6f},{1 + k / 7:.6f}\n" for k in range(40))
    assert "incomplete" not in read_table(tmp_path, "time,A\n" + rows).attrs
    assert "cut off" in read_table(tmp_path, "time,A\n" + rows[:-3]).attrs["incomplete"]


BAD = {
    "no numbers": ("time,A\nzero,one\n", "without a table of numbers"),
    "header only": ("time,A,B\n", "without a table of numbers"),
    "blank lines": ("\n\n  \n", "only empty lines"),
    "prose": ("The rotor fell.\nNobody measured it.\n", "without a table of numbers"),
    "thousands that may be decimals": (
        "Serial 17\ntime;A;B\n0,000;1,5;5.798\n0,001;1,6;5.799\n",
        r"Line 3 is the closest \('0,000;1,5;5.798'\), but '5.798' is not a number.* without thousands separators",
    ),
    "thousands that may be decimals further down": (
        "time;A;B\n0,000;1,5;999\n0,001;1,6;1.001\n",
        "line 3, column 'B': '1.001' is not a number",
    ),
    "text in a number": ("time,A\n0,1\n0.1,abc\n0.2,3\n", "line 3, column 'A': 'abc' is not a number"),
    "overload": ("time,A\n0,1\n0.1,OVERLOAD\n0.2,3\n", "'OVERLOAD' is not a number"),
    "short row": ("time,A,B\n0,1,2\n0.1,1\n0.2,1,2\n", "line 3 has 2 columns instead of 3"),
    "long row": ("time,A,B\n0,1,2\n0.1,1,5,7\n0.2,1,2\n", "line 3 has 4 columns instead of 3"),
    "words at the end": (
        "time,A,B\n0,1,2\n0.1,1,5\nEnd of file\n",
        r"line 4 \('End of file'\) is not a row of numbers: delete it",
    ),
    "cut row": ("time,A,B\n0,1,2\n0.1,1,5\n0.2,1", r"line 4 \(the last: the file was cut off\)"),
    "short row after a remark": ("time,A,B\n0,1,2\n% one\n0.1,1\n0.2,1,2\n", "line 4 has 2 columns instead of 3"),
    "short row of blanks": ("time A B\n0 1 2\n0.1 1\n0.2 1 2\n", "line 3 has 2 columns instead of 3"),
    "header too long": (
        "time;A;B;C\n0;1;2\n0.1;2;3\n",
        "the header in line 1 has 4 cells, the rows of numbers have 3; correct the header",
    ),
    "units fit and names do not": (
        "time;A;B;C\ns;um;um\n0;1;2\n0.1;2;3\n",
        "the header in line 1 has 4 cells, the rows of numbers have 3",
    ),
    "comma twice": (
        "time,A,B\n0,000,1,5,2,5\n0,001,1,5,2,5\n",
        "the header in line 1 has 3 cells, the rows of numbers have 6; the comma seems to be both separator and decimal sign",
    ),
    "comma twice under units": (
        "time,A,B\ns,um,1\n0,000,1,5,2\n0,001,1,5,2\n",
        "the header in line 2 has 3 cells, the rows of numbers have 5; the comma seems to be both separator and decimal sign",
    ),
    "no time": ("A,B\n1,2\n3,4\n", "the sampling times of 'A', 'B' are not given"),
    "no header": ("0,1\n0.1,2\n", "the sampling times of .* are not given"),
    "clock of too few digits": (
        "Uhrzeit;A\n09:59:59,800;1\n09:59:59,800;2\n09:59:59,801;3\n",
        "time does not increase after sample 1 .* too few digits",
    ),
    "backwards": ("time,A\n0,1\n0.2,2\n0.1,3\n", "goes back"),
    "repeated": ("time,A\n0.000,1\n0.001,2\n0.001,3\n", "too few digits"),
    "missing time": ("time,A\n0,1\n,2\n0.2,3\n", "the time of sample 2 is not a number"),
    "days of a spreadsheet": (
        "Zeit;A\n46091,6250000000;1\n46091,6250000012;2\n46091,6250000023;3\n",
        r"a sample every 1\.\d+e-09 s, so they are not in s; state their unit, as in .* 'Time \[d\]'",
    ),
    "same names": ("time,A,A\n0,1,2\n1,3,4\n", "'A' occurs twice"),
    "time only": ("time\n0\n1\n2\n", "no channel over time"),
}


@pytest.mark.parametrize("kind", BAD)
def test_bad_tables_are_refused_with_their_line(kind: str, tmp_path: Path) -> None:
    text, message = BAD[kind]
    with pytest.raises(InputError, match=message) as caught:
        read_table(tmp_path, text)
    assert "table.csv" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_huge_header_does_not_take_long(tmp_path: Path) -> None:
    record = read_table(tmp_path, "".join(f"# remark {k}\n" for k in range(4000)) + "time,A\n0,1\n1,2\n")
    assert record["A"].size == 2
    with pytest.raises(InputError, match="without a table of numbers"):
        read_table(tmp_path, "a line of words\n" * 100_000)


def test_what_an_oscilloscope_cannot_show_is_infinite(tmp_path: Path) -> None:
    record = read_table(tmp_path, "Time,Channel A\n(ms),(V)\n\n0.0,1.5\n0.1,∞\n0.2,-∞\n")
    np.testing.assert_array_equal(record["Channel A"].values, [1.5, np.inf, -np.inf])
