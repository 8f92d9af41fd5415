"""Processes that end with the one that started them, however that one ends.

A campaign that is killed would otherwise leave afl-fuzz running, and a killed afl-fuzz a target in the middle of an
execution.
"""

from __future__ import annotations

import ctypes
import sys

_SET_PARENT_DEATH_SIGNAL = 1  # PR_SET_PDEATHSIG, `man 2 prctl`

_library = ctypes.CDLL(None) if sys.platform == "linux" else None


def end_with_parent(signal: int) -> None:
    """Has this process get `signal` when its parent ends. Without effect where there is no such thing."""
    if _library is not None:
        _library.prctl(_SET_PARENT_DEATH_SIGNAL, signal, 0, 0, 0)
