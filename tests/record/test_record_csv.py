"""Tables as text, as loggers and spreadsheets write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tdbsim.errors import InputError

from tdbmon.record.inspect import inspect
from tdbmon.record.read import read, write


def _read(tmp_path: Path, text: str | bytes) -> object:
    path = tmp_path / "table.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8"))
    return read(path)


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
    "whole numbers": "time,A,B\n0,1.5,-2\n0.001,2.5,-3\n0.002,10,-4\n",
}


@pytest.mark.parametrize(
    "rate",
    ["Samples/s: 20000", "Samples/s;20000", "Samples/sec = 20000", "Sample rate: 20 kS/s", "Sample rate: 20000 Sa/s",
     "Abtastrate: 20.000 Hz", "Abtastrate;20.000", "Abtastrate [kHz];20", "Abtastrate [kHz];20.000", "dt [us];50",
     "Abtastrate: 20,0 kHz", "Abtastrate [kHz];20,0", "dt [us];50,0", "Scan rate;20,000", "fs (S/s);20000"],
)  # fmt: skip
def test_a_rate_in_many_dresses(rate: str, tmp_path: Path) -> None:
    record = _read(tmp_path, f"{rate}\nA;B\n1,5;-2\n2,5;-3\n")
    np.testing.assert_allclose(record["time"].values, [0.0, 50e-6])


@pytest.mark.parametrize("name", ["Messzeit [ms]", "X (ms)"])
def test_a_time_by_another_name_is_known_by_its_unit(name: str, tmp_path: Path) -> None:
    record = _read(tmp_path, f"{name};A [um]\n0,5;1,5\n1,5;2\n2,5;1\n")
    assert set(record.data_vars) == {"A"}
    np.testing.assert_allclose(record["time"].values, [0.0, 1e-3, 2e-3])


@pytest.mark.parametrize("kind", SAME)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252", "utf-16"])
def test_the_same_table_in_many_dresses(kind: str, encoding: str, tmp_path: Path) -> None:
    record = _read(tmp_path, SAME[kind].encode(encoding))
    assert set(record.data_vars) == {"A", "B"}
    scale = 1e-6 if record["A"].attrs["units"] == "m" else 1.0
    np.testing.assert_array_equal(record["A"].values, np.array([1.5, 2.5, 10.0]) * scale)
    np.testing.assert_array_equal(record["B"].values, [-2.0, -3.0, -4.0])
    np.testing.assert_allclose(record["time"].values, [0.0, 0.001, 0.002], atol=1e-12)
    stated = any(word in kind for word in ("bracket", "parenth", "unit", "semicolon"))
    assert (record["A"].attrs["units"], record["B"].attrs["units"]) == (("m", "V") if stated else ("", ""))


UNEVEN = {
    "a remark more than columns": "time;A;B;Comment\ns;um;V;\n0;1,5;-2\n0,001;2,5;-3\n",
    "rows that end with a separator": "time;A;B\ns;um;V\n0;1,5;-2;\n0,001;2,5;-3;\n",
    "names, units, remarks": "time;A;B\ns;um;V\nclock;left;right\n0;1,5;-2\n0,001;2,5;-3\n",
    "names, remarks, units": "time;A;B\nclock 1;left;right\ns;um;V\n0;1,5;-2\n0,001;2,5;-3\n",
    "an empty line": "time;A;B\ns;um;V\n\n0;1,5;-2\n0,001;2,5;-3\n",
    "columns counted below": "time;A;B;C\ns;um;V;V\n1;2;3;4\n0,000;1,5;-2;1\n0,001;2,5;-3;1\n",
    "columns counted above": "1;2;3;4\ntime;A;B;C\ns;um;V;V\n0,000;1,5;-2;1\n0,001;2,5;-3;1\n",
    "units of DOS": "time;A;B\ns;\u00e6m;V\n0;1,5;-2\n0,001;2,5;-3\n",
    "whole numbers first": "time;A;B\ns;um;V\n0;1;-2\n0,001;2,5;-3\n",
    "whole numbers first, blanks": "time A B\ns um V\n0 1 -2\n0,001 2,5 -3\n",
    "LabVIEW": "Y_Unit_Label\tMicrometers\tVolts\t\nX0\t0.0\t0.0\t\n***End_of_Header***\t\t\t\n"
    "X_Value\tA\tB\tComment\n0.0\t1.5\t-2\n0.001\t2.5\t-3\n",
    "LabVIEW without times": "Y_Unit_Label\tMicrometers\tVolts\t\nDelta_X\t0.001\t0.001\t\n***End_of_Header***\t\t\t\n"
    "X_Value\tA\tB\tComment\n\t1.5\t-2\n\t2.5\t-3\n",
}


@pytest.mark.parametrize("kind", UNEVEN)
def test_header_rows_that_differ_a_little_keep_their_names(kind: str, tmp_path: Path) -> None:
    record = _read(tmp_path, UNEVEN[kind])
    assert [name for name in record.data_vars if name != "C"] == ["A", "B"]
    first = 1.0 if "whole" in kind else 1.5
    np.testing.assert_allclose(record["A"].values, [first * 1e-6, 2.5e-6])
    np.testing.assert_array_equal(record["B"].values, [-2, -3])
    assert record["B"].attrs["units"] == "V"
    np.testing.assert_allclose(record["time"].values, [0, 0.001])


def test_units_behind_a_slash_or_in(tmp_path: Path) -> None:
    record = _read(
        tmp_path,
        "Zeit/ms;Weg X1/µm;Weg in Y/mm;Drehzahl in 1/min;Kraft/(kN);Ai0/Vib\n0;1,5;2;60;1;3\n0,5;2;3;120;1;4\n",
    )
    assert list(record.data_vars) == ["Weg X1", "Weg in Y", "Drehzahl", "Kraft", "Ai0/Vib"]
    np.testing.assert_allclose(record["time"], [0, 5e-4])
    np.testing.assert_allclose(record["Weg X1"], [1.5e-6, 2e-6])
    np.testing.assert_allclose(record["Weg in Y"], [2e-3, 3e-3])
    np.testing.assert_allclose(record["Drehzahl"], [1, 2])
    np.testing.assert_allclose(record["Kraft"], [1000, 1000])
    assert record["Ai0/Vib"].attrs["units"] == ""


def test_a_slash_in_names_is_no_unit_where_the_time_has_none_there(tmp_path: Path) -> None:
    record = _read(tmp_path, "time;Ai0/A;Ai0/V\n0;1;2\n0,001;2;3\n")
    assert list(record.data_vars) == ["Ai0/A", "Ai0/V"]


def test_a_row_of_empty_units_leaves_them_open(tmp_path: Path) -> None:
    record = _read(tmp_path, "time;A;B\n;;\n0;1,5;-2\n0,001;2,5;-3\n")
    assert list(record.data_vars) == ["A", "B"]
    assert record["A"].attrs["units"] == ""


@pytest.mark.parametrize("unit", ["µm RMS", "Mikron*"])
def test_units_that_nobody_knows_are_no_part_of_the_names(unit: str, tmp_path: Path) -> None:
    record = _read(tmp_path, f"time;A;B;C\ns;{unit};{unit};V\n0;1,5;-2;0\n0,001;2,5;-3;0\n")
    assert list(record.data_vars) == ["A", "B", "C"]
    assert record["A"].attrs["units"] == unit


def test_only_a_unit_in_the_last_brackets_leaves_the_name(tmp_path: Path) -> None:
    names = ["Bently 1 (X)", "Bently 1 (Y)", "Vib NDE X (45°)", "Probe (A)"]
    header = ",".join(["Time [s]", *(f"{name} [mil]" for name in names), "Ring (outer)", "Ring (45°)", "Speed (1/min)"])
    record = _read(tmp_path, f"{header}\n0,1,2,3,4,5,6,60\n0.001,1,2,3,4,5,6,60\n")
    assert list(record.data_vars) == [*names, "Ring (outer)", "Ring (45°)", "Speed"]
    for k, name in enumerate(names, start=1):
        assert record[name].attrs["units"] == "m"
        np.testing.assert_allclose(record[name], k * 25.4e-6)
    assert record["Ring (45°)"].attrs["units"] == record["Ring (outer)"].attrs["units"] == ""
    np.testing.assert_allclose(record["Speed"], 1.0)


def test_a_first_row_that_counts_is_measured_where_time_goes_on_from_it(tmp_path: Path) -> None:
    record = _read(tmp_path, "time;A;B;C\n1;2;3;4\n2;3;4;5\n")
    np.testing.assert_array_equal(record["A"].values, [2, 3])


def test_a_remark_before_an_empty_line_is_no_header(tmp_path: Path) -> None:
    record = _read(tmp_path, "fs;1000\nmade by;nobody\n\n1,5;-2\n2,5;-3\n")
    assert list(record.data_vars) == ["column_1", "column_2"]


def test_two_header_rows_of_names(tmp_path: Path) -> None:
    record = _read(
        tmp_path, "time,NDE,NDE,DE,DE\n,A,B,A,B\n0,1,2,3,4\n0.1,1,2,3,4\n0.2,1,2,3,4\n".replace("\n,", "\ntime,")
    )
    assert set(record.data_vars) == {"NDE_A", "NDE_B", "DE_A", "DE_B"}


def test_names_units_and_an_upper_row(tmp_path: Path) -> None:
    record = _read(tmp_path, "x,left,right\ntime,A,B\ns,um,mil\n0,1,2\n0.1,1,2\n0.2,1,2\n")
    assert record["A"].attrs["long_name"] == "left"
    np.testing.assert_allclose(record["B"].values, 2 * 25.4e-6)


def test_empty_cells_and_words_for_nothing_are_missing(tmp_path: Path) -> None:
    record = _read(tmp_path, "time,A,B\n0,1,2\n0.1,,NaN\n0.2,nan,n/a\n0.3,4,inf\n")
    np.testing.assert_array_equal(record["A"].values, [1, np.nan, np.nan, 4])
    np.testing.assert_array_equal(record["B"].values, [2, np.nan, np.nan, np.inf])


def test_columns_with_their_own_times(tmp_path: Path) -> None:
    text = "Time - A,A,Time - B,B\n" + "".join(
        f"{k / 100},{k},{k / 10 if k < 3 else ''},{10 * k if k < 3 else ''}\n" for k in range(10)
    )
    record = _read(tmp_path, text)
    assert record["A"].size == 10
    np.testing.assert_array_equal(record["B"].values, [0, 10, 20])
    np.testing.assert_allclose(record[record["B"].dims[0]].values, [0, 0.1, 0.2])


def test_one_sample_is_a_record(tmp_path: Path) -> None:
    record = _read(tmp_path, "time,A\n0,1\n")
    assert record["A"].values.tolist() == [1.0]


def test_a_clock_that_passes_midnight(tmp_path: Path) -> None:
    record = _read(tmp_path, "time,A\n23:59:59.5,1\n00:00:00.5,2\n00:00:01.5,3\n")
    np.testing.assert_allclose(record["time"].values, [0, 1, 2])


def test_a_last_line_that_may_lack_digits_is_told(tmp_path: Path) -> None:
    rows = "".join(f"{k / 1000:.6f},{1 + k / 7:.6f}\n" for k in range(40))
    assert "incomplete" not in _read(tmp_path, "time,A\n" + rows).attrs
    assert "cut off" in _read(tmp_path, "time,A\n" + rows[:-3]).attrs["incomplete"]


BAD = {
    "no numbers": ("time,A\nzero,one\n", "without a table of numbers"),
    "header only": ("time,A,B\n", "without a table of numbers"),
    "blank lines": ("\n\n  \n", "empty lines only"),
    "prose": ("The rotor fell.\nNobody measured it.\n", "without a table of numbers"),
    "hours of the morning": (
        "time,A,B\n10/03/2026 09:00:00.000 AM,1.5,-2\n10/03/2026 09:00:00.001 AM,2.5,-3\n",
        r"Line 2 comes nearest \('10/03/2026 09:00:00.000 AM,1.5,-2'\), but '10/03/2026 09:00:00.000 AM' is no number",
    ),
    "thousands": (
        "Serial 17\ntime;A;B\n0;1,234.5;2\n1;1,235.5;3\n",
        "Line 3 comes nearest .* but '1,234.5' is no number",
    ),
    "thousands in one column": (
        "time;A;B\n0,000;1,5;5.798\n0,001;1,6;5.799\n",
        "'5.798' is no number",
    ),
    "text in a number": ("time,A\n0,1\n0.1,abc\n0.2,3\n", "line 3, column 'A': 'abc' is no number"),
    "overload": ("time,A\n0,1\n0.1,OVERLOAD\n0.2,3\n", "'OVERLOAD' is no number"),
    "short row": ("time,A,B\n0,1,2\n0.1,1\n0.2,1,2\n", "line 3 has 2 columns instead of 3"),
    "long row": ("time,A,B\n0,1,2\n0.1,1,5,7\n0.2,1,2\n", "line 3 has 4 columns instead of 3"),
    "words at the end": (
        "time,A,B\n0,1,2\n0.1,1,5\nEnd of file\n",
        r"line 4 \('End of file'\) is no row of numbers: delete it",
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
        "the header in line 1 has 3 cells, the rows of numbers have 6; the comma seems to be separator and decimal sign",
    ),
    "comma twice under units": (
        "time,A,B\ns,um,1\n0,000,1,5,2\n0,001,1,5,2\n",
        "the header in line 2 has 3 cells, the rows of numbers have 5; the comma seems to be separator and decimal sign",
    ),
    "no time": ("A,B\n1,2\n3,4\n", "nothing tells when the samples of 'A', 'B' were taken"),
    "no header": ("0,1\n0.1,2\n", "nothing tells when"),
    "clock of too few digits": (
        "Uhrzeit;A\n09:59:59,800;1\n09:59:59,800;2\n09:59:59,801;3\n",
        "time does not increase after sample 1 .* too few digits",
    ),
    "backwards": ("time,A\n0,1\n0.2,2\n0.1,3\n", "runs backwards"),
    "repeated": ("time,A\n0.000,1\n0.001,2\n0.001,3\n", "too few digits"),
    "missing time": ("time,A\n0,1\n,2\n0.2,3\n", "the time of sample 2 is no number"),
    "same names": ("time,A,A\n0,1,2\n1,3,4\n", "'A' occurs twice"),
    "time only": ("time\n0\n1\n2\n", "no channel along time"),
}


@pytest.mark.parametrize("kind", BAD)
def test_bad_tables_are_refused_with_their_line(kind: str, tmp_path: Path) -> None:
    text, message = BAD[kind]
    with pytest.raises(InputError, match=message) as caught:
        _read(tmp_path, text)
    assert "table.csv" in str(caught.value)
    assert "\n" not in str(caught.value)


def _stamped(rate: float, stated: float) -> str:
    """A table of 0.1 s whose clock stamps are cut to ms."""
    stamps = (f"09:59:59.{int(1e3 * k / rate + 1e-9):03d},{k}" for k in range(int(0.1 * rate)))
    return "\n".join([f"Sample rate [Hz],{stated:g}", "Time,A (um)", *stamps, ""])


def test_stamps_that_repeat_give_way_to_the_stated_rate(tmp_path: Path) -> None:
    """At 20 kHz twenty samples have one stamp in ms."""
    record = _read(tmp_path, _stamped(20e3, 20e3))
    assert np.allclose(np.diff(record["time"].values), 5e-5, rtol=1e-9)
    assert record["A"].size == 2000 and record["A"].values[-1] == pytest.approx(1999e-6)
    assert "counted" in record["time"].attrs
    fine = _read(tmp_path, _stamped(500.0, 20e3))  # stamps that go on tell the time themselves
    assert np.allclose(np.diff(fine["time"].values), 2e-3) and "counted" not in fine["time"].attrs


def test_a_rate_that_stamps_contradict_is_not_taken(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="last 0.099 s where 2000 samples at the stated 10000 Hz last 0.1999 s"):
        _read(tmp_path, _stamped(20e3, 10e3))
    with pytest.raises(InputError, match="or state the true rate in the file"):
        _read(tmp_path, _stamped(20e3, 20e3).partition("\n")[2])


def test_a_huge_header_does_not_take_long(tmp_path: Path) -> None:
    record = _read(tmp_path, "".join(f"# remark {k}\n" for k in range(4000)) + "time,A\n0,1\n1,2\n")
    assert record["A"].size == 2
    with pytest.raises(InputError, match="without a table of numbers"):
        _read(tmp_path, "a line of words\n" * 100_000)


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
    record = _read(tmp_path, f"time,A\n{first},1\n{last},2\n")
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
    record = _read(tmp_path, f"# date: {stated}\ntime [s],A [um],B,C\n0,1,2,3\n0.001,2,3,4\n0.002,3,4,5\n")
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
    record = _read(tmp_path, f"{line}\ntime [s],A [um],B [um]\n0,1,2\n0.001,2,3\n0.002,3,4\n")
    assert "drop_time_unread" not in record.attrs


def test_a_day_of_two_readings_in_the_time_column_is_quoted(tmp_path: Path) -> None:
    record = _read(tmp_path, "time,A\n03/11/2026 09:00:00.0,1\n03/11/2026 09:00:00.1,2\n")
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
    record = _read(tmp_path, f"{above}time [s];A [um];B [um]\n0;1;2\n0.001;2;3\n0.002;3;4\n")
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
    record = _read(tmp_path, f"Date;Time;A [um]\n{first};1\n{last};2\n")
    np.testing.assert_allclose(record["time"].values, [0.0, 0.1])
    assert list(record.data_vars) == ["A"]
    assert record.attrs["drop_time"] == dropped


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
    record = _read(tmp_path, "\n".join(rows) + "\n")
    assert set(record.data_vars) == {"NDE_A", "speed"}
    np.testing.assert_allclose(record[record["speed"].dims[0]].values, 0.25 + 2e-3 * np.arange(5))
    np.testing.assert_allclose(record[record["NDE_A"].dims[0]].values, 1e-3 * np.arange(10))


def test_a_second_time_is_known_by_its_name_and_unit_between_channels(tmp_path: Path) -> None:
    rows = "".join(f"{k / 10},{k},{k / 5 + 3},{k},{k}\n" for k in range(10))
    record = _read(tmp_path, f"t_probe [s],NDE_A [um],t_speed [s],speed [Hz],V\n{rows}")
    np.testing.assert_allclose(record[record["speed"].dims[0]].values, 3 + 0.2 * np.arange(10))
    # the time that a turn takes rises as well, but is measured
    record = _read(tmp_path, f"time [s],NDE_A [um],turn [s],speed [Hz],V\n{rows}")
    np.testing.assert_allclose(record[record["speed"].dims[0]].values, 0.1 * np.arange(10))


def test_moments_of_one_form_are_read_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Half a minute went by over the stamps of a whole coast-down, since the form of each was guessed anew."""
    import pandas as pd

    forms = []
    plain = pd.to_datetime
    monkeypatch.setattr(pd, "to_datetime", lambda *args, **more: forms.append(more["format"]) or plain(*args, **more))
    record = _read(tmp_path, "Zeit;A\n11.03.2026 23:59:59,5;1\n12.03.2026 00:00:00,25;2\n")
    np.testing.assert_allclose(record["time"].values, [0, 0.75])
    assert "mixed" not in forms


