"""Traffic on the air: each transmission of a host, its fate at each robot, and the answers.

A host's transmission that holds a frame has a fate at each robot of its network: `fresh` (a valid frame with a new
number arrived), `repeated` (a valid frame that is not), `damaged` (characters that are no frame), `lost` (nothing),
`open` (the run ended before it could have arrived). If a robot receives nothing fresh for so long that its failsafe
orders the wheels to stop (`stopped`) or the motors off (`off`), this is shown on a separate lane. Received characters
belong to the last transmission before them, shifted by the radio's latency. Characters at other times are `noise` on an
idle carrier.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple

import msgspec

from miro_exact.bad_input import amount
from miro_exact.clock import CHARACTER_BITS, HOST_CHARACTER_TICKS, ROBOT_BIT_TICKS, ticks
from miro_protocol.decoder import Decoder, Received
from miro_protocol.frames import ContentError, describe
from miro_protocol.robot_receiver import Reception, RobotReceiver
from miro_protocol.robot_rules import ACTING_TICKS, TO_RI_TICKS
from miro_protocol.table import TELEMETRY, TICKS_PER_MS
from miro_protocol.transmission import DOWN, Transmission
from miro_sim.periods import Period, RobotId
from miro_sim.world.events import BoardLog, Cursor, Event
from miro_sim.world.world import World
from mirotwin.verify.checks.orders import Orders

STOPS = {"stopped": "wheels told to stop", "off": "motors off"}
OF_PC = ("answer", "reset", "power", "radio")
RESTARTS = ("reset", "power")
ROBOT_CHARACTER_TICKS = CHARACTER_BITS * ROBOT_BIT_TICKS
TOGETHER_TICKS = 3 * ROBOT_CHARACTER_TICKS
"""Characters with a longer pause between them are two noises."""
SLACK_TICKS = 24_000
"""A frame may arrive earlier than calculated by this much, because delays are rounded."""


class LinkMark(msgspec.Struct, frozen=True):
    """Something on a lane from `start_tick` to `end_tick`. `robot`: at which it happened, if at one."""

    lane: str
    kind: str
    start_tick: int
    end_tick: int
    text: str
    robot: RobotId | None = None


class Arrival(NamedTuple):
    """Characters at a robot, by their ticks: a valid frame (`fresh` or not), or none (`fresh` None)."""

    ticks: tuple[int, ...]
    fresh: bool | None


class Stop(NamedTuple):
    """An order of the failsafe, `stopped` or `off`, so long after the last fresh frame."""

    tick: int
    kind: str
    after_ticks: int


class Arrivals:
    """Characters that the serial port of one of `robots` delivers, and when each came.

    `stops`: of each silence, the first order to stop and the first to switch off that no frame can have caused.
    """

    def __init__(self, log: BoardLog, robots: int) -> None:
        self.all: list[Arrival] = []
        self.stops: list[Stop] = []
        self._orders = Orders()
        self._fresh_tick = -1
        self._log = Cursor(log)
        self._robots = robots
        self._ticks: list[int] = []
        self._receiver = RobotReceiver(robots)

    def look(self, restarts: Sequence[Event]) -> None:
        """Processes new events; after a restart a robot has no memory of earlier frames."""
        own = [event for _, event in self._log.read() if event.what in ("received", "command")]
        for event in sorted([*own, *restarts], key=lambda event: event.tick):
            if event.what == "received":
                self._ticks.append(event.tick - TO_RI_TICKS)
                receptions = self._receiver.character(event.value, event.good_stop, event.tick)
                self._note(receptions)
                if any(fresh for _, fresh in receptions):
                    self._fresh_tick = event.tick
            elif event.what == "command":
                self._take_order(event)
            else:
                self.flush()
                self._receiver = RobotReceiver(self._robots)
                self._orders, self._fresh_tick = Orders(), -1

    def _take_order(self, event: Event) -> None:
        order = self._orders.take(event)
        after = event.tick - self._fresh_tick
        if order is None or order.what == "drive" or self._fresh_tick < 0 or after <= ACTING_TICKS:
            return
        kind = "off" if order.what == "off" else "stopped"
        if not any(stop.kind == kind and stop.tick > self._fresh_tick for stop in self.stops[-2:]):
            self.stops.append(Stop(event.tick, kind, after))

    def flush(self) -> None:
        """Nothing more comes."""
        self._note(self._receiver.flush())

    def _note(self, receptions: Sequence[Reception]) -> None:
        """Every character belongs to one event, in the order in which they came."""
        for reception, fresh in receptions:
            self.all.append(Arrival(tuple(self._ticks[: len(reception.data)]), fresh))
            del self._ticks[: len(reception.data)]


class LinkLog:
    """Watches the air of a world while it runs. Call `marks` at the end."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.wire: list[Transmission] = []
        self._at_pc: dict[int, list[Event]] = {network.index: [] for network in world.networks}
        self._pc = {network.index: Cursor(network.log) for network in world.networks}
        self._arrivals = {
            (network.index, robot.slot): Arrivals(robot.log, network.spec.robots)
            for network in world.networks
            for robot in network.robots
        }
        world.observers.append(self.look)

    def look(self, period: Period) -> None:
        """Processes the logs' new entries."""
        self.wire += period.wire
        for network in self.world.networks:
            index = network.index
            new = [event for _, event in self._pc[index].read() if event.what in OF_PC]
            self._at_pc[index] += new
            for robot in network.robots:
                restarts = [event for event in new if event.what in RESTARTS and event.slot == robot.slot]
                self._arrivals[index, robot.slot].look(restarts)

    def marks(self) -> list[LinkMark]:
        """All marks, lane by lane, in the order of time."""
        marks: list[LinkMark] = []
        for network in self.world.networks:
            index = network.index
            sent = [
                transmission
                for transmission in self.wire
                if transmission.network == index and transmission.direction == DOWN
            ]
            received = [
                transmission
                for transmission in self.wire
                if transmission.network == index and transmission.direction != DOWN
            ]
            named = [_named(transmission, network.spec.robots) for transmission in sent]
            delay = ticks(network.spec.radio.latency_s)
            marks += [_sent(transmission, name) for transmission, name in zip(sent, named, strict=True)]
            for robot in network.robots:
                arrivals = self._arrivals[index, robot.slot]
                arrivals.flush()
                place = (index, robot.slot)
                marks += _fates(place, sent, named, arrivals.all, delay, self.world.tick)
                marks += _stops(place, arrivals, self.world.tick)
            marks += _answers(received, self._at_pc[index], index)
            marks += [_action(event) for event in self._at_pc[index] if event.what != "answer"]
        return marks


