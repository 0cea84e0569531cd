"""Drops in which one magnetic bearing goes on holding: its end did not fall, touched nothing, and accuses no probe."""

from __future__ import annotations

import numpy as np
import pytest
from tdbsim.errors import InputError

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.contract import analysis_json
from tdbmon.analysis.summary import summary_lines
from tdbmon.history.matching import doubts
from tdbmon.identify.drop import measured_drop
from tdbmon.record.assign import assign
from tdbmon.record.direction_checks import motions_of
from tdbmon.record.held_end import falls_at, held_ends
from tdbmon.record.quality import check, left_out
from tdbmon.record.read import read
from tdbmon.report.sections.summary import section
from tdbmon.shipped import shipped
from tests.held_drop import GAP, RELEASE_S, held_drop

OTHER = {"NDE": "DE", "DE": "NDE"}


@pytest.fixture(scope="module", params=["NDE", "DE"])
def held(request, machine, rotor):
    """The end that is held, its record, and the greatest excursion there and at the other end."""
    record, path = held_drop(machine, rotor, request.param)
    start = path[: int(RELEASE_S * 10_000)].mean(axis=0)
    reach = dict(zip(machine.ends, np.abs(path - start).max(axis=0), strict=True))
    assert reach[request.param] < 0.5 * GAP < GAP < reach[OTHER[request.param]]
    return request.param, record, reach


@pytest.fixture(scope="module")
def found(held, machine):
    return analyse(held[1], machine)


def test_the_end_that_is_held_did_not_fall_and_the_other_one_did(held, found):
    end, _, reach = held
    (row,) = [check for check in found.checks if check.check == "held" and not check.passed]
    assert row.channel == end and "stayed levitated (did not fall)" in row.detail
    told = float(row.detail.partition("it moves at most ")[2].split()[0])
    assert told == pytest.approx(reach[end] * 1e6, abs=1.5)  # probes' noise carried to the bearing plane
    ends = analysis_json(found)["ends"]
    assert ends[end]["fell"] is False and ends[OTHER[end]]["fell"] is True
    assert ends[end]["contacts"] is None and "stayed levitated" in ends[end]["contacts_why"]
    assert found.ends[end].gap is None and found.ends[end].contacts is None
    assert found.ends[OTHER[end]].contacts.count.value >= 1


def test_no_probe_is_accused(held, found):
    """Nor in the archive: the end that fell stays a reference for later drops."""
    assert [check.check for check in found.checks if not check.passed] == ["held"]
    names = [each["check"] for each in analysis_json(found)["quality"] if not each["passed"]]
    assert names == ["held"] and not doubts(f"{name} {held[0]}" for name in names)


def test_the_release_is_that_of_an_end_let_go_alone(found):
    """It falls with the missing force, which is not its weight."""
    assert found.release.time.low <= RELEASE_S <= found.release.time.high
    assert found.release.time.value == pytest.approx(RELEASE_S, abs=1e-4)


def test_words_and_report_tell_it(held, found):
    end = held[0]
    lines = summary_lines(found)
    at = next(i for i, line in enumerate(lines) if line.startswith(f"{end}  ("))
    assert any("stayed levitated (did not fall)" in line for line in lines[at : at + 4])
    assert not any("--forces" in line for line in lines)
    assert f"End {end} stayed levitated (did not fall)" in section(found).blocks[0].text


@pytest.fixture(scope="module")
def turning(held, machine):
    """The record with probes of the held end that move by some micrometres, as dead ones do: by once per revolution."""
    end, record, _ = held
    still = record.copy()
    turned = 2 * np.pi * 120.0 * record.time.values
    for probe in machine.probes_at(end):
        noise = np.random.default_rng(2).normal(0, 0.25e-6, turned.size)
        still[probe.name] = record[probe.name].copy(data=0.6e-6 * np.cos(turned - probe.angle) + noise)
    return still


@pytest.fixture(scope="module")
def drop(machine):
    return assign(read(shipped("short/drop_100.nc")), machine).load()


def test_a_quite_still_end_whose_probes_see_it_turn_has_no_dead_probes(held, turning, machine):
    end, record, _ = held
    still = turning.copy()
    failed = [check for check in analyse(still, machine).checks if not check.passed]
    assert not [check for check in failed if check.check in ("dead", "unit")]
    assert ("held", end) in [(check.check, check.channel) for check in failed]
    for probe in machine.probes_at(end):
        noise = np.random.default_rng(3).normal(0, 0.6e-6, record.time.size)
        still[probe.name] = record[probe.name].copy(data=noise)  # now really dead
    dead = [check.channel for check in analyse(still, machine).checks if check.check == "dead" and not check.passed]
    assert dead == [probe.name for probe in machine.probes_at(end)]


def test_a_sample_that_is_missing_at_the_start_of_the_other_end_kills_no_probe(held, turning, machine):
    record = turning.copy(deep=True)
    for probe in machine.probes_at(OTHER[held[0]]):
        record[probe.name][10] = np.nan
    checks = check(record, machine)
    assert not left_out(record, machine, checks)
    assert not [each for each in checks if not each.passed and each.check in ("dead", "unit")]


def test_an_end_without_values_falls_at_no_time(machine):
    time = np.arange(100) * 1e-3
    assert falls_at({"NDE": (time, np.full(100, np.nan + 0j))}, machine) is None


@pytest.mark.parametrize("scale", [1 / 25.4, 0.2, 0.35, 1.0])
def test_an_end_that_falls_on_a_small_scale_is_not_held(scale, drop, machine):
    small = drop.copy()
    for probe in machine.probes_at("DE"):
        small[probe.name] = drop[probe.name] * scale
    assert held_ends(motions_of(small, machine), machine) == {}
    failed = {check.check for check in analyse(small, machine).checks if not check.passed and check.channel[:2] == "DE"}
    assert "held" not in failed
    assert scale == 1.0 or failed & {"unit", "free fall"}  # which name the scale


@pytest.mark.parametrize("after_ms", [4.0, 5.0, 6.3])
def test_a_record_that_ends_in_the_fall_says_so_and_sends_to_no_fit(drop, machine, after_ms):
    """The shaft falls through 250 um in 7 ms."""
    found = analyse(drop.sel(time=slice(0, RELEASE_S + after_ms * 1e-3)), machine)
    for end in found.ends.values():
        assert "while the shaft is still falling" in end.unsettled and "lifts off" not in end.unsettled
    assert not found.forces_tell_contacts


@pytest.mark.parametrize(("after_ms", "told"), [(20.0, False), (30.0, True)])
def test_the_fit_is_named_where_it_can_be_made(drop, machine, after_ms, told):
    cut = drop.sel(time=slice(0, RELEASE_S + after_ms * 1e-3))
    assert analyse(cut, machine).forces_tell_contacts == told
    if told:
        measured_drop(cut, machine)
    else:
        with pytest.raises(InputError, match="before the first contacts are over"):
            measured_drop(cut, machine)
