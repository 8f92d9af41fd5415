"""The workers of a campaign: processes of this machine, or an executor of the caller."""

from __future__ import annotations

from concurrent.futures import CancelledError, Executor

from mirotwin.campaign.processes import cores, processes

AHEAD = 4
"""Jobs for each worker that are handed over: enough to keep it busy, few enough to stop soon."""


class Workers:
    """An executor that is the caller's own, and stays open.

    `ahead`: jobs that are handed over at once. `restarts`: whether `start` gives another executor when one is broken.
    `ended`: errors that say of one job that its workers have ended; `gone`: that all have.
    `option` names the workers in errors.
    """

    restarts = False
    ended: tuple[type[Exception], ...] = ()
    gone: tuple[type[BaseException], ...] = (CancelledError,)
    option = "executor"

    def __init__(self, executor: Executor | None = None) -> None:
        self.executor = executor
        self.ahead = AHEAD * int(getattr(executor, "_max_workers", cores()))

    def start(self) -> Executor:
        assert self.executor is not None
        return self.executor

    def stop(self, executor: Executor) -> None:
        """Ends what `start` gave. Jobs that can be cancelled are cancelled already."""

    def close(self) -> None:
        """No executor is wanted any more."""


class Processes(Workers):
    """So many processes of this machine."""

    restarts = True
    option = "--jobs"

    def __init__(self, count: int | None = None) -> None:
        super().__init__()
        self.count = count or cores()
        self.ahead = AHEAD * self.count

    def start(self) -> Executor:
        return processes(self.count)

    def stop(self, executor: Executor) -> None:
        executor.shutdown(wait=True, cancel_futures=True)
