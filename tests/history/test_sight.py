"""What is seen of an end: "as before" is said of no end that hides its wear, and no alarm is over with a drop that hides it."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from math import ceil, sqrt

import numpy as np
import pytest
from tdbsim.machine import load_machine

from tdbmon.estimate import Estimate
from tdbmon.history.archive import open_archive
from tdbmon.history.compare import compare
from tdbmon.history.contract import comparison_json
from tdbmon.history.feature import KINDS, NO_FORCES
from tdbmon.history.sight import WEAR, sight, sights
from tdbmon.history.standing import Judged, standing_beside
from tdbmon.history.study import study_record
from tdbmon.history.unfiled import as_drop
from tdbmon.record.read import read
from tests.history.conftest import YEARS
from tests.history.made import ENDS, USUAL, add, files, filing, fill, judged, latest, without

PROBES = ("NDE_A", "NDE_B", "DE_A", "DE_B")


def later(archive, number, changed) -> Judged:
    """Judge a shipped drop anew, as one after all ten, with its probes changed."""
    record = read(YEARS / f"drop_{number:02d}.nc").copy(deep=True)
    record.attrs |= {"drop_time": "2024-06-11T09:00:00Z", "sha256": "7" * 64}
    changed(record)
    found = compare(archive, as_drop(study_record(record, load_machine(YEARS / "machine.toml"), "0" * 64)))
    return Judged(found)


def swings(record):
    """Let NDE swing by 60 um to the end: it tells no clearance circle, and that it does not whirl."""
    time = record.time.to_numpy()
    swing = 60e-6 * np.clip((time - 0.25) / 0.05, 0, 1) * np.sin(2 * np.pi * 31 * time)
    for probe in PROBES[:2]:
        record[probe].values[:] += swing


def scaled(factor):
    def change(record):
        for probe in PROBES:
            record[probe].values[:] *= factor

    return change


def turned(record):
    """Mount all probes 30 degrees further on."""
    cos, sin = sqrt(3) / 2, 0.5
    for one, other in (PROBES[:2], PROBES[2:]):
        a, b = record[one].to_numpy().copy(), record[other].to_numpy().copy()
        record[one].values[:], record[other].values[:] = cos * a + sin * b, cos * b - sin * a


def test_an_end_that_shows_its_whirl_alone_is_not_as_before_and_clears_no_alarm_of_it(years):
    """The worn end swung on; all other quantities, and no whirl there, were "as before"."""
    own = later(years, 7, swings)
    known = {c.kind.name for c in own.comparison.changes if c.end == "NDE" and c.kind.judged and c.estimate.known}
    assert known == {"whirl_backward_s", "whirl_full_s"}
    assert own.comparison.flagged == ()
    assert own.verdict.word == "inspect"
    assert "does not show NDE, but 10 drops before do: missing are radius at rest, fall" in own.verdict.reasons[0]
    nde, de = sights(own.comparison)
    assert (nde.lost, nde.enough, de.lost, de.enough) == (True, False, False, True)
    stand = {each.comparison.entry.raw_name for each in standing_beside(years, own)}
    assert stand & {"drop_09.nc", "drop_10.nc"}  # whose falls at NDE were longer
    sound = later(years, 7, scaled(1.0))
    assert sound.verdict.word == "as before"
    assert standing_beside(years, sound) == ()


@pytest.mark.parametrize("changed", [scaled(0.8), turned])
def test_probes_that_all_read_or_stand_otherwise_are_no_wear(years, changed):
    own = later(years, 7, changed)
    assert own.verdict.word == "inspect"
    assert "checks of the record's probes failed" in own.verdict.reasons[0]
    for change in (c for c in own.comparison.flagged if c.kind.name == "gap_um" and c.difference.value < 0):
        (said,) = [each for each in own.verdict.reasons if each.startswith(change.title)]
        assert "sensitivity or angle of the probes" in said and "wear" not in said


def test_a_smaller_radius_is_not_said_to_be_worn(years):
    own = later(years, 7, scaled(0.8))
    assert any(c.kind.name == "gap_um" and c.difference.value < 0 for c in own.comparison.flagged)


@pytest.mark.parametrize("check", ["free fall", "rest at the bottom"])
def test_a_drop_is_no_reference_where_the_fall_or_the_rest_of_both_ends_is_wrong(empty, tmp_path, check):
    fill(empty, tmp_path, 5)
    one = add(empty, tmp_path, 10, dropped="2020-02-01", failed_checks=(f"{check} DE",))
    both = add(empty, tmp_path, 11, dropped="2020-02-02", failed_checks=tuple(f"{check} {end}" for end in ENDS))
    found, verdict = judged(empty, add(empty, tmp_path, 12, dropped="2020-03-01"))
    matched = [entry.id for entry in found.matched]
    assert one in matched and both not in matched
    assert verdict.word == "as before"
    assert judged(empty, one)[1].word == "as before"
    assert judged(empty, both)[1].word == "inspect"


@pytest.mark.parametrize("shown", [0, 3, 4, 5])
def test_drops_that_tell_nothing_of_an_end_do_not_count_for_it(empty, tmp_path, shown):
    for i in range(7):
        raw, machine = files(tmp_path, i)
        made = filing(raw, machine, seed=i, dropped=f"2020-01-{i + 1:02d}")
        empty.add(made if i < shown or i == 6 else without(made, "NDE"), raw, machine)
    found, verdict = judged(empty, empty.entries()[-1].id)
    assert len(found.matched) == 6
    assert verdict.word == ("as before" if shown == 5 else "too few drops")
    assert comparison_json(Judged(found))["ends"]["NDE"]["drops"] == shown
    if shown < 5:
        assert verdict.reasons[0].startswith("NDE: ") and f"at most {shown} drops before" in verdict.reasons[0]
    else:
        assert any(
            each.startswith("NDE: compared with 5 drops before; growth of the radius by") for each in verdict.reasons
        )


def test_growth_that_would_not_have_been_seen_is_not_as_before(years, tmp_path):
    folder = tmp_path / "archive"
    shutil.copytree(years.folder, folder)
    strict = open_archive(folder)
    seventh = strict.entries()[6].id
    seen = {each.end: each.growth for each in sights(judged(strict, seventh)[0])}
    assert all(0.02 < growth < 0.2 for growth in seen.values())
    with (folder / "archive.toml").open("a") as file:
        file.write(f'\n[machine."{strict.machines()[0]}".inspect]\ngap_growth = 0.01\n')
    verdict = judged(strict, seventh)[1]
    assert verdict.word == "too few drops"
    for end, growth in seen.items():
        said = f"{end}: growth of the radius by 1 % would not have been detected, only by {ceil(100 * growth)} % or more"
        assert any(each.startswith(said) for each in verdict.reasons)


def test_growth_that_a_fall_shows_is_that_of_the_height_really_fallen(years):
    """The rotor levitates 39 um above the centre: what 20 um of wear made of the fall was told as 6 % of the radius."""
    answer = json.loads((YEARS / "answer.json").read_text())
    last = latest(years)
    found = {c.kind.name: c for c in last.changes if c.end == answer["end"]}
    fall, radius = found["fall_time_ms"], np.median([e.value for _, e in found["gap_um"].earlier])
    told = sight(last, answer["end"])
    share = last.detectable(fall) / fall.difference.value  # of what the wear made the fall longer by
    assert told.growth * radius == pytest.approx(share * answer["wear_of_the_journal_m"], rel=0.08)
    assert told.seen_from == "7 %"


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kept", [WEAR, ("gap_um",), ("gap_um", "deepest_um"), ("fall_time_ms",)])
def test_growth_is_flagged_from_where_it_is_said_to_be_seen(empty, tmp_path, seed, kept):
    """The radius grows, the fall goes through it, and the deepest excursion reaches as much deeper."""

    def drop(i, values=None):
        raw, machine = files(tmp_path, 10 * seed + i)
        made = filing(raw, machine, seed=10 * seed + i, dropped=f"2020-01-{i + 1:02d}", values=values)
        return (
            replace(made, features=tuple(f for f in made.features if f.name not in WEAR or f.name in kept)),
            raw,
            machine,
        )

    for i in range(6):
        empty.add(*drop(i))
    first = compare(empty, as_drop(drop(6)[0]))
    usual = {c.kind.name: c.difference.before.centre for c in first.changes if c.end == "NDE" and c.kind.name in kept}

    def grown(share):
        radius = usual.get("gap_um", 0.0)
        values = {
            "gap_um": usual.get("gap_um", 0.0) + share * radius,
            "deepest_um": usual.get("deepest_um", 0.0) + share * radius,
            "fall_time_ms": usual.get("fall_time_ms", 0.0) * sqrt(1 + share),
        }
        given = {(name, "NDE"): values[name] / USUAL[KINDS[name].unit] for name in kept}
        return compare(empty, as_drop(drop(6, given)[0]))

    growth = sight(grown(0.0), "NDE").growth
    for share, seen in ((1.1 * growth, True), (0.9 * growth, False)):
        assert any(c.key in {(k, "NDE") for k in kept} for c in grown(share).flagged) == seen


def test_a_fit_that_is_lost_is_a_reason_to_look(empty, tmp_path):
    for i in range(5):
        add(empty, tmp_path, i, dropped=f"2020-01-{i + 1:02d}", stress=2.0e9)
    fits = ((7, NO_FORCES, "as before"), (8, "the fitted model is off by 16 % of the gap", "inspect"))
    for seed, why, word in fits:
        raw, machine = files(tmp_path, seed)
        made = filing(raw, machine, seed=seed, dropped=f"2020-02-{seed:02d}")
        lost = [
            replace(f, estimate=Estimate.missing("N", why)) if f.name == "peak_force_n" else f for f in made.features
        ]
        empty.add(replace(made, features=tuple(lost)), raw, machine)
        verdict = judged(empty, made.drop)[1]
        assert verdict.word == word
    assert "the fitted model gives no forces at " in verdict.reasons[0]
    assert "but did for 5 drops before" in verdict.reasons[0]
    assert "off by 16 % of the gap" in verdict.reasons[0]
