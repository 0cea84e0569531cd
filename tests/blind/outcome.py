"""One case through `tdbmon diagnose` on the command line, and the outcome as JSON."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from tests.blind.case import draw_case, write
from tests.blind.judge import Judgement, Size, judge
from tests.blind.projected_signal import projected_signal


@dataclass(frozen=True)
class Outcome:
    """A case and its judgement; if the command failed, `judgement` is None and `error` says why.

    `levels` and `where` are those of the hidden effects in alphabetical order.
    """

    seed: int
    strangeness: float
    levels: tuple[float, ...]
    signal: float
    machine: str
    where: tuple[str, ...]
    seconds: float
    processor_seconds: float
    gain: float | None
    judgement: Judgement | None
    error: str
    result: dict[str, Any]


def diagnose_case(
    seed: int,
    folder: Path,
    *,
    kind: str | None = None,
    effect: str | None = None,
    strangeness: float | None = None,
    strong: bool = False,
    drops: tuple[int, ...] = (0, 1, 2, 3),
) -> Outcome:
    """Make a case, diagnose it and keep the outcome in a folder; an outcome that is there without error is read instead."""
    path = folder / f"case_{seed:07d}.json"
    if path.exists() and not (kept := load(path)).error:
        return kept
    case = draw_case(seed, kind=kind, effect=effect, strangeness=strangeness, strong=strong)
    with tempfile.TemporaryDirectory() as temporary:
        place = Path(temporary)
        write(case, place)
        answer = json.loads((place / "answer.json").read_text(encoding="utf-8"))
        files = [f"drop_{case.machine.speeds[k]:03d}.nc" for k in drops]
        command = [sys.executable, "-m", "tdbmon", "diagnose", "machine.toml", *files, "--json", "result.json"]
        began = time.monotonic()
        with (place / "errors").open("w+") as errors:
            process = subprocess.Popen(command, cwd=place, stdout=subprocess.DEVNULL, stderr=errors)
            _, status, usage = os.wait4(process.pid, 0)
            seconds = time.monotonic() - began
            errors.seek(0)
            said = errors.read().strip().splitlines()
        done = place / "result.json"
        result = json.loads(done.read_text(encoding="utf-8")) if done.exists() else {}
        process.returncode = code = os.waitstatus_to_exitcode(status)
        error = "" if result and code in (0, 3) else f"exit code {code}: {said[-1] if said else 'no output'}"
    ordered = sorted(zip(case.hidden, case.levels, strict=True), key=lambda pair: pair[0].name)
    outcome = Outcome(
        seed=seed,
        strangeness=case.strangeness,
        levels=tuple(level for _, level in ordered),
        signal=projected_signal(case),
        machine=case.machine.name,
        where=tuple(hidden.where for hidden, _ in ordered),
        seconds=seconds,
        processor_seconds=usage.ru_utime + usage.ru_stime,
        gain=result.get("gain"),
        judgement=None if error else judge(answer, result),
        error=error,
        result=result,
    )
    folder.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(".partial")
    partial.write_text(json.dumps(asdict(outcome), indent=1), encoding="utf-8")
    partial.replace(path)
    return outcome


def load(path: Path) -> Outcome:
    """Return a kept outcome."""
    return _outcome(json.loads(path.read_text(encoding="utf-8")))


def with_ledger(ledger: Path, outcomes: Iterable[Outcome]) -> list[Outcome]:
    """Return the outcomes together with those of other seeds in a ledger, sorted by seed, and write all of them there.

    The ledger has one line per case, without the command's result; it is created if missing.
    """
    lines = ledger.read_text(encoding="utf-8").splitlines() if ledger.exists() else []
    before = [_outcome({**json.loads(line), "result": {}}) for line in lines]
    everything = {each.seed: each for each in (*before, *outcomes)}
    kept = [everything[seed] for seed in sorted(everything)]
    rows = [{name: value for name, value in asdict(each).items() if name != "result"} for each in kept]
    partial = ledger.with_suffix(".partial")
    partial.write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")
    partial.replace(ledger)
    return kept


def _outcome(data: dict[str, Any]) -> Outcome:
    judged = data.pop("judgement")
    if judged is not None:
        judged["sizes"] = tuple(Size(**size) for size in judged["sizes"])
        judged["stated"] = tuple((p, bool(true)) for p, true in judged["stated"])
        judged["hidden"], judged["said"] = tuple(judged["hidden"]), tuple(judged["said"])
    data["levels"], data["where"] = tuple(data["levels"]), tuple(data["where"])
    return Outcome(judgement=None if judged is None else Judgement(**judged), **data)
