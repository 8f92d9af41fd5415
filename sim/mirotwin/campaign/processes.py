"""The processes that make rows: as many as there are cores, each with the engine of the first one.

What belongs here: how they begin. What does not: what they do (`job`, `execute`). Nothing here imports a hot module: a
new process reads this file before its engine is chosen.
"""

from __future__ import annotations

import os
import signal
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from miro_exact import engine


def processes(count: int) -> ProcessPoolExecutor:
    """Processes with the engine of this one."""
    return ProcessPoolExecutor(
        max_workers=count, mp_context=get_context("spawn"), initializer=_begin, initargs=(engine.active(),)
    )


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _begin(chosen: str) -> None:
    """In a new process. Ctrl-C goes to all processes of a terminal; the first one tells the others to end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    engine.select(chosen)
