"""A drop against those before: the hidden wear is found, each quantity has its difference, its probability and its trend."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from tdbmon.figures.differences import differences
from tdbmon.history import catalogue
from tdbmon.history.contract import comparison_json
from tdbmon.history.feature import KINDS
from tdbmon.history.machine_history import machine_history
from tdbmon.history.standing import Judged, judge
from tdbmon.history.summary import comparison_lines
from tdbmon.report.compare_report import build_compare_report
from tdbmon.report.html import render_html
from tests.history.conftest import YEARS
from tests.history.made import ENDS, add, files, filing, fill, judged
from tests.json_page import documented


def test_the_hidden_wear_is_found_and_the_drops_before_it_raise_nothing(years):
    history = machine_history(years, years.machines()[0])
    words = [each.verdict.word for each in history.judged]
    assert words == ["too few drops"] * 5 + ["as before"] * 2 + ["changed"] * 3
    flagged = [
        c for each in history.judged[7:] for c in each.comparison.flagged
    ]  # in the first its touch is less sure than before
    fall = next(c for c in flagged if c.kind.name == "fall_time_ms" and c.end == "NDE")
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
    content = comparison_json(judge(years, years.entries()[7].id))
    assert set(content) == documented("compare")
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


def test_probabilities_of_what_is_judged_do_not_depend_on_what_is_not(empty, tmp_path):
    fill(empty, tmp_path, 8)
    raw, machine = files(tmp_path, 50)
    made = filing(raw, machine, dropped="2021-01-01", seed=50)
    without = replace(made, features=tuple(f for f in made.features if KINDS[f.name].judged or f.name == "initial_hz"))
    found = []
    for each in (made, without):
        empty.add(each, raw, machine)
        changes = judged(empty, made.drop)[0].changes
        found.append({c.key: c.p_adjusted for c in changes if c.kind.judged})
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
    change = next(c for c in comparison.changes if c.key == ("fall_time_ms", "NDE"))
    assert not change.estimate.known
    assert change.trend.slope.value == pytest.approx(0.01 * 7e-3)
    courses = {(course.name, course.end): course for course in machine_history(empty, "made up").courses}
    assert courses["fall_time_ms", "NDE"].slope.value == pytest.approx(0.01 * 7e-3)


def test_the_shipped_answer_is_what_the_archive_hides():
    import json

    answer = json.loads((YEARS / "answer.json").read_text())
    assert (answer["worn_from_drop"], answer["end"]) == (8, "NDE")


def test_the_json_counts_the_drops_that_are_compared_with(years):
    """Number and range of those before are of the same drops as their centre: what was off itself is listed apart."""
    features = comparison_json(judge(years, years.entries()[9].id))["features"]
    rebound = next(f for f in features if (f["name"], f["end"]) == ("rebound_um", "DE"))
    assert len(rebound["left_out"]) == 2
    assert rebound["before"]["n"] == 7
    assert rebound["before"]["high"] < 400 < rebound["value"]["value"]  # the worn drops before reach 437
    assert rebound["before"]["low"] <= rebound["before"]["median"] <= rebound["before"]["high"]


@pytest.mark.parametrize(("last", "word"), [(0.0, "as before"), (0.5, "changed")])
def test_a_quantity_that_was_nought_in_every_drop_is_compared(empty, tmp_path, last, word):
    """Its least scatter is a share of nothing."""
    for i in range(6):
        add(empty, tmp_path, i, dropped=f"2020-01-{i + 1:02d}", values={("friction", "NDE"): 0.0})
    drop = add(empty, tmp_path, 50, dropped="2021-01-01", values={("friction", "NDE"): last})
    comparison, verdict = judged(empty, drop)
    assert verdict.word == word
    assert [c.kind.name for c in comparison.flagged] == ["friction"] * (last > 0)
    assert all(change.grown is None for change in comparison.flagged)  # over nought
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
    assert "100 Hz ± 2.5 %" in comparison_lines(Judged(comparison))[1]
    pages = render_html(build_compare_report(Judged(comparison)))
    assert "at most 2.5 % off" in pages
    assert "at most 0.4 %" in pages
    drop = add(empty, tmp_path, 50, dropped="2021-01-01", values={("gap_um", "NDE"): 1.135})
    assert re.search(r"grown by 1[23]\.\d %, more than 12\.5 %", judged(empty, drop)[1].reasons[0])


@pytest.mark.parametrize("correction", ["holm", "fdr_bh"])
def test_what_was_flagged_is_no_measure_for_the_next_drop(empty, tmp_path, correction):
    """Drops were left out by Bonferroni's stricter method: one flagged by the milder one stayed, and hid the next like it."""
    (empty.folder / "archive.toml").write_text(f'format = 1\n[compare]\ncorrection = "{correction}"\n')
    fill(empty, tmp_path, 7)
    kinds = [kind.name for kind in KINDS.values() if kind.judged and not kind.forces and kind.unit in ("um", "ms", "1")]
    sizes = np.linspace(1.02, 1.16, 2 * len(kinds))  # from hardly to clearly beyond chance
    keys = [(name, end) for name in kinds for end in ENDS]
    values = {key: float(size) for key, size in zip(keys, sizes, strict=True)}
    changed = add(empty, tmp_path, 50, dropped="2020-02-01", values=values)
    flagged = {c.key for c in judged(empty, changed)[0].flagged}
    after = judged(empty, add(empty, tmp_path, 51, dropped="2020-02-02"))[0].changes
    left_out = {c.key for c in after if changed in c.left_out}
    assert len(flagged) > 5
    assert flagged <= left_out
