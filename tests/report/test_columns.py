"""How wide the columns of a table are on paper."""

from __future__ import annotations

import pytest

from tdbmon.report.columns import BESIDE, PAGE, breakable, column_widths
from tdbmon.report.document import Row, Table

_NAMES = (
    "Generatorturbine_Wasserkraftwerk_Unterstrom_Block_2_Maschine_4",
    "Compressor 31-K-1201 second stage, Hauptwelle Nord (rebuilt 2019)",
)


def _fleet(names: tuple[str, ...]) -> Table:
    header = ("Machine", "Verdict", "By the drop", "Drops", "Latest", "Changed")
    drop = "record_of_drop_from_full_speed_no_07.nc (2024-05-11 09:00:00 UTC, 99 Hz)"
    changed = "Rebound after the first contact, DE; Air gap (fitted), NDE …"
    return Table("t", header, tuple(Row((name, "changed", drop, "12", "this one", changed)) for name in names))


def test_a_table_that_fits_is_left_as_it_is() -> None:
    assert column_widths(Table("t", ("a", "b"), (Row(("1.25 mm", "yes")),))) is None


def test_long_names_fill_the_page_and_short_cells_stay_whole() -> None:
    widths = column_widths(_fleet(_NAMES))
    assert widths is not None
    assert sum(widths) == pytest.approx(PAGE)
    for cell, width in (("changed", widths[1]), ("12", widths[3]), ("this one", widths[4]), ("Drops", widths[3])):
        assert breakable(cell, width) == cell
    assert max(widths[0], widths[2], widths[5]) < 2.5 * min(widths[0], widths[2], widths[5])


def test_short_words_stay_whole_beside_wide_columns() -> None:
    header = ("Drop", "Record", "Time", "Speed", "Verdict", "Changed", "Not compared")
    changed = (
        "Fall, release to first touch, NDE; First contact, duration, DE; Rebound after the first contact, DE; 2 more"
    )
    row = ("1e9d536f2c65", "drop_10.nc", "2024-05-11 09:00:00 UTC", "74.55 Hz", "changed", changed, "14 at NDE")
    widths = column_widths(Table("t", header, (Row(row),)))
    assert widths is not None
    assert [breakable(cell, width) for cell, width in zip(row, widths, strict=True)] == list(row)


def test_a_word_longer_than_its_column_ends_lines_after_its_marks() -> None:
    widths = column_widths(_fleet(_NAMES))
    assert widths is not None
    lines = breakable(_NAMES[0], widths[0]).split("\u200b")
    assert "".join(lines) == _NAMES[0]
    assert "Unterstrom_" in lines  # which has a line to itself, and is not torn


def test_a_name_without_marks_may_break_anywhere() -> None:
    broken = breakable("x" * 80, PAGE / 8)
    assert broken.count("\u200b") == 79
    assert breakable("x", BESIDE + 1) == "\u200b".join("x")


def test_letters_that_the_fonts_lack_are_reckoned_too() -> None:
    assert column_widths(Table("t", ("四",), (Row(("四 " * 400,)),))) == [pytest.approx(PAGE)]
