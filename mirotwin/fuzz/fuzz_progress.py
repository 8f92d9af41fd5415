"""How a campaign of `mirotwin fuzz` is shown while it is under way: a line that is drawn again, or plain lines.

This is one of the few places that know the wall clock.
"""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import TYPE_CHECKING

from mirotwin.fuzz.campaign import Status
from mirotwin.shell.program import complain

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

LINE_S = 10.0
"""Wall time between two plain lines, where stderr is no terminal."""


class FuzzProgress:
    """A context manager; `show(status)` may be called as often as one likes. `time_s` None: no end is known."""

    def __init__(self, what: str, time_s: float | None, quiet: bool = False) -> None:
        stream = vars(sys)["stderr"]
        self.time_s = time_s
        self._quiet = quiet
        self._live = not quiet and stream is not None and stream.isatty()
        self._what = what
        self._line_s = time.monotonic()
        self._progress: Progress | None = None
        self._task: TaskID | None = None

    def __enter__(self) -> FuzzProgress:
        if self._live:
            self._progress = _bar()
            self._task = self._progress.add_task(f"fuzzing {self._what}", total=self.time_s, said="starting")
            self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._progress is not None:
            self._progress.stop()

    def show(self, status: Status) -> None:
        """Draws the line again, or writes one if the last is some time ago."""
        if self._progress is not None and self._task is not None:
            done = status.run_s if self.time_s is None else min(status.run_s, self.time_s)
            self._progress.update(self._task, completed=done, said=said(status))
        elif not self._quiet and time.monotonic() - self._line_s >= LINE_S:
            self._line_s = time.monotonic()
            left = "" if self.time_s is None else f", {clock(max(0.0, self.time_s - status.run_s))} left"
            complain(f"fuzzing {self._what}: {clock(status.run_s)}: {said(status)}{left}")


def said(status: Status) -> str:
    """Rates and counts of a campaign, in short."""
    parts = [f"{status.executions_per_s:.0f}/s"]
    if status.edges is not None:  # else the engine has not said yet
        parts.append(f"{status.edges} edges")
    parts.append(counted(status.crashes, "crash", "crashes"))
    if status.unconfirmed:
        parts.append(f"{status.unconfirmed} unconfirmed")
    return ", ".join(parts)


def counted(number: int, word: str, plural: str = "") -> str:
    """`no inputs`, `1 input`, `2 crashes`."""
    return f"{number or 'no'} {word if number == 1 else plural or f'{word}s'}"


def clock(time_s: float) -> str:
    """A duration as minutes and seconds, `1:05`, or `2:00:00` with hours."""
    minutes, seconds = divmod(int(time_s), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{seconds:02}" if hours else f"{minutes}:{seconds:02}"


def _bar() -> Progress:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    return Progress(
        TextColumn("{task.description}", markup=False),
        TextColumn("{task.fields[said]}", markup=False),
        BarColumn(bar_width=16),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        transient=True,
    )
