"""How long a search may go on: so many tries, and so much wall time.

This is one of the few places that know the wall clock.
"""

from __future__ import annotations

import time
from collections.abc import Callable

Question = Callable[[bytes], bool]
"""Whether an input still does it."""


class Budget:
    """So many tries, and so many seconds of wall time. `spent`: tries that were made.

    `tell` is called now and then, for whoever draws a progress line.
    """

    def __init__(self, tries: int, time_s: float, tell: Callable[[], None] = lambda: None) -> None:
        self.tries = tries
        self.spent = 0
        self.end_s = time.monotonic() + time_s
        self._tell = tell

    @property
    def over(self) -> bool:
        return self.spent >= self.tries or time.monotonic() >= self.end_s

    def asked(self, still: Question, data: bytes) -> bool:
        """The answer of one try."""
        self.spent += 1
        self._tell()
        return still(data)
