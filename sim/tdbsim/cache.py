"""Cache of compiled kernels in a folder named by a hash of all of tdbsim's sources, their place and the processor.

numba checks only the file of the compiled function.  After an edit in another file (the friction law, an effect) it would
silently continue with the old physics.  Here an edit of any source changes the folder.  So does everything that makes numba
itself discard a kernel, so that all kernels in a folder are valid.
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
_KEPT_DAYS = 30  # unused folders of earlier sources are removed after this time


@cache
def source_hash() -> str:
    """Return the hash of the names and contents of all of tdbsim's sources."""
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
    """Return the hash of all that compiled code depends on: sources, their place, modification times, processor."""
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
    """Return the folder of the compiled kernels; a temporary one where the user's is not writable.

    ``TDBMON_CACHE`` sets another parent folder.
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
        except OSError:  # another process was faster
            continue


def compiled(function: Callable[..., Any]) -> Any:
    """Compile a kernel on its first call, in nopython mode and cached on disk."""
    return _kept(function, False)


def reassociated(function: Callable[..., Any]) -> Any:
    """Compile as `compiled`, but let the compiler reassociate sums for vectorisation; infinities stay valid."""
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
    """Inline a small function into each `compiled` kernel that calls it; it is cached with the kernel."""
    return _part(function, True, _REASSOCIATED)


def in_order(function: Callable[..., Any]) -> Any:
    """Compile as `inlined`, with sums in the written order."""
    return _part(function, True, {"contract"})


def called(function: Callable[..., Any]) -> Any:
    """Compile a function that kernels call without inlining: a long or rarely needed one."""
    return _part(function, False, _REASSOCIATED)


def shared(function: Callable[..., Any]) -> Any:
    """Make a small Python function available to kernels, which inline it."""
    from numba.extending import register_jitable

    return register_jitable(error_model="numpy", forceinline=True)(function)


def _part(function: Callable[..., Any], always_inlined: bool, fastmath: set[str]) -> Any:
    import numba

    return numba.njit(error_model="numpy", nogil=True, fastmath=fastmath, forceinline=always_inlined)(function)
