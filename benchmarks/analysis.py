"""Time and memory of the main job on the whole coast-down: 85 s at 10 kHz, four probes, speed, keyphasor.

All steps run in a fresh process, as a user would run them, and the analysis once more when warm; the reference is one plain
pass of a Hann-windowed short-time FFT (scipy) over the same four channels in the same process.
"""

from __future__ import annotations

import subprocess
import sys

_STEPS = """
import resource, time
t0 = time.perf_counter()
from tdbsim.machine import load_machine
from tdbmon.analysis.analyse import analyse
from tdbmon.record.read import read
from tdbmon.shipped import shipped
machine = load_machine(shipped("coastdown/machine.toml"))
t1 = time.perf_counter()
record = read(shipped("coastdown/drop_100.nc"))
result = analyse(record, machine)
t2 = time.perf_counter()
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
result = analyse(read(shipped("coastdown/drop_100.nc")), machine)
t3 = time.perf_counter()
import pathlib, tempfile
from tdbmon.report.drop_report import build_report
from tdbmon.report.html import write_html
from tdbmon.report.pdf import write_pdf
with tempfile.TemporaryDirectory() as folder:
    document = build_report(result)
    page, paper = pathlib.Path(folder, "r.html"), pathlib.Path(folder, "r.pdf")
    write_html(document, page)
    write_pdf(document, paper)
    sizes = page.stat().st_size / 1e6, paper.stat().st_size / 1e6
t_reports = time.perf_counter()
from tdbmon.record.assign import assign
from tdbmon.record.quality import check
record = assign(record, machine)
t4 = time.perf_counter()
check(record, machine)
t4, checks = time.perf_counter(), time.perf_counter() - t4
from scipy.signal import ShortTimeFFT
import numpy as np
t5 = time.perf_counter()
for name in ("NDE_A", "NDE_B", "DE_A", "DE_B"):
    ShortTimeFFT(np.hanning(8192), 2048, 1e4).stft(record[name].to_numpy())
t6 = time.perf_counter()
print(f"imports and machine {t1 - t0:.2f} s; read and analyse {t2 - t1:.2f} s cold, {t3 - t2:.2f} s warm")
print(f"peak memory {peak:.0f} MB after the first analysis")
print(f"both reports {t_reports - t3:.2f} s; HTML {sizes[0]:.2f} MB, PDF {sizes[1]:.2f} MB")
print(f"checks of the record {checks:.2f} s, {checks / (t6 - t5):.2f} of a plain short-time FFT")
print(f"ratio of the warm analysis to a plain short-time FFT ({t6 - t5:.2f} s): {(t3 - t2) / (t6 - t5):.1f}")
"""


def main() -> None:
    """Print the measurements; goals: analysis under 3 s and 600 MB, reports under 5 s, help under 0.5 s."""
    import time

    subprocess.run([sys.executable, "-c", _STEPS], check=True)
    start = time.perf_counter()
    subprocess.run([sys.executable, "-m", "tdbmon", "--help"], check=True, stdout=subprocess.DEVNULL)
    print(f"tdbmon --help {time.perf_counter() - start:.2f} s")


if __name__ == "__main__":
    main()
