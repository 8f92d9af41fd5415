"""Times on the command line: 2s, 20ms, 341us, 5min, or 48000t, which are ticks of the crystal."""

from __future__ import annotations

import re

from miro_exact.bad_input import BadInput, shortened
from miro_exact.clock import TICKS_PER_SECOND
from miro_exact.times import SHAPE, time_of
from miro_exact.times import Time as Time
from mirotwin.shell.command import Word

LONGEST_S = 10**9
"""Longer than any run."""


class TimeType(Word):
    """A time with its unit, as a Time: at most `longest_s`, and more than zero where `positive`.

    A time of the wall clock (`on_wall`) has no ticks.
    """

    def __init__(self, positive: bool = False, longest_s: float = LONGEST_S, on_wall: bool = False) -> None:
        super().__init__("TIME", self._read)
        self.positive = positive
        self.longest_s = longest_s
        self.on_wall = on_wall

    def _read(self, word: str) -> Time:
        shown, text = shortened(repr(word)), word.strip()
        time = time_of(text)
        if time is None or (self.on_wall and time.in_ticks):
            raise ValueError(f"{shown} is not a time; {self._remedy(SHAPE.fullmatch(text))}.")
        if self.positive and not time.value:
            raise ValueError(f"{shown} is no time at all; give more than zero.")
        if time.seconds() > self.longest_s:
            raise ValueError(f"{shown} is too long; the longest is {self.longest_s:.0f}s.")
        return time

    def _remedy(self, match: re.Match[str] | None) -> str:
        if match is None or match[2]:
            return "write 2s, 20ms, 341us or 5min" + ("" if self.on_wall else ", or 48000t for ticks")
        number = match[1]
        ticks = "" if self.on_wall else f", {number.partition('.')[0] or 0}t for ticks of the crystal"
        return f"it has no unit: write {number}s for seconds{ticks}"


def window(
    from_time: Time | None, to_time: Time | None, crystal_hz: int = TICKS_PER_SECOND
) -> tuple[int, int | None]:
    """First and last tick of --from and --to; None: to the end. Raises BadInput for an empty window."""
    from_tick = 0 if from_time is None else from_time.ticks(crystal_hz)
    to_tick = None if to_time is None else to_time.ticks(crystal_hz)
    if to_tick is not None and to_tick <= from_tick:
        place = f"--to {to_time}" if from_time is None else f"--from {from_time} --to {to_time}"
        raise BadInput("", place, "the window is empty", "--to must be later")
    return from_tick, to_tick


def wall_time(longest_s: float) -> Word:
    """A time of the wall clock, in seconds."""
    time = TimeType(positive=True, longest_s=longest_s, on_wall=True)
    return Word("TIME", lambda word: time.read(word).seconds(), "{:g}s".format)
