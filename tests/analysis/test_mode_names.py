"""Modes named by what they do: a stiff shaft on soft springs in closed form, and a shaft that bends before it tilts."""

from __future__ import annotations

import pytest
from tdbsim.modes import Spring, free_free, supported, whirl_modes

from tdbmon.analysis.mode_names import mode_names


@pytest.mark.parametrize("arm", [0.1, 0.5])
def test_on_soft_springs_the_shaft_bounces_and_tilts_before_it_bends(arm, rotor):
    """Springs that stand closer than the radius of gyration tilt it more slowly than they lift it."""
    ends = [rotor.centre_of_mass - arm, rotor.centre_of_mass + arm]
    found = whirl_modes(rotor, [Spring(at, 1e4, 1e4) for at in ends])
    lift = 2 * 1e4 / rotor.total_mass
    tilt = 2 * 1e4 * arm**2 / rotor.diametral_inertia
    first = ["conical", "bounce"] if tilt < lift else ["bounce", "conical"]
    assert first[0] == ("conical" if arm == 0.1 else "bounce")
    assert mode_names(found, ends) == (*first, "bending 1")
    assert found.frequencies[4] == pytest.approx(free_free(rotor, 1).frequencies[2], rel=1e-2)


def test_on_hard_springs_it_bends_before_it_tilts(machine, rotor):
    ends = [bearing.position for bearing in machine.touchdown_bearings]
    names = mode_names(supported(machine, rotor, dict.fromkeys(machine.ends, 5e9)), ends)
    assert names == ("bounce", "bending 1", "bending 2")


def test_on_its_own_bearings_the_shipped_shaft_moves_as_a_whole_first(machine, rotor):
    ends = [bearing.position for bearing in machine.touchdown_bearings]
    assert mode_names(supported(machine, rotor, dict.fromkeys(machine.ends, 6e7)), ends) == (
        "bounce",
        "conical",
        "bending 1",
    )
