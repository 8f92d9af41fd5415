"""Pools of processes that work for this one: they have its engine, ignore Ctrl-C, and end when it does.

This module imports no hot module: a new process imports it before its engine is chosen.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_all_start_methods, get_context, parent_process
from multiprocessing.context import BaseContext

from miro_exact import engine
from mirotwin.shell.processes import cores, safe_path


def start_pool(count: int, context: BaseContext) -> tuple[ProcessPoolExecutor, list[Future[int]]]:
    """A pool with started processes, and a job for each of them that is done when it is ready.

    Ctrl-C goes to all processes of a terminal; only the first one handles it and ends the others. They ignore it from
    their first instruction on, because a process inherits ignored signals.
    """
    with _ignoring_interrupts(), safe_path():
        pool = ProcessPoolExecutor(count, context, initializer=_begin, initargs=(engine.active(),))
        return pool, [pool.submit(int) for _ in range(count)]  # a job starts a process while none is idle


@contextmanager
def spare_process() -> Iterator[Executor | None]:
    """A process that starts as a copy of this one, with everything loaded; None without a free core.

    A process with threads is not copied: their locks would stay locked.
    """
    if cores() == 1 or threading.active_count() > 1 or "fork" not in get_all_start_methods():
        yield None
        return
    pool, _ = start_pool(1, get_context("fork"))
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)


def _begin(chosen: str) -> None:
    """In a new process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for number in (signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)):
        if callable(signal.getsignal(number)):  # a copy has the program's, which raises an exception
            signal.signal(number, signal.SIG_DFL)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    engine.select(chosen)  # before a job imports a hot module, which settles it


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
