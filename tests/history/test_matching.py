"""Which drops of before a drop is compared with, and what is told of clocks, versions and names."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest
from tdbsim.errors import InputError

from tdbmon.estimate import Estimate
from tdbmon.history import catalogue, matching
from tdbmon.history.catalogue import Entry
from tdbmon.history.command import list_drops
from tdbmon.history.compare import compare
from tdbmon.history.feature import Feature
from tdbmon.history.fleet import fleet
from tdbmon.history.matching import clock_remarks, odd_clocks
from tdbmon.history.unfiled import as_drop, drop_to_compare
from tdbmon.progress import silent
from tdbmon.record.read import read, write
from tests.history.conftest import YEARS
from tests.history.made import add, files, filing, fill, judged


def test_only_matching_drops_count(empty, tmp_path):
    before = [add(empty, tmp_path, i, dropped=f"2020-01-{i + 1:02d}", speed=99.0 + i) for i in range(5)]
    add(empty, tmp_path, 10, dropped="2020-01-06", speed=60.0)
    add(empty, tmp_path, 11, dropped="2020-01-06", speed=100.0, assembly="after the overhaul")
    add(empty, tmp_path, 12, dropped="2020-01-07", speed=100.0, name="another machine")
    later = add(empty, tmp_path, 13, dropped="2020-03-01", speed=101.0)
    drop = add(empty, tmp_path, 14, dropped="2020-02-01", speed=100.0)
    comparison, verdict = judged(empty, drop)
    assert [entry.id for entry in comparison.matched] == before
    assert verdict.word == "as before"
    assert later not in [entry.id for entry in comparison.matched]
    assert comparison.life.full_drops == 7  # of all speeds, this assembly, up to this drop


def test_drops_of_one_day_come_in_the_order_of_their_filing(empty, tmp_path):
    """Times that state the day alone are the same for all of them."""
    for i in range(7):
        raw, machine = files(tmp_path, i)
        made = filing(raw, machine, seed=i, dropped="2026-03-11T00:00:00")
        empty.add(replace(made, filed=f"2026-03-12T08:0{i}:00+00:00"), raw, machine)
    entries = empty.entries()
    for place, entry in enumerate(entries):
        found, _ = judged(empty, entry.id)
        assert found.matched == tuple(entries[:place])
        assert found.life.full_drops == place + 1
    assert found.likeness.compared


def test_drops_whose_probes_did_not_see_the_machine_are_not_compared_with(empty, tmp_path):
    other = ("free fall DE", "machine and record NDE")  # of the fall's acceleration, and of the machine file's weights
    before = [add(empty, tmp_path, i, dropped=f"2020-01-{i + 1:02d}", failed_checks=other) for i in range(6)]
    wrong = ("fall NDE", "whirl NDE", "dead DE_B")
    add(empty, tmp_path, 20, dropped="2020-01-20", values={("gap_um", "NDE"): 3.0}, failed_checks=wrong)
    sound = add(empty, tmp_path, 21, dropped="2020-02-01")
    comparison, verdict = judged(empty, sound)
    assert [entry.id for entry in comparison.matched] == before
    assert verdict.word == "as before"
    assert any("not used for comparison" in reason and "fall NDE, whirl NDE)" in reason for reason in verdict.reasons)
    for i, each in enumerate((wrong, ("probe scales DE",), ("cabling NDE_A, DE_A",))):
        doubted = add(empty, tmp_path, 22 + i, dropped=f"2020-02-{i + 2:02d}", failed_checks=each)
        verdict = judged(empty, doubted)[1]
        assert verdict.word == "inspect"
        assert "the differences may come from the probes" in verdict.reasons[0]


def test_clocks_that_go_backwards_or_ahead_are_told(empty, tmp_path):
    for i in range(3):
        add(empty, tmp_path, i, dropped=f"2020-01-{i + 1:02d}T00:00:00Z")
    raw, machine = files(tmp_path, 9)
    back = replace(filing(raw, machine, seed=9, dropped="2001-01-01T00:00:00Z"), filed="2026-02-01T00:00:00+00:00")
    empty.add(back, raw, machine)
    ahead = add(empty, tmp_path, 10, dropped="2033-01-01T00:00:00Z")
    timeless = add(empty, tmp_path, 11)
    entries = {entry.id: entry for entry in empty.entries()}
    said = {drop: clock_remarks(entry, list(entries.values())) for drop, entry in entries.items()}
    assert "the recorder's clock was set back" in said[back.drop][0]
    assert "is after its filing" in said[ahead][0]
    assert "states no readable time" in said[timeless][0]
    assert sum(bool(remarks) for remarks in said.values()) == 3
    assert odd_clocks(list(entries.values())) == {back.drop, ahead}
    _, verdict = judged(empty, back.drop)
    assert any("was set back" in reason for reason in verdict.reasons)


def test_a_drop_without_a_time_is_never_the_latest_of_its_machine(empty, tmp_path):
    """An old drop whose date was not understood became the latest, and the machine was judged by it."""
    dated = [add(empty, tmp_path, i, dropped=f"2020-01-{i + 1:02d}") for i in range(6)]
    old = [add(empty, tmp_path, 10 + i, values={("gap_um", "DE"): 4.0}) for i in range(2)]
    assert [entry.id for entry in empty.entries()] == [*sorted(old), *dated]  # filed in one second: by identifier
    assert drop_to_compare(empty, "", None, False, silent).entry.id == dated[-1]
    (member,) = fleet(empty)
    assert member.latest.comparison.entry.id == dated[-1]
    assert any(
        "2 drops of the machine without a time count as earlier" in each for each in member.latest.comparison.remarks
    )
    assert (member.undated, member.latest.comparison.entry.dropped) == (2, "2020-01-06")
    found, _ = judged(empty, old[0])
    assert any("counts as earlier than all drops with a time" in each for each in found.remarks)


def test_a_record_without_a_time_that_is_not_filed_is_compared_with_all_that_are(empty, tmp_path):
    for i in range(4):
        add(empty, tmp_path, i, dropped=f"2020-01-{i + 1:02d}")
    raw, machine = files(tmp_path, 20)
    found = compare(empty, as_drop(filing(raw, machine, seed=20)))
    assert len(found.matched) == 4
    assert any("counts as dropped now" in each for each in found.remarks)


def made_entry(number: int, moment: float, filed: float, stated: bool) -> Entry:
    when = datetime.fromtimestamp(moment, UTC).isoformat() if stated else ""
    first = datetime.fromtimestamp(filed, UTC).isoformat()
    return Entry(
        f"{number:012d}", "", "", "", "made up", "", when, moment if stated else filed, first, None, True, (), number
    )


def test_the_clocks_of_a_list_are_those_that_each_drop_is_told_of():
    """By one pass over all drops: each against all others took minutes where an archive holds ten thousand."""
    day = 86400.0
    for seed in range(50):
        rng = np.random.default_rng(seed)
        drawn = zip(
            rng.integers(0, 12, 20) * day, rng.integers(0, 12, 20) * 0.7 * day, rng.random(20) < 0.8, strict=True
        )
        entries = [made_entry(number, *map(float, two), bool(stated)) for number, (*two, stated) in enumerate(drawn)]
        entries.sort(key=lambda entry: entry.order)
        told = {entry.id for entry in entries if entry.dropped and clock_remarks(entry, entries)}
        assert 0 < len(told) < 20
        assert odd_clocks(entries) == told


def test_listing_twice_the_drops_reads_twice_the_times(monkeypatch, empty, tmp_path, capsys):
    """It read the times of every pair of drops."""
    read = []
    monkeypatch.setattr(matching, "seconds", lambda time: read.append(time) or catalogue.seconds(time))

    def times_read() -> int:
        read.clear()
        list_drops(empty.folder, "", None)
        return len(read)

    fill(empty, tmp_path, 12, few=True)
    half = times_read()
    for i in range(12):
        add(empty, tmp_path, 20 + i, dropped=f"2021-01-{i + 1:02d}", few=True)
    assert times_read() < 2.2 * half


def test_a_word_for_the_assembly_that_is_left_out_after_an_overhaul_is_told(empty, tmp_path):
    """Such a drop compares with those before the overhaul, whose assembly has no word either."""
    fill(empty, tmp_path, 6)
    add(empty, tmp_path, 10, dropped="2020-02-01", assembly="rebuilt")
    _, verdict = judged(empty, add(empty, tmp_path, 11, dropped="2020-02-02"))
    assert any(
        "no assembly is stated for this drop, but 'rebuilt' for drops before it" in each for each in verdict.reasons
    )
    for drop in (empty.entries()[5].id, empty.entries()[6].id):
        assert not any("no assembly is stated" in each for each in judged(empty, drop)[1].reasons)


def test_a_folder_filed_at_once_in_any_order_says_nothing_of_a_clock(empty, tmp_path):
    for i in (2, 0, 1):
        raw, machine = files(tmp_path, i)
        made = filing(raw, machine, seed=i, dropped=f"2020-01-{i + 1:02d}T00:00:00Z")
        empty.add(replace(made, filed=f"2026-01-01T0{3 - i}:00:00+00:00"), raw, machine)
    entries = empty.entries()
    assert [clock_remarks(entry, entries) for entry in entries] == [[], [], []]


def test_results_of_another_version_among_the_drops_before_are_told(empty, tmp_path):
    for i in range(4):
        add(empty, tmp_path, i, dropped=f"2020-01-{i + 1:02d}", version="0.1.0" if i else "0.0.9")
    drop = add(empty, tmp_path, 9, dropped="2020-02-01")
    _, verdict = judged(empty, drop)
    assert any("1 of the matching drops were analysed with another version" in reason for reason in verdict.reasons)


def test_a_record_of_a_drop_that_is_filed_is_not_compared_with_itself(years, tmp_path):
    """With a channel missing its numbers differ, so that it is no mere copy; its time tells."""
    write(read(YEARS / "drop_05.nc").drop_vars("DE_B"), tmp_path / "again.nc")
    with pytest.raises(
        InputError, match=r"again.nc: states the same time \(2019-05-11 09:00:00 UTC\), machine and speed as"
    ):
        drop_to_compare(years, str(tmp_path / "again.nc"), None, False, silent)


def test_a_drop_of_unknown_speed_is_told_why_nothing_matches(empty, tmp_path):
    fill(empty, tmp_path, 6)
    raw, machine = files(tmp_path, 50)
    made = filing(raw, machine, seed=50, dropped="2021-01-01")
    why = "no levitated stretch before the release"
    unknown = Feature("initial_hz", "", Estimate.missing("Hz", why))
    empty.add(replace(made, features=(unknown, *made.features[1:])), raw, machine)
    comparison, verdict = judged(empty, made.drop)
    assert comparison.matched == ()
    # the cure was a speed signal that may be sound: the start of the record may be missing
    assert any(f"not known ({why}), so it is compared with none of the 6 drops before" in reason for reason in verdict.reasons)
    assert not any("with a speed" in reason for reason in judged(empty, empty.entries()[-2].id)[1].reasons)


def test_drops_from_standstill_match_whatever_the_noise_of_their_speed(empty, tmp_path):
    for i, speed in enumerate((0.0, 0.012, 0.31, 0.05)):
        add(empty, tmp_path, i, dropped=f"2020-01-{i + 1:02d}", speed=speed)
    add(empty, tmp_path, 10, dropped="2020-02-01", speed=2.0)
    last = add(empty, tmp_path, 11, dropped="2020-03-01", speed=0.02)
    assert len(judged(empty, last)[0].matched) == 4
