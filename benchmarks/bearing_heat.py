"""Processor time of ball loads and heat in a simulated drop, as ratios to the same drop without heat in the same run.

Cases: the shipped machine with heat at both ends, 0.2 s from 150 Hz at 20 kHz, and the motor of Publication II as in its file.
``run`` is the integration, ``simulate`` the whole drop with its record.  The times of each pair are measured alternately, so
that other load of the processor affects both.
"""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
_TURNS = 15


def in_turn(*functions):
    """Return the shortest processor time of each of several functions called alternately, s."""
    for function in functions:
        function()
    times = np.empty((_TURNS, len(functions)))
    for row in times:
        for k, function in enumerate(functions):
            begin = time.process_time()
            function()
            row[k] = time.process_time() - begin
    return times.min(axis=0)


def with_same_heat(machine, heat):
    """Return a machine with the same thermal data, or None, at both ends."""
    bearings = tuple(bearing.model_copy(update={"heat": heat}) for bearing in machine.touchdown_bearings)
    return machine.model_copy(update={"touchdown_bearings": bearings})


def shipped_heat(machine, heat):
    """Return thermal data with radii that fit the shipped machine."""
    bore = machine.touchdown_bearings[0].journal_radius + machine.touchdown_bearings[0].radial_gap.high
    radii = {"inner_race_radius": bore + 4e-3, "outer_race_radius": bore + 16e-3, "outer_radius": bore + 20e-3}
    return heat.model_copy(update=radii | {"housing_radius": bore + 25e-3})


def main() -> None:
    """Print times and ratios; goal: ball loads and heat cost at most 30 % of a drop's time."""
    from tdbsim.drop_model import build_model
    from tdbsim.machine import load_machine
    from tdbsim.observe import observed
    from tdbsim.simulate import DropPlan, run, simulate

    motor = load_machine(ROOT / "datasets" / "machines" / "motor_6014_71914.toml")
    rotor = load_machine(ROOT / "datasets" / "coastdown" / "machine.toml")
    heat = motor.touchdown_bearings[1].heat
    cases = (
        ("shipped machine, heat at both ends", with_same_heat(rotor, shipped_heat(rotor, heat)), DropPlan(150.0, 0.2)),
        ("motor of Publication II, heat at one end", motor, DropPlan(15200 / 60, 0.3)),
    )
    for name, warm, plan in cases:
        cold = with_same_heat(warm, None)
        models = build_model(cold, bending=4), build_model(warm, bending=4)
        trajectory = run(models[0], plan)
        integrated = in_turn(*(partial(run, model, plan) for model in models))
        whole = in_turn(*(partial(simulate, machine, plan, bending=4) for machine in (cold, warm)))
        (loads,) = in_turn(partial(observed, trajectory))
        print(f"{name}, {plan.seconds:g} s, {round(plan.seconds / plan.heat_interval)} exchanges")
        print(f"  run: {integrated[0] * 1e3:.1f} ms cold, {integrated[1] * 1e3:.1f} ms with heat,"
              f" {100 * (integrated[1] / integrated[0] - 1):.0f} % more")  # fmt: skip
        print(f"  simulate: {whole[0] * 1e3:.1f} ms cold, {whole[1] * 1e3:.1f} ms with heat,"
              f" {100 * (whole[1] / whole[0] - 1):.0f} % more")  # fmt: skip
        print(f"  forces, ball loads and energies at all samples: {loads * 1e3:.1f} ms")
        share = (whole[1] - whole[0] + loads) / whole[1]
        print(f"  ball loads and heat together: {100 * share:.0f} % of the drop's time (goal: at most 30 %)")


if __name__ == "__main__":
    main()
