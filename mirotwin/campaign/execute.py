"""Makes the results of many jobs in the order of the jobs, whatever executor runs them.

A result is a function of its job, so it does not matter which process made it, or how many there were.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future
from typing import TypeVar

from miro_exact.bad_input import BadInput

J = TypeVar("J")
R = TypeVar("R")


def in_order(make: Callable[[J], R], jobs: Iterable[J], executor: Executor, ahead: int) -> Iterator[R]:
    """`make` of each job, as soon as it and those before it are there.

    `ahead`: so many jobs are handed over before the first result is back. Whoever stops asking, or is interrupted,
    leaves no job behind: the executor is shut down.
    """
    pending: deque[Future[R]] = deque()
    try:
        for job in jobs:
            pending.append(executor.submit(make, job))
            if len(pending) >= ahead:
                yield pending.popleft().result()
        while pending:
            yield pending.popleft().result()
    except BrokenExecutor:
        what = "a process that made rows has ended: killed, or out of memory"
        raise BadInput("", "--jobs", what, "try again with fewer") from None
    finally:
        executor.shutdown(wait=True, cancel_futures=True)
