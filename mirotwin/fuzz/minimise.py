"""Makes an input shorter and simpler as long as it still does what it was kept for.

Delta debugging (Zeller, Hildebrandt: Simplifying and isolating failure-inducing input, IEEE TSE 28(2), 2002), in the
form that takes away one chunk after the other, from half of the input down to single bytes, then the same with zeros in
the place of chunks. An input that is shorter is simpler; of two as long as each other, the one with more zeros.

The order in which inputs are tried depends on the input alone. How far the search comes is bounded by tries, which are
the same everywhere, and by a time, which is not: where time is over first, a slower machine keeps a longer input.
"""

from __future__ import annotations

from mirotwin.fuzz.budget import Budget, Question


def minimise(data: bytes, still: Question, budget: Budget) -> bytes:
    """The simplest input found within the budget for which `still` is true; `data` itself, where it is not of that."""
    if budget.over or not budget.asked(still, data):
        return data
    while not budget.over:
        before = data
        data = _without_chunks(data, still, budget)
        data = _with_zeros(data, still, budget)
        if data == before:
            break
    return data


def _without_chunks(data: bytes, still: Question, budget: Budget) -> bytes:
    """Chunks are taken away from the end on: what comes after the crash goes first."""
    size = max(1, len(data) // 2)
    while data:
        end = len(data)
        while end > 0 and not budget.over:
            begin = max(0, end - size)
            shorter = data[:begin] + data[end:]
            if budget.asked(still, shorter):
                data = shorter
            end = begin
        if size == 1 or budget.over:
            break
        size //= 2
    return data


def _with_zeros(data: bytes, still: Question, budget: Budget) -> bytes:
    size = max(1, len(data) // 2)
    while data:
        for begin in range(0, len(data), size):
            chunk = data[begin : begin + size]
            if not any(chunk):
                continue
            if budget.over:
                return data
            zeroed = data[:begin] + bytes(len(chunk)) + data[begin + size :]
            if budget.asked(still, zeroed):
                data = zeroed
        if size == 1:
            break
        size //= 2
    return data
