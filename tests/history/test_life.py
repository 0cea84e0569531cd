"""Agreed drops counted down, and the damage that drops of differing severity add up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tdbsim.machine import load_machine

from tdbmon.estimate import Estimate
from tdbmon.history.compare import compare, filed_drop
from tdbmon.history.feature import Feature
from tdbmon.history.filing import result_name, satisfying_names
from tdbmon.history.standing import Judged
from tdbmon.history.study import study_record
from tdbmon.history.summary import comparison_lines
from tdbmon.history.unfiled import as_drop
from tdbmon.history.verdict import verdict_of
from tdbmon.record.read import read
from tdbmon.shipped import shipped
from tests.history.made import add, files, filing, judged, newer


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
        assert not any("not compared" in line for line in comparison_lines(Judged(comparison)))
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
        assert any("settings for machine 'Made up'" in reason for reason in verdict.reasons) == told
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
        told = f"in 1 of {i + 1} drops balls came above 4200 MPa: they may be indented, and the sum is not valid there"
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
    assert "one cycle per drop" in life.damage.method
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
