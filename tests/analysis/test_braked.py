"""A drive that brakes is told from contacts, which slow a rotor by the friction of its weight at most."""

from __future__ import annotations

import numpy as np
import pytest
from tdbsim.machine import STANDARD_GRAVITY, Machine
from tdbsim.rotor import RotorModel

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.braked import beyond_contacts
from tdbmon.analysis.drag_law import DragLaw
from tdbmon.analysis.rundown import RunDown, fit_rundown
from tdbmon.record.read import read
from tdbmon.shipped import shipped

RELEASE, SPEED = 0.5, 120.0


def slowed_by(rate: float, seconds: float, rotor: RotorModel, later: dict[str, float]) -> RunDown:
    """Slowed by a law of drag, and by a rate, Hz/s, more for some seconds after the release."""
    t = np.arange(0, 12.0, 1 / 2000)
    more = DragLaw(RELEASE, SPEED, linear=later.get("linear", 0.0), constant=later.get("constant", 0.0) + rate)
    law = DragLaw(RELEASE + seconds, float(more.speed_at(RELEASE + seconds)), **later)
    speed = np.where(t < law.start, more.speed_at(np.maximum(t, RELEASE)), law.speed_at(t))
    speed += np.random.default_rng(0).normal(0, 0.05, len(t))
    return fit_rundown(t, speed, release_time=RELEASE, polar_inertia=rotor.polar_inertia)


def test_more_speed_than_friction_takes_was_taken_by_a_drive(machine: Machine, rotor: RotorModel) -> None:
    run = beyond_contacts(slowed_by(30.0, 2.0, rotor, {"linear": 1 / 14.0}), machine, rotor, RELEASE)
    assert run.decay_time.low <= 14.0 <= run.decay_time.high
    assert not run.lost_speed.known
    assert run.doubt == run.lost_speed.why and "does the drive brake" in run.doubt


def test_more_constant_drag_than_friction_gives_is_that_of_a_drive(machine: Machine, rotor: RotorModel) -> None:
    run = beyond_contacts(slowed_by(0.0, 0.0, rotor, {"constant": 40.0}), machine, rotor, RELEASE)
    assert run.drag_torque.value == pytest.approx(2 * np.pi * rotor.polar_inertia * 40.0, rel=1e-3)
    assert "does the drive brake" in run.doubt


def test_a_rotor_that_slides_on_rings_that_stand_still_is_not_called_braked(
    machine: Machine, rotor: RotorModel
) -> None:
    """Friction at its highest by the machine file, for two seconds until the rings come free."""
    bearing = machine.touchdown_bearings[0]
    friction = bearing.friction.high * rotor.total_mass * STANDARD_GRAVITY * bearing.journal_radius
    rate = friction / (2 * np.pi * rotor.polar_inertia)
    found = slowed_by(rate, 2.0, rotor, {"linear": 1 / 14.0})
    run = beyond_contacts(found, machine, rotor, RELEASE)
    assert run == found and not run.doubt
    lost = rate * 14.0 * (np.exp(2.0 / 14.0) - 1)  # what the friction took, grown as far as drag would have shrunk it
    assert run.lost_speed.value == pytest.approx(lost, abs=0.03)


def test_an_analysis_says_that_the_drive_brakes(machine: Machine) -> None:
    record = read(shipped("years/drop_01.nc"))
    t = record["speed"][record["speed"].dims[0]].to_numpy()
    squares = float(record["speed"][:100].mean()) ** 2 * np.clip(1 - np.clip(t - 0.1, 0, None) / 3.0, 0, 1)
    speed = np.sqrt(squares) + np.random.default_rng(0).normal(0, 0.05, len(t))
    braked = record.assign(speed=(record["speed"].dims, speed, record["speed"].attrs)).drop_vars("keyphasor")
    found = analyse(braked, machine)
    failed = [check for check in found.checks if check.check == "run-down"]
    assert len(failed) == 1 and not failed[0].passed
    assert "does the drive brake" in failed[0].detail
    assert found.rundown is not None and not found.rundown.decay_time.known
