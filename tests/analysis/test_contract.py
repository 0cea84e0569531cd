"""The JSON has the same keys whatever a record lacks, and every value that is missing says why."""

from __future__ import annotations

import pytest

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.contract import analysis_json
from tdbmon.history.extract import features_of
from tdbmon.record.read import read
from tdbmon.shipped import shipped
from tests.json_page import documented
from tests.shipped_drops import analysed, recorded

LACKING = {
    "no displacement": ["NDE_A", "NDE_B", "DE_A", "DE_B"],
    "no speed": ["speed", "keyphasor"],
    "one end": ["DE_A", "DE_B"],
    "one probe": ["NDE_B"],
    "no release": [],
}


def keys(content, at=""):
    """Paths of all keys down to the quantities; lists, and what only the whole record has events for, are not entered."""
    if not isinstance(content, dict) or "value" in content:
        return {at}
    return set().union(*(keys(value, f"{at}/{name}") for name, value in content.items())) if content else {at}


def quantities(content, at=""):
    if isinstance(content, dict) and "value" in content:
        yield at, content
    elif isinstance(content, dict | list):
        items = content.items() if isinstance(content, dict) else enumerate(content)
        for name, value in items:
            yield from quantities(value, f"{at}/{name}")


def test_the_page_of_the_json_has_its_keys():
    assert set(analysis_json(analysed("short/drop_100"))) == documented("analyse")


@pytest.mark.parametrize("which", LACKING)
def test_what_is_lacking_is_null_with_the_reason(which, machine):
    whole = analysis_json(analysed("short/drop_100"))
    less = recorded("short/drop_100").drop_vars([machine.channel_in_file(name) for name in LACKING[which]])
    if which == "no release":
        less = less.isel(time=slice(2300, None))
    content = analysis_json(analyse(less, machine))
    parts = ("release_time_s", "release", "speed", "ends", "indicators")
    assert keys({p: content[p] for p in parts}) == keys({p: whole[p] for p in parts})
    missing = [(at, q) for at, q in quantities(content) if q["value"] is None]
    assert len(missing) > len([q for _, q in quantities(whole) if q["value"] is None])
    assert all(q["why"] for _, q in missing)


@pytest.mark.parametrize("until_s", [0.075, None])
def test_what_has_no_interval_says_why(until_s, machine):
    """Without a drop no circle tells the clearance centre, from which the levitated shaft is measured."""
    record = recorded("short/drop_100").sel(time=slice(None, until_s))
    told = list(quantities(analysis_json(analyse(record, machine))))
    bare = {at: quantity for at, quantity in told if quantity["low"] is None}
    assert [at for at, quantity in bare.items() if not quantity.get("why")] == []
    if until_s is not None:
        assert bare["/levitation/DE/share_of_clearance"]["value"] is not None


def without_30_ms(record):
    lost = (record.time > 0.127) & (record.time < 0.157)
    return record.map(lambda channel: channel.where(~lost) if channel.attrs.get("units") == "m" else channel)


@pytest.mark.parametrize(
    ("shown", "why"),
    [
        (lambda record: record, None),
        (without_30_ms, "more contacts may be hidden there"),
        (lambda record: record.sel(time=slice(0.115, None)), "the record begins"),
    ],
)
def test_the_number_of_contacts_is_told_only_where_none_can_have_been_missed(shown, why, machine):
    """The JSON tells what the archive has filed: 9 of the whole record, of which 5 and 8 were told of its parts."""
    analysis = analyse(shown(read(shipped("short/drop_060.nc"))), machine)
    filed = {f.end: f.estimate for f in features_of(analysis) if f.name == "contacts"}
    for name, end in analysis_json(analysis)["ends"].items():
        told = tuple(end[key] for key in ("contacts", "contacts_low", "contacts_high"))
        assert told == (filed[name].value, filed[name].low, filed[name].high)
        if why is None:
            assert end["contacts"] == 9 and end["contacts_why"] is None
        else:
            assert end["contacts"] is None and why in end["contacts_why"]


def test_a_record_without_orbits_tells_nothing_of_whirl(machine):
    record = read(shipped("short/drop_100.nc"))
    assert analysis_json(analyse(record, machine))["whirl"]["backward"] is False
    alone = record.drop_vars([machine.channel_in_file(probe.name) for probe in machine.probes])
    assert analysis_json(analyse(alone, machine))["whirl"] == {"backward": None, "full": None, "ends": {}}
