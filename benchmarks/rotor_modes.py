"""Time to build the rotor and its modes, and truncation error of each modal reduction, on the shipped machine.

Run: python benchmarks/rotor_modes.py
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from tdbsim.machine import load_machine
from tdbsim.modes import Spring, free_free, supported
from tdbsim.rotor import build_rotor

ROOT = Path(__file__).parents[1]
MACHINE = load_machine(ROOT / "datasets" / "coastdown" / "machine.toml")
PLACES = [bearing.position for bearing in MACHINE.touchdown_bearings]
STIFFNESS = {bearing.name: bearing.support_stiffness.nominal for bearing in MACHINE.touchdown_bearings}


def milliseconds(call: Callable[[], object], repeats: int = 10) -> float:
    """Return the shortest time of several calls after a warm-up call, ms."""
    call()
    runs = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        runs.append(time.perf_counter() - start)
    return 1e3 * min(runs)


def main() -> None:
    """Print times and errors."""
    sys.path.insert(0, str(ROOT / "tests" / "sim"))
    from truncation_error import truncation_error

    model = build_rotor(MACHINE)
    speeds = np.linspace(0, 250, 26)
    work = {
        "build_rotor + free_free, 4 bending": lambda: free_free(build_rotor(MACHINE), 4),
        "free_free, 4 bending + 2 attachment": lambda: free_free(model, 4, PLACES),
        "supported, 6 modes at 150 Hz": lambda: supported(MACHINE, model, STIFFNESS, 150.0),
        "supported, 6 modes at 26 speeds": lambda: [supported(MACHINE, model, STIFFNESS, speed) for speed in speeds],
    }
    print(f"{len(model.nodes)} nodes, {model.total_mass:.2f} kg; shortest of ten runs")
    for name, call in work.items():
        print(f"{name:40s} {milliseconds(call):8.2f} ms")
    print("\nrelative error of the first 4 natural frequencies on the supports, and missing compliance there")
    print("bending modes   alone, frequency   alone, compliance   with 2 attachment modes, frequency")
    springs = [Spring(place, STIFFNESS[end], STIFFNESS[end]) for place, end in zip(PLACES, MACHINE.ends, strict=True)]
    for n in (2, 4, 8, 16):
        alone, attached = (truncation_error(free_free(model, n, attach), springs) for attach in ((), PLACES))
        worst, missing = alone.frequencies.max(), alone.compliance.max()
        print(f"{n:13d}   {worst:16.2e}   {missing:17.2e}   {attached.frequencies.max():34.2e}")


if __name__ == "__main__":
    main()
