"""A campaign: collects, judges and triages an engine's inputs until the time is over.

This module is one of the few that use the wall clock.

    engine ──crashes──► triage: minimised, grouped, confirmed
       └────queue────► coverage, --covering, checks in Python (a share of the time, the rest waits)

The engine runs in its own processes and continues while an input is examined here.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec

from miro_exact.bad_input import BadInput
from mirotwin.fuzz.engine import Engine, EngineProgress
from mirotwin.fuzz.triage import Crash, Triage
from mirotwin.shell.verdicts import Verdict

LOOK_S = 0.2
"""Wall time between two looks at the engine."""
SLICE_S = 0.5
"""Longest time in which queue inputs are examined without a break, in seconds."""
LOOKED = 8
"""Inputs of the queue that are looked at between two crashes, which take longer."""
AFTER_S = 20.0
"""Longest time in which inputs are still examined after the end of the campaign, in seconds."""


class Covering(msgspec.Struct, frozen=True):
    """A function that an input should reach, and its address."""

    name: str
    address: int


class Campaign:
    """One campaign. `expected`: Python checks run on each input of the queue; `tell` gets each crash at once.

    `inputs`: examined inputs of the queue; `judged`: inputs judged by the checks, with their `verdicts`; `reached_by`:
    the stream that reached the wanted function. `until_crash`: end at the first confirmed crash. `show` is called
    regularly.
    """

    def __init__(
        self,
        engine: Engine,
        triage: Triage,
        expected: Mapping[str, Any],
        covering: Covering | None,
        tell: Callable[[Crash], None],
        until_crash: bool = False,
    ) -> None:
        self.engine = engine
        self.triage = triage
        self.expected = expected
        self.verdicts: dict[str, set[Verdict]] = {name: set() for name in expected}
        self.covering = covering
        self.tell = tell
        self.until_crash = until_crash
        self.show: Callable[[Campaign], None] = lambda campaign: None
        self.judged = 0
        self.inputs = 0
        self.reached_by: Path | None = None
        self._progress = EngineProgress()
        self._crashes: deque[bytes] = deque()
        self._queue: deque[bytes] = deque()
        self._to_judge: deque[bytes] = deque()
        self._judged: set[bytes] = set()
        self._judging_s = 0.0
        self._looked = LOOKED
        self._began_s = time.monotonic()
        self._stopped_s: float | None = None
        self._shown_s = 0.0
        triage.tell = self._show_sometimes

    def begin_with(self, failing: Iterable[bytes], passing: Iterable[bytes]) -> None:
        """Inputs to look at before those of the engine: seeds that fail are crashes, others give coverage."""
        for data in failing:
            self._add(data, self._crashes)
        for data in passing:
            self._add(data, self._queue)
        self._looked = LOOKED - len(self._queue)  # these are quick, and --covering may need no more

    # ---- the loop ------------------------------------------------------------------------------------------

    def run(self, time_s: float) -> None:
        """Runs until the time is over or the wanted result is found. The engine is stopped in any case."""
        self._began_s = time.monotonic()
        try:
            self.engine.start()
            while not self.done and self.run_s < time_s:
                began_s = time.monotonic()
                self._collect()
                self._work(min(time.monotonic() + SLICE_S, self._began_s + time_s))
                self._show_sometimes()
                time.sleep(max(0.0, LOOK_S - (time.monotonic() - began_s)))
        finally:
            self.engine.stop()
            self._stopped_s = time.monotonic()
        self._collect()

    def finish(self, limit_s: float) -> int:
        """Examines the remaining inputs for at most `limit_s` seconds; returns the number of inputs left out."""
        self._work(time.monotonic() + limit_s, at_ease=True)
        return len(self._crashes) + len(self._queue) + len(self._to_judge)

    @property
    def crashed(self) -> bool:
        """True if a crash was found that ends the campaign."""
        return self.until_crash and bool(self.triage.confirmed)

    @property
    def done(self) -> bool:
        return self.crashed or self.reached_by is not None

    @property
    def run_s(self) -> float:
        """Wall time for which the engine has been running."""
        return (self._stopped_s or time.monotonic()) - self._began_s

    def progress(self) -> EngineProgress:
        """The engine's progress; the last known one if the engine ended with an error."""
        with suppress(BadInput):
            self._progress = self.engine.progress()
        return self._progress

    @property
    def rate(self) -> float:
        """Executions a second of wall time, at the last look."""
        return self._progress.executions / self.run_s if self.run_s else 0.0

    def _show_sometimes(self) -> None:
        now_s = time.monotonic()
        if now_s - self._shown_s >= LOOK_S:
            self._shown_s = now_s
            self.show(self)

    # ---- what comes from the engine ------------------------------------------------------------------------

    def _collect(self) -> None:
        new = (self.engine.new_crashes(), self._crashes), (self.engine.new_queue(), self._queue)
        for paths, inputs in new:
            for path in paths:
                with suppress(OSError):  # the engine has taken it away again
                    self._add(path.read_bytes(), inputs)

    def _add(self, data: bytes, inputs: deque[bytes]) -> None:
        if data not in self._judged:
            self._judged.add(data)
            inputs.append(data)

    def _work(self, end_s: float, at_ease: bool = False) -> None:
        """Crashes, and coverage between two of them; checks in Python get a third of the time."""
        while (at_ease or not self.done) and time.monotonic() < end_s:
            if self._crashes and (not self._queue or self._looked >= LOOKED):
                done = self._crashes
                self._looked = 0
                self._keep(self.triage.take(done[0]))
            elif self._to_judge and (at_ease or 3 * self._judging_s <= self.run_s):
                done = self._to_judge
                self._judge(done[0])
            elif self._queue:
                done = self._queue
                self._looked += 1
                self._look(done[0])
            else:
                return
            done.popleft()  # now: what is interrupted is looked at again

    def _keep(self, crash: Crash | None) -> None:
        if crash is not None:
            self.tell(crash)

    def _look(self, data: bytes) -> None:
        """Examines an input with new coverage: records what it executes."""
        self.inputs += 1
        self.triage.folder.write("corpus", f"input-{self.inputs:05d}", data)
        counts = self.triage.reached.run(data)
        if self.expected:
            self._to_judge.append(data)
        if self.covering is not None and self.reached_by is None and self.covering.address in counts:
            stream = self.triage.oracle.judged(data, {}).stream()
            self.reached_by = self.triage.leave("covering", self.covering.name, data, stream, counts)

    def _judge(self, data: bytes) -> None:
        """Judges an input by the checks in Python. Raises PluginError where one raises."""
        began_s = time.monotonic()
        try:
            self.judged += 1
            run = self.triage.oracle.judged(data, self.expected)
            failure = run.failure
            for name in self.expected:
                self.verdicts[name].add(run.verdict_on(name))
            if failure is not None:
                self._keep(self.triage.take_judged(data, failure, self.expected))
        finally:
            self._judging_s += time.monotonic() - began_s
