"""Processor time and error of one drop of 0.2 s, against scipy's RK45 at the published settings in the same run.

The reference integrates the equations written in plain NumPy (tests/sim/plain_drop.py) with rtol 1e-5 and steps of at most
10 us, as in the source of the machine's data.  Errors are those of the shaft centre at the touchdown bearings over the first
50 ms, against the adaptive method at a tolerance of 1e-10, for machines with randomly drawn parameters.
"""

from __future__ import annotations

import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
MACHINE = ROOT / "datasets" / "coastdown" / "machine.toml"
_FIRST_CALL = """
import sys, time
start = time.perf_counter()
from tdbsim.machine import load_machine
from tdbsim.simulate import DropPlan, simulate
simulate(load_machine(sys.argv[1]), DropPlan(150.0, 0.2), bending=4)
print(time.perf_counter() - start)
"""


def best_of(function, count=10):
    """Return the shortest processor time of several calls, s, which other programs affect less than wall-clock time."""
    times = []
    for _ in range(count):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return min(times)


def drawn(model, plan, rng):
    """Return a model and a plan with randomly drawn gap, friction, support, ball clearance, speed and initial state."""
    from tdbsim.columns import FRICTION, GAP, HALF_CLEARANCE, SUPPORT_DAMPING, SUPPORT_XX, SUPPORT_YY

    other = model.copy()
    end = other.arrays.end
    end[:, GAP] *= rng.uniform(0.9, 1.15, 2)
    end[:, FRICTION] *= rng.uniform(0.7, 1.3)
    end[:, [SUPPORT_XX, SUPPORT_YY]] *= rng.uniform(0.85, 1.15, (2, 1))
    end[:, SUPPORT_DAMPING] *= rng.uniform(0.7, 1.3, 2)
    end[:, HALF_CLEARANCE] *= rng.uniform(0.8, 1.2, 2)
    places = tuple((float(x), float(y)) for x, y in rng.uniform(-4e-5, 4e-5, (2, 2)))
    angles = rng.uniform(0, 2 * np.pi, 3)
    plan = replace(plan, speed=float(rng.choice([60.0, 100.0, 150.0, 210.0])), set_point=places)
    return other, replace(plan, shaft_angle=float(angles[0]), cage_angle=(float(angles[1]), float(angles[2])))


def at_ends(trajectory):
    """Return the shaft centre at both touchdown bearings (k, 2), complex."""
    from tdbsim import state_layout

    n = trajectory.model.n
    modes = trajectory.state[:, state_layout.modes_x(n)] + 1j * trajectory.state[:, state_layout.modes_y(n)]
    return modes @ trajectory.model.arrays.at_end.T


def main() -> None:
    """Print times, ratios and errors."""
    sys.path.insert(0, str(ROOT / "tests" / "sim"))
    from plain_drop import PlainDrop
    from scipy.integrate import solve_ivp
    from tdbsim import splitting
    from tdbsim.drop_model import build_model
    from tdbsim.machine import load_machine
    from tdbsim.simulate import DropPlan, initial_state, run

    machine = load_machine(MACHINE)
    model = build_model(machine, bending=4)
    plan = DropPlan(150.0, 0.2, step=50e-6)
    trajectory = run(model, plan)
    start = initial_state(model, plan)
    times, out = trajectory.time, np.empty_like(trajectory.state)
    peak, first = np.zeros(2), np.array(splitting.START)
    kernel = best_of(
        lambda: splitting.integrate(model.arrays, start.copy(), 0.0, 50e-6, times, out, peak, first.copy()), 30
    )
    setup = best_of(lambda: initial_state(build_model(machine, bending=4), plan))
    whole = best_of(lambda: run(build_model(machine, bending=4), plan))

    plain = PlainDrop(machine, 150.0, bending=4)
    begin = time.process_time()
    solve_ivp(plain, (0, 0.2), plain.from_state(start), method="RK45", rtol=1e-5, atol=1e-8, max_step=1e-5)
    reference = time.process_time() - begin

    many = build_model(machine, bending=12)
    short = DropPlan(150.0, 0.06, levitated=0.008)
    fit = best_of(lambda: run(many, short), 30)

    rng = np.random.default_rng(1)
    errors: dict[float, list[float]] = {50e-6: [], 40e-6: [], 25e-6: []}
    for _ in range(24):
        case, cut = drawn(model, replace(plan, seconds=0.05, sampling=5e3), rng)
        exact = at_ends(run(case, replace(cut, method="dormand_prince", tolerance=1e-10)))
        for step, found in errors.items():
            found.append(float(np.abs(at_ends(run(case, replace(cut, step=step))) - exact).max()))

    full = at_ends(run(build_model(machine, bending=20), replace(plan, seconds=0.05)))
    print(f"kernel, 0.2 s at 50 us, 8 modes a plane: {kernel * 1e3:.2f} ms")
    print(f"model and state at the release: {setup * 1e3:.2f} ms; all together: {whole * 1e3:.2f} ms")
    print(f"run of 60 ms at 25 us and 20 kHz, 16 modes a plane, as fits make it: {fit * 1e3:.2f} ms")
    print(f"scipy RK45, NumPy right-hand side, rtol 1e-5, max_step 1e-5: {reference:.2f} s")
    print(f"ratio: {reference / kernel:.0f} (kernel), {reference / whole:.0f} (with set-up)")
    for step, found in errors.items():
        middle, worse = np.percentile(found, [50, 90]) * 1e9
        print(f"error up to 50 ms at {step * 1e6:.0f} us: median {middle:.0f} nm, 90th percentile {worse:.0f} nm")
    for bending, attachment in ((4, True), (4, False), (8, True), (8, False)):
        some = at_ends(run(build_model(machine, bending=bending, attachment=attachment), replace(plan, seconds=0.05)))
        off = np.abs(some - full).max() * 1e6
        name = "with" if attachment else "without"
        print(f"{bending} bending modes {name} attachment modes, against 20 with: {off:.3f} um up to 50 ms")
    for _ in range(2):  # the first one may have to compile
        command = [sys.executable, "-c", _FIRST_CALL, str(MACHINE)]
        first = subprocess.run(command, capture_output=True, text=True, check=True)
    print(f"first call from a warm cache, import included: {float(first.stdout):.2f} s")


if __name__ == "__main__":
    main()
