"""The events of a world: one record per event, from the logs of the boards and of the PC.

what        at the tick at which                                          fields
sent        the first start bit of a host's transmission leaves           data, good_stop (of all characters)
heard       the PC has sampled the stop bit of a character                value, good_stop
answer      the PC has sampled the last stop bit of a robot's answer      frame, slot
received    a robot's serial port sets RI for a character                 value, good_stop
transmitted a robot's serial port sets TI for a character                 value
frame       ... for the last character of a valid frame                   frame
command     an LM629 has taken the last byte of a command                 side, opcode, data
start_lost  an LM629 has accepted an STT before the sample of another     side
fault       the firmware did what it must not                             value (the kind), address
reached     the instruction at an address is next                         address
ended       no input can make the program go on, and all is sent         address
edge        a pin changes                                                 pin, value (the new level)
level       a pin has a level for a time, as somebody waits for           pin, measured (milliseconds)
pulse       a pulse ends, a period ends, as somebody waits for            pin, measured (us, Hz, share)
  frequency, duty
value       a value of a part is as somebody waits for                    pin (its path), measured
text        a text has come that somebody waits for                       data (which), measured
true        a predicate is true                                           -
wheel_lost  a position error makes an LM629 switch its motor off          side
reset       the level at a robot's reset pin is set                       value, slot
power       a robot's supply is switched                                  value (1: on), slot
put         a test puts a value of a board's part                         data (`PART.KEY = VALUE`), slot
hardware    hardware breaks, or is mended                                 data (the fault), slot
radio       a network's radio works, is off, or gives noise               value (of `radio.link_state`)
touch       two robots have begun to touch, seen every millisecond        value (slot), other (network, slot)
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Sequence
from itertools import takewhile

import msgspec

from miro_exact.bad_input import amount
from miro_protocol.events import Received
from miro_protocol.frames import ContentError, Message, TelemetryFrame
from miro_protocol.transmission import Transmission
from miro_robot import event_log
from miro_robot.event_log import EventLog
from miro_robot.lm629.commands import BY_OPCODE
from miro_sim.radio.params import LINK_STATES

PC = -1
"""Slot of what happens at the PC."""
SIDES = ("left", "right")
KEPT = 4096
MEASURES = {"level": " ms", "pulse": " us", "frequency": " Hz", "duty": " high"}
"""The unit of what was measured at a pin, by the kind of event."""
Symbol = tuple[int, bool, int]
"""Character, whether its stop bit was good, start tick."""


class Event(msgspec.Struct, frozen=True, kw_only=True, gc=False):
    """Something that happened at `tick`, on a robot or (`slot` -1) at the PC of a network."""

    tick: int
    what: str
    network: int = 0
    slot: int = PC
    value: int = 0
    good_stop: bool = True
    data: bytes = b""
    side: str = ""
    opcode: int = -1
    address: int = -1
    pin: str = ""
    measured: float | str | None = None
    other: tuple[int, int] | None = None
    frame: Received | None = None

    def __str__(self) -> str:
        where = f"net{self.network}/" + ("pc" if self.slot == PC else f"robot{self.slot}")
        return f"tick {self.tick}: {where}: {self.what}{self._detail()}"

    @property
    def command(self) -> str:
        """The name of the LM629 command (`STT`); of an opcode without a name the number (`7Fh`)."""
        known = BY_OPCODE.get(self.opcode)
        return f"{self.opcode:02X}h" if known is None else known.name

    def _detail(self) -> str:
        if self.what in ("heard", "received", "transmitted"):
            return f" {self.value:02X}h{'' if self.good_stop else ' with a bad stop bit'}"
        if self.what == "command":
            return f" {self.side} {self.command} {self.data.hex(' ')}".rstrip()
        if self.what in ("start_lost", "wheel_lost"):
            return f" {self.side}"
        if self.what == "edge":
            return f" {self.pin} to {self.value}"
        if self.what == "text":
            return f" {self.measured!r}"
        if self.what == "value":
            return f" {self.pin} = {self.measured}"
        if self.what in MEASURES:
            return f" {self.pin}, {self.measured:.6g}{MEASURES[self.what]}"
        if self.what in ("reached", "fault", "ended"):
            return f" {self.address:#06x}"
        if self.what in ("reset", "power"):
            return f" {self.value}"
        if self.what in ("put", "reseed", "hardware"):
            return f" {self.data.decode()}"
        if self.what == "radio":
            return f" {LINK_STATES[self.value]}"
        if self.what == "sent":
            return f" {amount(len(self.data), 'character')}"
        return ""


class HostLog:
    """The last 4096 events at the PC of one network, with serial numbers as a board's log has them.

    What the host sent, answers and characters become events when they are read. `known_tick`: when a symbol is
    known whose start bit began at a tick. `robots`: of the network.
    """

    NOT_STATE = ("*",)

    def __init__(self, network: int, known_tick: Callable[[int], int], robots: int) -> None:
        self.network = network
        self.robots = robots
        self.known_tick = known_tick
        self.end = 0
        self.kept: deque[Event | Transmission | Received | Symbol] = deque(maxlen=KEPT)
        self.rare: deque[tuple[int, Event | Transmission | Received]] = deque(maxlen=KEPT)  # no characters

    @property
    def first(self) -> int:
        return self.end - len(self.kept)

    def note(self, record: Event | Transmission | Received) -> None:
        self.kept.append(record)
        self.rare.append((self.end, record))
        self.end += 1

    def note_heard(self, symbols: Sequence[Symbol]) -> None:
        self.kept.extend(symbols)
        self.end += len(symbols)

    def since(self, serial: int, kinds: Collection[str] | None = None) -> list[tuple[int, Event]]:
        """(serial number, event) of the events still stored from `serial` on; `kinds`: of these alone."""
        first = self.first
        some: Sequence[tuple[int, Event | Transmission | Received | Symbol]]
        if kinds is None or "heard" in kinds:
            some = [(number, self.kept[number - first]) for number in range(max(serial, first), self.end)]
        else:
            some = list(takewhile(lambda numbered: numbered[0] >= serial, reversed(self.rare)))[::-1]
        return [
            (number, self._event(record))
            for number, record in some
            if kinds is None or _kind(record) in kinds
        ]

    def _event(self, record: Event | Transmission | Received | Symbol) -> Event:
        if isinstance(record, Event):
            return record
        if isinstance(record, Transmission):
            good = not record.bad_stop
            return Event(
                tick=record.tick, what="sent", network=self.network, data=record.data, good_stop=good
            )
        if not isinstance(record, Received):
            value, good, start_tick = record
            tick = self.known_tick(start_tick)
            return Event(tick=tick, what="heard", network=self.network, value=value, good_stop=good)
        try:
            message: Message | None = record.message(self.robots)
        except ContentError:  # the CRC is good: a firmware that sets bits which the format keeps at 0
            message = None
        slot = message.slot if isinstance(message, TelemetryFrame) else -1
        tick = self.known_tick(record.last_tick)
        return Event(tick=tick, what="answer", network=self.network, value=slot, frame=record)

    def cut(self, serial: int) -> None:
        """Forgets the events from `serial` on."""
        while self.end > serial and self.kept:
            self.kept.pop()
            self.end -= 1
        while self.rare and self.rare[-1][0] >= self.end:
            self.rare.pop()


def _kind(record: Event | Transmission | Received | Symbol) -> str:
    """The kind of a host log's record."""
    if isinstance(record, Event):
        return record.what
    if isinstance(record, Transmission):
        return "sent"
    return "answer" if isinstance(record, Received) else "heard"


