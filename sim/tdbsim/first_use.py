"""Compilation of kernels in a separate process before their first use.

numba compiles functions called by a kernel (`tdbsim.cache.called`) separately too, and a kernel just compiled calls these.
Loaded from the cache, it calls the copies inside it, which were optimised together with it and round differently.  A process
that only loads kernels therefore gives the same last digits as all later ones.  Of several processes that start together, one has
a kernel compiled and the others wait for it.
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

_SECONDS = 1e-3  # length of the drop that is simulated to trigger compilation
_PATIENCE_S = 600.0  # longest wait for another process that compiles, which takes a minute or two
_CHILD = (
    "import pickle, sys\n"
    "sys.path[:] = pickle.load(sys.stdin.buffer)\n"
    "from tdbsim.first_use import compile_here\n"
    "compile_here(*pickle.load(sys.stdin.buffer))\n"
)

_seen: set[str] = set()  # kernels that are compiled, or whose compilation was tried
_lock = Lock()


def is_compiled(kernel: str) -> bool:
    """Return whether a kernel is compiled already; compilation takes most of a minute."""
    return kernel in _seen or _in_cache(kernel) or not _compiles()


def compile_apart(kernel: str, model: DropModel, plan: DropPlan) -> None:
    """Ensure that a kernel is in the cache; where that fails, the first call in this process compiles it.

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
                if not _in_cache(kernel):  # another process may have compiled it meanwhile
                    subprocess.run(
                        [sys.executable, "-c", _CHILD],
                        input=pickle.dumps(sys.path) + pickle.dumps((kernel, model, plan)),
                        capture_output=True,
                        check=False,
                    )
        _seen.add(kernel)


def compile_here(kernel: str, model: DropModel, plan: DropPlan) -> None:
    """Compile a kernel into the cache in this process, by simulating a short drop."""
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
    """Exclude other processes that share the cache, by a database lock, which is released when its process ends."""
    import sqlite3

    with ExitStack() as held:
        with suppress(sqlite3.Error):  # a file system without locks: at worst both compile
            lock = sqlite3.connect(kernel_folder() / "compiling.sqlite", timeout=_PATIENCE_S, isolation_level=None)
            held.callback(lock.close)
            lock.execute("BEGIN EXCLUSIVE")
        yield


def _in_cache(kernel: str) -> bool:
    python = f"py{sys.version_info.major}{sys.version_info.minor}"
    # numba writes its index (.nbi) before the code
    return any(kernel_folder().rglob(f"{kernel}.integrate-*.{python}*.nbc"))


def _compiles() -> bool:
    """True where another interpreter can compile; not in a frozen program, nor with compilation disabled."""
    import numba

    config: Any = numba.config
    return bool(sys.executable) and not getattr(sys, "frozen", False) and not config.DISABLE_JIT
