"""The LM629's bus limits, against the ticks at which its pins move.

The meaning of the bytes is in `host_port.py`; the board reports violations. The modelled chip continues as if the
access were in time, because real behaviour after a violation is not documented.

A tick is 125/3 ns. Only edges within one instruction can be too close: those of two instructions are at least 8
ticks (333 ns) apart, from a port pin that moves as one ends to the address that a MOVX puts out in the next. So
nothing here has to be saved.
"""

from __future__ import annotations

import msgspec

_NONE, _READ_ACCESS, _WRITE_PULSE, _DATA_SETUP, _DATA_HOLD = 0, 1, 2, 3, 4
_PS_SETUP, _PS_HOLD, _RECOVERY, RESET_PULSE = 5, 6, 7, 8
_LONG_AGO = -(1 << 40)


class Limit(msgspec.Struct, frozen=True):
    """The LM629 needs `needed_ns`; the AT89C52 at 24 MHz may have `lost_ns` less to give than its edges say.

    `lost_ns`: nominal time less the one its AC table guarantees: 5 clocks - 118 ns for reading, 6 clocks - 150 ns for
    the width of /WR, 1 clock - 16.7 ns for write data after it. Port pins lose nothing of note, but are 500 ns apart.
    """

    name: str
    needed_ns: int
    lost_ns: int = 0

    @property
    def ticks(self) -> int:
        """The fewest whole ticks that are enough."""
        return -(-3 * (self.needed_ns + self.lost_ns) // 125)

    def breach(self, ticks: int) -> str:
        """For people: what there was, and what is needed."""
        given_ns = max(0, (125 * ticks - 3 * self.lost_ns + 1) // 3)
        return f"{self.name} {given_ns} ns, {self.needed_ns} ns needed"


LIMITS = (
    Limit("", 0),
    Limit("read access", 180, 90),
    Limit("/WR pulse", 100, 100),
    Limit("write data set-up", 50),
    Limit("write data hold", 120, 25),
    Limit("PS set-up", 30),
    Limit("PS hold", 30),
    Limit("recovery between two accesses", 120),
    Limit("/RST pulse", 1333),  # 8 clocks
)


class BusTiming:
    """Watches one chip's pins. `ticks` is how long the time was that `pins` or `sampled` found too short.

    A strobe is /CS and /WR low, or /CS and /RD low with /WR high. PS must stand from before it begins until after it
    ends; write data before and after a write ends.
    """

    NOT_STATE = ("*",)

    def __init__(self) -> None:
        self.least = [limit.ticks for limit in LIMITS]
        self.ticks = 0
        self.broken = _NONE
        self.rest(0, 0, 1, 0xFF)

    def rest(self, writing: int, reading: int, ps: int, data: int) -> None:
        """The pins have been like this for long."""
        self.writing = writing
        self.reading = reading
        self.ps = ps
        self.data = data
        self.begin_tick = _LONG_AGO
        self.end_tick = _LONG_AGO
        self.written_tick = _LONG_AGO
        self.ps_tick = _LONG_AGO
        self.data_tick = _LONG_AGO

    def pins(self, tick: int, cs: int, rd: int, wr: int, ps: int, data: int) -> int:
        """Levels from `tick` on. Returns the place in LIMITS of the first that this breaks, or 0."""
        writing = 1 if cs == 0 and wr == 0 else 0
        reading = 1 if cs == 0 and rd == 0 and wr != 0 else 0
        self.broken = _NONE
        moved = writing != self.writing or reading != self.reading
        if moved and (self.writing or self.reading):
            self._strobe_ends(tick)
        if ps != self.ps:
            self._require(_PS_HOLD, 0 if self.writing or self.reading else tick - self.end_tick)
            self.ps = ps
            self.ps_tick = tick
        if data != self.data:
            self._require(_DATA_HOLD, tick - self.written_tick)
            self.data = data
            self.data_tick = tick
        if moved and (writing or reading):
            self._require(_RECOVERY, tick - self.end_tick)
            self._require(_PS_SETUP, tick - self.ps_tick)
            self.begin_tick = tick
        self.writing = writing
        self.reading = reading
        return self.broken

    def sampled(self, tick: int) -> int:
        """The CPU takes what this chip drives at `tick`. Returns the place of a limit as `pins` does."""
        self.broken = _NONE
        if self.reading:
            self._require(_READ_ACCESS, tick - self.begin_tick)
        return self.broken

    def _strobe_ends(self, tick: int) -> None:
        if self.writing:
            self._require(_WRITE_PULSE, tick - self.begin_tick)
            self._require(_DATA_SETUP, tick - self.data_tick)
            self.written_tick = tick
        self.end_tick = tick

    def _require(self, limit: int, ticks: int) -> None:
        """Notes the limit if it is the first that is broken."""
        if ticks < self.least[limit] and self.broken == _NONE:
            self.broken = limit
            self.ticks = ticks
