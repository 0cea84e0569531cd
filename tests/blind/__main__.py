"""Blind cases: make them, put them through `tdbmon diagnose`, and write the page about it.

python -m tests.blind --cases 300 --seed 1 --jobs 2 --out FOLDER     resumes where it stopped; FOLDER/blind.md
python -m tests.blind --page docs/blind.md --out FOLDER              only the page
python -m tests.blind --only-generate N DIR [--kind ...] [--effect NAME]

A page is about the cases of FOLDER and those of the ledger beside it (docs/blind.jsonl), which keeps all of them, a line each.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from tests.blind.case import FIRST_CALIBRATION_SEED, KINDS, STRONG, draw_case, write
from tests.blind.effects import names, outside
from tests.blind.outcome import Outcome, diagnose_case, load, with_ledger
from tests.blind.table import page

ABOUT_STRONG = (
    f"These cases are *strong*: the generator as it stands with plain laws, single effects from {STRONG:g} of their range of"
    " sizes (counted logarithmically) up. They show how well the method finds what was hidden."
)


def main() -> None:
    """Read the command line and do what it asks for."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.blind", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cases", type=int, default=0, metavar="N", help="diagnose N cases")
    parser.add_argument("--jobs", type=int, default=1, help="number of cases diagnosed in parallel")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="folder for the outcomes, one JSON per case")
    parser.add_argument("--page", type=Path, metavar="FILE", help="file of the page; default FOLDER/blind.md")
    parser.add_argument("--remark", default="", metavar="TEXT", help="remark for the page: how the cases were run")
    parser.add_argument("--only-generate", nargs=2, metavar=("N", "DIR"), help="write N cases into a folder")
    parser.add_argument(
        "--seed", type=int, default=1, help=f"seed of the first case; from {FIRST_CALIBRATION_SEED} on: for calibration"
    )
    parser.add_argument("--kind", choices=KINDS, help="what is hidden; drawn by default")
    parser.add_argument("--effect", choices=(*names(), *outside()), metavar="NAME", help="hide this effect")
    parser.add_argument("--strangeness", type=float, help="0 to 1; by default 0 for even seeds, 1 for odd ones")
    parser.add_argument("--strong", action="store_true", help="the generator as it stands, plain laws, strong effects")
    o = parser.parse_args()
    if o.only_generate:
        count, folder = int(o.only_generate[0]), Path(o.only_generate[1])
        for seed in range(o.seed, o.seed + count):
            case = draw_case(seed, kind=o.kind, effect=o.effect, strangeness=o.strangeness, strong=o.strong)
            write(case, folder / f"case_{seed:07d}")
            hidden = ", ".join(f"{h.name} at {h.where}" for h in case.hidden) or "nothing hidden"
            print(f"case_{seed:07d}: {hidden}", flush=True)
        return
    if o.out is None:
        parser.error("--out FOLDER is needed: the folder for the outcomes")
    with ProcessPoolExecutor(o.jobs) as pool:
        ahead = [
            pool.submit(
                diagnose_case, seed, o.out, kind=o.kind, effect=o.effect, strangeness=o.strangeness, strong=o.strong
            )
            for seed in range(o.seed, o.seed + o.cases)
        ]
        for done in as_completed(ahead):
            print(_line(done.result()), flush=True)
    outcomes = [load(path) for path in sorted(o.out.glob("case_*.json"))]
    target = o.page or o.out / "blind.md"
    outcomes = with_ledger(target.with_suffix(".jsonl"), outcomes)
    command = "python -m tests.blind --strong" if o.strong else "python -m tests.blind"
    remark = " ".join(part for part in (ABOUT_STRONG if o.strong else "", o.remark) if part)
    target.write_text(page(outcomes, command, remark), encoding="utf-8")
    print(f"{len(outcomes)} cases: {target}")


def _line(outcome: Outcome) -> str:
    j = outcome.judgement
    if j is None:
        return f"{outcome.seed}: FAILED {outcome.error}"
    hidden = ", ".join(f"{name} at {w}" for name, w in zip(j.hidden, outcome.where, strict=True)) or "nothing"
    right = "right" if j.right and j.place else "right, place wrong" if j.right else "WRONG"
    return (
        f"{outcome.seed}: {right}  hidden {hidden}  said {j.verdict} {', '.join(j.said)}"
        f"  signal {outcome.signal:.0f}  gain {outcome.gain}  {outcome.seconds:.0f} s"
    )


if __name__ == "__main__":
    main()
