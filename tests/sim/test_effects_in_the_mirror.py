"""Every effect in the mirror: a machine that turns the other way, its ends in the other order, drops mirrored."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from changed_machine import ADAPTIVE, changed, exactly
from tdbsim.effect import catalogue, places
from tdbsim.simulate import simulate

PLAN = replace(
    ADAPTIVE, seconds=0.025, levitated=0.005, set_point=((1e-5, 2e-5), (-3e-5, 0.0)), shaft_angle=0.4,
    ring_angle=(0.3, 0.5), cage_angle=(0.1, 0.2),
)  # fmt: skip
SAME, TURNED = ("rotor_y", "ring_y", "support_y"), ("rotor_x", "ring_x", "support_x")
SPEEDS = ("rotor_speed", "ring_speed")


@pytest.fixture(scope="module")
def uneven(machine):
    """Two bearings that differ in all that effects work on."""
    nde, de = machine.touchdown_bearings
    other = de.model_copy(
        update={
            "radial_gap": exactly(240e-6), "friction": exactly(0.1), "inner_ring_drag": exactly(0.02),
            "contact_stiffness": 0.8 * de.contact_stiffness, "inner_ring_inertia": 1.3 * de.inner_ring_inertia,
            "balls": de.balls.model_copy(update={"count": 12}),
        }
    )  # fmt: skip
    return changed(machine, touchdown_bearings=(nde, other))


def in_the_mirror(machine):
    """x -> -x, where an angle phi on a shaft at angle a stands at pi - a - phi."""
    return changed(
        machine,
        rotation="cw",
        touchdown_bearings=machine.touchdown_bearings[::-1],
        probes=tuple(each.model_copy(update={"angle": math.pi - each.angle}) for each in machine.probes),
        rotor={
            "unbalance": tuple(
                each.model_copy(update={"phase": exactly(-each.phase.nominal)}) for each in machine.rotor.unbalance
            )
        },
    )


def planned_in_the_mirror(plan):
    return replace(
        plan,
        set_point=tuple((-x, y) for x, y in plan.set_point[::-1]),
        shaft_angle=math.pi - plan.shaft_angle,
        ring_angle=tuple(math.pi - angle for angle in plan.ring_angle[::-1]),
        cage_angle=tuple(math.pi - angle for angle in plan.cage_angle[::-1]),
    )


def effect_and_image(declared, where):
    """An effect of typical size, and what it is in the mirror: angles change their sign.

    Those from +x of something with two or more even lobes do so as well, since half a turn leaves it as it is.
    """
    values = {each.name: each.typical for each in declared.parameters if not each.choices}
    angles = {each.name: values[each.name] or 0.4 for each in declared.parameters if each.si == "rad"}
    turned = {name: -angle for name, angle in angles.items()}
    return declared.at(where, values | angles), declared.at(where, values | turned)


def seen(drop, machine, mirror=1):
    """Readings and places in nm, speeds in mHz; those of the mirror turned back."""
    at = drop.sel(end=["NDE", "DE"])
    found = [drop[probe.name].values * 1e9 for probe in machine.probes]
    found += [at[name].values * 1e9 for name in SAME] + [mirror * at[name].values * 1e9 for name in TURNED]
    found += [mirror * at[name].values * 1e3 for name in SPEEDS]
    return np.vstack([np.atleast_2d(each) for each in found])


@pytest.fixture(scope="module")
def plain(uneven):
    return seen(simulate(uneven, PLAN), uneven)


@pytest.mark.parametrize("declared", catalogue(), ids=[each.identifier for each in catalogue()])
def test_an_effect_acts_in_the_mirror_as_it_does(declared, uneven, plain):
    """It reads its own end's values, and turns with the machine."""
    effect, image = effect_and_image(declared, places(declared.place, uneven)[0])
    drop = simulate(uneven, PLAN, [effect])
    assert float(drop["normal_force"].max()) > 1000
    found = seen(drop, uneven)
    mirrored = seen(simulate(in_the_mirror(uneven), planned_in_the_mirror(PLAN), [image]), uneven, mirror=-1)
    assert np.abs(found - plain).max() > 10
    assert np.abs(mirrored - found).max() < 0.2
