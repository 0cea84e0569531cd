"""A drop against those before: the hidden wear is found, the drops before it raise nothing, few drops are said to be few."""

from __future__ import annotations

import re
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest
from tdbsim.errors import InputError
from tdbsim.machine import load_machine

from tdbmon.estimate import Estimate
from tdbmon.figures.differences import differences
from tdbmon.history import catalogue, matching
from tdbmon.history.archive import open_archive
from tdbmon.history.catalogue import Entry
from tdbmon.history.command import list_drops
from tdbmon.history.compare import compare, filed_drop
from tdbmon.history.contract import comparison_json
from tdbmon.history.feature import KINDS, Feature
from tdbmon.history.filing import result_name, satisfying_names
from tdbmon.history.machine_history import machine_history
from tdbmon.history.matching import clock_remarks, odd_clocks
from tdbmon.history.study import study_record
from tdbmon.history.summary import comparison_lines
from tdbmon.history.unfiled import as_drop, drop_to_compare
from tdbmon.history.verdict import verdict_of
from tdbmon.progress import silent
from tdbmon.record.read import read, write
from tdbmon.report.compare_report import build_compare_report
from tdbmon.report.html import render_html
from tdbmon.shipped import shipped
from tests.history.conftest import YEARS
from tests.history.made import add, files, filing, fill, judged, newer


def test_the_hidden_wear_is_found_and_the_drops_before_it_raise_nothing(years):
    history = machine_history(years, years.machines()[0])
    words = [each.verdict.word for each in history.judged]
    assert words == ["too few drops"] * 5 + ["as before"] * 2 + ["changed"] * 3
    first = history.judged[7].comparison
    fall = next(c for c in first.flagged if c.kind.name == "fall_time_ms" and c.end == "NDE")
    # a fall through 20 um more, h = g t^2 / 2 from about 257 um: the end of a rotor that turns about the other falls
    # faster than g, so that the free fall is the upper limit
    free = np.sqrt(2 / 9.81) * (np.sqrt(277e-6) - np.sqrt(257e-6))
    assert 0 < fall.difference.low < free * 1.1
    assert fall.difference.value < free * 1.1 + (fall.difference.high - fall.difference.value)


def test_every_feature_is_declared_and_has_its_unit(years):
    with catalogue.reading(years.catalogue) as base:
        found = catalogue.features(base, [entry.result for entry in years.entries()])
    for features in found.values():
        assert {f.name for f in features} == set(KINDS)
        for feature in features:
            assert feature.estimate.unit == KINDS[feature.name].unit
            assert feature.estimate.known or feature.estimate.why
            assert not KINDS[feature.name].forces or "--forces" in feature.estimate.why


def test_the_json_is_that_of_the_contract(years):
    comparison, verdict = judged(years, years.entries()[7].id)
    content = comparison_json(comparison, verdict)
    assert set(content) >= {"verdict", "reasons", "drop", "matched", "matching", "features", "stress", "life"}
    assert len(content["matched"]) == 7
    assert content["matching"]["speed_hz"] == pytest.approx(74.1, abs=0.1)
    for feature in content["features"]:
        assert set(feature) >= {"name", "end", "value", "before", "difference", "p_adjusted", "flag", "trend_per_drop"}
        assert set(feature["before"]) >= {"n", "median", "low", "high"}
        for quantity in (feature["value"], feature["difference"], feature["trend_per_drop"]):
            assert set(quantity) >= {"value", "low", "high", "unit", "method"}
            assert quantity["value"] is not None or quantity["why"]
    gap = next(f for f in content["features"] if (f["name"], f["end"]) == ("gap_um", "NDE"))
    assert 240 < gap["value"]["value"] < 300  # micrometres, as the name says
    assert content["life"]["full_drops"] == 8
    assert content["life"]["agreed"] is None
    assert "agreed_drops" in content["life"]["margin"]["why"]


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
    assert any("not compared with" in reason and "fall NDE, whirl NDE)" in reason for reason in verdict.reasons)
    for i, each in enumerate((wrong, ("probe scales DE",), ("cabling NDE_A, DE_A",))):
        doubted = add(empty, tmp_path, 22 + i, dropped=f"2020-02-{i + 2:02d}", failed_checks=each)
        verdict = judged(empty, doubted)[1]
        assert verdict.word == "inspect"
        assert "what differs may be theirs" in verdict.reasons[0]


