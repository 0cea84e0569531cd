"""Drops a second in a batch of varied machines on all processors, against scipy's RK45 at the published settings."""

from __future__ import annotations

import os
import sys
import time

import numpy as np

from benchmarks.drop import MACHINE, ROOT, drawn


def main() -> None:
    """Print drops a second and the ratio."""
    sys.path.insert(0, str(ROOT / "tests" / "sim"))
    from plain_drop import PlainDrop
    from scipy.integrate import solve_ivp
    from tdbsim.drop_model import build_model
    from tdbsim.ensemble import run_many
    from tdbsim.machine import load_machine
    from tdbsim.simulate import DropPlan, initial_state

    machine = load_machine(MACHINE)
    model = build_model(machine)
    rng = np.random.default_rng(2)
    plan = DropPlan(150.0, 0.2, sampling=5e3, step=50e-6)
    cases = [drawn(model, plan, rng) for _ in range(64)]
    run_many(cases[:2])
    rates = {}
    for threads in (1, os.cpu_count() or 1):
        begin = time.perf_counter()
        run_many(cases, threads)
        rates[threads] = len(cases) / (time.perf_counter() - begin)

    plain = PlainDrop(machine, 150.0)
    start = plain.from_state(initial_state(model.copy(), DropPlan(150.0)))
    begin = time.perf_counter()
    solve_ivp(plain, (0, 0.02), start, method="RK45", rtol=1e-5, atol=1e-8, max_step=1e-5)
    reference = 0.1 / (time.perf_counter() - begin)
    for threads, rate in rates.items():
        print(f"{threads} thread(s): {rate:.0f} drops of 0.2 s a second, set-up included; ratio {rate / reference:.0f}")


if __name__ == "__main__":
    main()
