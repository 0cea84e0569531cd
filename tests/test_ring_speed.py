"""When an inner ring turns with the journal."""

from __future__ import annotations

import numpy as np

from tdbmon.ring_speed import turns_along

RADII = 0.035, 0.03525


def test_a_ring_turns_with_the_journal_from_two_per_cent_of_slip_on_and_where_it_overtakes_it():
    """One that passed the journal between two samples was said never to reach it."""
    rolling = 100.0 * RADII[0] / RADII[1]
    ring = np.array([0.0, 0.97, 0.985, 1.0, 1.03, -1.0]) * rolling
    for way in (1.0, -1.0):
        found = turns_along(way * ring, np.full(6, way * 100.0), *RADII)
        assert found.tolist() == [False, False, True, True, True, False]


def test_no_ring_turns_with_a_shaft_that_stands():
    assert not turns_along(np.array([0.0, 1e-9, 5.0]), np.zeros(3), *RADII).any()
