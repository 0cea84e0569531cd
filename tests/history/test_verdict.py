"""What is said of a drop: as before, changed, to inspect or too few drops; and what is told first and beside it."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from tdbsim.machine import load_machine

from tdbmon.analysis.stiffness import single_mass_stiffness
from tdbmon.estimate import Estimate
from tdbmon.history.archive import open_archive
from tdbmon.history.compare import compare
from tdbmon.history.contract import comparison_json
from tdbmon.history.machine_history import machine_history
from tdbmon.history.standing import Judged
from tdbmon.history.study import study_record
from tdbmon.history.unfiled import as_drop
from tdbmon.history.verdict import verdict_of
from tdbmon.record.read import read
from tests.analysis.test_stiffness import passing
from tests.history.conftest import YEARS
from tests.history.made import add, files, filing, fill, judged


@pytest.mark.parametrize("count", [0, 1, 2])
def test_with_too_few_drops_there_is_no_verdict_whatever_the_difference(empty, tmp_path, count):
    fill(empty, tmp_path, count)
    drop = add(empty, tmp_path, 50, dropped="2021-01-01", values={("gap_um", "NDE"): 100.0})
    comparison, verdict = judged(empty, drop)
    assert verdict.word == "too few drops"
    assert not verdict.alarm
    assert comparison.flagged == ()
    gap = next(c for c in comparison.changes if c.key == ("gap_um", "NDE"))
    assert (gap.difference is None) == (count == 0)
    assert (gap.p_adjusted is None) == (count < 2)


def test_a_gross_change_is_flagged_with_its_size_and_only_it(empty, tmp_path):
    fill(empty, tmp_path, 8)
    drop = add(empty, tmp_path, 50, dropped="2021-01-01", values={("gap_um", "NDE"): 1.15})
    comparison, verdict = judged(empty, drop)
    assert verdict.word == "changed"
    assert [c.key for c in comparison.flagged] == [("gap_um", "NDE")]
    (gap,) = comparison.flagged
    assert gap.difference.low < 0.15 * 250e-6 < gap.difference.high
    assert any("Radius at rest, NDE" in reason and "wear" in reason for reason in verdict.reasons)


def test_a_stiffness_that_rises_is_flagged(empty, tmp_path):
    """The single-mass value is a guess within -60 and 5 %, but so it is of every drop: no rise was ever flagged."""

    def with_stiffness(made, seed, factor=1.0):
        half = 3e-3 * (1 + 0.005 * np.random.default_rng(seed).standard_normal()) / np.sqrt(factor)
        known = single_mass_stiffness(passing(half), 45.0).apart
        features = [replace(f, estimate=known) if f.name == "stiffness_n_per_m" else f for f in made.features]
        return replace(made, features=tuple(features))

    for seed in range(10):
        raw, machine = files(tmp_path, seed)
        made = filing(raw, machine, seed=seed, dropped=f"2020-01-{seed + 1:02d}")
        empty.add(with_stiffness(made, seed, 1.3 if seed == 9 else 1.0), raw, machine)
    found, verdict = judged(empty, empty.entries()[-1].id)
    assert {c.kind.name for c in found.flagged} == {"stiffness_n_per_m"}
    assert verdict.word == "changed"


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
    change = next(c for c in found.flagged if c.key == ("gap_um", "DE"))
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
    assert [c.key for c in comparison.noted] == [("levitated_1x_um", "NDE")]
    (said,) = [reason for reason in verdict.reasons if reason.startswith("beside the verdict")]
    assert "Once per revolution in levitation, NDE" in said
    assert "unbalance" in said
    (row,) = [f for f in comparison_json(Judged(comparison))["features"] if f["noted"]]
    assert row["name"] == "levitated_1x_um"
    assert not row["flag"]
    assert row["p_adjusted"] < 0.05
    assert row["detectable"] < row["difference"]["value"]


def test_what_is_not_judged_is_seldom_told_of_drops_like_those_before(empty, tmp_path):
    fill(empty, tmp_path, 24)
    ids = [entry.id for entry in empty.entries()][5:]
    assert sum(bool(judged(empty, drop)[0].noted) for drop in ids) <= 3  # 5 % of 19, and chance


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
        "damping of bearing and support; or the other end, NDE, whose impact adds or removes energy"
    )
    (said,) = [reason for reason in verdict.reasons if reason.startswith("Single-mass")]
    assert "the other end" not in said


def test_a_probe_is_among_the_causes_of_what_a_probe_moves(empty, tmp_path):
    """A gain of NDE that was off moved the centre at DE too, by the line through all probes; a late channel reads as a gain."""
    fill(empty, tmp_path, 8)
    values = {("gap_centre_x_um", "DE"): 1.3, ("probe_ratio", "DE"): 1.3}
    _, verdict = judged(empty, add(empty, tmp_path, 50, dropped="2021-01-01", values=values))
    (said,) = [reason for reason in verdict.reasons if reason.startswith("Clearance centre x, DE")]
    assert "moved sideways, sensitivity of a probe; or a probe of the other end, NDE, since the centre" in said
    (said,) = [reason for reason in verdict.reasons if "Free fall by one probe over the other's" in reason]
    assert said.endswith("sensitivity or angle of a probe, or a channel that is late")


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
    values = {f.key: 1.5 for f in filing(raw, machine).features if f.name not in apart}
    values = {key: 1.5 for key in values if not key[0].startswith(("levitated", "initial"))}
    drop = add(empty, tmp_path, 50, dropped="2021-01-01", values=values)
    _, verdict = judged(empty, drop)
    assert any("drop of this machine" in reason for reason in verdict.reasons)


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
    assert "shows only" in blind.reasons[0]
    assert "2 checks: dead NDE_A, dead DE_B: check the probes" in blind.reasons[0]
    held = without(0.8, ("held DE",)).reasons[0]  # sound probes see it
    assert "the magnetic bearing held DE" in held
    assert "check the probes" not in held and "no check" not in held
    sound = without(0.8, ()).reasons[0]  # the arc is too short, say: no fault of the probes
    assert "no check of its record failed; the reason for most missing quantities: a probe is dead" in sound
    assert "check the probes" not in sound


def test_an_end_that_is_not_seen_is_not_as_before(years, tmp_path):
    """Of a lost end the rotor and the other end still tell more than half of what the drops before told."""
    record = read(YEARS / "drop_07.nc").drop_vars(["DE_A", "DE_B"])
    record.attrs |= {"drop_time": "2021-06-11T09:00:00Z", "sha256": "7" * 64}
    machine = load_machine(YEARS / "machine.toml")
    drop = as_drop(study_record(record, machine, "0" * 64))
    verdict = verdict_of(compare(years, drop))
    assert verdict.word == "inspect"
    assert "does not show DE, but 7 drops before do: missing are radius at rest, fall" in verdict.reasons[0]
    assert "present DE_A, present DE_B: check the probes" in verdict.reasons[0]


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
    assert f"; not judged: {comparison.tested - 2} more, for which fewer than 3 of these" in verdict.reasons[0]
    for i in range(7):
        raw, machine = files(tmp_path, i)
        made = filing(raw, machine, seed=i, dropped=f"2020-01-{i + 1:02d}")
        empty.add(replace(made, features=made.features if i >= 4 else made.features[:1]), raw, machine)
    verdict = judged(empty, empty.entries()[-1].id)[1]
    assert verdict.word == "too few drops"
    assert "no quantity is known for this drop and for 3 drops before" in verdict.reasons[0]


@pytest.mark.parametrize(
    ("name", "end", "told"), [("restitution", "DE", True), ("settled_s", "DE", True), ("gap_um", "DE", False)]
)
def test_a_form_that_comes_now_and_then_is_a_change_the_first_time_only(empty, tmp_path, name, end, told):
    """On a sound machine of many drops it was one each time; what tells wear never comes back, and is always one."""
    form = 20.0 if name == "settled_s" else 1.15
    forms = dict.fromkeys((6, 14, 20), form)
    found = [
        judged(empty, add(empty, tmp_path, i, dropped=f"{1990 + i}-01-01", values={(name, end): forms.get(i, 1.0)}))
        for i in range(21)
    ]
    assert found[6][1].word == "changed"
    comparison, verdict = found[20]
    assert verdict.word == ("as before" if told else "changed")
    (change,) = (c for c in comparison.changes if c.key == (name, end))
    assert change.p_adjusted < 0.05
    assert change.flag == (not told)
    names = [comparison.record(drop) for drop in change.as_in]
    assert names == (["drop_6.nc", "drop_14.nc"] if told else [])
    said = [reason for reason in verdict.reasons if "as in drop_6.nc, drop_14.nc, after which it came back" in reason]
    assert len(said) == told
    assert all(each.startswith(f"beside the verdict: {change.title}: ") for each in said)


def test_a_form_that_stays_is_a_change_though_it_came_before(empty, tmp_path):
    """The third drop in a row is one, and any where fewer than three came back since the first."""
    levels = [1.0] * 7 + [1.15, 1.0, 1.0, 1.15, *[1.0] * 3, *[1.15] * 4]
    found = []
    for i, level in enumerate(levels):
        drop = add(empty, tmp_path, i, dropped=f"{1990 + i}-01-01", values={("restitution", "DE"): level})
        found.append(judged(empty, drop))
    words = [verdict.word for _, verdict in found]
    assert words[7:] == ["changed", *["as before"] * 2, "changed", *["as before"] * 5, *["changed"] * 2]
    assert [bool(comparison.repeated) for comparison, _ in found[14:]] == [True, True, False, False]