@pytest.mark.parametrize("count", [0, 1, 2])
def test_with_too_few_drops_there_is_no_verdict_whatever_the_difference(empty, tmp_path, count):
    fill(empty, tmp_path, count)
    drop = add(empty, tmp_path, 50, dropped="2021-01-01", values={("gap_um", "NDE"): 100.0})
    comparison, verdict = judged(empty, drop)
    assert verdict.word == "too few drops"
    assert not verdict.alarm
    assert comparison.flagged == ()
    gap = next(c for c in comparison.changes if (c.kind.name, c.end) == ("gap_um", "NDE"))
    assert (gap.difference is None) == (count == 0)
    assert (gap.p_adjusted is None) == (count < 2)


def test_a_gross_change_is_flagged_with_its_size_and_only_it(empty, tmp_path):
    fill(empty, tmp_path, 8)
    drop = add(empty, tmp_path, 50, dropped="2021-01-01", values={("gap_um", "NDE"): 1.15})
    comparison, verdict = judged(empty, drop)
    assert verdict.word == "changed"
    assert [(c.kind.name, c.end) for c in comparison.flagged] == [("gap_um", "NDE")]
    (gap,) = comparison.flagged
    assert gap.difference.low < 0.15 * 250e-6 < gap.difference.high
    assert any("Radius at rest, NDE" in reason and "wear" in reason for reason in verdict.reasons)


def test_the_least_probable_change_is_told_first(years, empty, tmp_path):
    """Of the second worn drop the fall and the rebound tell the wear, and the stiffness the least."""
    _, verdict = judged(years, years.entries()[8].id)
    told = [reason for reason in verdict.reasons if "(p = " in reason]
    p = [float(reason.partition("(p = ")[2].partition(",")[0]) for reason in told]
    assert len(p) > 2 and p == sorted(p)
    (stiffness,) = [reason for reason in told if reason.startswith("Single-mass stiffness")]
    assert "a worn or opened gap" in stiffness
    fill(empty, tmp_path, 6)
    values = {("levitated_x_um", "NDE"): 1.3, ("levitated_1x_um", "NDE"): 6.0}
    found, _ = judged(empty, add(empty, tmp_path, 7, dropped="2020-02-01", values=values))
    assert [change.kind.name for change in found.noted] == ["levitated_1x_um", "levitated_x_um"]


def test_a_change_that_is_not_new_is_told_with_the_drop_where_it_began(empty, tmp_path):
    fill(empty, tmp_path, 6)
    for i in (6, 7, 8):
        add(empty, tmp_path, i, dropped=f"2021-01-0{i}", values={("gap_um", "DE"): 1.15})
    found, verdict = judged(empty, empty.entries()[-1].id)
    change = next(c for c in found.flagged if (c.kind.name, c.end) == ("gap_um", "DE"))
    first = empty.entries()[6]
    assert change.since == first.id
    assert change.left_out == (first.id, empty.entries()[7].id)
    assert f"the 6 matching drops before {first.raw_name}, where the change began" in verdict.reasons[0]
    new, verdict = judged(empty, first.id)
    assert next(c for c in new.flagged if c.kind.name == "gap_um").since == ""
    assert "the 6 matching drops before (p =" in verdict.reasons[0]