def lanes_of(marks: Sequence[LinkMark]) -> list[str]:
    """Names of the lanes, in the order in which they are drawn from the top."""
    return list(dict.fromkeys(mark.lane for mark in marks))


def _named(sent: Transmission, robots: int) -> str:
    """The content of the frames in a transmission; empty where it holds none."""
    decoder = Decoder(robots)
    frames = [event for event in [*decoder.hear(sent), *decoder.flush()] if isinstance(event, Received)]
    return ", ".join(_content(frame, robots) for frame in frames)


def _content(frame: Received, robots: int) -> str:
    try:
        return describe(frame.message(robots))
    except ContentError:
        return f"unknown frame seq={frame.seq}"


def _sent(sent: Transmission, named: str) -> LinkMark:
    end = sent.tick + len(sent.data) * HOST_CHARACTER_TICKS
    text = named or _characters(len(sent.data))
    return LinkMark(f"net{sent.network} PC sends", "sent" if named else "raw", sent.tick, end, text)


def _fates(
    robot: RobotId,
    sent: Sequence[Transmission],
    named: Sequence[str],
    arrivals: Sequence[Arrival],
    delay: int,
    over_tick: int,
) -> list[LinkMark]:
    """The result of each transmission; characters that belong to none are noise."""
    lane = f"net{robot[0]}/robot{robot[1]} hears"
    begins = [arrival.tick + delay - SLACK_TICKS for arrival in sent]
    ends = [arrival.tick + delay + len(arrival.data) * HOST_CHARACTER_TICKS + SLACK_TICKS for arrival in sent]
    damaged: dict[int, int] = {}  # transmission -> characters of it in no frame
    frames: dict[int, bool] = {}  # ... -> whether the frame was fresh
    marks = []
    for arrival in arrivals:
        if arrival.fresh is not None:
            frames[bisect_right(begins, arrival.ticks[-1]) - 1] = arrival.fresh
            continue
        noise: list[int] = []
        for tick in arrival.ticks:
            number = bisect_right(begins, tick) - 1
            if number >= 0 and tick <= ends[number]:
                damaged[number] = damaged.get(number, 0) + 1
            else:
                noise.append(tick)
        for first, last, count in _together(noise):
            marks.append(LinkMark(lane, "noise", first, last, f"{_characters(count)} of noise"))
    for number, name in enumerate(named):
        start, end = begins[number] + SLACK_TICKS, ends[number] - SLACK_TICKS
        kind = _fate(frames.get(number), damaged.get(number, 0), end + SLACK_TICKS > over_tick)
        if name or kind not in ("lost", "open"):
            shown = min(end, over_tick) if kind == "open" else end
            marks.append(LinkMark(lane, kind, start, shown, f"{name or 'no frame'}: {kind}", robot))
    return sorted(marks, key=lambda mark: mark.start_tick)


