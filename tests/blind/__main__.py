"""Make cases: `python -m tests.blind --only-generate N DIR [--seed S] [--kind none|effect|pair|outside] [--effect NAME]`."""

from __future__ import annotations

import argparse
from pathlib import Path

from tests.blind.case import KINDS, draw_case, write
from tests.blind.effects import names, outside


def main() -> None:
    """Read the command line and do what it asks for."""
    parser = argparse.ArgumentParser(prog="python -m tests.blind", description=__doc__)
    parser.add_argument(
        "--only-generate", nargs=2, metavar=("N", "DIR"), help="write N cases into a folder", required=True
    )
    parser.add_argument("--seed", type=int, default=1, help="seed of the first case; from 1000000 on: for calibration")
    parser.add_argument("--kind", choices=KINDS, help="what is hidden; drawn by default")
    parser.add_argument("--effect", choices=(*names(), *outside()), metavar="NAME", help="hide this effect")
    parser.add_argument("--strangeness", type=float, help="0 to 1; by default 0 for even seeds, 1 for odd ones")
    options = parser.parse_args()
    count, folder = int(options.only_generate[0]), Path(options.only_generate[1])
    for seed in range(options.seed, options.seed + count):
        case = draw_case(seed, kind=options.kind, effect=options.effect, strangeness=options.strangeness)
        write(case, folder / f"case_{seed:07d}")
        print(
            f"case_{seed:07d}: {', '.join(f'{h.name} at {h.where}' for h in case.hidden) or 'nothing hidden'}",
            flush=True,
        )


if __name__ == "__main__":
    main()