def test_what_is_not_judged_is_told_beside_the_verdict_where_it_differs(empty, tmp_path):
    """Six times the unbalance in levitation was a line of the table without a mark, under "as before"."""
    fill(empty, tmp_path, 8)
    drop = add(empty, tmp_path, 50, dropped="2021-01-01", values={("levitated_1x_um", "NDE"): 6.0})
    comparison, verdict = judged(empty, drop)
    assert verdict.word == "as before"
    assert not verdict.alarm
    assert comparison.flagged == ()
    assert [(c.kind.name, c.end) for c in comparison.noted] == [("levitated_1x_um", "NDE")]
    (said,) = [reason for reason in verdict.reasons if reason.startswith("beside the verdict")]
    assert "Once per revolution in levitation, NDE" in said
    assert "unbalance" in said
    (row,) = [f for f in comparison_json(comparison, verdict)["features"] if f["noted"]]
    assert row["name"] == "levitated_1x_um"
    assert not row["flag"]
    assert row["p_adjusted"] < 0.05
    assert row["detectable"] < row["difference"]["value"]


def test_what_is_not_judged_is_seldom_told_of_drops_like_those_before(empty, tmp_path):
    fill(empty, tmp_path, 24)
    ids = [entry.id for entry in empty.entries()][5:]
    assert sum(bool(judged(empty, drop)[0].noted) for drop in ids) <= 3  # 5 % of 19, and chance


def test_probabilities_of_what_is_judged_do_not_depend_on_what_is_not(empty, tmp_path):
    fill(empty, tmp_path, 8)
    raw, machine = files(tmp_path, 50)
    made = filing(raw, machine, dropped="2021-01-01", seed=50)
    without = replace(made, features=tuple(f for f in made.features if KINDS[f.name].judged or f.name == "initial_hz"))
    found = []
    for each in (made, without):
        empty.add(each, raw, machine)
        changes = judged(empty, made.drop)[0].changes
        found.append({(c.kind.name, c.end): c.p_adjusted for c in changes if c.kind.judged})
        empty.remove(made.drop)
    assert found[0] == found[1]


def test_the_trend_counts_the_drops_that_lack_the_quantity(empty, tmp_path):
    """A probe dead in every second drop does not double the slope a drop, in a comparison and in the report of the machine."""
    for i in range(16):
        values = {("fall_time_ms", "NDE"): 1 + 0.01 * i}
        drop = add(
            empty, tmp_path, i, dropped=f"2020-01-{i + 1:02d}", **({"few": True} if i % 2 else {"values": values})
        )
    comparison, _ = judged(empty, drop)
    change = next(c for c in comparison.changes if (c.kind.name, c.end) == ("fall_time_ms", "NDE"))
    assert not change.estimate.known
    assert change.trend.slope.value == pytest.approx(0.01 * 7e-3)
    courses = {(course.name, course.end): course for course in machine_history(empty, "made up").courses}
    assert courses["fall_time_ms", "NDE"].slope.value == pytest.approx(0.01 * 7e-3)


def test_a_drop_that_was_off_the_other_way_is_no_beginning(empty, tmp_path):
    fill(empty, tmp_path, 6)
    add(empty, tmp_path, 6, dropped="2021-01-06", values={("gap_um", "DE"): 0.85})
    add(empty, tmp_path, 7, dropped="2021-01-07", values={("gap_um", "DE"): 1.15})
    found, verdict = judged(empty, empty.entries()[-1].id)
    change = next(c for c in found.flagged if c.kind.name == "gap_um")
    assert change.left_out and change.since == ""
    assert "6 of the 7 matching drops before (p =" in verdict.reasons[0]


def test_a_change_of_the_rebound_may_come_from_the_other_end(years, empty, tmp_path):
    """Above a restitution of one it comes first: the shipped years flag DE alone in the end, and the wear is at NDE."""
    _, verdict = judged(years, years.entries()[-1].id)
    for name in ("Rebound", "Restitution"):
        (said,) = [reason for reason in verdict.reasons if reason.startswith(name)]
        assert "may come from: the other end, NDE: the restitution here is 1.41" in said
    fill(empty, tmp_path, 8)
    values = {("rebound_um", "DE"): 1.3, ("restitution", "DE"): 0.6, ("stiffness_n_per_m", "NDE"): 1.3}
    _, verdict = judged(empty, add(empty, tmp_path, 50, dropped="2021-01-01", values=values))
    (said,) = [reason for reason in verdict.reasons if reason.startswith("Rebound")]
    assert said.endswith(
        "damping of bearing and support; or the other end, NDE, whose impact feeds it or takes from it"
    )
    (said,) = [reason for reason in verdict.reasons if reason.startswith("Single-mass")]
    assert "the other end" not in said


