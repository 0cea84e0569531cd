"""Adds drops in a child process, kills it at a random instant, looks at the archive, and does so again and again.

Run as a program of its own: a fork of a process with threads is no test of anything.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from pathlib import Path

import numpy as np

from tdbmon.history.archive import open_archive
from tdbmon.history.verify import verify
from tests.history.made import files, filing

_A_FOLDER = 8  # kills


def main(folder: Path, kills: int) -> None:
    """Print what was seen as JSON."""
    rng = np.random.default_rng(0)
    seen = {"kills": 0, "unfinished": 0, "faults": [], "lost": 0, "repeated": [], "journals": 0}
    number, first = 0, 0
    known: set[str] = set()
    for kill in range(kills):
        if kill % _A_FOLDER == 0:  # a new one now and then: looking at all files of one takes ever longer
            archive, known = open_archive(folder / f"archive_{kill}", create=True), set()
            first = number
        pair, status = os.pipe(), 0
        child = os.fork()
        if child == 0:
            os.close(pair[0])
            for i in range(number, number + 50):
                raw, machine = files(folder / "raw", i)
                made = filing(raw, machine, seed=i, few=True)
                os.write(pair[1], b"x")  # only the filing itself shall be killed, not the making of what is filed
                archive.add(made, raw, machine)
                os.write(pair[1], b"y")
            os._exit(0)
        os.close(pair[1])
        done = 0
        os.read(pair[0], 1)
        time.sleep(float(rng.uniform(0, 0.03)))
        os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
        while more := os.read(pair[0], 1000):
            done += more.count(b"y")
        os.close(pair[0])
        seen["kills"] += os.WIFSIGNALED(status)
        seen["journals"] += (archive.folder / "catalogue.sqlite-journal").exists()
        faults = verify(archive)
        seen["unfinished"] += any(f.harmless for f in faults)
        seen["faults"] += [f"{f.file}: {f.what}" for f in faults if not f.harmless]
        now = {entry.id for entry in archive.entries()}
        seen["lost"] += len(known - now) + (len(now) < len(known) + done)
        # the add that was cut short is repeated, and is whole then
        raw, machine = files(folder / "raw", number + done)
        seen["repeated"].append(archive.add(filing(raw, machine, seed=number + done, few=True), raw, machine))
        seen["faults"] += [f"after repeating: {f.file}: {f.what}" for f in verify(archive)]
        known = {entry.id for entry in archive.entries()}
        number += done + 1
        seen["lost"] += len(known) != number - first
    print(json.dumps(seen))


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
