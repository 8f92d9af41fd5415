"""Times in the text of captures, as ticks of 24 MHz."""

from __future__ import annotations

import re
from datetime import date

from miro_exact.clock import TICKS_PER_SECOND

_DAY_TICKS = 86_400 * TICKS_PER_SECOND
_UNITS = {"s": 1, "sec": 1, "ms": 10**3, "us": 10**6, "µs": 10**6, "μs": 10**6, "ns": 10**9}
TIME = (
    r"(?:(?:(?P<year>[0-9]{4})[-/.](?P<month>[0-9]{1,2})[-/.](?P<day>[0-9]{1,2})|[0-9]{1,2}[-/.][0-9]{1,2}[-/.][0-9]{2,4})"
    r"(?:T|[ ,_\t]{1,3}))?"
    r"(?P<hour>[0-9]{1,2}):(?P<minute>[0-5][0-9]):(?P<second>[0-5][0-9])(?:[.,](?P<part>[0-9]{1,9}+)(?![0-9]))?+"
    r"(?:\s?(?P<noon>[AP]M)|Z|[+-][0-9]{2}:?[0-9]{2})?"
    r"|(?P<number>[0-9]{1,20}+(?:\.[0-9]{1,12}+)?+)\s?(?P<unit>s|sec|ms|us|µs|μs|ns)?(?![0-9A-Za-z])"
)
"""A time of day, with or without a date, or a number of seconds or of another unit."""
_TIME = re.compile(TIME, re.IGNORECASE)


class Clock:
    """Parses times. A time of day that goes back by hours has passed midnight. `resolution_ticks`: of the times read so
    far. `assumed`: the unit assumed for an integer without one.

    A number without a point and a unit is taken as Unix time if it has the digits of one, else as ms.
    """

    def __init__(self, unit: str = "") -> None:
        self.unit = unit
        self.resolution_ticks = TICKS_PER_SECOND
        self.assumed = ""
        self._days = 0
        self._last = 0

    def ticks(self, match: re.Match[str]) -> int:
        """Of a match of `TIME`. Raises ValueError for a date that no calendar has."""
        if match["number"] is None:
            return self._of_day(match)
        whole, _, part = match["number"].partition(".")
        unit = match["unit"] or self.unit
        if not unit:
            unit = "s"
            if not part:
                unit = self.assumed = {10: "s", 13: "ms", 16: "us", 19: "ns"}.get(len(whole), "ms")
        return self._scaled(int(whole + part), len(part), _UNITS[unit.lower()])

    def of_text(self, text: str) -> int:
        """The tick of a time. Raises ValueError for text that is no time."""
        text = text.strip()
        match = _TIME.fullmatch(text.removeprefix("-"))
        if match is None:
            raise ValueError(f"{text[:20]!r} is no time")
        return -self.ticks(match) if text.startswith("-") else self.ticks(match)

    def _scaled(self, number: int, places: int, per_second: int) -> int:
        scale: int = 10**places * per_second
        self.resolution_ticks = min(self.resolution_ticks, max(1, TICKS_PER_SECOND // scale))
        return (2 * number * TICKS_PER_SECOND + scale) // (2 * scale)

    def _of_day(self, match: re.Match[str]) -> int:
        hour = int(match["hour"])
        if match["noon"]:
            hour = hour % 12 + 12 * (match["noon"].upper() == "PM")
        part = match["part"] or ""
        seconds = (hour * 60 + int(match["minute"])) * 60 + int(match["second"])
        tick = self._scaled(int(f"{seconds}{part}"), len(part), 1)
        if match["year"]:
            day = date(int(match["year"]), int(match["month"]), int(match["day"])).toordinal()
            return tick + (day - date(1970, 1, 1).toordinal()) * _DAY_TICKS
        if tick < self._last - _DAY_TICKS // 2:
            self._days += 1
        self._last = tick
        return tick + self._days * _DAY_TICKS
