"""The archive: records per minute on one and two processes, memory over 500 records, time of a comparison among 100,000 drops.

The records are copies of a shipped synthetic one, each with 0.1 um of independent noise; the 100,000 drops (a thousand machines
with a hundred each) have randomly drawn features, inserted into the catalogue as `archive add` does.  Processor time is printed
beside wall-clock time, since the ratio of two processes to one needs two free cores.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from tdbmon.history import catalogue
from tdbmon.history.archive import open_archive
from tdbmon.history.batch import add_all
from tdbmon.history.contract import comparison_json
from tdbmon.history.feature import Feature
from tdbmon.history.filing import Filing
from tdbmon.history.standing import judge
from tdbmon.history.study import Order, study
from tdbmon.record.read import read, write
from tdbmon.shipped import shipped

_RECORDS, _LONG = 500, 500
_MACHINES, _DROPS = 1000, 100
_MACHINE = shipped("short/machine.toml")


def main() -> None:
    """Print the measurements; goals: 1.8 times the rate on two processes, a comparison under 0.5 s, constant memory."""
    with tempfile.TemporaryDirectory() as folder:
        _comparison(Path(folder))
    with tempfile.TemporaryDirectory() as folder:
        records = _copies(Path(folder), _LONG)
        _throughput(Path(folder), records[:_RECORDS])
        # in a fresh process, so that memory used before does not count
        code = "import sys; from benchmarks.archive import memory; memory(sys.argv[1])"
        subprocess.run([sys.executable, "-c", code, folder], check=True)


def _copies(folder: Path, count: int) -> list[Path]:
    record = read(shipped("short/drop_100.nc"))
    rng = np.random.default_rng(0)
    paths = []
    for i in range(count):
        noisy = record.copy(deep=True)
        for name in ("NDE_A", "NDE_B", "DE_A", "DE_B"):
            noisy[name] = noisy[name] + rng.normal(0, 1e-7, noisy[name].shape)
            noisy[name].attrs = record[name].attrs
            noisy[name].encoding = {}
        paths.append(folder / f"drop_{i:03d}.nc")
        write(noisy, paths[-1])
    return paths


def _throughput(folder: Path, records: list[Path]) -> None:
    orders = [Order(_MACHINE, record) for record in records]
    study(orders[0])  # warm-up: imports and caches are not measured
    rates = []
    for workers in (1, 2):
        archive = open_archive(folder / f"archive_{workers}", create=True)
        before = _processor(), time.perf_counter()
        states = [outcome.state for outcome in add_all(archive, orders, workers=workers)]
        assert states == ["filed"] * len(orders)
        processor, clock = _processor() - before[0], time.perf_counter() - before[1]
        rates.append(60 * len(orders) / clock)
        print(
            f"{workers} process{'es' * (workers > 1)}: {rates[-1]:.0f} records a minute;"
            f" {processor / len(orders):.2f} s of processor time a record"
        )
    print(f"ratio {rates[1] / rates[0]:.2f} on {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")


def memory(folder: str) -> None:
    """Print the memory of this process while it files many records."""
    archive = open_archive(Path(folder) / "archive_long", create=True)
    orders = [Order(_MACHINE, record) for record in sorted(Path(folder).glob("drop_*.nc"))]
    sizes = []
    for i, _ in enumerate(add_all(archive, orders), start=1):
        if i % 100 == 0 or i == 50:
            sizes.append(f"{_resident():.0f} MB after {i}")
    print("memory: " + ", ".join(sizes))


def _resident() -> float:
    """Return the resident memory of this process, MB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 2**20


def _processor() -> float:
    both = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in both)


def _comparison(folder: Path) -> None:
    archive = open_archive(folder / "archive", create=True)
    model = study(Order(_MACHINE, shipped("short/drop_100.nc")))
    rng = np.random.default_rng(1)
    start = time.perf_counter()
    with catalogue.writing(archive.catalogue) as base:
        for machine in range(_MACHINES):
            for number in range(_DROPS):
                catalogue.insert(base, _drawn(model, machine, number, rng), "raw", f"{machine}/{number}", "none")
    size = archive.catalogue.stat().st_size / 1e6
    rows = _MACHINES * _DROPS * len(model.features)
    print(f"{_MACHINES * _DROPS} drops, {rows} features: {size:.0f} MB, made in {time.perf_counter() - start:.0f} s")
    entries = archive.entries("machine 500")
    comparison_json(judge(archive, entries[-1].id))  # imports
    times = []
    for entry in entries[-5:]:
        start = time.perf_counter()
        found = judge(archive, entry.id)
        comparison_json(found)
        times.append(time.perf_counter() - start)
    print(
        f"comparison, verdict and JSON with {len(found.comparison.matched)} drops before: {sorted(times)[2]:.3f} s (median of 5)"
    )


def _drawn(model: Filing, machine: int, number: int, rng: np.random.Generator) -> Filing:
    features = tuple(
        Feature(f.name, f.end, replace(f.estimate, value=f.estimate.value * float(rng.normal(1, 0.01))))
        if f.estimate.value is not None and f.name != "initial_hz"
        else f
        for f in model.features
    )
    return replace(
        model,
        sha256=f"{machine * _DROPS + number:012x}" + "0" * 52,
        machine=f"machine {machine}",
        dropped=f"{1900 + number}-01-01T00:00:00Z",
        features=features,
    )


if __name__ == "__main__":
    main()
