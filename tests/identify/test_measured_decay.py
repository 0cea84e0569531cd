"""The decay time of a calibrated machine is that of its run-down, where that is surer than a fit of the first contacts."""

from types import SimpleNamespace

import numpy as np
import pytest
from tdbsim.machine import Tolerant

from tdbmon.analysis.drag_law import DragLaw
from tdbmon.analysis.rundown import fit_rundown
from tdbmon.estimate import Estimate
from tdbmon.identify.measured_decay import NAME, decay_of_rotor, with_measured_decay

RELEASE, DECAY = 0.5, 14.0


def run_down(machine, rotor, seconds=3.0, **more):
    """A rotor of that decay time that turns its rings with it: the same drag slows more inertia."""
    rings = sum(bearing.inner_ring_inertia for bearing in machine.touchdown_bearings)
    linear = rotor.polar_inertia / (rotor.polar_inertia + rings) / DECAY
    t = np.arange(0, RELEASE + seconds, 1 / 2000)
    law = DragLaw(RELEASE, 120.0, linear, **more)
    speed = law.speed_at(np.maximum(t, RELEASE)) + np.random.default_rng(0).normal(0, 0.01, len(t))
    return fit_rundown(t, speed, release_time=RELEASE, polar_inertia=rotor.polar_inertia)


def fit(machine, half):
    """What a fit to 65 ms says: the decay time by its tolerance, and little besides."""
    value = Estimate(13.0, 13.0 - half, 13.0 + half, "s")
    loose = Tolerant(nominal=13.0, low=0.75 * 13.0, high=1.25 * 13.0)
    rotor = machine.rotor.model_copy(update={"speed_decay_time": loose})
    calibrated = machine.model_copy(update={"rotor": rotor})
    return SimpleNamespace(calibrated=calibrated, values={NAME: value}, drops=(SimpleNamespace(name="drop.nc"),))


def test_the_rings_part_is_taken_off(machine, rotor):
    run = run_down(machine, rotor, 30.0)
    found = decay_of_rotor(run, machine)
    assert found.low <= DECAY <= found.high
    assert run.decay_time.value - found.value == pytest.approx(0.005 * DECAY, rel=0.2)  # two rings of 0.27 % each


def test_the_surer_of_run_down_and_fit_is_taken(machine, rotor):
    run = run_down(machine, rotor)
    made, remark = with_measured_decay(fit(machine, 2.0), run)
    assert made.rotor.speed_decay_time.nominal == pytest.approx(DECAY, rel=0.01)
    assert "from the run-down of drop.nc" in remark
    assert made.touchdown_bearings == fit(machine, 2.0).calibrated.touchdown_bearings
    made, remark = with_measured_decay(fit(machine, 0.001), run)
    assert made.rotor.speed_decay_time.nominal == 13.0 and not remark


def test_a_linear_term_beside_a_quadratic_one_is_no_decay_time_of_a_machine(machine, rotor):
    run = run_down(machine, rotor, 30.0, quadratic=2e-3)
    assert run.decay_time.known and run.law.quadratic > 0
    assert decay_of_rotor(run, machine) is None
    assert decay_of_rotor(None, machine) is None
