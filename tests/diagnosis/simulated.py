"""Two short drops of the shipped machine with hidden effects, by the same simulator as the model (synthetic)."""

import numpy as np
from tdbsim.effect import parse
from tdbsim.sensors import ProbeChain, SensorChain
from tdbsim.simulate import DropPlan, simulate

from tdbmon.identify.drop import measured_drop
from tdbmon.identify.problem import build_problem
from tests.identify import drops


def record(machine, speed, seed, *effects, seconds=0.03):
    rng = np.random.default_rng(seed)
    plan = DropPlan(
        speed=speed,
        seconds=seconds,
        levitated=0.08,
        set_point=tuple(map(tuple, rng.uniform(-25e-6, 25e-6, (2, 2)))),
        shaft_angle=float(rng.uniform(0, 2 * np.pi)),
        cage_angle=tuple(rng.uniform(0, 2 * np.pi / 11, 2)),
        sensors=SensorChain(probe=ProbeChain(noise=drops.NOISE), speed_noise_hz=0.03),
        seed=seed,
        bending=12,
    )
    made = simulate(machine, plan, [parse(text) for text in effects])
    made.attrs["source_file"] = f"drop_{speed:g}.nc"
    return made


def problem_of(crew, *effects):
    machine = drops.machine()
    measured = tuple(
        measured_drop(record(machine, speed, seed, *effects), machine) for speed, seed in ((80.0, 1), (150.0, 2))
    )
    return build_problem(machine, measured, crew)
