"""Observations of one robot in a trial, at its wires and chips. No symbol of the firmware is used.

An order to a wheel is a command to its LM629. An answer is the frame that the PC received. The chips are read at the
start of each control period.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TypeVar

import msgspec

from miro_protocol.events import Received
from miro_protocol.frames import ContentError, TelemetryFrame
from miro_robot.board import Board
from miro_robot.lm629.commands import BY_NAME
from miro_sim.periods import Axis, RobotPeriod
from miro_sim.world.events import SIDES, Event
from mirotwin.verify.checks.orders import Order, Orders

_RDRP = BY_NAME["RDRP"].opcode
_LFIL, _UDF = BY_NAME["LFIL"].opcode, BY_NAME["UDF"].opcode
READING = frozenset(command.opcode for command in BY_NAME.values() if command.words_out)
"""Commands that only read."""

Words = tuple[int, ...]
T = TypeVar("T", Event, Order, "ReceivedAnswer")


def within(items: Iterable[T], after_tick: int, until_tick: int) -> list[T]:
    """The items of `items` later than `after_tick` and not later than `until_tick`."""
    return [item for item in items if after_tick < item.tick <= until_tick]


class ReceivedAnswer(msgspec.Struct, frozen=True):
    """A valid answer, received completely by the PC at `tick`. `content`: None if it is not known."""

    tick: int
    frame: Received
    content: TelemetryFrame | None


class Observed:
    """Robot `slot` of `robots`. Everything is in the order of time; `end_tick`: the end of the observation.

    `filters`: tick and filter words (kp, ki, kd, il) that a chip took, by side.
    """

    def __init__(self, robots: int, slot: int) -> None:
        self.robots = robots
        self.slot = slot
        self.end_tick = 0
        self._orders = Orders()
        self.orders: dict[str, list[Order]] = {side: [Order(-1, side, "off")] for side in SIDES}
        self._filter: dict[str, list[int]] = {side: [0, 0, 0, 0] for side in SIDES}
        self.filters: dict[str, list[tuple[int, Words]]] = {side: [] for side in SIDES}
        self.events: list[Event] = []
        self.commands: list[Event] = []
        self.received: list[Event] = []
        self.answers: list[ReceivedAnswer] = []
        self.periods: list[tuple[int, RobotPeriod]] = []
        self.samples: list[tuple[int, int, int]] = []  # when looked at; next samples of left and right

    # ---- reported by the monitor --------------------------------------------------------------------------------

    def take(self, event: Event) -> None:
        self.events.append(event)
        if event.what == "command":
            self._command(event)
        elif event.what == "heard":
            self.received.append(event)
        elif event.what == "answer" and event.frame is not None:
            try:
                content = event.frame.message(self.robots)
            except ContentError:
                content = None
            assert content is None or isinstance(content, TelemetryFrame)
            self.answers.append(ReceivedAnswer(event.tick, event.frame, content))

    def forget(self, data: bytes) -> None:
        """Removes the last reception of these characters: another robot sent them."""
        # the last ones: the robot under test may have sent the same characters before
        start = bytes(event.value for event in self.received).rfind(data)
        del self.received[start : start + len(data)]

    def take_period(self, tick: int, record: RobotPeriod, board: Board) -> None:
        """Adds the robot's record at the start of a control period, and the present state of its board."""
        self.periods.append((tick, record))
        self.samples.append((tick, board.left.sample_tick, board.right.sample_tick))

    def restarted(self, tick: int) -> None:
        """The processor starts again: earlier orders to the wheels do not hold on."""
        self._orders = Orders()
        for side in SIDES:
            self.orders[side].append(Order(tick, side, "off"))

    def _command(self, event: Event) -> None:
        self.commands.append(event)
        order = self._orders.take(event)
        if order is not None:
            self.orders[event.side].append(order)
        elif event.opcode == _LFIL:
            words = [int.from_bytes(event.data[at : at + 2], "big") for at in range(0, len(event.data), 2)]
            control = words.pop(0)
            for place in range(4):
                if control & 8 >> place and words:
                    self._filter[event.side][place] = words.pop(0)
        elif event.opcode == _UDF:
            self.filters[event.side].append((event.tick, tuple(self._filter[event.side])))

    # ---- requested by the rules ----------------------------------------------------------------------------

    def last_order(self, side: str, tick: int) -> Order:
        """The last order to the wheel, up to and including `tick`."""
        return next(order for order in reversed(self.orders[side]) if order.tick <= tick)

    def both_orders(self, tick: int) -> tuple[Order, Order]:
        left, right = SIDES
        return self.last_order(left, tick), self.last_order(right, tick)

    def ordered(self, after_tick: int, until_tick: int) -> Iterator[Order]:
        """The orders to either wheel in between, in the order of time."""
        orders = [order for side in SIDES for order in within(self.orders[side], after_tick, until_tick)]
        yield from sorted(orders, key=lambda order: order.tick)

    def wrote(self, after_tick: int, until_tick: int) -> list[Event]:
        """The commands in between that do more than read."""
        return [
            event for event in within(self.commands, after_tick, until_tick) if event.opcode not in READING
        ]

    def read_positions(self, side: str, after_tick: int, until_tick: int) -> list[int]:
        """The low words of the real positions that the robot read in between."""
        return [
            int.from_bytes(command.data[-2:], "big")
            for command in within(self.commands, after_tick, until_tick)
            if command.opcode == _RDRP and command.side == side
        ]

    def set_to(self, side: str, tick: int) -> Words | None:
        """The filter words in force at `tick`, None before the first."""
        words_taken = [words for taken_tick, words in self.filters[side] if taken_tick <= tick]
        return words_taken[-1] if words_taken else None

    def chips(self, after_tick: int, until_tick: int) -> Iterator[tuple[int, str, Axis]]:
        """Tick, side and state of both chips at the start of each control period in between."""
        for tick, record in self.periods:
            if after_tick < tick <= until_tick:
                yield tick, SIDES[0], record.left
                yield tick, SIDES[1], record.right