def test_growth_of_the_gap_beyond_the_limit_asks_for_an_inspection(empty, tmp_path):
    fill(empty, tmp_path, 8)
    drop = add(empty, tmp_path, 50, dropped="2021-01-01", values={("gap_um", "NDE"): 1.25})
    _, verdict = judged(empty, drop)
    assert verdict.word == "inspect"
    assert re.search(r"grown by 2[45]\.\d %, more than 20 %", verdict.reasons[0])


def test_stress_and_whirl_beyond_their_limits_ask_for_an_inspection_even_of_the_first_drop(empty, tmp_path):
    values = {("stress_max_mpa", "DE"): 2.15, ("whirl_backward_s", "NDE"): 0.3}
    drop = add(empty, tmp_path, 1, values=values)
    _, verdict = judged(empty, drop)
    assert verdict.word == "inspect"
    assert sum("4300 MPa" in reason for reason in verdict.reasons) == 1
    assert sum("backward whirl" in reason for reason in verdict.reasons) == 1


def test_so_many_differences_at_once_may_be_another_machine(empty, tmp_path):
    """Told too where what tells machines apart is as before: then probes or assembly may be others."""
    apart = ("gap_um", "gap_centre_x_um", "gap_centre_y_um", "stiffness_n_per_m", "decay_time_s", "keyphasor_ratio")
    fill(empty, tmp_path, 8)
    raw, machine = files(tmp_path, 50)
    values = {(f.name, f.end): 1.5 for f in filing(raw, machine).features if f.name not in apart}
    values = {key: 1.5 for key in values if not key[0].startswith(("levitated", "initial"))}
    drop = add(empty, tmp_path, 50, dropped="2021-01-01", values=values)
    _, verdict = judged(empty, drop)
    assert any("drop of this machine" in reason for reason in verdict.reasons)


def test_the_agreed_number_is_counted_down(empty, tmp_path):
    (empty.folder / "archive.toml").write_text('format = 1\n[life]\nagreed_drops = 4\nfull_speed = "100 Hz"\n')
    for i in range(3):
        add(empty, tmp_path, i, dropped=f"2020-01-{i + 1:02d}")
    add(empty, tmp_path, 10, dropped="2020-01-10", speed=50.0)
    fourth = add(empty, tmp_path, 11, dropped="2020-01-11")
    third, verdict = judged(empty, empty.entries()[2].id)
    assert (third.life.full_drops, third.life.margin.value) == (3, 1.0)
    assert verdict.word != "inspect"
    last, verdict = judged(empty, fourth)
    assert (last.life.full_drops, last.life.partial_drops, last.life.margin.value) == (4, 1, 0.0)
    assert verdict.word == "inspect"
    assert "4 full drops of 4 agreed" in verdict.reasons[0]


