"""Filings and files made up of numbers: what the archive does must not depend on an analysis."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np

from tdbmon.estimate import Estimate
from tdbmon.history.archive import Archive
from tdbmon.history.compare import Comparison
from tdbmon.history.feature import KINDS, Feature
from tdbmon.history.filing import Filing, StressBox
from tdbmon.history.standing import judge
from tdbmon.history.verdict import Verdict
from tdbmon.history.verify import verify

HOSTILE = "</script><b>&amp; $\\frac{1}$ #sys.inputs *b*"  # what markup and formulas would take for their own
ENDS = ("NDE", "DE")
# what a feature of this unit usually is, SI
USUAL = {
    "um": 250e-6,
    "ms": 7e-3,
    "N/m": 5e7,
    "N": 5e3,
    "MPa": 2e9,
    "N s/m": 4e3,
    "N m": 0.02,
    "Hz": 30.0,
    "s": 1.0,
    "1": 1.0,
}
_ROTOR = {"initial_hz", "keyphasor_ratio", "decay_time_s", "lost_speed_hz", "swing_1_hz"}


def filing(
    raw: Path,
    machine: Path,
    *,
    name: str = "made up",
    dropped: str = "",
    values: dict[tuple[str, str], float] | None = None,
    speed: float = 100.0,
    seed: int = 0,
    stress: float | None = None,
    fatigue: float | None = None,
    version: str = "0.1.0",
    assembly: str = "",
    few: bool = False,
    failed_checks: tuple[str, ...] = (),
) -> Filing:
    """Return a filing of a raw file, its features drawn around what is `USUAL`.

    `values`, in units of that, sets some of them; `few` keeps but six.  With `stress` the drop has forces; `fatigue` is in
    cycles, by default one at that stress, and 0 files it as before these were counted.
    """
    rng = np.random.default_rng(seed)
    features = [_feature("initial_hz", "", speed / USUAL["Hz"])]
    for kind in KINDS.values():
        for end in ("",) if kind.name in _ROTOR else ENDS:
            if kind.name not in ("initial_hz", "fatigue_cycles"):
                still = kind.name.startswith("whirl")  # no whirl, as in most drops
                features.append(_feature(kind.name, end, 0.0 if still else float(rng.normal(1.0, 0.01))))
    if stress is not None and fatigue != 0:
        cycles = (stress / 2e9) ** 9 if fatigue is None else fatigue
        features += [_feature("fatigue_cycles", end, cycles) for end in ENDS]
    given = {} if stress is None else {("stress_max_mpa", end): stress / USUAL["MPa"] for end in ENDS}
    given |= values or {}
    features = [f for f in features if f.name != "stress_max_mpa" or f.key in given]
    features = [_feature(f.name, f.end, given[f.key]) if f.key in given else f for f in features]
    boxes = (
        ()
        if stress is None
        else tuple(
            StressBox(end, stress, 0.3 * stress, 0.28 * stress, 0.2 * stress, 0.4 * stress, (0.9 * stress,))
            for end in ENDS
        )
    )
    return Filing(
        sha256=hashlib.sha256(raw.read_bytes()).hexdigest(),
        raw_name=raw.name,
        machine=name,
        machine_sha256=hashlib.sha256(machine.read_bytes()).hexdigest(),
        dropped=dropped,
        filed="2026-01-01T00:00:00+00:00",
        assembly=assembly,
        synthetic=True,
        version=version,
        forces=stress is not None,
        features=tuple(features[:6] if few else features),
        stress=boxes,
        failed_checks=failed_checks,
        analysis={"quality": [{"check": each, "passed": False, "detail": "made up"} for each in failed_checks]},
    )


def without(made: Filing, *ends: str) -> Filing:
    """Return the filing of a drop that does not show some ends, but that they did not whirl."""
    lost = [
        replace(f, estimate=Estimate.missing(f.estimate.unit, "the arc is too short"))
        if f.end in ends and not f.name.startswith("whirl")
        else f
        for f in made.features
    ]
    return replace(made, features=tuple(lost))


def files(folder: Path, seed: int, size: int = 4000) -> tuple[Path, Path]:
    """Write a raw file of noise and a machine file; return both."""
    folder.mkdir(parents=True, exist_ok=True)
    raw, machine = folder / f"drop_{seed}.nc", folder / "machine.toml"
    raw.write_bytes(np.random.default_rng(seed).bytes(size))
    machine.write_text('name = "made up"\n')
    return raw, machine


def fill(archive: Archive, folder: Path, count: int, **changes: object) -> list[Filing]:
    """File some drops, a day apart."""
    made = []
    for i in range(count):
        raw, machine = files(folder, i)
        one = filing(raw, machine, dropped=f"2020-01-{i + 1:02d}T00:00:00Z", seed=i, **changes)  # type: ignore[arg-type]
        assert archive.add(one, raw, machine) == "filed"
        made.append(one)
    return made


def newer(old: Filing, version: str) -> Filing:
    """Return the same drop as a newer version of the program would file it."""
    return replace(old, version=version, filed="2026-06-01T00:00:00+00:00")


def _feature(name: str, end: str, value: float) -> Feature:
    unit = KINDS[name].unit
    value *= USUAL[unit]
    return Feature(name, end, Estimate.from_sigma(value, 0.01 * abs(value), unit, "made up"))


def judged(archive: Archive, drop: str) -> tuple[Comparison, Verdict]:
    """Return a filed drop's comparison and its verdict."""
    found = judge(archive, drop)
    return found.comparison, found.verdict


def latest(archive: Archive) -> Comparison:
    """Return the comparison of the last drop of an archive."""
    return judge(archive, archive.entries()[-1].id).comparison


def add(archive: Archive, folder, seed: int, **changes):
    """File one more drop; return its identifier."""
    raw, machine = files(folder, seed)
    made = filing(raw, machine, seed=seed, **changes)
    archive.add(made, raw, machine)
    return made.drop


def wrong(archive: Archive) -> list[str]:
    """Return what an archive's check finds wrong."""
    return [f"{fault.file}: {fault.what}" for fault in verify(archive) if not fault.harmless]
