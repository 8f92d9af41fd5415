"""The workers of a campaign: processes of this machine, each with the engine of the first one, or a caller's executor.

Nothing here imports a hot module: a new process reads this file before its engine is chosen.
"""

from __future__ import annotations

import os
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from multiprocessing import current_process
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Any

from miro_exact.bad_input import BadInput
from mirotwin.shell.process_pool import start_pool
from mirotwin.shell.processes import cores

NAME = "mirotwin worker"
FAILED = 1
"""Exit code of a process that an exception ended."""
END_S = 5.0
UNGUARDED = 72
"""Exit code of a worker whose import of the main script starts a campaign again."""
GUARD = (
    "is called again by each process that it starts, which imports your script first",
    'put the calls in your script below a line `if __name__ == "__main__":`',
)


class WorkerContext(SpawnContext):
    """Starts the processes of a pool and keeps them: their exit codes say why they ended. `begun`: their first jobs."""

    def __init__(self) -> None:
        self.started: list[SpawnProcess] = []
        self.begun: list[Future[int]] = []

    def Process(self, *arguments: Any, **named: Any) -> SpawnProcess:  # type: ignore[override]
        # The name tells `refuse_in_import` that it is in one of ours.
        process = SpawnProcess(*arguments, **{**named, "name": NAME})
        self.started.append(process)
        return process

    def check_ended(self) -> None:
        """Raises BadInput if the processes ended because the main script cannot be imported: no run is to blame."""
        for process in self.started:
            process.join(END_S)  # a broken pool ends the others, too
        # All of them: the pool ends the others by a signal, so one exit code among many tells the cause.
        codes = [process.exitcode for process in self.started]
        if UNGUARDED in codes:
            raise BadInput("", "campaign.run", *GUARD)
        # Who finished its first job has imported the script: then it is a run that ended the process.
        if FAILED in codes and not any(future.done() and future.exception() is None for future in self.begun):
            reason = "its processes import your script first, which fails in them for the reason above"
            raise BadInput("", "campaign.run", reason, GUARD[1])


def refuse_in_import() -> None:
    """Ends a worker that imports the main script and comes here by it: the first process says why, once.

    Raises BadInput in a process that somebody else started. `multiprocessing` marks such an import the same way.
    """
    # Without this each worker would start a campaign of its own, and its workers too.
    if getattr(current_process(), "_inheriting", False):
        # an exception would be one traceback for each process; the exit code is read by `check_ended`
        if current_process().name == NAME:
            os._exit(UNGUARDED)
        raise BadInput("", "campaign.run", *GUARD)


def processes(count: int, context: WorkerContext | None = None) -> ProcessPoolExecutor:
    """Processes with the engine of this one, which have begun."""
    # Before the pool: its own error for this speaks of `freeze_support`, and comes once for each process.
    refuse_in_import()
    context = context or WorkerContext()
    pool, context.begun = start_pool(count, context)
    return pool


AHEAD = 4
"""Jobs for each worker that are handed over: enough to keep it busy, few enough to stop soon."""
MANY_WORKERS = 64
"""Workers of an executor that does not say how many it has, such as one of other machines."""


class Workers:
    """An executor that is the caller's own, and stays open.

    `ahead`: jobs that are handed over at once. `restarts`: whether `start` gives another executor each time, which has
    to be shut down. `option` names the workers in errors.
    """

    restarts = False
    option = "executor"

    def __init__(self, executor: Executor) -> None:
        self._executor = executor
        self.ahead = AHEAD * int(getattr(executor, "_max_workers", MANY_WORKERS))

    def start(self) -> Executor:
        return self._executor

    def check_ended(self) -> None:
        """Raises BadInput where processes ended for a reason that others would end for, too."""


class Processes(Workers):
    """`count` processes of this machine; as many as it has cores where none is given."""

    restarts = True
    option = "--jobs"

    def __init__(self, count: int | None = None) -> None:
        self.count = count or cores()
        self.ahead = AHEAD * self.count

    def start(self) -> Executor:
        # A new one each time: exit codes of a pool that broke before are no reason for this one.
        self._context = WorkerContext()
        return processes(self.count, self._context)

    def check_ended(self) -> None:
        self._context.check_ended()
