"""The terminal at the end of a board's wire: bytes for its serial port, levels for its pins.

Pins come from a text file:

    # TICK * PIN LEVEL, in the order of time; a tick is a period of the crystal, 12 a machine cycle
    0 * P3.2 1
    1ms * P3.2 0       # /INT0 falls after 1 ms: tick 24000 at 24 MHz
    24120 * P3.2 1

Pins are high until the file says otherwise. P1 to P3 are quasi-bidirectional and P0 is open drain: a pin is low if its
latch or the outside pulls it low. The CPU samples pins once a machine cycle (AT89C52 data sheet, S5P2), so it may miss
a pulse that is shorter than that.
"""

from __future__ import annotations

import re
from typing import NamedTuple

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import TICKS_PER_SECOND
from miro_exact.times import tick_of

RXD = (3, 0)  # P3.0, whose level also is what the receiver sees
_LATEST_TICK = 1 << 60
_LINE = re.compile(r"([\d.]{1,40}[a-z]{0,3})\s+\*\s+P([0-3])\.([0-7])\s+([01])", re.ASCII)
_FORM = "write TICK * P1.0 0|1, such as 24000 * P3.2 0 or 1ms * P3.2 0"


class InputPiece(NamedTuple):
    """Bytes with a condition: they begin `delay_ticks` after the program has sent `when`.

    Without `when` the delay counts from the end of the piece before, or from the start. With neither (None), they
    follow the piece before, or begin as soon as the program listens. `when` is looked for in what is sent after the
    piece before.
    """

    data: bytes
    when: bytes = b""
    delay_ticks: int | None = None

    @property
    def has_condition(self) -> bool:
        return bool(self.when) or self.delay_ticks is not None


class PinEvent(NamedTuple):
    """The outside puts `level` on P`port`.`bit` at `tick`."""

    tick: int
    port: int
    bit: int
    level: int


def read_pins(text: str, path: str, crystal_hz: int = TICKS_PER_SECOND) -> tuple[PinEvent, ...]:
    """The events of a file. `crystal_hz`: ticks a second. Raises BadInput."""
    events: list[PinEvent] = []
    last: dict[tuple[int, int], int] = {}  # tick of the last event of a pin
    for number, line in enumerate(text.split("\n"), 1):
        content = line.partition("#")[0].strip()
        if not content:
            continue
        match = _LINE.fullmatch(content)
        tick = None if match is None else tick_of(match[1], crystal_hz)
        if match is None or tick is None:
            raise BadInput(path, number, f"{content[:40]!r} is no pin event", _FORM)
        event = PinEvent(tick, *(int(part) for part in match.groups()[1:]))
        if event.tick > _LATEST_TICK:
            raise BadInput(path, number, f"tick {event.tick} is too late", f"use ticks up to {_LATEST_TICK}")
        if events and event.tick < events[-1].tick:
            problem = f"tick {event.tick} comes after tick {events[-1].tick}"
            raise BadInput(path, number, problem, "sort the lines by tick")
        if last.get((event.port, event.bit)) == event.tick:
            problem = f"P{event.port}.{event.bit} has a level at tick {event.tick} already"
            raise BadInput(path, number, problem, "leave one line out")
        last[event.port, event.bit] = event.tick
        events.append(event)
    return tuple(events)


class TerminalSpec(msgspec.Struct, frozen=True, kw_only=True):
    """`pieces` for the serial port at `baud`, or at the rate of its receiver; `pins` for the ports.

    `gap_ticks`: least time from the end of a character to the start of the next. `wait`: each character waits until the
    program has taken the one before. `live`: more may be added any time.
    """

    pieces: tuple[InputPiece, ...] = ()
    baud: int | None = None
    gap_ticks: int = 0
    wait: bool = False
    live: bool = False
    pins: tuple[PinEvent, ...] = ()