_LABVIEW = (
    "Date\t2026/03/11\nTime\t09:00:00.0000000\n***End_of_Header***\t\n\t\nChannels\t2\t\t\nDate\t{0}2026/03/11\t\n"
    "Time\t{0}09:00:00.0000000\t\nY_Unit_Label\tum\t{1}V\t\n***End_of_Header***\t\t\t\n"
)


def test_rows_of_the_columns_dates_do_not_replace_that_of_the_record(tmp_path: Path) -> None:
    dates = _LABVIEW.format("2026/03/11\t", "").replace("Time\t2026/03/11", "Time\t09:00:00.0000000")
    record = _read(tmp_path, f"{dates}X_Value\tA\tB\tComment\n0.0\t1.5\t-2\n0.001\t2.5\t-3\n")
    assert record.attrs["drop_time"] == "2026-03-11T09:00:00"
    assert "drop_time_unread" not in record.attrs


def test_each_channel_of_labview_may_have_a_time_of_its_own(tmp_path: Path) -> None:
    record = _read(
        tmp_path,
        _LABVIEW.format("", "\t") + "X_Value\tA\tX_Value\tB\tComment\n0.0\t1.5\t5.0\t-2\n0.001\t2.5\t5.1\t-3\n",
    )
    assert {name: array.attrs["units"] for name, array in record.items()} == {"A": "m", "B": "V"}
    np.testing.assert_allclose(record[record["A"].dims[0]].values, [0, 0.001])
    np.testing.assert_allclose(record[record["B"].dims[0]].values, [5, 5.1])


def test_what_an_oscilloscope_cannot_show_is_infinite(tmp_path: Path) -> None:
    record = _read(tmp_path, "Time,Channel A\n(ms),(V)\n\n0.0,1.5\n0.1,∞\n0.2,-∞\n")
    np.testing.assert_array_equal(record["Channel A"].values, [1.5, np.inf, -np.inf])