class BoardLog:
    """The events of a board, read as those of a PC are."""

    NOT_STATE = ("*",)

    def __init__(self, log: EventLog, network: int, slot: int) -> None:
        self.log = log
        self.network = network
        self.slot = slot

    @property
    def first(self) -> int:
        return self.log.first

    @property
    def end(self) -> int:
        return self.log.end

    def since(self, serial: int, kinds: Collection[str] | None = None) -> list[tuple[int, Event]]:
        """(serial number, event) of the events still stored from `serial` on; `kinds`: of these alone."""
        events = []
        for number in range(max(serial, self.log.first), self.log.end):
            noted = self.log.event(number)
            if kinds is None or _KINDS[noted[1]] in kinds:
                events.append((number, _event(*noted, self.network, self.slot)))
        return events


_KINDS = {
    event_log.RECEIVED: "received",
    event_log.SENT: "transmitted",
    event_log.COMMAND: "command",
    event_log.FAULT: "fault",
    event_log.REACHED: "reached",
    event_log.TRUE: "true",
    event_log.START_LOST: "start_lost",
    event_log.WHEEL_LOST: "wheel_lost",
    event_log.ENDED: "ended",
}


class Cursor:
    """A reader of a log, from now on: `next` is the serial number of the first unread event."""

    NOT_STATE = ("*",)

    def __init__(self, log: HostLog | BoardLog) -> None:
        self.log = log
        self.next = log.end

    @property
    def lost(self) -> int:
        """Events that were overwritten before they were read."""
        return max(0, self.log.first - self.next)

    def read(self, kinds: Collection[str] | None = None) -> list[tuple[int, Event]]:
        """(serial number, event) of what is new; `kinds`: of these alone."""
        events = self.log.since(self.next, kinds)
        self.next = self.log.end
        return events


def _event(tick: int, kind: int, code: int, value: int, data: bytes, network: int, slot: int) -> Event:
    word = _KINDS[kind]
    if word == "command":
        side, opcode = SIDES[code >> 8], code & 0xFF
        return Event(tick=tick, what=word, network=network, slot=slot, side=side, opcode=opcode, data=data)
    if word in ("start_lost", "wheel_lost"):
        return Event(tick=tick, what=word, network=network, slot=slot, side=SIDES[code])
    if word in ("fault", "reached", "ended"):
        return Event(tick=tick, what=word, network=network, slot=slot, value=code, address=value)
    good = word != "received" or code == 1
    return Event(tick=tick, what=word, network=network, slot=slot, value=value, good_stop=good)
