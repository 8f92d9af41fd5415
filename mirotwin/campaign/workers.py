"""The workers of a campaign: processes of this machine, each with the engine of the first one, or a caller's executor.

Nothing here imports a hot module: a new process reads this file before its engine is chosen.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context, parent_process

from miro_exact import engine
from mirotwin.shell.program import cores, safe_path


def processes(count: int) -> ProcessPoolExecutor:
    """Processes with the engine of this one, which have begun.

    Ctrl-C goes to all processes of a terminal; the first one tells the others to end. They ignore it from their first
    instruction on: what a process ignores, those that it starts ignore too.
    """
    with _ignoring_interrupts(), safe_path():
        found = ProcessPoolExecutor(
            max_workers=count,
            mp_context=get_context("spawn"),
            initializer=_begin,
            initargs=(engine.active(),),
        )
        for _ in range(count):  # each of which starts a process, as long as none is idle
            found.submit(int)
    return found


def _begin(chosen: str) -> None:
    """In a new process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    engine.select(chosen)


def _end_with_parent() -> None:
    """Ends this process when its parent does: it would wait for jobs for ever if that was killed."""
    parent = parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


@contextmanager
def _ignoring_interrupts() -> Iterator[None]:
    try:
        before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    except ValueError:  # not the thread that signals come to
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


AHEAD = 4
"""Jobs for each worker that are handed over: enough to keep it busy, few enough to stop soon."""


class Workers:
    """An executor that is the caller's own, and stays open.

    `ahead`: jobs that are handed over at once. `restarts`: whether `start` gives another executor each time, which has
    to be shut down. `option` names the workers in errors.
    """

    restarts = False
    option = "executor"

    def __init__(self, executor: Executor) -> None:
        self._executor = executor
        self.ahead = AHEAD * int(getattr(executor, "_max_workers", cores()))

    def start(self) -> Executor:
        return self._executor


class Processes(Workers):
    """So many processes of this machine."""

    restarts = True
    option = "--jobs"

    def __init__(self, count: int | None = None) -> None:
        self.count = count or cores()
        self.ahead = AHEAD * self.count

    def start(self) -> Executor:
        return processes(self.count)
