"""Drops per second in a batch of varied machines on all processors, against scipy's RK45 at the published settings.

Also the processor time per drop when several are computed side by side, against one alone, in the same run, set-up included.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.drop import MACHINE, ROOT, best_of, drawn


def beside(what: str, cases: list[Any], together: Callable[[], object]) -> str:
    """Return the processor times per drop alone and side by side with others, measured alternately, as a line of text."""
    from tdbsim.simulate import run

    alone, several = [], []
    for _ in range(5):
        alone.append(best_of(lambda: [run(*case) for case in cases], 1) / len(cases))
        several.append(best_of(together, 1) / len(cases))
    one, other = min(alone) * 1e3, min(several) * 1e3
    return f"{what}: {one:.2f} ms of processor time alone, {other:.2f} ms side by side; ratio {one / other:.2f}"


def main() -> None:
    """Print drops per second and the ratio."""
    sys.path.insert(0, str(ROOT / "tests" / "sim"))
    from plain_drop import PlainDrop
    from scipy.integrate import solve_ivp
    from tdbsim.columns import GAP
    from tdbsim.drop_model import build_model
    from tdbsim.ensemble import run_many
    from tdbsim.machine import load_machine
    from tdbsim.side_by_side import MOST, run_side_by_side
    from tdbsim.simulate import DropPlan, initial_state

    machine = load_machine(MACHINE)
    model = build_model(machine, bending=4)
    rng = np.random.default_rng(2)
    plan = DropPlan(150.0, 0.2, sampling=5e3, step=50e-6)
    cases = [drawn(model, plan, rng) for _ in range(64)]
    run_many(cases[:8])
    rates = {}
    for threads in (1, os.cpu_count() or 1):
        begin = time.perf_counter()
        run_many(cases, threads)
        rates[threads] = len(cases) / (time.perf_counter() - begin)
    many = build_model(machine, bending=12)
    near = [(many.copy(), DropPlan(150.0, 0.06, levitated=0.008)) for _ in range(MOST)]
    for k, (each, _) in enumerate(near):
        each.arrays.end[:, GAP] *= 1 + 1e-6 * k
    print(beside("drop of an ensemble", cases, lambda: run_many(cases, 1)))
    print(beside("run of a fit", near, lambda: run_side_by_side(near)))

    plain = PlainDrop(machine, 150.0, bending=4)
    start = plain.from_state(initial_state(model.copy(), DropPlan(150.0)))
    begin = time.perf_counter()
    solve_ivp(plain, (0, 0.02), start, method="RK45", rtol=1e-5, atol=1e-8, max_step=1e-5)
    reference = 0.1 / (time.perf_counter() - begin)
    for threads, rate in rates.items():
        print(f"{threads} thread(s): {rate:.0f} drops of 0.2 s a second, set-up included; ratio {rate / reference:.0f}")


if __name__ == "__main__":
    main()
