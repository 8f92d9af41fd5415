"""Times as people write them: 2s, 20ms, 341us, 5min, or 48000t, which are ticks of the crystal."""

from __future__ import annotations

import re
from fractions import Fraction

import msgspec

from miro_exact.clock import TICKS_PER_SECOND

UNITS_S = {
    "h": Fraction(3600),
    "min": Fraction(60),
    "s": Fraction(1),
    "ms": Fraction(1, 1000),
    "us": Fraction(1, 1_000_000),
}
TICKS = "t"
SHAPE = re.compile(r"([0-9]{1,18}(?:\.[0-9]{0,18})?|\.[0-9]{1,18}) *([a-z]*)", re.ASCII | re.IGNORECASE)
TICK = re.compile(r"[0-9]{1,20}")


class Time(msgspec.Struct, frozen=True):
    """Seconds, or ticks of a crystal whose frequency is known only after all options are read."""

    text: str
    value: Fraction
    in_ticks: bool

    def __str__(self) -> str:
        return self.text

    def ticks(self, crystal_hz: int = TICKS_PER_SECOND) -> int:
        """Whole ticks, rounded down."""
        return int(self.value if self.in_ticks else self.value * crystal_hz)

    def seconds(self, crystal_hz: int = TICKS_PER_SECOND) -> float:
        return float(self.value / crystal_hz if self.in_ticks else self.value)


def time_of(text: str) -> Time | None:
    """The time in a text; None for any other text, including a number without a unit."""
    match = SHAPE.fullmatch(text)
    if match is None:
        return None
    number, unit = match.groups()
    if unit not in UNITS_S and (unit != TICKS or "." in number):
        return None
    return Time(text, Fraction(number) * UNITS_S.get(unit, 1), unit == TICKS)


def tick_of(text: str, crystal_hz: int) -> int | None:
    """The tick in a file's text, given as a number or a time; None for any other text."""
    if TICK.fullmatch(text):
        return int(text)
    time = time_of(text)
    return None if time is None else time.ticks(crystal_hz)
