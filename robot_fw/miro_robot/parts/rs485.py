"""A transceiver between the serial port and an RS485 bus, as MAX485 and SN75176.

DI >──|>── A/B     while DE is high; the PC is on the bus, too, with an adapter that switches by itself
RO <──<|── A/B
"""

from __future__ import annotations

from typing import Any

from miro_exact.clock import NEVER_TICK
from miro_exact.state import FLAG, TICK, Rows
from miro_robot.faults import FaultKind
from miro_robot.parts.keys import PartKeys, Pin, Place
from miro_robot.parts.part import Part
from miro_robot.parts.wire_part import WirePart

_DE = 2
_MOST_SENT = 64
_CONTENTION = int(FaultKind.NET_CONTENTION)


class Rs485(PartKeys, frozen=True, kw_only=True, tag="rs485"):
    """An RS485 transceiver. The bus is biased: it reads 1 while nobody drives it. It hears the PC whatever /RE is."""

    PINS = (Pin("di"), Pin("ro"), Pin("de"), Pin("re", optional=True, level=0))
    AT = {"di": "P3.1", "ro": "P3.0"}
    PUTS = {"broken": bool}
    READS = {
        "broken": "whether its wire to the bus is broken",
        "driving": "whether it drives the bus: DE is high, and the wire whole",
        "drove_us": "for how long it drove the bus last, up to now if it still does",
        "lost": "characters of the processor that did not come through: DE was low, or both ends drove",
    }
    SHEET = "Maxim, MAX481/MAX483/MAX485/MAX487 (19-0122), tables 1 and 2; delays below 1 us are left out"

    def make(self, place: Place) -> Part:
        return Rs485Part(self, place)


class Rs485Part(WirePart):
    """`driving` since `begun_tick`, or until `ended_tick`. `sent`: from when to when the PC sends, the last 64.

    On a bus of several boards, `names`: `switched`: when its driver went on or off, until the bus takes that;
    `meetings`: when it gets known whose driver was on already.
    """

    STATE = {
        "driving": FLAG,
        "broken": FLAG,
        "begun_tick": TICK,
        "ended_tick": TICK,
        "sent": Rows(_MOST_SENT, TICK, TICK),
        "switched": Rows(1 << 20, TICK, FLAG),
        "meetings": Rows(1 << 20, TICK, ("B", 0, 15)),
    }
    NOT_STATE = ("names", "slot", "delay_ticks")

    def __init__(self, keys: Rs485, place: Place) -> None:
        WirePart.__init__(self, keys, place)
        self.driving = self.broken = self.begun_tick = self.ended_tick = 0
        self.sent: list[tuple[int, int]] = []
        self.switched: list[tuple[int, int]] = []
        self.meetings: list[tuple[int, int]] = []
        self.names: list[str] = []
        self.slot = self.delay_ticks = 0

    def supply(self, on: int, tick: int) -> None:
        WirePart.supply(self, on, tick)
        self._switch(tick)

    def changed(self, pins: int, tick: int) -> None:
        if pins >> _DE & 1:
            self._switch(tick)

    def put(self, name: str, value: Any, tick: int) -> None:
        self.broken = 1 if value else 0
        self._switch(tick)

    def _switch(self, tick: int) -> None:
        driving = 1 if self.on and not self.broken and self.level(_DE) else 0
        if driving == self.driving:
            return
        self.driving = driving
        if self.names:
            self.switched.append((tick, driving))
        if driving:
            self.begun_tick = tick
            if any(first <= tick < end for first, end in self.sent):
                self._contend(0)
        else:
            self.ended_tick = tick
            began = [first for first, _ in self.sent if self.begun_tick < first < tick]
            if began:  # the PC, meanwhile
                self._contend(tick - began[0])

    # Several boards

    def join(self, names: list[str], slot: int, delay_ticks: int) -> None:
        """Joins a bus of boards with these `names`, as the one in `slot`."""
        self.names, self.slot, self.delay_ticks = names, slot, delay_ticks
        self.switched = [(0, self.driving)] if self.driving else []

    def take(self, end_tick: int) -> list[tuple[int, int]]:
        """Ticks at which its driver went on or off before `end_tick`; each is returned once."""
        taken = [change for change in self.switched if change[0] < end_tick]
        self.switched = self.switched[len(taken) :]
        return taken

    def meet(self, tick: int, other: int) -> None:
        """Reports at `tick` that the driver of the board in slot `other` was on when this one went on."""
        self.meetings.append((tick, other))
        self.next_tick = self.meetings[0][0]

    def due(self, tick: int) -> None:
        names = [self.names[other] for _, other in self.meetings[:1]]
        self.meetings = self.meetings[1:]
        self.next_tick = self.meetings[0][0] if self.meetings else NEVER_TICK
        detail = f"bus: {self.names[self.slot]}.{self.name} and that of {names[0]} both drive"
        self.fault(_CONTENTION, detail, 0, self.delay_ticks)

    def _contend(self, ago: int) -> None:
        self.fault(_CONTENTION, f"bus of {self.name}: {self.name} and the PC both drive", 0, ago)

    def gives(self, first_tick: int, tick: int, bit_ticks: int) -> bool:
        """The driver was on from before the start bit until now; the bias holds a stop bit that it leaves early."""
        alone = not any(first < tick and first_tick < end for first, end in self.sent)
        if self.driving and self.begun_tick <= first_tick and alone:
            return True
        self.lost += 1
        return False

    def takes(self, first_tick: int, end_tick: int, characters: int) -> bool:
        self.sent = [*self.sent[1 - _MOST_SENT :], (first_tick, end_tick)]
        return bool(self.on and not self.broken)

    def read(self, name: str, tick: int) -> float | int | bool | str:
        if name in ("driving", "broken"):
            return bool(self.driving if name == "driving" else self.broken)
        if name == "drove_us":
            return 1e6 * ((tick if self.driving else self.ended_tick) - self.begun_tick) / self.crystal_hz
        return self.lost
