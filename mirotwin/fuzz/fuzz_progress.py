"""How a campaign of `mirotwin fuzz` is shown while it is under way: a line that is drawn again, or plain lines.

This is one of the few places that know the wall clock.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Self

from miro_exact.bad_input import amount
from mirotwin.fuzz.campaign import Status
from mirotwin.shell.program import complain
from mirotwin.shell.progress import ProgressBar

if TYPE_CHECKING:
    from rich.progress import ProgressColumn

LINE_S = 10.0
"""Wall time between two plain lines, where stderr is no terminal."""


class FuzzProgress(ProgressBar):
    """A context manager; `show(status)` may be called as often as one likes. `time_s` None: no end is known."""

    PATIENCE_S = 0.0

    def __init__(self, what: str, time_s: float | None, quiet: bool = False) -> None:
        super().__init__(f"fuzzing {what}", time_s, quiet)
        self._quiet = quiet
        self._line_s = time.monotonic()

    def __enter__(self) -> Self:
        self.to(0.0, said="starting")
        return self

    def show(self, status: Status) -> None:
        """Draws the line again, or writes one if the last is some time ago."""
        if self._shown:
            done = status.run_s if self.total is None else min(status.run_s, self.total)
            self.to(done, said=said(status))
        elif not self._quiet and time.monotonic() - self._line_s >= LINE_S:
            self._line_s = time.monotonic()
            left = "" if self.total is None else f", {clock(max(0.0, self.total - status.run_s))} left"
            complain(f"{self.what}: {clock(status.run_s)}: {said(status)}{left}")

    def _columns(self) -> list[ProgressColumn]:
        from rich.progress import BarColumn, TextColumn, TimeRemainingColumn

        words = [TextColumn(f"{{task.{one}}}", markup=False) for one in ("description", "fields[said]")]
        return [*words, BarColumn(bar_width=16), TimeRemainingColumn()]


def said(status: Status) -> str:
    """Rates and counts of a campaign, in short."""
    parts = [f"{status.executions_per_s:.0f}/s"]
    if status.edges is not None:  # else the engine has not said yet
        parts.append(amount(status.edges, "edge"))
    parts.append(amount(status.crashes or "no", "crash", "crashes"))
    if status.unconfirmed:
        parts.append(f"{status.unconfirmed} unconfirmed")
    return ", ".join(parts)


def clock(time_s: float) -> str:
    """A duration as minutes and seconds, `1:05`, or `2:00:00` with hours."""
    minutes, seconds = divmod(int(time_s), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{seconds:02}" if hours else f"{minutes}:{seconds:02}"
