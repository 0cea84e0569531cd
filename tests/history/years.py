"""Ten drops of one machine over ten years, the last three with a worn journal: `python -m tests.history.years datasets/years`.

The drops come from the generator of `tests/blind`, which shares no code with the simulator that the analysis knows.  Set-point,
angles and speed at the release differ from drop to drop; from the eighth drop on the journal at NDE is worn by 20 um.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import netCDF4
import numpy as np

from tests.blind.case import Case, _start, draw_case
from tests.blind.machine import toml
from tests.blind.sensors import FULL_SCALE, Channels, read
from tests.blind.truth import RATE, Start, run

SEED = 4242
DROPS, WORN_FROM, WEAR = 10, 8, 20e-6
SECONDS = 3.0
_EVERY = 2  # of the samples is kept: 10 kHz


def main(folder: Path) -> None:
    """Write the machine file, the drops and the answer."""
    folder.mkdir(parents=True, exist_ok=True)
    case = draw_case(SEED, kind="none", strangeness=0.0)
    (folder / "machine.toml").write_text(toml(case.machine), encoding="utf-8")
    rng = np.random.default_rng([SEED, 77])
    speed = case.machine.speeds[1]
    first = _start(case.machine, speed, rng)
    for number in range(1, DROPS + 1):
        wear = WEAR if number >= WORN_FROM else 0.0
        nde, de = case.world.truth.bearings
        truth = replace(case.world.truth, bearings=(nde._replace(gap=nde.gap + wear), de))
        drop = run(truth, _again(case, first, rng), samples=int(SECONDS * RATE))
        noise = np.random.default_rng([SEED, 200 + number])
        channels = read(drop, case.machine, case.world.sensors, case.world.marks[1], noise)
        _write(folder / f"drop_{number:02d}.nc", case, channels, number, speed)
    answer = {"worn_from_drop": WORN_FROM, "end": "NDE", "wear_of_the_journal_m": WEAR, "seed": SEED}
    (folder / "answer.json").write_text(json.dumps(answer, indent=1) + "\n", encoding="utf-8")


def _again(case: Case, first: Start, rng: np.random.Generator) -> Start:
    """A drop like the first: the same set-point to a micrometre, the same speed to a percent, any angles."""
    angles = _start(case.machine, round(first.speed / 2 / np.pi), rng)
    near = tuple(place + complex(*rng.normal(0, 1e-6, 2)) for place in first.set_point)
    return replace(angles, set_point=near, speed=2 * np.pi * case.machine.speeds[1] * rng.uniform(0.99, 1.0))


def _write(path: Path, case: Case, channels: Channels, number: int, speed: int) -> None:
    step = slice(None, None, _EVERY)
    with netCDF4.Dataset(path, "w", format="NETCDF4") as file:
        file.title = f"Synthetic dropdown from {speed} Hz"
        file.machine = case.machine.name
        file.drop_number = np.int64(number)
        file.date = f"{2014 + number}-05-11T09:00:00Z"
        count = len(channels.speed[step])
        file.createDimension("time", count)
        time = file.createVariable("time", "f8", ("time",), zlib=True)
        time.units = "s"
        time[:] = np.arange(count) * _EVERY / RATE
        for p, probe in enumerate(case.machine.probes):
            channel = file.createVariable(probe.name, "i2", ("time",), zlib=True, complevel=7)
            channel.units = "um"
            channel.scale_factor = FULL_SCALE * 1e6 / 32768
            channel.add_offset = 0.0
            channel.set_auto_scale(False)
            channel[:] = np.round(channels.probes[step, p] / (FULL_SCALE / 32768)).astype(np.int16)
        pulse = file.createVariable("keyphasor", "i1", ("time",), zlib=True, complevel=7)
        pulse.units = "1"
        pulse[:] = channels.keyphasor[step]
        signal = file.createVariable("speed", "f4", ("time",), zlib=True, complevel=7, least_significant_digit=3)
        signal.units = "Hz"
        signal[:] = channels.speed[step]


if __name__ == "__main__":
    main(Path(sys.argv[1]))
