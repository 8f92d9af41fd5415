"""Levels that the outside puts on port pins of the bare machine, from a text file.

    # TICK * PIN LEVEL, in the order of time; a tick is a period of the crystal, 12 a machine cycle
    0 * P3.2 1
    24000 * P3.2 0     # /INT0 falls after 1 ms at 24 MHz
    24120 * P3.2 1

Pins are high until the file says otherwise. P1 to P3 are quasi-bidirectional and P0 is open drain: a pin is low if its
latch or the outside pulls it low. The CPU samples pins once a machine cycle (AT89C52 data sheet, S5P2), so it may miss
a pulse that is shorter than that.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import NamedTuple

from miro_exact.bad_input import BadInput
from miro_exact.clock import NEVER_TICK
from miro_exact.state import TICK
from miro_robot.bare.input import MARGIN_TICKS, SLICE
from miro_robot.mcs51.cpu import Cpu

RXD = (3, 0)  # P3.0, whose level also is what the receiver sees
_LATEST_TICK = 1 << 60
_MOST_RXD = 2_000  # edges handed over at a time: the line keeps 4096
_LINE = re.compile(r"(\d{1,20})\s+\*\s+P([0-3])\.([0-7])\s+([01])", re.ASCII)
_FORM = "write TICK * P1.0 0|1, such as 24000 * P3.2 0"


class PinEvent(NamedTuple):
    """The outside puts `level` on P`port`.`bit` at `tick`."""

    tick: int
    port: int
    bit: int
    level: int


def read_pins(text: str, path: str) -> tuple[PinEvent, ...]:
    """The events of a file. Raises BadInput."""
    events: list[PinEvent] = []
    last: dict[tuple[int, int], int] = {}  # tick of the last event of a pin
    for number, line in enumerate(text.split("\n"), 1):
        content = line.partition("#")[0].strip()
        if not content:
            continue
        match = _LINE.fullmatch(content)
        if match is None:
            raise BadInput(path, number, f"{content[:40]!r} is no pin event", _FORM)
        event = PinEvent(*(int(part) for part in match.groups()))
        if event.tick > _LATEST_TICK:
            raise BadInput(path, number, f"tick {event.tick} is too late", f"use ticks up to {_LATEST_TICK}")
        if events and event.tick < events[-1].tick:
            what = f"tick {event.tick} comes after tick {events[-1].tick}"
            raise BadInput(path, number, what, "sort the lines by tick")
        if last.get((event.port, event.bit)) == event.tick:
            what = f"P{event.port}.{event.bit} has a level at tick {event.tick} already"
            raise BadInput(path, number, what, "leave one line out")
        last[event.port, event.bit] = event.tick
        events.append(event)
    return tuple(events)


class PinInput:
    """Hands `events`, which are in the order of time, to `cpu`. `told(tick, port, levels)` gets each of them too."""

    STATE = {"done": TICK, "levels": ("4B", 0, 0xFF)}
    NOT_STATE = ("cpu", "events", "told", "uses_rxd")

    def __init__(self, cpu: Cpu, events: tuple[PinEvent, ...]) -> None:
        self.cpu = cpu
        self.events = events
        self.uses_rxd = any((event.port, event.bit) == RXD for event in events)
        self.told: Callable[[int, int, int], object] | None = None
        self.done = 0  # events handed over
        self.levels = [0xFF] * 4

    @property
    def next_tick(self) -> int:
        """Tick of the first event that the CPU does not know yet, NEVER_TICK if it knows them all."""
        return self.events[self.done].tick if self.done < len(self.events) else NEVER_TICK

    def feed(self) -> int:
        """Hands over what comes soon, and says up to which cycle the CPU may run before it needs more."""
        end_tick = 12 * (self.cpu.cycles + SLICE) + MARGIN_TICKS
        rxd_edges = 0
        while self.next_tick < end_tick and rxd_edges < _MOST_RXD:
            event = self.events[self.done]
            rxd_edges += (event.port, event.bit) == RXD
            self._push(event)
            self.done += 1
        if self.uses_rxd:
            self.cpu.rxd.settled_tick = self.next_tick
        return max((self.next_tick - MARGIN_TICKS) // 12, self.cpu.cycles + 1)

    def _push(self, event: PinEvent) -> None:
        tick, port, bit, level = event
        if (port, bit) == RXD:
            self.cpu.rxd.append(tick, level)
            return
        levels = self.levels[port] & (0xFF ^ 1 << bit) | level << bit
        if levels != self.levels[port]:
            self.levels[port] = levels
            self.cpu.set_external(port, levels, tick)
            if self.told is not None:
                self.told(tick, port, levels)

    def after_load(self) -> None:
        """Raises ValueError for more events than there are."""
        if self.done > len(self.events):
            raise ValueError(f"{self.done} of {len(self.events)} events were handed over")
