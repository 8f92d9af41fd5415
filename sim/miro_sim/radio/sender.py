"""A transmitter as the robots hear it: what it has on the air, and when each bit of it begins.

A character with a bad stop bit has space in place of it for three quarters of a bit, and mark for the last one. An 8051
samples the stop bit at 7, 8 and 9 sixteenths and looks for the next start bit from 10 sixteenths on, a UART that
samples once does both in the middle: all of them take the stop bit for bad and see the fall of the next start bit.
"""

from __future__ import annotations

from miro_exact.clock import CHARACTER_BITS, NEVER_TICK
from miro_exact.state import Rows
from miro_sim.radio.params import Radio, bit_ticks

_CHARACTER = 10
assert CHARACTER_BITS == _CHARACTER


class Sender:
    """One transmitter, on the clock of robots whose crystals are off by `crystal_offset_ppm`.

    `transmissions`: (tick at which the first start bit arrives, bytes, stops), in order. `stops`: empty, or a byte
    for each character, which is 1 where the stop bit is bad.
    """

    STATE = {
        "transmissions": Rows(
            *(1 << 16, ("q", 0, NEVER_TICK >> 1), "I", ("s", 1 << 21)),
            split=lambda row: (row[0], len(row[1]), row[1] + row[2]),
            make=lambda cells: (cells[0], cells[2][: cells[1]], cells[2][cells[1] :]),
            ordered=True,
        )
    }
    NOT_STATE = ("always_on", "denominator", "keyup", "latency", "numerator")

    def __init__(self, params: Radio, crystal_offset_ppm: int) -> None:
        bit = bit_ticks(params.baud_offset_ppm, crystal_offset_ppm)
        self.numerator = bit.numerator
        self.denominator = bit.denominator
        self.latency = params.latency_ticks
        self.keyup = params.keyup_ticks
        self.always_on = params.carrier == "on"
        self.transmissions: list[tuple[int, bytes, bytes]] = []

    def __repr__(self) -> str:
        waiting = [(start, data.hex(" ")) for start, data, _ in self.transmissions]
        return f"Sender({self.numerator}/{self.denominator} ticks a bit, {waiting})"

    def begin(self, start: int, number: int) -> int:
        """Tick at which bit `number` of a transmission begins."""
        if self.denominator == 1:
            return start + number * self.numerator
        return start + number * self.numerator // self.denominator

    def back(self, start: int, number: int) -> int:
        """Tick at which bit `number`, a bad stop bit, goes back to mark."""
        return start + (4 * number + 3) * self.numerator // (4 * self.denominator)

    def number(self, since: int) -> int:
        """Number of the bit that is on the air `since` ticks after the start."""
        return ((since + 1) * self.denominator - 1) // self.numerator

    def end(self, start: int, count: int) -> int:
        """Tick at which the last stop bit of `count` characters from `start` on is over."""
        return self.begin(start, _CHARACTER * count)

    def levels(self, data: bytes, stops: bytes, number: int) -> int:
        """The levels of the character that bit `number` belongs to, that of its start bit lowest."""
        index = number // _CHARACTER
        stop = 0 if len(stops) > 0 and stops[index] else 1
        return stop << (_CHARACTER - 1) | data[index] << 1

    def bad_stop(self, stops: bytes, number: int) -> bool:
        """True if bit `number` is a bad stop bit."""
        if len(stops) == 0 or number % _CHARACTER != _CHARACTER - 1:
            return False
        return stops[number // _CHARACTER] != 0

    def level(self, tick: int) -> int:
        """The signal on the air at `tick`: 0 space, 1 mark, -1 no carrier."""
        for index in range(len(self.transmissions)):
            start, data, stops = self.transmissions[index]
            if start <= tick < self.end(start, len(data)):
                number = self.number(tick - start)
                if self.bad_stop(stops, number) and tick >= self.back(start, number):
                    return 1
                return self.levels(data, stops, number) >> number % _CHARACTER & 1
            if start - self.keyup <= tick < start:
                return 1
        return 1 if self.always_on else -1

    def forget(self, until: int) -> None:
        """Drops the transmissions that are over by then."""
        while self.transmissions:
            start, data, _ = self.transmissions[0]
            if self.end(start, len(data)) > until:
                break
            del self.transmissions[0]

    def after_load(self) -> None:
        """Raises ValueError unless each transmission holds a byte at least and none begins within another."""
        before = 0
        for start, data, stops in self.transmissions:
            if start < before or not data:
                raise ValueError(f"a transmission of {len(data)} bytes at tick {start}, after tick {before}")
            if len(stops) not in (0, len(data)):
                raise ValueError(f"{len(stops)} stop bits of {len(data)} characters")
            before = start + len(data)
