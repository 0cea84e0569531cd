"""The rows above a table: names, units, remarks and what the lines before them say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from record_samples import read_table

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
    record = read_table(tmp_path, UNEVEN[kind])
    assert [name for name in record.data_vars if name != "C"] == ["A", "B"]
    first = 1.0 if "whole" in kind else 1.5
    np.testing.assert_allclose(record["A"].values, [first * 1e-6, 2.5e-6])
    np.testing.assert_array_equal(record["B"].values, [-2, -3])
    assert record["B"].attrs["units"] == "V"
    np.testing.assert_allclose(record["time"].values, [0, 0.001])


def test_units_behind_a_slash_or_in(tmp_path: Path) -> None:
    record = read_table(
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
    record = read_table(tmp_path, "time;Ai0/A;Ai0/V\n0;1;2\n0,001;2;3\n")
    assert list(record.data_vars) == ["Ai0/A", "Ai0/V"]


def test_a_row_of_empty_units_leaves_them_open(tmp_path: Path) -> None:
    record = read_table(tmp_path, "time;A;B\n;;\n0;1,5;-2\n0,001;2,5;-3\n")
    assert list(record.data_vars) == ["A", "B"]
    assert record["A"].attrs["units"] == ""


@pytest.mark.parametrize("unit", ["µm RMS", "Mikron*"])
def test_units_that_nobody_knows_are_no_part_of_the_names(unit: str, tmp_path: Path) -> None:
    record = read_table(tmp_path, f"time;A;B;C\ns;{unit};{unit};V\n0;1,5;-2;0\n0,001;2,5;-3;0\n")
    assert list(record.data_vars) == ["A", "B", "C"]
    assert record["A"].attrs["units"] == unit


def test_only_a_unit_in_the_last_brackets_leaves_the_name(tmp_path: Path) -> None:
    names = ["Bently 1 (X)", "Bently 1 (Y)", "Vib NDE X (45°)", "Probe (A)"]
    header = ",".join(["Time [s]", *(f"{name} [mil]" for name in names), "Ring (outer)", "Ring (45°)", "Speed (1/min)"])
    record = read_table(tmp_path, f"{header}\n0,1,2,3,4,5,6,60\n0.001,1,2,3,4,5,6,60\n")
    assert list(record.data_vars) == [*names, "Ring (outer)", "Ring (45°)", "Speed"]
    for k, name in enumerate(names, start=1):
        assert record[name].attrs["units"] == "m"
        np.testing.assert_allclose(record[name], k * 25.4e-6)
    assert record["Ring (45°)"].attrs["units"] == record["Ring (outer)"].attrs["units"] == ""
    np.testing.assert_allclose(record["Speed"], 1.0)


@pytest.mark.parametrize(
    ("time", "probe", "stamps", "metres"),
    [
        ("time_ms", "NDE_A_um", "0,1", 1e-6),
        ("t_s", "NDE_A_mm", "0,0.001", 1e-3),
        ("Time_us", "NDE_A_microns", "0,1000", 1e-6),
        ("timestamp_s", "NDE_A_UM", "0,0.001", 1e-6),
        ("TIME_MS", "NDE_A mil", "0,1", 25.4e-6),
    ],
)
def test_names_may_end_with_their_unit(time: str, probe: str, stamps: str, metres: float, tmp_path: Path) -> None:
    first, second = stamps.split(",")
    record = read_table(tmp_path, f"{time},{probe},speed_rpm\n{first},1,60\n{second},2,120\n")
    assert list(record.data_vars) == ["NDE_A", "speed"]
    np.testing.assert_allclose(record["time"], [0, 1e-3])
    np.testing.assert_allclose(record["NDE_A"], [metres, 2 * metres])
    np.testing.assert_allclose(record["speed"], [1, 2])


def test_names_of_probes_and_filters_are_no_units(tmp_path: Path) -> None:
    names = ["NDE_A", "DE_V", "DE_H", "probe_m", "fall_g", "X_lowpass_1000_Hz", "mean_10_ms", "force_s"]
    record = read_table(tmp_path, f"time,{','.join(names)}\n0,1,2,3,4,5,6,7,8\n1,1,2,3,4,5,6,7,8\n")
    assert list(record.data_vars) == names
    assert {array.attrs["units"] for array in record.data_vars.values()} == {""}


def test_a_quantity_in_two_units_keeps_them_in_its_names(tmp_path: Path) -> None:
    record = read_table(tmp_path, "time_s,speed_rpm,speed_Hz,Ring [um],Ring [V]\n0,60,1,5,6\n1,120,2,5,6\n")
    assert list(record.data_vars) == ["speed_rpm", "speed_Hz", "Ring [um]", "Ring [V]"]
    np.testing.assert_allclose(record["speed_rpm"], record["speed_Hz"])
    assert record["Ring [V]"].attrs["units"] == "V"


def test_the_interval_above_a_table_may_have_its_unit_in_its_name(tmp_path: Path) -> None:
    record = read_table(tmp_path, "dt_ms = 0.5\nNDE_A_um,DE_A_um\n1,2\n2,3\n3,4\n")
    np.testing.assert_allclose(record["time"], [0, 5e-4, 1e-3])


def test_a_first_row_that_counts_is_measured_where_time_goes_on_from_it(tmp_path: Path) -> None:
    record = read_table(tmp_path, "time;A;B;C\n1;2;3;4\n2;3;4;5\n")
    np.testing.assert_array_equal(record["A"].values, [2, 3])


def test_a_remark_before_an_empty_line_is_no_header(tmp_path: Path) -> None:
    record = read_table(tmp_path, "fs;1000\nmade by;nobody\n\n1,5;-2\n2,5;-3\n")
    assert list(record.data_vars) == ["column_1", "column_2"]


def test_two_header_rows_of_names(tmp_path: Path) -> None:
    record = read_table(
        tmp_path, "time,NDE,NDE,DE,DE\n,A,B,A,B\n0,1,2,3,4\n0.1,1,2,3,4\n0.2,1,2,3,4\n".replace("\n,", "\ntime,")
    )
    assert set(record.data_vars) == {"NDE_A", "NDE_B", "DE_A", "DE_B"}


def test_names_units_and_an_upper_row(tmp_path: Path) -> None:
    record = read_table(tmp_path, "x,left,right\ntime,A,B\ns,um,mil\n0,1,2\n0.1,1,2\n0.2,1,2\n")
    assert record["A"].attrs["long_name"] == "left"
    np.testing.assert_allclose(record["B"].values, 2 * 25.4e-6)


_LABVIEW = (
    "Date\t2026/03/11\nTime\t09:00:00.0000000\n***End_of_Header***\t\n\t\nChannels\t2\t\t\nDate\t{0}2026/03/11\t\n"
    "Time\t{0}09:00:00.0000000\t\nY_Unit_Label\tum\t{1}V\t\n***End_of_Header***\t\t\t\n"
)


def test_rows_of_the_columns_dates_do_not_replace_that_of_the_record(tmp_path: Path) -> None:
    dates = _LABVIEW.format("2026/03/11\t", "").replace("Time\t2026/03/11", "Time\t09:00:00.0000000")
    record = read_table(tmp_path, f"{dates}X_Value\tA\tB\tComment\n0.0\t1.5\t-2\n0.001\t2.5\t-3\n")
    assert record.attrs["drop_time"] == "2026-03-11T09:00:00"
    assert "drop_time_unread" not in record.attrs


def test_each_channel_of_labview_may_have_a_time_of_its_own(tmp_path: Path) -> None:
    record = read_table(
        tmp_path,
        _LABVIEW.format("", "\t") + "X_Value\tA\tX_Value\tB\tComment\n0.0\t1.5\t5.0\t-2\n0.001\t2.5\t5.1\t-3\n",
    )
    assert {name: array.attrs["units"] for name, array in record.items()} == {"A": "m", "B": "V"}
    np.testing.assert_allclose(record[record["A"].dims[0]].values, [0, 0.001])
    np.testing.assert_allclose(record[record["B"].dims[0]].values, [5, 5.1])


@pytest.mark.parametrize("clock", ["Zeit  1 - Schnelle Messrate", "Time  1 - default sample rate"])
def test_names_and_units_of_catman_stand_above_all_that_it_tells_of_a_channel(clock: str, tmp_path: Path) -> None:
    above = ["HBM catman", "", "Datum: 10.03.2026 15:00:00", "", "Kanal 1 bis 3", ""]
    told = [[clock, "NDE_A", "speed"], ["s", "µm", "U/min"], ["", "", ""], ["10.03.2026 15:00:00"] * 3,
            ["0,05 ms (20000 Hz)"] * 3, ["MX440B"] * 3, *([f"{k}: -"] * 3 for k in range(23))]  # fmt: skip
    rows = [["0,00000", "1,5", "5798,4"], ["0,00005", "2,5", "5797,2"]]
    record = read_table(tmp_path, "\n".join([*above, *("\t".join(row) + "\t" for row in told + rows)]).encode("cp1252"))
    assert set(record.data_vars) == {"NDE_A", "speed"}
    np.testing.assert_allclose(record["NDE_A"].values, [1.5e-6, 2.5e-6])
    np.testing.assert_allclose(record["speed"].values, [96.64, 96.62])
    np.testing.assert_allclose(record["time"].values, [0, 5e-5])
    assert record.attrs["drop_time"] == "2026-03-10T15:00:00"


@pytest.mark.parametrize("unit", ["Upm", "U/min", "1/min", "min-1", "Umdr./min"])
def test_turns_a_minute_in_german(unit: str, tmp_path: Path) -> None:
    record = read_table(tmp_path, f"Zeit [s];Drehzahl [{unit}]\n0,0;5.798,4\n0,1;5.797,2\n")
    np.testing.assert_allclose(record["Drehzahl"].values, [96.64, 96.62])
