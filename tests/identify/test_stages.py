"""The instants up to which models are judged, against simulated drops (synthetic) through narrow and wide gaps."""

import numpy as np
import pytest
from tdbsim.machine import Tolerant, load_machine
from tdbsim.simulate import DropPlan, simulate

from tdbmon.identify.stages import Stages, stages_of
from tdbmon.shipped import shipped


def machine(gap, gravity=9.80665):
    """The shipped machine with other gaps, m."""
    full = load_machine(shipped("short/machine.toml"))
    bearings = tuple(
        each.model_copy(update={"radial_gap": Tolerant(nominal=gap, low=0.8 * gap, high=1.2 * gap)})
        for each in full.touchdown_bearings
    )
    return full.model_copy(update={"touchdown_bearings": bearings, "gravity": gravity})


def touches(gap):
    """Instants of each end's touches, s after the release."""
    path = simulate(machine(gap), DropPlan(speed=100.0, seconds=0.06, sampling=100e3))
    time = path.time.to_numpy() - path.attrs["release_time_s"]
    loaded = path.normal_force.to_numpy() > 0
    begins = loaded[:, 1:] & ~loaded[:, :-1]
    return [time[1:][each] for each in begins]


def again(end):
    """Return the first touch that is no chatter of the first one, s after the release."""
    return end[end > end[0] + 2e-3][0]


@pytest.mark.parametrize("gap", [80e-6, 120e-6, 150e-6, 250e-6, 400e-6, 600e-6, 900e-6])
def test_a_drop_has_come_as_far_as_each_instant_says(gap):
    stages = stages_of(machine(gap))
    ends = touches(gap)
    first, second = [end[0] for end in ends], [again(end) for end in ends]
    assert stages.fall < 1.06 * min(first) or gap < 150e-6  # in 150 um it touches at 5.71 ms
    assert max(first) < stages.met < stages.touched
    assert min(second) < stages.bounced


def test_narrow_and_usual_gaps_leave_the_instants_as_they_are():
    for gap in (5e-6, 100e-6, 250e-6, 400e-6):
        assert stages_of(machine(gap)) == Stages()
    assert Stages().diagnosis[:8] == Stages().calibration[:8]


def test_wider_gaps_stretch_them_as_the_time_of_the_fall():
    for gap in (450e-6, 600e-6, 900e-6):
        wanted = np.sqrt(gap / 250e-6)
        stages = stages_of(machine(gap))
        assert stages.stretch == pytest.approx(wanted, abs=0.026)
        np.testing.assert_allclose(stages.calibration, stages.stretch * np.array(Stages().calibration), atol=5.1e-5)


def test_less_weight_stretches_them():
    assert stages_of(machine(250e-6, gravity=9.80665 / 4)).stretch == 2.0
    assert stages_of(machine(5e-3)).stretch == 2.0
