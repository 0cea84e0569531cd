"""Drops are simulated in several threads at a time, which share what is known of the levitated rotor."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from tdbsim.drop_model import build_model
from tdbsim.machine import load_machine
from tdbsim.simulate import DropPlan, initial_state

from tdbmon.shipped import shipped

CALLS = 3000


def test_threads_that_levitate_one_rotor_do_not_disturb_each_other():
    """What holds a rotor up is kept for all of them, and none may change it."""
    model = build_model(load_machine(shipped("short/machine.toml")), bending=12)
    plan = DropPlan(speed=100.0, seconds=0.01, set_point=((1e-5, -2e-5), (2e-5, 1e-5)))
    alone = initial_state(model.copy(), plan)
    models = [model.copy() for _ in range(4)]

    def differing(mine):
        return sum(not np.array_equal(initial_state(mine.copy(), plan), alone) for _ in range(CALLS // len(models)))

    with ThreadPoolExecutor(len(models)) as pool:
        assert sum(pool.map(differing, models)) == 0