def test_a_record_without_a_drop_uses_up_no_agreed_drop(empty, tmp_path):
    """Levitation alone, and displacements in mm that are stated as um; told before the drops, after them and without any."""
    machine, record = load_machine(shipped("short/machine.toml")), read(shipped("short/drop_100.nc"))
    probes = {probe.name: record[probe.name] / 1000 for probe in machine.probes}
    for made in (record.isel(time=slice(0, 1900)), record.assign(probes)):
        drop = as_drop(study_record(made, machine, "0" * 64, dropped="2020-01-20"))
        assert drop.entry.failed_checks == ("drop",)
        comparison = compare(empty, drop)
        verdict = verdict_of(comparison)
        assert (comparison.life.full_drops, verdict.word, verdict.alarm) == (0, "no drop", True)
        assert verdict.reasons[0].startswith("no drop in this record")
        assert "no probe moves by more than" in verdict.reasons[0]
        assert not any("not compared" in line for line in comparison_lines(comparison, verdict))
    (empty.folder / "archive.toml").write_text("format = 1\n[life]\nagreed_drops = 3\n")
    add(empty, tmp_path, 0, dropped="2020-01-01", stress=2e9)
    for i in range(1, 4):
        add(empty, tmp_path, i, dropped=f"2020-01-{i + 1:02d}", failed_checks=("drop",))
    second = add(empty, tmp_path, 4, dropped="2020-01-05", stress=2e9)
    comparison, verdict = judged(empty, second)
    assert [entry.id for entry in comparison.matched] == [empty.entries()[0].id]
    assert (comparison.life.full_drops, comparison.life.margin.value) == (2, 1.0)
    assert comparison.life.damage.value == pytest.approx(2.0)
    assert verdict.word == "too few drops"
    assert any("nor counted" in remark and "drop_3.nc (drop)" in remark for remark in verdict.reasons)


def test_settings_of_a_name_that_no_drop_bears_are_told(empty, tmp_path):
    """The number agreed for it would never be counted down."""
    drop = add(empty, tmp_path, 0, dropped="2020-01-01")
    for name, told in (("Made up", True), ("made up", False)):
        (empty.folder / "archive.toml").write_text(f'format = 1\n[machine."{name}".life]\nagreed_drops = 4\n')
        comparison, verdict = judged(empty, drop)
        assert any("settings for a machine 'Made up'" in reason for reason in verdict.reasons) == told
        assert comparison.life.agreed == (None if told else 4)


def test_damage_counts_a_harder_drop_as_many(empty, tmp_path):
    (empty.folder / "archive.toml").write_text("format = 1\n[life]\nagreed_drops = 10\n")
    add(empty, tmp_path, 0, dropped="2020-01-01", stress=2e9)
    add(empty, tmp_path, 1, dropped="2020-01-02", stress=2e9)
    drop = add(empty, tmp_path, 2, dropped="2020-01-03", stress=2e9 * 2 ** (1 / 3))  # eight times a drop like the first
    life = compare(empty, filed_drop(empty, drop)).life
    assert life.damage.value == pytest.approx(10.0)
    assert life.damage.low < 10 < life.damage.high
    assert life.margin.value == pytest.approx(0.0)
    assert life.margin.high > 0 > life.margin.low


def test_damage_says_where_the_sum_does_not_hold(empty, tmp_path):
    for i, stress in enumerate((4.1e9, 4.3e9, 4.1e9)):
        drop = add(empty, tmp_path, i, dropped=f"2020-01-{i + 1:02d}", stress=stress)
        damage = compare(empty, filed_drop(empty, drop)).life.damage
        assert damage.value is not None
        told = f"in 1 of {i + 1} drops balls came above 4200 MPa: they may be indented, and there the sum does not hold"
        assert damage.why == (told if i else "")


def test_damage_adds_up_the_cycles_of_each_drop(empty, tmp_path):
    """The same greatest stress, but twice and five times the cycles of the first drop."""
    (empty.folder / "archive.toml").write_text("format = 1\n[life]\nagreed_drops = 10\n")
    add(empty, tmp_path, 0, dropped="2020-01-01", stress=2e9, fatigue=3.0)
    add(empty, tmp_path, 1, dropped="2020-01-02", stress=2e9, fatigue=6.0)
    drop = add(empty, tmp_path, 2, dropped="2020-01-03", stress=2e9, fatigue=15.0)
    life = compare(empty, filed_drop(empty, drop)).life
    assert life.damage.value == pytest.approx(8.0)
    assert "rainflow" in life.damage.method
    assert life.margin.value == pytest.approx(2.0)
    assert 1 < life.damage.low < 8 < life.damage.high
    assert life.margin.low == pytest.approx(10 - life.damage.high)
    assert life.margin.high == pytest.approx(10 - life.damage.low)


