"""Work in processes gives what work one after the other gives, to the last bit."""

import os
import pickle
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from tdbsim.effect import catalogue
from tdbsim.errors import InputError

from tdbmon.identify.crew import Crew, all_cores
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.least_squares import linearised
from tdbmon.identify.problem import build_problem
from tests.identify import drops


def square(number):
    if number < 0:
        raise InputError(f"{number} is negative")
    return number**2, os.getpid()


def test_tasks_come_back_in_order_from_other_processes():
    with Crew(2) as crew:
        found = crew.apart(square, [(k,) for k in range(20)])
    assert [value for value, _ in found] == [k**2 for k in range(20)]
    assert os.getpid() not in {process for _, process in found}
    assert 1 <= len({process for _, process in found}) <= 2


def test_an_error_of_a_task_reaches_who_asked():
    with Crew(2) as crew, pytest.raises(InputError, match="-3 is negative"):
        crew.apart(square, [(2,), (-3,)])


def test_slopes_from_processes_are_the_same():
    machine = drops.machine()
    measured = tuple(measured_drop(drops.drop(seed=seed), machine) for seed in (1, 2))
    with Crew() as alone, Crew(2) as two:
        one = linearised(build_problem(machine, measured, alone), build_problem(machine, measured, alone).start, 0.012)
        other = linearised(build_problem(machine, measured, two), build_problem(machine, measured, two).start, 0.012)
    for a, b in zip(one.slopes, other.slopes, strict=True):
        assert np.count_nonzero(a)
        assert np.array_equal(a, b)


def test_a_closed_or_sent_crew_works_one_after_the_other():
    sent = pickle.loads(pickle.dumps(Crew(3)))
    assert sent.apart(square, [(3,), (4,)]) == [(9, os.getpid()), (16, os.getpid())]
    assert sent.together(lambda k: k + 1, range(3)) == [1, 2, 3]


def test_effects_travel_by_name():
    for each in catalogue():
        assert pickle.loads(pickle.dumps(each)) is each


_OPEN_FOR_EVER = """
import os, sys, time
from tdbmon.identify.crew import Crew
from tests.identify.test_crew import square
if __name__ == "__main__":
    with Crew(2) as crew:
        print(*{process for _, process in crew.apart(square, [(k,) for k in range(4)])}, flush=True)
        time.sleep(600)
"""


def alive(process):
    stat = Path(f"/proc/{process}/stat")
    return stat.exists() and stat.read_text().rpartition(")")[2].split()[0] != "Z"


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc to see processes")
def test_workers_end_with_a_parent_that_is_killed(tmp_path):
    script = tmp_path / "open_for_ever.py"
    script.write_text(_OPEN_FOR_EVER)
    root = Path(__file__).parents[2]
    paths = os.pathsep.join([str(root), str(root / "sim"), os.environ.get("PYTHONPATH", "")])
    with subprocess.Popen(
        [sys.executable, script],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": paths},
    ) as parent:
        workers = [int(process) for process in parent.stdout.readline().split()]
        assert workers
        assert all(map(alive, workers))
        parent.kill()
    until = time.monotonic() + 20
    while any(map(alive, workers)) and time.monotonic() < until:
        time.sleep(0.1)
    assert not any(map(alive, workers))


def test_no_more_workers_than_cores():
    assert 1 <= all_cores() <= (os.cpu_count() or 1)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells which cores a process may use")
def test_no_more_workers_than_cores_that_this_process_may_use():
    code = "import os; os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})\n"
    code += "from tdbmon.identify.crew import all_cores; print(all_cores())"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout.split() == ["1"]
