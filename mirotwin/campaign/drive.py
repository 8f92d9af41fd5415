"""Submits all missing runs of a plan to an executor and yields each outcome when it is ready.

A killed process breaks its whole pool. A new pool then retries all jobs of the broken one, each alone in a process. A
job that kills its process twice gets an outcome that says so; the others continue together.
"""

from __future__ import annotations

import concurrent.futures as futures
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Future
from contextlib import closing

import msgspec

from miro_exact.bad_input import BadInput
from mirotwin.campaign.journal import in_order
from mirotwin.campaign.worker import RunOutcome, Work, work
from mirotwin.campaign.workers import Workers

SPREAD = 4096
"""Largest distance between the first run without an outcome and the last submitted run; limits waiting rows."""
ISOLATED_RETRIES = 2
"""Retries, alone in the executor, of a job that was under way when a worker died: a suspect."""
MAX_DEAD_EXECUTORS = 20
"""Give up after this many executors in a row die without finishing a run."""


def outcomes_of(jobs: Sequence[Work], workers: Workers) -> Iterator[RunOutcome]:
    """The outcome of each job in their order, numbered from 0, as soon as it and those before it are there."""
    drive = Drive(lambda run: msgspec.structs.replace(jobs[run], run=run), workers)
    with closing(drive.outcomes(range(len(jobs)))) as outcomes:
        yield from in_order(outcomes)


class Drive:
    """Runs jobs through an executor. `job(run)`: the object submitted for a run."""

    def __init__(self, job: Callable[[int], Work], workers: Workers) -> None:
        self.job = job
        self.workers = workers
        self._pending: dict[Future[RunOutcome], int] = {}
        self._suspects: dict[int, int] = {}  # run -> so often it was under way when a process ended
        self._dead_executors = 0

    def outcomes(self, runs: Iterable[int]) -> Generator[RunOutcome]:
        """Yields each outcome when it is ready. Cancels all jobs when the generator is closed or interrupted."""
        self._runs = iter(runs)
        self._next = next(self._runs, None)
        if self._next is None:
            return
        self._executor = self.workers.start()
        try:
            self._hand_over()
            while self._pending:
                done, _ = futures.wait(self._pending, return_when=futures.FIRST_COMPLETED)
                yield from self._take(done)
                self._hand_over()
        finally:
            self._close()

    def _hand_over(self) -> None:
        """Submits jobs until the queue is full."""
        while (run := self._choose()) is not None:
            try:
                self._pending[self._executor.submit(work, self.job(run))] = run
            except BrokenExecutor:  # a worker has ended in between: this run is not to blame
                self._suspects.setdefault(run, 0)
                if self._pending:  # they say so, too
                    return
                self._restart()

    def _choose(self) -> int | None:
        """The next run to hand over, None where all have their hands full. A suspect goes alone."""
        if self._suspects:
            # a worker's death does not say which of its pool's jobs did it: with one alone there is no doubt
            return None if self._pending else min(self._suspects)
        if self._next is None or len(self._pending) >= self.workers.ahead:
            return None
        # the reader puts outcomes in order: while one run is slow, those after it fill its memory
        if self._pending and self._next - min(self._pending.values()) >= SPREAD:
            return None
        chosen, self._next = self._next, next(self._runs, None)
        return chosen

    def _take(self, done: Iterable[Future[RunOutcome]]) -> Iterator[RunOutcome]:
        lost = []
        for future in done:
            run = self._pending.pop(future)
            try:
                outcome = future.result()
            except BrokenExecutor:
                lost.append(run)
                continue
            except CancelledError:
                raise self._gone() from None
            self._suspects.pop(run, None)
            self._dead_executors = 0
            yield outcome
        if lost:
            yield from self._broken(lost)

    def _broken(self, lost: list[int]) -> list[RunOutcome]:
        """Replaces the broken executor and queues its jobs again.

        Returns error outcomes of jobs without retries left.
        """
        lost += self._pending.values()  # a pool that is broken gives no more outcomes, whether done or not
        self._pending.clear()
        self._restart()
        if len(lost) == 1 and self._suspects.get(lost[0], 0) >= ISOLATED_RETRIES:
            self._suspects.pop(lost[0])
            return [RunOutcome(lost[0], error="ended the process that ran it (killed, or out of memory)")]
        for run in lost:
            self._suspects[run] = self._suspects.get(run, 0) + 1
        return []

    def _restart(self) -> None:
        self.workers.check_ended()  # first: a script that cannot be imported would end each new pool, too
        self._dead_executors += 1
        if not self.workers.restarts or self._dead_executors > MAX_DEAD_EXECUTORS:
            raise self._gone()
        self._close()
        self._executor = self.workers.start()

    def _close(self) -> None:
        for future in self._pending:
            future.cancel()
        if self.workers.restarts:
            self._executor.shutdown(cancel_futures=True)

    def _gone(self) -> BadInput:
        reason = "workers have ended, and with them what was under way"
        return BadInput(
            "", self.workers.option, reason, "start them again, and give the same command: it goes on"
        )
