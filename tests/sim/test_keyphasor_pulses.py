"""Every pulse of a simulated keyphasor is seen, or the sampling is refused."""

from __future__ import annotations

import numpy as np
import pytest
from changed_machine import changed
from tdbsim.errors import InputError
from tdbsim.simulate import DropPlan, simulate


@pytest.mark.parametrize(("speed", "pulses"), [(100.0, 60), (1500.0, 1), (300.0, 20)])
def test_every_pulse_is_seen(machine, speed, pulses):
    toothed = changed(
        machine,
        keyphasor=machine.keyphasor.model_copy(update={"pulses_per_revolution": pulses}),
        rotor={"unbalance": ()},
    )
    sampling = max(DropPlan.sampling, 4 * speed * pulses)
    drop = simulate(toothed, DropPlan(speed, 0.02, levitated=0.02, sampling=sampling))
    edges = np.count_nonzero(np.diff(drop[machine.channel_in_file("keyphasor")].values) > 0.5)
    assert edges == pytest.approx(pulses * np.ptp(drop["shaft_angle"].values) / (2 * np.pi), abs=1.0)


def test_pulses_that_no_sampling_tells_apart_are_refused(machine):
    toothed = changed(machine, keyphasor=machine.keyphasor.model_copy(update={"pulses_per_revolution": 60}))
    with pytest.raises(
        InputError, match="60 pulses per revolution at 200 Hz are 12000 per second.* sample at 96000 Hz or faster"
    ):
        simulate(toothed, DropPlan(200.0, 0.01))
