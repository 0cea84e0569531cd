"""Time of a joint fit of four drops and of their forces, in one process and in one per core, relative to one simulation."""

from __future__ import annotations

import os
import time

from tdbsim.drop_model import build_model
from tdbsim.machine import load_machine
from tdbsim.simulate import DropPlan, run

from tdbmon.identify.calibrate import fit_drops
from tdbmon.identify.forces import forces_of
from tdbmon.record.read import read
from tdbmon.shipped import shipped

_RUNS = 50


def main() -> None:
    """Print times, and their ratio to one simulation of a drop of 60 ms."""
    machine = load_machine(shipped("short/machine.toml"))
    records = [read(path) for path in sorted(shipped("short").glob("drop_*.nc"))]
    model, plan = build_model(machine, bending=12), DropPlan(150.0, 0.06, levitated=0.008)
    run(model, plan)  # compile, or load from the cache
    began = time.perf_counter()
    for _ in range(_RUNS):
        run(model, plan)
    once = (time.perf_counter() - began) / _RUNS
    forces_of(fit_drops(machine, records[:1], horizons=(0.006, 0.014)), seconds=0.02, members=8)  # warm-up likewise
    for workers in sorted({1, os.cpu_count() or 1}):
        began = time.perf_counter()
        calibration = fit_drops(machine, records, workers=workers)
        fitted = time.perf_counter() - began
        forces_of(calibration)
        total = time.perf_counter() - began
        print(
            f"{workers} process(es): four drops fitted to {calibration.horizon * 1e3:g} ms in {fitted:.1f} s"
            f" ({fitted / once:.0f} simulations of 60 ms), with forces {total:.1f} s; left {calibration.misfit:.2f} times noise"
        )


if __name__ == "__main__":
    main()
