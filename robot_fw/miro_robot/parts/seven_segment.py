"""One to eight digits of seven segments and a point, driven one after the other so fast that all seem to be lit.

      a               dig1      dig2      dig3      dig4
     ───            ┌───────┬─────────┬─────────┬────────┐
   f│   │b    a ────┤  ─    │  ─      │  ─      │  ─     │   a segment of a digit is lit while both its pin and that
     ─g─      ..    │ | |   │ | |     │ | |     │ | |    │   of the digit are on:
   e│   │c    dp ───┤  ─  . │  ─  .   │  ─  .   │  ─  .  │     cathode   segments high, digit low
     ─── dp         └───────┴─────────┴─────────┴────────┘     anode     segments low, digit high
      d

What is seen is that of the last `window_ms` that is over, each counted from the one before: a segment is seen that was
lit for a quarter of the time of the brightest one at least, and for 1/256 of the window. So what flashes up while
digits are switched is not seen, as by the eye; that quarter is chosen. Transistors that turn a level round are
inverters in the board file: `dig1 = "!P2.0"`.
"""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from miro_exact.state import TICK
from miro_robot.parts.keys import IN, PartKeys, Pin, Place
from miro_robot.parts.part import Part

_MOST_DIGITS = 8
_NEVER = 1 << 62
_GLYPHS = {
    0x3F: "0", 0x06: "1", 0x5B: "2", 0x4F: "3", 0x66: "4", 0x6D: "5", 0x7D: "6", 0x07: "7", 0x7F: "8", 0x6F: "9",
    0x7C: "6", 0x27: "7", 0x67: "9", 0x77: "A", 0x39: "C", 0x5E: "d", 0x79: "E", 0x71: "F", 0x3D: "G", 0x76: "H",
    0x74: "h", 0x1E: "J", 0x38: "L", 0x54: "n", 0x5C: "o", 0x73: "P", 0x50: "r", 0x78: "t", 0x3E: "U", 0x1C: "u",
    0x6E: "y", 0x58: "c", 0x00: " ", 0x08: "_", 0x40: "-", 0x48: "=", 0x63: "°",
}  # fmt: skip
"""Segments, a lowest, to what a reader takes them for; 6, 7 and 9 with and without their serifs."""


class SevenSegment(PartKeys, frozen=True, kw_only=True, tag="seven_segment"):
    """Digits, as many as have a pin; without one it is a single digit that is always on. What has no pin is dark.

    `common`: what the segments of a digit share. `window_ms`: for so long an eye gathers light.
    """

    PINS = (
        *(Pin(name) for name in "abcdefg"),
        Pin("dp", IN, optional=True, level=0),
        *(Pin(f"dig{number}", IN, optional=True) for number in range(1, _MOST_DIGITS + 1)),
    )
    READS = {
        "text": "what is seen, a point behind its digit, ? for what is no character",
        "segments": "the same as hex digits, two a digit, a lowest, dp highest",
        "digits": "how many digits show anything",
    }
    SHEET = "Kingbright SC56-11 (common cathode), SA56-11 (common anode): internal circuit diagram"

    common: Literal["cathode", "anode"] = "cathode"
    window_ms: Annotated[float, Meta(ge=1.0, le=1000.0)] = 20.0

    @property
    def pulled_up(self) -> tuple[str, ...]:
        """The segments of a common anode, by their digits."""
        return (*"abcdefg", "dp") if self.common == "anode" else ()

    def make(self, place: Place) -> Part:
        return SevenSegmentPart(self, place)


class SevenSegmentPart(Part):
    """`lit`: by digit and segment, ticks in this window up to `last_tick`. `seen`: segments by digit, of the last."""

    STATE = {
        "last_tick": TICK,
        "segments": ("i", 0, 0xFF),
        "digits": ("i", 0, 0xFF),
        "lit": ("64q", 0, 1 << 62),
        "seen": "8B",
    }
    NOT_STATE = ("count", "turned", "there", "window_ticks")

    def __init__(self, keys: SevenSegment, place: Place) -> None:
        Part.__init__(self, keys, place)
        selects = [number - 7 for number in place.connected if number > 7]
        self.count = max(selects, default=1)
        self.turned = 0xFF if keys.common == "anode" else 0xFF00  # pins that are on while they are low
        self.there = sum([1 << number for number in place.connected])
        self.window_ticks = max(1, self.ticks(1000.0 * keys.window_ms))
        self.last_tick = self.segments = self.digits = 0
        self.lit = [0] * 64
        self.seen = [0] * 8

    def start(self, tick: int) -> None:
        self.last_tick = tick
        self.next_tick = tick + self.window_ticks
        self._look()

    def supply(self, on: int, tick: int) -> None:
        """Without it nothing is seen, and what was lit before is forgotten."""
        for place in range(64):
            self.lit[place] = 0
            self.seen[place & 7] = 0
        Part.supply(self, on, tick)

    def changed(self, pins: int, tick: int) -> None:
        self._gather(tick)
        self._look()

    def _look(self) -> None:
        """Samples the lit segments from now on."""
        on = (self.levels ^ self.turned) & self.there
        self.segments = on & 0xFF
        self.digits = on >> 8 & 0xFF if self.there >> 8 else 1

    def _gather(self, tick: int) -> None:
        """Adds the lit segments up to now."""
        since = tick - self.last_tick
        self.last_tick = tick
        if not self.segments:
            return
        for digit in range(self.count):
            if self.digits >> digit & 1:
                for segment in range(8):
                    if self.segments >> segment & 1:
                        self.lit[8 * digit + segment] += since

    def due(self, tick: int) -> None:
        """A window is over."""
        self._gather(tick)
        self.next_tick = tick + self.window_ticks
        least = max(self.window_ticks >> 8, 1)
        for place in range(64):
            least = max(least, self.lit[place] >> 2)
        for digit in range(_MOST_DIGITS):
            seen = 0
            for segment in range(8):
                seen |= (1 if self.lit[8 * digit + segment] >= least else 0) << segment
                self.lit[8 * digit + segment] = 0
            self.seen[digit] = seen

    def read(self, name: str, tick: int) -> float | int | bool | str:
        seen = [self.seen[digit] for digit in range(self.count)]
        if name == "digits":
            return len([lit for lit in seen if lit])
        if name == "segments":
            return "".join([f"{lit:02x}" for lit in seen])
        return "".join([_GLYPHS.get(lit & 0x7F, "?") + ("." if lit & 0x80 else "") for lit in seen])