def test_the_damage_of_a_less_certain_drop_is_less_certain(empty, tmp_path):
    widths = []
    for k, (word, stated) in enumerate((("sure", 0.01), ("unsure", 0.5))):
        for i in range(2):
            raw, machine = files(tmp_path, 10 * k + i)
            one = filing(raw, machine, seed=10 * k + i, dropped=f"2020-01-0{i + 1}", assembly=word, stress=2e9)
            known = [f for f in one.features if f.name != "fatigue_cycles"]
            doubt = 1 + stated
            cycles = [Feature("fatigue_cycles", end, Estimate(5.0, 5.0 / doubt, 5.0 * doubt)) for end in ("NDE", "DE")]
            empty.add(replace(one, features=(*known, *cycles)), raw, machine)
        damage = compare(empty, filed_drop(empty, one.drop)).life.damage
        assert damage.value == pytest.approx(2.0)
        widths.append(damage.high - damage.low)
    assert widths[1] > 1.1 * widths[0]


def test_one_cycle_a_drop_is_as_certain_as_the_stress(empty, tmp_path):
    """Known to 1 %, the ninth power of a stress is known to 9 %, and so is the first drop's."""
    add(empty, tmp_path, 0, dropped="2020-01-01", stress=2e9, fatigue=0.0)
    drop = add(empty, tmp_path, 1, dropped="2020-01-02", stress=2e9, fatigue=0.0)
    damage = compare(empty, filed_drop(empty, drop)).life.damage
    assert np.log((damage.high - 1) / (damage.low - 1)) / (2 * 1.96) == pytest.approx(9 * 0.01 * np.sqrt(2), rel=0.01)


def test_drops_filed_before_cycles_were_counted_keep_the_old_measure_until_they_are_added_again(empty, tmp_path):
    """An archive of an older version: nothing is lost, nothing mixed, and the drop's own measure comes with its new result."""
    old = add(empty, tmp_path, 0, dropped="2020-01-01", stress=2e9, fatigue=0.0)
    drop = add(empty, tmp_path, 1, dropped="2020-01-02", stress=2e9, fatigue=50.0)
    life = compare(empty, filed_drop(empty, drop)).life
    assert life.damage.value == pytest.approx(2.0)  # two drops of one stress
    assert "one cycle a drop" in life.damage.method
    assert "1 of 2 drops" in life.damage.why
    raw, machine = files(tmp_path, 0)
    again = filing(raw, machine, seed=0, dropped="2020-01-01", stress=2e9, fatigue=10.0)
    assert empty.add(newer(again, "0.1.1"), raw, machine) == "analysed again"
    assert len(list((empty.folder / "results" / old).glob("*.nc"))) == 2
    life = compare(empty, filed_drop(empty, drop)).life
    assert life.damage.value == pytest.approx(6.0)
    assert life.damage.why == ""


def test_results_with_forces_of_before_are_made_again_and_count_as_results_without():
    wanted = satisfying_names("0.1.0", "ab" * 32, forces=True)
    assert "0.1.0-abababab-forces.nc" not in wanted
    assert "0.1.0-abababab-forces.nc" in satisfying_names("0.1.0", "ab" * 32, forces=False)
    assert wanted == (result_name("0.1.0", "ab" * 32, True),)


def test_without_forces_the_damage_is_not_guessed(empty, tmp_path):
    add(empty, tmp_path, 0, dropped="2020-01-01", stress=2e9)
    drop = add(empty, tmp_path, 1, dropped="2020-01-02")
    assert "1 of 2 drops were filed without forces" in compare(empty, filed_drop(empty, drop)).life.damage.why


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
    assert "the recorder's clock went back" in said[back.drop][0]
    assert "lies after its filing" in said[ahead][0]
    assert "states no time" in said[timeless][0]
    assert sum(bool(remarks) for remarks in said.values()) == 3
    assert odd_clocks(list(entries.values())) == {back.drop, ahead}
    _, verdict = judged(empty, back.drop)
    assert any("went back" in reason for reason in verdict.reasons)


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
        "no assembly is stated of this drop, and 'rebuilt' of drops before it" in each for each in verdict.reasons
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


