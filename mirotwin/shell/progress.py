"""A progress bar on stderr for work of more than a second, shown only on a terminal.

This module is one of the few that use the wall clock.
"""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING

from miro_exact.bad_input import one_line

if TYPE_CHECKING:
    from rich.progress import Progress, ProgressColumn


class ProgressBar:
    """`bar.to(done)` out of `total`. Draws nothing in the first second, nor when stderr is no terminal or closed.

    `unit`: the counted items ("runs"); if given, the rate is shown, too. Rate and remaining time count from `begun`.
    """

    PATIENCE_S = 1.0

    def __init__(self, task: str, total: float | None, quiet: bool = False, unit: str = "") -> None:
        self.what = one_line(task)
        self.total = total
        self.unit = unit
        self.begun = 0
        stream = vars(sys)["stderr"]  # None where it is closed
        self._shown = not quiet and stream is not None and stream.isatty()
        self._began_s = time.monotonic()
        self._progress: Progress | None = None

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(self, *raised: object) -> None:
        if self._progress is not None:
            self._progress.stop()

    def to(self, done: float, note: str = "") -> None:
        """Moves the bar to `done`; cheap enough to call every control period. `note`: text of the bar's text column."""
        if not self._shown:
            return
        if self._progress is None:
            if time.monotonic() - self._began_s < self.PATIENCE_S:
                return
            self._progress = self._bar()
            self._progress.add_task(self.what, total=self.total, completed=self.begun, note="")
            self._progress.start()
        self._progress.update(self._progress.task_ids[0], completed=done, note=note or self._rate(done))

    def _bar(self) -> Progress:
        from rich.console import Console  # loaded when the first bar is drawn: most commands are over before
        from rich.progress import Progress

        return Progress(*self._columns(), console=Console(stderr=True), transient=True)

    def _columns(self) -> list[ProgressColumn]:
        from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn

        words, rate = (TextColumn(f"{{task.{key}}}", markup=False) for key in ("description", "fields[note]"))
        return [words, BarColumn(), TaskProgressColumn(), rate if self.unit else TimeRemainingColumn()]

    def _rate(self, done: float) -> str:
        """The rate since `begun`, and the remaining time at that rate."""
        passed_s = time.monotonic() - self._began_s
        per_s = (done - self.begun) / passed_s
        if self.total is None or per_s <= 0.0:
            return ""
        remaining_s = round((self.total - done) / per_s)
        hours, minutes, seconds = remaining_s // 3600, remaining_s // 60 % 60, remaining_s % 60
        return f"{per_s:.1f} {self.unit}/s, {hours}:{minutes:02}:{seconds:02} left"
