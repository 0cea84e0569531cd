"""An alarm of a machine stands until a matching drop or a stated overhaul clears it."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial

import pytest

from tdbmon.cli import main
from tdbmon.estimate import Estimate
from tdbmon.history.feature import KINDS, NO_FORCES
from tdbmon.history.fleet import fleet
from tdbmon.history.machine_history import machine_history
from tdbmon.history.standing import judge, standing
from tdbmon.report.document import Verdict
from tdbmon.report.fleet_report import build_fleet_report
from tdbmon.report.html import render_html
from tdbmon.report.machine_report import build_machine_report
from tests.history.made import ENDS, files, filing, fill, without

WORN = {("gap_um", "DE"): 1.15}


def add(archive, folder, seed, **changes):
    """File one more drop, on a later day the greater its seed."""
    raw, machine = files(folder, seed)
    archive.add(filing(raw, machine, seed=seed, dropped=f"2021-01-{seed:02d}", **changes), raw, machine)


def alarms(archive):
    """The records of the alarms that stand, with the word."""
    found = standing(archive.entries(), partial(judge, archive))
    return [(each.comparison.entry.raw_name, each.verdict.word) for each in found]


@pytest.fixture
def worn(empty, tmp_path):
    """Six drops that are alike, and one that changed."""
    fill(empty, tmp_path, 6)
    add(empty, tmp_path, 6, values=WORN)
    assert alarms(empty) == [("drop_6.nc", "changed")]
    return empty


def test_a_drop_at_another_speed_does_not_hide_an_alarm(worn, tmp_path):
    add(worn, tmp_path, 7, speed=160.0)
    assert alarms(worn) == [("drop_6.nc", "changed")]
    (member,) = fleet(worn)
    assert member.verdict.word == "changed"
    assert member.latest.verdict.word == "too few drops"
    said = "drop_6.nc (2021-01-06, 100.0 Hz)"
    document = build_fleet_report([member])
    assert "1 of 1 machines needs attention." in render_html(document)
    assert said in render_html(document)
    html = render_html(build_machine_report(machine_history(worn, worn.machines()[0])))
    assert f"The alarm of {said} stands: changed" in html
    assert "The latest drop: too few matching drops for a verdict." in html


def test_a_comparison_fails_on_an_earlier_alarm_that_stands(worn, tmp_path, capsys):
    """The drop at another speed has too few before it; whoever asks whether all is well gets no clean bill."""
    add(worn, tmp_path, 7, speed=160.0)
    told, report = tmp_path / "c.json", tmp_path / "c.html"
    asked = ["compare", "--archive", str(worn.folder), "--fail-on", "alarm"]
    with pytest.raises(SystemExit) as end:
        main([*asked, "--json", str(told), "--report", str(report)])
    assert end.value.code == 3
    alarm = worn.entries()[6]
    content = json.loads(told.read_text())
    assert content["verdict"] == "too few drops"
    assert [(each["drop"], each["verdict"]) for each in content["standing"]] == [(alarm.id, "changed")]
    said = "drop_6.nc (2021-01-06, 100.0 Hz)"
    assert f"an earlier alarm stands: {said}: changed" in capsys.readouterr().out
    assert f"The alarm of {said} stands: changed" in report.read_text()
    for drop, code in ((worn.entries()[5].id, 0), (alarm.id, 3)):  # as it was after that drop
        with pytest.raises(SystemExit) as end:
            main([*asked[:3], drop, *asked[3:]])
        assert end.value.code == code
    add(worn, tmp_path, 8, speed=102.0)
    with pytest.raises(SystemExit) as end:
        main(asked)
    assert end.value.code == 0


def test_a_matching_drop_that_is_as_before_clears_it(worn, tmp_path):
    add(worn, tmp_path, 7, speed=160.0)
    add(worn, tmp_path, 8, speed=102.0)
    assert alarms(worn) == []


def test_a_drop_that_does_not_show_the_end_clears_no_alarm_of_it(worn, tmp_path):
    raw, machine = files(tmp_path, 7)
    made = filing(raw, machine, seed=7, dropped="2021-01-07")
    worn.add(without(made, "DE"), raw, machine)
    assert alarms(worn) == [("drop_7.nc", "inspect"), ("drop_6.nc", "changed")]
    raw, machine = files(tmp_path, 8)
    worn.add(without(filing(raw, machine, seed=8, dropped="2021-01-08"), "NDE"), raw, machine)
    assert alarms(worn) == [("drop_8.nc", "inspect")]  # it shows DE
    add(worn, tmp_path, 9)
    assert alarms(worn) == []


def test_what_changed_must_be_shown_again_to_clear_its_alarm(empty, tmp_path):
    """Radius, fall and deepest excursion stand for each other; the rebound for itself alone."""
    fill(empty, tmp_path, 6)
    add(empty, tmp_path, 6, values={("rebound_um", "DE"): 1.3})
    for seed, lost, stands in ((7, "rebound_um", True), (8, "gap_um", False)):
        raw, machine = files(tmp_path, seed)
        made = filing(raw, machine, seed=seed, dropped=f"2021-01-{seed:02d}")
        kept = tuple(f for f in made.features if f.key != (lost, "DE"))
        empty.add(replace(made, features=kept), raw, machine)
        assert alarms(empty) == ([("drop_6.nc", "changed")] if stands else [])


def test_a_matching_drop_that_is_changed_too_takes_its_place(worn, tmp_path):
    add(worn, tmp_path, 7, values=WORN)
    assert alarms(worn) == [("drop_7.nc", "changed")]


STRANGE = {
    (f"levitated_{name}_um", end): factor
    for end in ENDS
    for name, factor in (("x", 1.5), ("y", 1.5), ("1x", 3.0), ("noise", 3.0))
}


def test_drops_of_another_machine_do_not_pass_for_this_one_by_their_number(empty, tmp_path):
    """The second and the third of them were "as before", and had cleared the alarm of the first."""
    fill(empty, tmp_path, 8)
    for seed in (20, 21, 22):
        add(empty, tmp_path, seed, values=STRANGE)
        assert alarms(empty) == [(f"drop_{seed}.nc", "changed")]
        assert judge(empty, empty.entries()[-1].id).comparison.likeness.strange
    add(empty, tmp_path, 23)
    assert alarms(empty) == []


def test_only_a_drop_that_shows_what_told_another_machine_clears_its_alarm(empty, tmp_path):
    """None of it is judged: no quantity of the verdict tells whose drop it was."""
    fill(empty, tmp_path, 8)
    add(empty, tmp_path, 20, values=STRANGE)
    found = judge(empty, empty.entries()[-1].id)
    assert set(found.verdict.concerns) == set(STRANGE)
    raw, machine = files(tmp_path, 21)
    made = filing(raw, machine, seed=21, dropped="2021-01-21")
    kept = tuple(f for f in made.features if f.name != "levitated_noise_um")
    empty.add(replace(made, features=kept), raw, machine)
    assert judge(empty, made.drop).verdict.word == "as before"
    assert alarms(empty) == [("drop_20.nc", "changed")]
    add(empty, tmp_path, 22)
    assert alarms(empty) == []


def lacking(archive, folder, seed, why, *names, **changes):
    """File one more drop that lacks some quantities, of both ends."""
    raw, machine = files(folder, seed)
    made = filing(raw, machine, seed=seed, dropped=f"2021-01-{seed:02d}", **changes)
    features = [
        replace(f, estimate=Estimate.missing(f.estimate.unit, why)) if f.name in names else f for f in made.features
    ]
    archive.add(replace(made, features=tuple(features)), raw, machine)


def test_a_drop_without_forces_clears_no_alarm_of_a_model_that_follows_no_more(empty, tmp_path):
    fill(empty, tmp_path, 6, stress=2e9)
    lacking(empty, tmp_path, 8, "the fitted model is off by 16 % of the gap", "peak_force_n", stress=2e9)
    lost = [("drop_8.nc", "inspect")]
    assert alarms(empty) == lost
    forces = [kind.name for kind in KINDS.values() if kind.forces]
    for seed in (9, 10):
        lacking(empty, tmp_path, seed, NO_FORCES, *forces)
        assert judge(empty, empty.entries()[-1].id).verdict.word == "as before"
        assert alarms(empty) == lost
    add(empty, tmp_path, 11, stress=2e9)
    assert alarms(empty) == []


def test_a_drop_that_told_little_stands_until_later_ones_tell_what_it_did_not(empty, tmp_path):
    fill(empty, tmp_path, 6)
    kept = ("gap_um", "fall_time_ms", "deepest_um", "whirl_backward_s", "whirl_full_s", "rebound_um", "swing_1_hz")
    judged = [kind.name for kind in KINDS.values() if kind.judged and kind.name not in kept]
    lacking(empty, tmp_path, 8, "the record is short", *judged)
    assert alarms(empty) == [("drop_8.nc", "inspect")]
    assert ("gap_um", "DE") not in judge(empty, empty.entries()[-1].id).verdict.concerns
    lacking(empty, tmp_path, 9, "the record is short", "restitution")
    assert judge(empty, empty.entries()[-1].id).verdict.word == "as before"
    assert alarms(empty) == [("drop_8.nc", "inspect")]
    lacking(empty, tmp_path, 10, "the record is short", "contacts")
    assert alarms(empty) == []  # the two together


def test_a_stated_overhaul_clears_it_and_a_word_left_out_does_not(empty, tmp_path):
    fill(empty, tmp_path, 6, assembly="a")
    add(empty, tmp_path, 6, values=WORN, assembly="a")
    add(empty, tmp_path, 7, speed=160.0)
    assert alarms(empty) == [("drop_6.nc", "changed")]
    add(empty, tmp_path, 8, assembly="b")
    assert alarms(empty) == []
    add(empty, tmp_path, 9)
    assert alarms(empty) == []


def test_too_few_drops_are_no_verdict_and_clear_nothing(empty, tmp_path):
    fill(empty, tmp_path, 3)
    add(empty, tmp_path, 4, values={("gap_um", "DE"): 4.0})
    add(empty, tmp_path, 5)
    assert alarms(empty) == [("drop_4.nc", "inspect")]
    add(empty, tmp_path, 6)
    assert alarms(empty) == []


def test_a_drop_whose_probes_saw_another_thing_clears_nothing_and_is_over_with_the_next(worn, tmp_path):
    add(worn, tmp_path, 7, failed_checks=("fall NDE",))
    assert alarms(worn) == [("drop_7.nc", "inspect"), ("drop_6.nc", "changed")]
    add(worn, tmp_path, 8, speed=160.0)
    assert alarms(worn) == [("drop_6.nc", "changed")]


def test_a_record_without_a_drop_is_told_while_it_is_the_latest_and_hides_no_alarm(worn, tmp_path):
    add(worn, tmp_path, 7, failed_checks=("drop",))
    assert alarms(worn) == [("drop_6.nc", "changed"), ("drop_7.nc", "no drop")]
    (member,) = fleet(worn)
    assert (member.verdict.word, member.latest.verdict.word) == ("changed", "no drop")
    html = render_html(build_machine_report(machine_history(worn, worn.machines()[0])))
    assert "The latest drop: there is no drop in this record." in html
    add(worn, tmp_path, 8, speed=160.0)
    assert alarms(worn) == [("drop_6.nc", "changed")]


def test_a_fleet_of_which_too_little_is_known_is_not_called_well(empty, tmp_path):
    fill(empty, tmp_path / "a", 6, name="steady")
    raw, machine = files(tmp_path / "b", 200)
    empty.add(filing(raw, machine, name="new", seed=200, dropped="2020-01-01"), raw, machine)
    (finding,) = [b for b in build_fleet_report(fleet(empty)).sections[0].blocks if isinstance(b, Verdict)]
    assert finding.text == "None of 2 machines needs attention; 1 has too few matching drops for a verdict."
    assert finding.tone == "plain"
    (steady,) = [m for m in fleet(empty) if m.machine == "steady"]
    (finding,) = [b for b in build_fleet_report([steady]).sections[0].blocks if isinstance(b, Verdict)]
    assert finding == Verdict("None of 1 machines needs attention.", "good")


def exit_code(*arguments):
    """Run a command in this process and return its exit code."""
    with pytest.raises(SystemExit) as end:
        main([str(argument) for argument in arguments])
    return end.value.code


def test_a_fleet_fails_on_the_alarm_of_any_machine(worn, tmp_path, capsys):
    """`compare` looks at the archive's last drop alone, of whatever machine; a fleet had no exit status."""
    for i in range(6):
        add(worn, tmp_path / "b", 20 + i, name="steady")
    told = tmp_path / "f.json"
    assert exit_code("compare", "--archive", worn.folder, "--fail-on", "alarm") == 0
    capsys.readouterr()
    asked = ["archive", "report", "--archive", worn.folder]
    assert exit_code(*asked, "--fail-on", "alarm", "--json", told) == 3
    said = capsys.readouterr().out
    assert said.startswith("made up: changed: drop_6.nc (2021-01-06, 100.0 Hz); 7 drops\n")
    assert "steady: as before: drop_25.nc" in said
    made_up, steady = json.loads(told.read_text())["machines"]
    assert (made_up["machine"], made_up["verdict"], made_up["alarm"]) == ("made up", "changed", True)
    assert made_up["standing"] == [{key: made_up[key] for key in ("drop", "verdict", "reasons")}]
    assert any("DE" in reason for reason in made_up["reasons"])
    assert (steady["verdict"], steady["alarm"], steady["standing"], steady["drops"]) == ("as before", False, [], 6)
    assert exit_code(*asked, "--json", told) == 0
    assert exit_code(*asked, "--machine", "steady", "--fail-on", "alarm", "--json", told) == 0
    assert [each["machine"] for each in json.loads(told.read_text())["machines"]] == ["steady"]


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        (["--fail-on", "anything"], "--fail-on 'anything': is unknown; write --fail-on alarm"),
        (["--drop", "drop_6.nc", "--fail-on", "alarm"], "--drop reports one record"),
        ([], "no --report file is given"),
    ],
)
def test_what_a_fleet_cannot_be_asked_is_told(worn, capsys, asked, says):
    assert exit_code("archive", "report", "--archive", worn.folder, *asked) == 2
    assert says in capsys.readouterr().err
