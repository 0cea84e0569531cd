"""Two short drops of the shipped machine with hidden effects, from the same simulator as the model (synthetic)."""

from dataclasses import replace

import numpy as np
from tdbsim.sensors import ProbeChain, SensorChain
from tdbsim.simulate import DropPlan, simulate
from tdbsim.stated_effects import parse

from tdbmon.diagnosis.contender import Contender, settled
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.least_squares import linearised
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
    )
    made = simulate(machine, plan, [parse(text) for text in effects], bending=12)
    made.attrs["source_file"] = f"drop_{speed:g}.nc"
    return made


def problem_of(crew, *effects, speeds=((80.0, 1), (150.0, 2)), seconds=0.03):
    """Drops from speeds, Hz, each with its seed."""
    machine = drops.machine()
    measured = tuple(
        measured_drop(record(machine, speed, seed, *effects, seconds=seconds), machine) for speed, seed in speeds
    )
    return build_problem(machine, measured, crew)


def with_readings(problem, more):
    """The problem with `more`, of times (n,), shaft angles (n,) and probe angles (probes, 1), added to the readings."""
    changed = []
    for drop in problem.drops:
        angle = np.interp(drop.time, drop.pulse_times, drop.pulse_angles)
        axes = np.array([probe.angle for probe in drop.probes])[:, None]
        changed.append(replace(drop, reading=drop.reading + more(drop.time - drop.release, angle, axes)))
    return replace(problem, drops=tuple(changed))


def settled_plain(problem, *horizons):
    """The plain model fitted along horizons, s."""
    found = Contender((), problem, linearised(problem, problem.start, horizons[0]), horizons[0], 0.9)
    for horizon in horizons:
        found = settled(found, horizon, 4)
    return found
