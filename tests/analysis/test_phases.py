"""Phases cover the record from the first known border to its end, without gap or overlap."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from tdbmon.analysis.phases import split_phases

instant = st.one_of(st.none(), st.floats(0.01, 9.0))


@given(st.lists(instant, min_size=4, max_size=4))
def test_phases_join(times):
    """In whatever order the borders come."""
    release, contact, settled, standstill = times
    phases = split_phases(0.0, 10.0, release, contact, settled, standstill)
    for a, b in pairwise(phases):
        assert a.end == b.start
    if phases:
        assert phases[-1].end == 10.0
    assert ("levitated" in [p.name for p in phases]) == (release is not None)


def test_no_contact_that_is_told_leaves_no_fall_of_half_a_second():
    """A drop of 0.3 mm lasts 8 ms: what follows is no fall, though the first contact is not known."""
    assert [p.name for p in split_phases(0.0, 0.5, 0.1, None, None, None)] == ["levitated", "fall and contacts"]
    assert [p.name for p in split_phases(0.0, 0.5, 0.1, 0.108, None, None)] == ["levitated", "fall", "contacts"]


def test_a_rotor_that_stands_still_before_it_has_settled_rests_once_it_has():
    """Its contacts lasted to 3 s and its rest began at 2 s."""
    phases = split_phases(0.0, 10.0, 0.5, 0.508, settled=3.0, standstill=2.0)
    assert [(p.name, p.end) for p in phases] == [("levitated", 0.5), ("fall", 0.508), ("contacts", 3.0), ("rest", 10.0)]
