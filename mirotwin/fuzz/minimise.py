"""Makes an input shorter and simpler as long as it still does what it was kept for.

Delta debugging (Zeller, Hildebrandt: Simplifying and isolating failure-inducing input, IEEE TSE 28(2), 2002), in the
form that takes away one chunk after the other, from half of the input down to single bytes, then the same with zeros in
the place of chunks. An input that is shorter is simpler; of two as long as each other, the one with more zeros.

The order in which inputs are tried depends on the input alone. How far the search comes is bounded by tries, which are
the same everywhere, and by a time, which is not: where time is over first, a slower machine keeps a longer input.
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


def minimise(data: bytes, still: Question, budget: Budget) -> bytes:
    """The simplest input found within the budget for which `still` is true; `data` itself, where it is not of that."""
    if budget.over or not budget.asked(still, data):
        return data
    while not budget.over:
        before = data
        data = _simpler(data, still, budget, lambda chunk: b"")
        data = _simpler(data, still, budget, lambda chunk: bytes(len(chunk)))
        if data == before:
            break
    return data


def _simpler(data: bytes, still: Question, budget: Budget, instead: Callable[[bytes], bytes]) -> bytes:
    """What is put in the place of chunks, from the end on: what comes after the crash goes first."""
    size = max(1, len(data) // 2)
    while data:
        end = len(data)
        while end > 0 and not budget.over:
            begin = max(0, end - size)
            chunk = data[begin:end]
            simpler = data[:begin] + instead(chunk) + data[end:]
            if simpler != data and budget.asked(still, simpler):
                data = simpler
            end = begin
        if size == 1 or budget.over:
            break
        size //= 2
    return data
