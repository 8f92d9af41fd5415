"""Our child processes: starting a module in one, the number of cores, import safety, and their end with the parent."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

_SAFE_PATH = "PYTHONSAFEPATH"


def python_module(name: str, *arguments: str) -> list[str]:
    """The command that runs a module of ours in a new process."""
    return [sys.executable, "-P", "-m", name, *arguments]


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def safe_path() -> Iterator[None]:
    """Child processes started within this block do not import from the current folder."""
    before = os.environ.get(_SAFE_PATH)
    os.environ[_SAFE_PATH] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[_SAFE_PATH]
        else:
            os.environ[_SAFE_PATH] = before


_SET_PARENT_DEATH_SIGNAL = 1  # PR_SET_PDEATHSIG, `man 2 prctl`

_library = ctypes.CDLL(None) if sys.platform == "linux" else None


def end_with_parent(signal: int) -> None:
    """Lets the system send `signal` to this process when its parent ends.

    No effect on systems without this function.
    """
    if _library is not None:
        _library.prctl(_SET_PARENT_DEATH_SIGNAL, signal, 0, 0, 0)
