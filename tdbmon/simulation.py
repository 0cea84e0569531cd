"""Simulation of a drop for the command line, with typical sensors; its main results as text and JSON."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from tdbsim.effect import Effect
from tdbsim.errors import InputError
from tdbsim.first_use import is_compiled
from tdbsim.machine import Machine
from tdbsim.sensors import ProbeChain, SensorChain, least_sampling
from tdbsim.simulate import DropPlan, simulate
from tdbsim.stated_effects import all_effects, parse

from tdbmon.estimate import Estimate
from tdbmon.option_quantity import sampling_of, seconds_of, speed_of
from tdbmon.progress import Progress
from tdbmon.ring_speed import turns_along
from tdbmon.unsettled_end import unsettled_lines

# a typical eddy-current probe: 0.25 um of noise, a little hum, a 16-bit converter over 2 mm, or over six gaps if that is wider
# (the default `range` of a machine file is three gaps to either side)
_PROBE = ProbeChain(noise=0.25e-6, hum=0.1e-6, full_scale=1e-3)
_GAPS = 3.0
_LEVITATED_S = 0.1
_COMPILING = "compiling the simulation (once on this computer, up to a minute), then simulating"
_EXACT = "a simulated value, without an interval"
_SAMPLED = "a simulated value, the greatest of the record's samples, without an interval"


def simulate_drop(
    machine: Machine,
    speed: str,
    seconds: str,
    effects: Sequence[str],
    seed: int,
    progress: Progress,
    sampling: str | None = None,
) -> xr.Dataset:
    """Simulate a drop from the texts of command-line options.

    The default `sampling` is 20 kHz, or more if the keyphasor's pulses require it.

    Raises
    ------
    InputError
        If a text is not a valid quantity, an effect or its place is unknown or its size is zero, or the integration does not
        converge.
    """
    hz = speed_of(speed)
    rate = max(DropPlan.sampling, least_sampling(machine, hz)) if sampling is None else sampling_of(sampling)
    widest = max(bearing.radial_gap.high for bearing in machine.touchdown_bearings)
    probe = replace(_PROBE, full_scale=max(_PROBE.full_scale, _GAPS * widest))
    plan = DropPlan(
        speed=hz,
        seconds=seconds_of(seconds),
        levitated=_LEVITATED_S,
        sampling=rate,
        sensors=SensorChain(probe=probe, speed_noise_hz=0.05),
        seed=seed,
    )
    wanted = tuple(parse(text) for text in effects)
    for effect in wanted:
        if effect.is_off:
            first = effect.parameters()[0]
            raise InputError(
                f"{effect.identifier()}: {first.name} is {first.text(first.off)}, so the effect does nothing;"
                f" give it a size, e.g. {first.name}={first.text(first.typical)}"
            )
    progress("simulating" if is_compiled(plan.method) else _COMPILING)
    return simulate(machine, plan, wanted)


def _numbers(drop: xr.Dataset, machine: Machine) -> dict[str, dict[str, Estimate]]:
    """Return the peak forces of each end, and the time at which its ring first turns with the journal."""
    out = {}
    release = float(drop.attrs["release_time_s"])
    for i, end in enumerate(drop["end"].values):
        ring, shaft = drop["ring_speed"].values[i], drop["rotor_speed"].values
        bearing = machine.bearing(str(end))
        bore = bearing.journal_radius + bearing.radial_gap.nominal
        rolls = turns_along(ring, shaft, bearing.journal_radius, bore)
        caught = np.flatnonzero(rolls & (drop["time"].values >= release))
        peak = Estimate(float(drop["peak_normal_force"].values[i]), unit="N", why=_EXACT, kind="0-pk")
        ball = Estimate(float(drop["ball_load"].values[i].max()), unit="N", why=_SAMPLED, kind="0-pk")
        if shaft[0] == 0.0:
            when = Estimate.missing("s", "the shaft does not turn")
        elif drop["peak_normal_force"].values[i] == 0.0:
            when = Estimate.missing("s", "the shaft does not touch the ring within the simulated time")
        elif caught.size:
            at = float(drop["time"].values[caught[0]]) - release
            when = Estimate(at, unit="s", method="first sample with the ring at 98 % of the journal's surface speed", why=_EXACT)
        else:
            when = Estimate.missing("s", "the ring does not reach the journal's speed within the simulated time")
        out[str(end)] = {"peak_force_n": peak, "peak_ball_load_n": ball, "ring_at_speed_s": when}
    return out


def _given_again(effects: Sequence[Effect]) -> list[str]:
    """Return a remark on each effect given more than once at a place, machine file included: none replaces another."""
    given = Counter((each.identifier(), each.where) for each in effects)
    return [
        f"{name} is given {count} times for '{where}', machine file included: all of them act together"
        for (name, where), count in given.items()
        if count > 1
    ]


def simulation_lines(drop: xr.Dataset, machine: Machine, effects: Sequence[str]) -> list[str]:
    """Return the main results of a drop, simulated with effects in addition to the machine's own, as lines of text."""
    acting = all_effects(machine, map(parse, effects))
    lines = [f"{drop.attrs['title']}; effects: {drop.attrs['effects'] or 'none'}", *_given_again(acting)]
    names = {
        "peak_force_n": "peak force on the ring",
        "peak_ball_load_n": "peak ball load, sampled",
        "ring_at_speed_s": "ring at shaft speed after",
    }
    for end, numbers in _numbers(drop, machine).items():
        lines.append(end)
        lines += [f"  {names[name]:<26}{value}" for name, value in numbers.items()]
    return lines + unsettled_lines(drop, machine)


def simulation_json(drop: xr.Dataset, machine: Machine) -> dict[str, Any]:
    """Return the main results of a simulated drop as plain dictionaries, times from the record's first sample."""
    release = float(drop.attrs["release_time_s"])
    ends = {}
    for end, numbers in _numbers(drop, machine).items():
        since_start = {"ring_at_speed_s": numbers["ring_at_speed_s"].later(release)}
        ends[end] = {name: value.to_json() for name, value in {**numbers, **since_start}.items()}
    return {
        "synthetic": True,
        "title": drop.attrs["title"],
        "machine": drop.attrs["machine"],
        "effects": drop.attrs["effects"],
        "release_time_s": release,
        "ends": ends,
    }
