"""Phases cover the record from the first known border to its end, without gap or overlap."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from tdbmon.analysis.phases import split_phases

instant = st.one_of(st.none(), st.floats(0.01, 9.0))


@given(st.lists(instant, min_size=4, max_size=4))
def test_phases_join(times):
    known = sorted(t for t in times if t is not None)
    ordered = iter(known)
    release, contact, settled, standstill = (None if t is None else next(ordered) for t in times)
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
