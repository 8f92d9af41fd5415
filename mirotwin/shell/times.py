"""Times on the command line: 2s, 20ms, 341us, 5min, or 48000t, which are ticks of the crystal."""

from __future__ import annotations

import re
from fractions import Fraction

import msgspec

from miro_exact.bad_input import BadInput, shortened
from miro_exact.clock import TICKS_PER_SECOND
from mirotwin.shell.command import Word

UNITS_S = {
    "h": Fraction(3600),
    "min": Fraction(60),
    "s": Fraction(1),
    "ms": Fraction(1, 1000),
    "us": Fraction(1, 1_000_000),
}
TICKS = "t"
SHAPE = re.compile(r"([0-9]{1,18}(?:\.[0-9]{0,18})?|\.[0-9]{1,18}) *([a-z]*)", re.ASCII | re.IGNORECASE)
LONGEST_S = 10**9
"""Longer than any run."""


class Time(msgspec.Struct, frozen=True):
    """Seconds, or ticks of the crystal; which crystal is known only when all options are."""

    text: str
    value: Fraction
    in_ticks: bool

    def __str__(self) -> str:
        return self.text

    def ticks(self, crystal_hz: int = TICKS_PER_SECOND) -> int:
        return int(self.value if self.in_ticks else self.value * crystal_hz)

    def seconds(self, crystal_hz: int = TICKS_PER_SECOND) -> float:
        return float(self.value / crystal_hz if self.in_ticks else self.value)


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
        match = SHAPE.fullmatch(text)
        if match is None or not self._is_unit(match[1], match[2]):
            raise ValueError(f"{shown} is not a time; {self._remedy(match)}.")
        time = Time(text, Fraction(match[1]) * UNITS_S.get(match[2], 1), match[2] == TICKS)
        if self.positive and not time.value:
            raise ValueError(f"{shown} is no time at all; give more than zero.")
        if time.seconds() > self.longest_s:
            raise ValueError(f"{shown} is too long; the longest is {self.longest_s:.0f}s.")
        return time

    def _is_unit(self, number: str, unit: str) -> bool:
        return unit in UNITS_S or (unit == TICKS and not self.on_wall and "." not in number)

    def _remedy(self, match: re.Match[str] | None) -> str:
        if match is None or match[2]:
            return "write 2s, 20ms, 341us or 5min" + ("" if self.on_wall else ", or 48000t for ticks")
        number = match[1]
        ticks = "" if self.on_wall else f", {number.partition('.')[0] or 0}t for ticks of the crystal"
        return f"it has no unit: write {number}s for seconds{ticks}"


def window(
    from_time: Time | None, to_time: Time | None, crystal_hz: int = TICKS_PER_SECOND
) -> tuple[int, int | None]:
    """The ticks that --from and --to ask for; None: to the end. Raises BadInput where there are none between."""
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