def _stops(robot: RobotId, arrivals: Arrivals, over_tick: int) -> list[LinkMark]:
    """From each order of the failsafe to its next one, or to the next fresh frame."""
    lane = f"net{robot[0]}/robot{robot[1]} failsafe"
    begins = [stop.tick for stop in arrivals.stops]
    begins += [arrival.ticks[-1] for arrival in arrivals.all if arrival.fresh]
    marks = []
    for tick, kind, after_ticks in arrivals.stops:
        end = min((begin for begin in begins if begin > tick), default=over_tick)
        text = f"{STOPS[kind]}, {after_ticks / TICKS_PER_MS:.1f} ms after the last fresh frame"
        marks.append(LinkMark(lane, kind, tick, end, text, robot))
    return marks


def _together(ticks_of: Sequence[int]) -> list[tuple[int, int, int]]:
    """Begin, end and number of characters of each dense group."""
    spans: list[tuple[int, int, int]] = []
    for tick in ticks_of:
        end = tick + ROBOT_CHARACTER_TICKS
        if spans and tick - spans[-1][1] <= TOGETHER_TICKS:
            spans[-1] = (spans[-1][0], end, spans[-1][2] + 1)
        else:
            spans.append((tick, end, 1))
    return spans


def _fate(fresh: bool | None, damaged: int, at_the_end: bool) -> str:
    if fresh is not None:
        return "fresh" if fresh else "repeated"
    if at_the_end:
        return "open"
    return "damaged" if damaged else "lost"


def _answers(received: Sequence[Transmission], events: Sequence[Event], network: int) -> list[LinkMark]:
    """Receptions of the PC: characters without a valid answer are a damaged one, or too few for that, noise."""
    answers = [(event.tick, _content(event.frame, 3)) for event in events if event.frame is not None]
    marks = []
    for transmission in received:
        end = transmission.tick + len(transmission.data) * ROBOT_CHARACTER_TICKS
        within = [text for tick, text in answers if transmission.tick <= tick <= end + SLACK_TICKS]
        enough = len(transmission.data) >= TELEMETRY.wire_size // 2
        kind = "answer" if within else "damaged" if enough else "noise"
        who = ", ".join(within) or f"{_characters(len(transmission.data))}, no valid answer"
        marks.append(LinkMark(f"net{network} PC hears", kind, transmission.tick, end, who))
    return marks


def _action(event: Event) -> LinkMark:
    lane = f"net{event.network} done to it"
    return LinkMark(
        lane, "action", event.tick, event.tick + HOST_CHARACTER_TICKS, f"{event}".partition(": ")[2]
    )


def _characters(count: int) -> str:
    return amount(count, "character")
