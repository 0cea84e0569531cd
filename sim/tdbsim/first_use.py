"""Kernels compiled, before their first use, by a process of their own.

numba compiles what a kernel calls (`tdbsim.cache.called`) for itself too, and a kernel that was just compiled calls that.
Loaded from the cache, it calls the copies within it, which the compiler saw together with it and which round otherwise.
A process that only loads kernels comes to the same last digits as all later ones.  Of several that begin at a time one has a
kernel compiled, and the others wait for it.
"""

from __future__ import annotations

import pickle
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from threading import Lock
from typing import TYPE_CHECKING, Any

from tdbsim.cache import kernel_folder
from tdbsim.drop_model import DropModel

if TYPE_CHECKING:
    from tdbsim.simulate import DropPlan

_SECONDS = 1e-3  # of a drop that is simulated to have a kernel compiled
_PATIENCE_S = 600.0  # with another process that has one compiled, which takes a minute or two
_CHILD = (
    "import pickle, sys\n"
    "sys.path[:] = pickle.load(sys.stdin.buffer)\n"
    "from tdbsim.first_use import compile_here\n"
    "compile_here(*pickle.load(sys.stdin.buffer))\n"
)

_seen: set[str] = set()  # kernels that are compiled, or for which that was tried
_lock = Lock()


def is_compiled(kernel: str) -> bool:
    """Return whether a kernel needs no compiling, which takes most of a minute, before its next use."""
    return kernel in _seen or _in_cache(kernel) or not _compiles()


def compile_apart(kernel: str, model: DropModel, plan: DropPlan) -> None:
    """See to it that a kernel is in the cache; where that cannot be, the first call in this process compiles it.

    Parameters
    ----------
    kernel : str
        The module of its ``integrate``: ``splitting``, ``dormand_prince`` or ``lanes``.
    model, plan
        A drop that uses it.
    """
    if kernel in _seen:
        return
    with _lock:
        if kernel not in _seen and not _in_cache(kernel) and _compiles():
            with _one_at_a_time():
                if not _in_cache(kernel):  # another process may have seen to it meanwhile
                    subprocess.run(
                        [sys.executable, "-c", _CHILD],
                        input=pickle.dumps(sys.path) + pickle.dumps((kernel, model, plan)),
                        capture_output=True,
                        check=False,
                    )
        _seen.add(kernel)


def compile_here(kernel: str, model: DropModel, plan: DropPlan) -> None:
    """Compile a kernel in this process, by a short drop; it stays in the cache."""
    from tdbsim.side_by_side import run_side_by_side
    from tdbsim.simulate import run

    _seen.add(kernel)
    short = replace(plan, seconds=_SECONDS, levitated=min(plan.levitated, _SECONDS))
    if kernel == "lanes":
        run_side_by_side([(model, short)])
    else:
        run(model, short)


@contextmanager
def _one_at_a_time() -> Iterator[None]:
    """Hold off other processes that share the cache, by the lock of a database: it ends with the process that holds it."""
    import sqlite3

    with ExitStack() as held:
        with suppress(sqlite3.Error):  # a folder that knows no locks: at worst both compile
            lock = sqlite3.connect(kernel_folder() / "compiling.sqlite", timeout=_PATIENCE_S, isolation_level=None)
            held.callback(lock.close)
            lock.execute("BEGIN EXCLUSIVE")
        yield


def _in_cache(kernel: str) -> bool:
    python = f"py{sys.version_info.major}{sys.version_info.minor}"
    # numba writes its index (.nbi) before the code
    return any(kernel_folder().rglob(f"{kernel}.integrate-*.{python}*.nbc"))


def _compiles() -> bool:
    """True where another interpreter can compile; in a frozen program there is none, and without a compiler no need."""
    import numba

    config: Any = numba.config
    return bool(sys.executable) and not getattr(sys, "frozen", False) and not config.DISABLE_JIT