def test_the_shipped_answer_is_what_the_archive_hides():
    import json

    answer = json.loads((YEARS / "answer.json").read_text())
    assert (answer["worn_from_drop"], answer["end"]) == (8, "NDE")


def test_a_drop_that_tells_little_of_what_those_before_told_is_not_as_before(years):
    seventh = machine_history(years, years.machines()[0]).judged[6]
    assert seventh.verdict.word == "as before"
    found = seventh.comparison
    sick = ("dead NDE_A", "dead DE_B")

    def without(share: float, failed_checks: tuple[str, ...] = sick):
        entry = replace(found.entry, failed_checks=failed_checks)
        lost = [
            replace(change, estimate=Estimate.missing(change.kind.unit, "a probe is dead"), differs=False)
            if k < share * len(found.changes)
            else change
            for k, change in enumerate(found.changes)
        ]
        return verdict_of(replace(found, entry=entry, changes=tuple(lost)))

    assert without(0.2).word == "as before"
    blind = without(0.8)
    assert blind.word == "inspect"
    assert blind.alarm
    assert "tells only" in blind.reasons[0]
    assert "2 checks: dead NDE_A, dead DE_B: see to the probes" in blind.reasons[0]
    sound = without(0.8, ()).reasons[0]  # the arc is too short, say: no fault of the probes
    assert "no check of its record failed, most is missing since a probe is dead" in sound
    assert "see to" not in sound


def test_an_end_that_is_not_seen_is_not_as_before(years, tmp_path):
    """Of a lost end the rotor and the other end still tell more than half of what the drops before told."""
    record = read(YEARS / "drop_07.nc").drop_vars(["DE_A", "DE_B"])
    record.attrs |= {"drop_time": "2021-06-11T09:00:00Z", "sha256": "7" * 64}
    machine = load_machine(YEARS / "machine.toml")
    drop = as_drop(study_record(record, machine, "0" * 64))
    verdict = verdict_of(compare(years, drop))
    assert verdict.word == "inspect"
    assert "this drop tells none of the 14 quantities that earlier drops tell of DE" in verdict.reasons[0]
    assert "present DE_A, present DE_B: see to the probes" in verdict.reasons[0]


def test_the_json_counts_the_drops_that_are_compared_with(years):
    """Number and range of those before are of the same drops as their centre: what was off itself is listed apart."""
    comparison, verdict = judged(years, years.entries()[9].id)
    features = comparison_json(comparison, verdict)["features"]
    rebound = next(f for f in features if (f["name"], f["end"]) == ("rebound_um", "DE"))
    assert len(rebound["left_out"]) == 2
    assert rebound["before"]["n"] == 7
    assert rebound["before"]["high"] < 400 < rebound["value"]["value"]  # the worn drops before reach 437
    assert rebound["before"]["low"] <= rebound["before"]["median"] <= rebound["before"]["high"]


def test_a_record_of_a_drop_that_is_filed_is_not_compared_with_itself(years, tmp_path):
    """With a channel missing its numbers differ, so that it is no mere copy; its time tells."""
    write(read(YEARS / "drop_05.nc").drop_vars("DE_B"), tmp_path / "again.nc")
    with pytest.raises(
        InputError, match=r"again.nc: states the same time \(2019-05-11 09:00:00 UTC\), machine and speed as"
    ):
        drop_to_compare(years, str(tmp_path / "again.nc"), None, False, silent)


@pytest.mark.parametrize(("last", "word"), [(0.0, "as before"), (0.5, "changed")])
def test_a_quantity_that_was_nought_in_every_drop_is_compared(empty, tmp_path, last, word):
    """Its least scatter is a share of nothing."""
    for i in range(6):
        add(empty, tmp_path, i, dropped=f"2020-01-{i + 1:02d}", values={("friction", "NDE"): 0.0})
    drop = add(empty, tmp_path, 50, dropped="2021-01-01", values={("friction", "NDE"): last})
    comparison, verdict = judged(empty, drop)
    assert verdict.word == word
    assert [c.kind.name for c in comparison.flagged] == ["friction"] * (last > 0)
    drawn = [label.get_text() for label in differences(comparison).axes[0].get_yticklabels()]
    assert any("Friction of journal on ring (fitted), NDE" in text for text in drawn) == (last > 0)


