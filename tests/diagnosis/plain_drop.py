"""A simulated drop that its model follows exactly, as the diagnosis sees it (synthetic)."""

import numpy as np
from tdbsim.drop_model import build_model
from tdbsim.sensors import SensorChain
from tdbsim.simulate import DropPlan, run

from tdbmon.diagnosis.left_over import LeftOver, seen_along, to_ends
from tdbmon.identify.noise import Noise
from tests.identify import drops

INTERVAL = 1e-4
COUNT = 240
SPEED = 97.0


def noise(sigma):
    return Noise(sigma, np.empty(0), sigma, 0.0, 0.0, np.zeros(3, dtype=complex), 0.0, 0j)


def bare(sigma, touch=((8e-3, 10e-3), None), chain=None):
    """24 ms from the release on without residual, with the given first contacts and sensor chain."""
    machine = drops.machine()
    axes = seen_along(machine.probes, chain or SensorChain())
    model = build_model(machine, bending=4)
    motion = run(model, DropPlan(speed=SPEED, seconds=2 * INTERVAL, levitated=2e-3, sampling=1 / INTERVAL))
    shape = len(machine.probes), COUNT
    return LeftOver(
        name="drop.nc",
        time=np.arange(COUNT) * INTERVAL,
        probes=machine.probes,
        noise=tuple(noise(sigma) for _ in machine.probes),
        measured=np.zeros(shape),
        simulated=np.zeros(shape),
        axes=axes,
        to_ends=to_ends(machine, machine.probes, axes),
        place=np.full((2, COUNT), -1e-4j),
        force=np.zeros((2, COUNT), dtype=complex),
        touch=touch,
        omega=2 * np.pi * SPEED,
        motion=motion,
    )
