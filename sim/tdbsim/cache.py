"""Compiled kernels, kept between runs in a folder named by a hash of all of tdbsim's sources, their place and the processor.

numba looks only at the file of the function that it has compiled.  After an edit in another file (the friction law, an
effect) it would go on with the old physics, silently.  Here any edit of any source gives another folder.  What numba takes for
stale by itself has another folder too: what lies in one is loaded.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

_REASSOCIATED = {"reassoc", "contract", "nsz", "arcp"}
_KEPT_DAYS = 30  # folders of earlier sources are removed when they were not used for so long


@cache
def source_hash() -> str:
    """Return the hash of all of tdbsim's sources: their names and their contents."""
    root = Path(__file__).parent
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode())
        digest.update(b"\0")
        digest.update(path.read_bytes())
        digest.update(b"\0")
    return digest.hexdigest()[:16]


@cache
def kernel_key() -> str:
    """Return the hash of what code is compiled from, and for: the sources, their place, when they were written, the processor."""
    from llvmlite.binding import get_host_cpu_name

    root = Path(__file__).parent
    times = [path.stat().st_mtime_ns for path in sorted(root.rglob("*.py"))]
    return hashlib.sha256(repr((source_hash(), str(root), times, get_host_cpu_name())).encode()).hexdigest()[:16]


def _user_folder() -> Path:
    if "TDBMON_CACHE" in os.environ:
        return Path(os.environ["TDBMON_CACHE"])
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", str(Path.home()))) / "tdbmon"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "tdbmon"
    return Path(os.environ.get("XDG_CACHE_HOME", str(Path.home() / ".cache"))) / "tdbmon"


@cache
def kernel_folder() -> Path:
    """Return the folder of the compiled kernels; a temporary one where the user's cannot be written.

    ``TDBMON_CACHE`` names another place for it.
    """
    for base in (_user_folder() / "kernels", Path(tempfile.gettempdir()) / "tdbmon-kernels"):
        folder = base / kernel_key()
        try:
            folder.mkdir(parents=True, exist_ok=True)
            os.utime(folder)
        except OSError:
            continue
        _remove_old(base, folder)
        return folder
    return Path(tempfile.mkdtemp(prefix="tdbmon-kernels-"))


def _remove_old(base: Path, current: Path) -> None:
    import shutil

    oldest = time.time() - _KEPT_DAYS * 86400
    for folder in base.iterdir():
        try:
            if folder != current and folder.is_dir() and folder.stat().st_mtime < oldest:
                shutil.rmtree(folder, ignore_errors=True)
        except OSError:  # another process was quicker
            continue


def compiled(function: Callable[..., Any]) -> Any:
    """Compile a kernel on its first call, without Python objects and with a result kept on disk."""
    return _kept(function, False)


def reassociated(function: Callable[..., Any]) -> Any:
    """Compile as `compiled`, and let the compiler reorder sums for the processor's vectors; infinities keep meaning."""
    return _kept(function, _REASSOCIATED)


def _kept(function: Callable[..., Any], fastmath: Any) -> Any:
    import numba

    config: Any = numba.config
    before = config.CACHE_DIR
    config.CACHE_DIR = str(kernel_folder())
    try:
        return numba.njit(cache=True, error_model="numpy", nogil=True, fastmath=fastmath)(function)
    finally:
        config.CACHE_DIR = before  # other libraries keep their own folder


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a small function into each `compiled` kernel that calls it; the kernel keeps the result."""
    return _part(function, True, _REASSOCIATED)


def in_order(function: Callable[..., Any]) -> Any:
    """Compile as `inlined`, with sums in the order that is written."""
    return _part(function, True, {"contract"})


def called(function: Callable[..., Any]) -> Any:
    """Compile a function that kernels call: a long one, or one that they seldom need."""
    return _part(function, False, _REASSOCIATED)


def shared(function: Callable[..., Any]) -> Any:
    """Let kernels have a small function compiled into them that stays a plain one for Python."""
    from numba.extending import register_jitable

    return register_jitable(error_model="numpy", forceinline=True)(function)


def _part(function: Callable[..., Any], always_inlined: bool, fastmath: set[str]) -> Any:
    import numba

    return numba.njit(error_model="numpy", nogil=True, fastmath=fastmath, forceinline=always_inlined)(function)