def test_stated_shares_keep_their_digits(empty, tmp_path):
    """Rounded to whole per cent a significance of 0.4 % is "0 %", and a limit of 12.5 % another one."""
    (empty.folder / "archive.toml").write_text(
        "format = 1\n[matching]\nspeed = '2.5 %'\n[compare]\nsignificance = 0.004\n[inspect]\ngap_growth = '12.5 %'\n"
    )
    fill(empty, tmp_path, 8)
    comparison, verdict = judged(empty, empty.entries()[-1].id)
    assert "(all together 0.4 %)" in verdict.reasons[0]
    assert "100 Hz ± 2.5 %" in comparison_lines(comparison, verdict)[1]
    pages = render_html(build_compare_report(comparison, verdict))
    assert "at most 2.5 % off" in pages
    assert "at most 0.4 %" in pages
    drop = add(empty, tmp_path, 50, dropped="2021-01-01", values={("gap_um", "NDE"): 1.135})
    assert re.search(r"grown by 1[23]\.\d %, more than 12\.5 %", judged(empty, drop)[1].reasons[0])


def test_what_fewer_than_three_drops_have_is_not_as_before(empty, tmp_path):
    """Six drops match and none of their quantities can stand out, since but two of them have any."""

    def whole_from(number, folder, **changes):
        archive = open_archive(tmp_path / folder, create=True)
        for i in range(7):
            raw, machine = files(tmp_path, i)
            made = filing(raw, machine, seed=i, dropped=f"2020-01-{i + 1:02d}", **(changes if i == 6 else {}))
            kept = made.features if i >= number else made.features[:3]  # speed, and the radius at rest
            archive.add(replace(made, features=kept), raw, machine)
        return judged(archive, archive.entries()[-1].id)

    comparison, verdict = whole_from(4, "a", values={("rebound_um", "NDE"): 3.0})
    assert len(comparison.matched) == 6
    assert verdict.word == "as before"
    assert verdict.reasons[0].startswith("none of 2 quantities differs from the 6 matching drops before")
    assert f"; nothing is told by {comparison.tested - 2} more, of which fewer than 3 of these" in verdict.reasons[0]
    for i in range(7):
        raw, machine = files(tmp_path, i)
        made = filing(raw, machine, seed=i, dropped=f"2020-01-{i + 1:02d}")
        empty.add(replace(made, features=made.features if i >= 4 else made.features[:1]), raw, machine)
    verdict = judged(empty, empty.entries()[-1].id)[1]
    assert verdict.word == "too few drops"
    assert "no quantity is known of this drop and of 3 drops before" in verdict.reasons[0]


def test_a_drop_of_unknown_speed_is_told_why_nothing_matches(empty, tmp_path):
    fill(empty, tmp_path, 6)
    raw, machine = files(tmp_path, 50)
    made = filing(raw, machine, seed=50, dropped="2021-01-01")
    empty.add(replace(made, features=made.features[1:]), raw, machine)
    comparison, verdict = judged(empty, made.drop)
    assert comparison.matched == ()
    assert any("none of the 6 drops before with a speed is compared" in reason for reason in verdict.reasons)
    assert not any("with a speed" in reason for reason in judged(empty, empty.entries()[-2].id)[1].reasons)


def test_drops_from_standstill_match_whatever_the_noise_of_their_speed(empty, tmp_path):
    for i, speed in enumerate((0.0, 0.012, 0.31, 0.05)):
        add(empty, tmp_path, i, dropped=f"2020-01-{i + 1:02d}", speed=speed)
    add(empty, tmp_path, 10, dropped="2020-02-01", speed=2.0)
    last = add(empty, tmp_path, 11, dropped="2020-03-01", speed=0.02)
    assert len(judged(empty, last)[0].matched) == 4
