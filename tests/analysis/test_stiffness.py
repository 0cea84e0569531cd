"""The single-mass stiffness against simulated first contacts, where the force is known (same model, synthetic)."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from tdbsim.machine import Tolerant
from tdbsim.rotor import static_loads
from tdbsim.simulate import DropPlan, simulate

from tdbmon.analysis.axes import to_planes
from tdbmon.analysis.contacts import find_contacts
from tdbmon.analysis.rest import rest_travel
from tdbmon.analysis.stiffness import single_mass_stiffness
from tdbmon.estimate import Estimate
from tests.analysis.circles import circle_of


def test_intervals_hold_peak_force_over_travel(machine, rotor):
    """24 first contacts with set-points of their own: at least nine in ten intervals hold bearing and support in series."""
    loads = static_loads(machine, rotor)
    rng = np.random.default_rng(11)
    held, forces = [], []
    for speed in (60.0, 100.0, 150.0, 210.0) * 3:
        points = tuple(tuple(rng.uniform(-30e-6, 30e-6, 2)) for _ in range(2))
        drop = simulate(machine, DropPlan(speed, 0.05, set_point=points, shaft_angle=rng.uniform(0, 6.28)))
        planes = to_planes(drop, machine)
        for i, end in enumerate(machine.ends):
            bearing = machine.bearing(end)
            travel = rest_travel(bearing, loads[end])
            play = bearing.balls.play
            radius = bearing.radial_gap.nominal + travel.total
            sure = [Estimate.from_sigma(v, 0.3e-6, "um", "") for v in (radius, 0.0, 0.0)]
            circle = circle_of(*sure, settled_from=0.05)
            first = find_contacts(planes, end, circle, travel, play, 0.0, machine.gravity).first
            found = single_mass_stiffness(first, loads[end] / machine.gravity)
            inside = (drop.time.values >= first.touch.value) & (
                drop.time.values <= first.touch.value + first.duration.value
            )
            force = drop.normal_force.values[i][inside].max()
            reach = np.hypot(*planes.displacement.sel(end=end).values)[inside].max()
            series = force / (reach - (radius - travel.total + play))
            held.append(found.low <= series <= found.high)
            forces.append(force)
    assert min(forces) > 1000  # every case is an impact
    assert np.mean(held) >= 0.9


@pytest.mark.parametrize("clearance", [10e-6, -20e-6])
def test_the_touch_is_when_the_force_begins_preloaded_balls_or_not(machine, rotor, clearance):
    """Half of a clearance below nought was taken for play: the touch was told 0.15 ms and more before any force."""
    exact = Tolerant(nominal=clearance, low=clearance, high=clearance)
    bearings = [
        b.model_copy(update={"balls": b.balls.model_copy(update={"diametral_clearance": exact})})
        for b in machine.touchdown_bearings
    ]
    held = machine.model_copy(update={"touchdown_bearings": tuple(bearings)})
    drop = simulate(held, DropPlan(100.0, 0.02, levitated=0.02))
    planes, loads = to_planes(drop, held), static_loads(held, rotor)
    for i, bearing in enumerate(bearings):
        travel = rest_travel(bearing, loads[bearing.name])
        radius = bearing.radial_gap.nominal + travel.total
        sure = [Estimate.from_sigma(v, 0.1e-6, "um", "") for v in (radius, 0.0, 0.0)]
        circle = circle_of(*sure, settled_from=0.04)
        found = find_contacts(planes, bearing.name, circle, travel, bearing.balls.play, 0.02, held.gravity)
        force = drop.time.values[drop.normal_force.values[i] > 0]
        assert found.first.touch.value == pytest.approx(force[0], abs=6e-5)  # a sample, and the bending in the fall


def test_what_was_not_found_is_missing():
    assert single_mass_stiffness(None, 50.0).why == "no first contact was found"


def passing(half: float) -> SimpleNamespace:
    """A first contact, as far as it is asked, that is beyond its position at rest for `half`, s."""
    known = (Estimate.from_sigma(at, 1e-5, "s", "made up") for at in (0.1, 0.1 + half))
    return SimpleNamespace(**dict(zip(("static_in", "static_out"), known, strict=True)))


def test_between_drops_only_the_instants_scatter():
    """The model's share is that of all drops of a machine: with it no stiffness is ever seen to rise."""
    found = single_mass_stiffness(passing(3e-3), 45.0)
    assert found.apart.value == found.value
    assert found.apart.sigma / found.value == pytest.approx(2 * 2e-5 / 3e-3, rel=0.01)  # it goes with the square
    assert found.low == pytest.approx(found.apart.low / 1.05)
    assert found.high == pytest.approx(found.apart.high / 0.40)
