"""The JSON has the same keys whatever a record lacks, and every value that is missing says why."""

from __future__ import annotations

import pytest

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.contract import analysis_json
from tdbmon.record.read import read
from tdbmon.shipped import shipped

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


@pytest.mark.parametrize("which", LACKING)
def test_what_is_lacking_is_null_with_the_reason(which, machine):
    record = read(shipped("short/drop_100.nc"))
    whole = analysis_json(analyse(record, machine))
    less = record.drop_vars([machine.channel_in_file(name) for name in LACKING[which]])
    if which == "no release":
        less = less.isel(time=slice(2300, None))
    content = analysis_json(analyse(less, machine))
    parts = ("release_time_s", "release", "speed", "ends", "indicators")
    assert keys({p: content[p] for p in parts}) == keys({p: whole[p] for p in parts})
    missing = [(at, q) for at, q in quantities(content) if q["value"] is None]
    assert len(missing) > len([q for _, q in quantities(whole) if q["value"] is None])
    assert all(q["why"] for _, q in missing)
