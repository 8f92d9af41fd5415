"""A line with several boards on it: an RS485 bus, or two boards whose serial ports are wired to each other.

    TXD of each, while its driver is on ──> `_collect` ──> queue ── 100 us later ──> RXD of all others
    PC ──────────────────────────────────> `send` ───────────┘

The boards run one after the other, in slices that are shorter than the delay: all that a slice may hear is known as it
begins. Where slices end changes no bit. A line that nobody drives is 1; of several drivers a 0 wins.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from miro_exact.bad_input import BadInput
from miro_exact.state import FLAG, TICK, Rows
from miro_protocol.actions import ScriptItem
from miro_robot.build import board_of
from miro_robot.image import Image, parse_hex
from miro_robot.mcs51.chips import CHIPS
from miro_robot.mcs51.cpu import STOPPED
from miro_robot.parts.rs485 import Rs485Part
from miro_robot.parts.wire_part import WirePart
from miro_sim.periods import PartValues
from miro_sim.scenario.board import MOST_BOARDS, BoardScenario
from miro_sim.world.actions import SETTLE_TICKS
from miro_sim.world.medium import Medium
from miro_sim.world.wire import BoardAlone, Wire

_DELAYS_PER_S = 10_000
_MOST_WAITING = 1 << 20
_SOURCES = (1 << (MOST_BOARDS + 1)) - 1  # the boards by their slots, then the PC, a bit each


class Bus(Wire):
    """`queue`: levels on their way to RXD, tick, source and level; `levels`: those that have come.

    `given`: levels that the sources put on the line now; `driving`: whose driver is on; `clashed`: several are, and
    have driven against each other. `said`: characters sent whose stop bit has not begun by `bus_tick`, up to which
    everything was exchanged: tick, slot, value, bits, ticks of a bit.
    """

    STATE: dict[str, Any] = {
        "bus_tick": TICK,
        "queue": Rows(_MOST_WAITING, TICK, ("B", 0, MOST_BOARDS), FLAG),
        "levels": ("i", 0, _SOURCES),
        "given": ("i", 0, _SOURCES),
        "driving": ("i", 0, _SOURCES),
        "clashed": FLAG,
        "said": Rows(_MOST_WAITING, TICK, ("B", 0, MOST_BOARDS), "B", ("B", 0, 16), TICK),
    }
    NOT_STATE = ("names", "delay_ticks", "slice_ticks", "transceivers", "rxds", "txds")

    def __init__(
        self,
        scenario: BoardScenario,
        seed: int,
        index: int,
        image: Image,
        script: Sequence[ScriptItem] | None,
    ) -> None:
        self.names = [scenario.board_name, *scenario.others]
        self.delay_ticks = max(scenario.clock // _DELAYS_PER_S, 2 * SETTLE_TICKS)
        self.slice_ticks = self.delay_ticks - SETTLE_TICKS
        self.bus_tick = 0
        self.clashed = 0
        self.queue: list[tuple[int, int, int]] = []
        self.said: list[tuple[int, int, int, int, int]] = []
        Wire.__init__(self, scenario, seed, index, image, script)
        self.rxds = [device.board.cpu.rxd for device in self.devices]
        self.txds = [device.board.cpu.txd for device in self.devices]
        self.transceivers: list[Rs485Part | None] = []
        for slot, device in enumerate(self.devices):
            device.board.sent = partial(self._say, slot)
            wire_part = next((part for part in device.board.parts if isinstance(part, WirePart)), None)
            transceiver = wire_part if isinstance(wire_part, Rs485Part) else None
            self.transceivers.append(transceiver)
            if transceiver is not None:
                transceiver.join(self.names, slot, self.delay_ticks)
            if device.board.drives_rxd or (wire_part is not None and transceiver is None):
                problem = "a part drives P3.0 (RXD), or stands between it and the line"
                raise BadInput("", f"board.{self.names[slot]}", problem, "wire P3.0 to the line alone")
        if None in self.transceivers and (len(self.devices) > 2 or self.transceivers != [None, None]):
            missing = self.names[self.transceivers.index(None)]
            problem = (
                "has no RS485 transceiver; only two boards, both without one, can be wired to each other"
            )
            raise BadInput("", f"board.{missing}", problem, 'give each board a part = "rs485"')
        self.levels = self.given = (2 << len(self.devices)) - 1
        self.driving = 0 if self.transceivers[0] is not None else (1 << len(self.devices)) - 1
        self._exchange(0)

    def _others(self, scenario: BoardScenario, seed: int, index: int, first: BoardAlone) -> list[BoardAlone]:
        devices = []
        for slot, (name, other) in enumerate(scenario.others.items(), 1):
            chip = CHIPS[other.board.chip]
            image = parse_hex(other.image.encode(), Path(f"{name}.hex"), chip.flash_bytes, {})
            board = board_of(other.board, image, seed, scenario.stop_on_fault)
            devices.append(BoardAlone(board, index, image, slot))
        first.line = dict(zip(self.names, [first, *devices], strict=True))
        return devices

    # Time

    def run(self, tick: int) -> bool:
        stopped = False
        while self.bus_tick < tick and not stopped:
            end = min(tick, self.bus_tick + self.slice_ticks)
            for device in self.devices:
                stopped = device.run(end) == STOPPED or stopped
            self._exchange(end)
        return stopped

    def settle(self, rendezvous_tick: int) -> None:
        """Does nothing: RXD is known for the length of the delay."""

    def _exchange(self, end: int) -> None:
        """Queues what the boards put on the line before `end`; passes to RXD what arrives within the delay."""
        self._collect(end)
        until = end + self.delay_ticks
        if self.queue:
            self._come(until)
        for rxd in self.rxds:
            rxd.settled_tick = until
        self.bus_tick = end
        if self.said:
            self.said.sort()
        while self.said and self.said[0][0] < end:
            tick, _, value, bits, bit_ticks = self.said.pop(0)
            self._hear_character(value, tick, max(0, tick - bits * bit_ticks), (bits + 1) * bit_ticks)

    def _come(self, until: int) -> None:
        """Passes the queue's levels before `until` to RXD of each board: the AND of all others'."""
        self.queue.sort()
        count = 0
        everything = (2 << len(self.devices)) - 1
        for tick, source, level in self.queue:
            if tick >= until:
                break
            count += 1
            self.levels = self.levels & ~(1 << source) | level << source
            for slot, (rxd, transceiver) in enumerate(zip(self.rxds, self.transceivers, strict=True)):
                heard = self.levels | 1 << slot == everything
                rxd.append(tick, int(heard or (transceiver is not None and transceiver.broken != 0)))
        del self.queue[:count]

    def _collect(self, end: int) -> None:
        """Edges of TXD and of driver enables since the last time, in the order of time and slots."""
        changes: list[tuple[int, int]] = []
        switches: dict[tuple[int, int], int] = {}
        for slot, txd in enumerate(self.txds):
            if txd.last_tick() >= self.bus_tick:
                tick = txd.next_edge(self.bus_tick - 1)
                while tick < end:
                    changes.append((tick, slot))
                    tick = txd.next_edge(tick)
            transceiver = self.transceivers[slot]
            if transceiver is not None and transceiver.switched:
                switches.update({(tick, slot): driving for tick, driving in transceiver.take(end)})
        if not changes and not switches:
            return
        moves = sorted(dict.fromkeys([*changes, *switches]))
        for place, (tick, slot) in enumerate(moves):
            bit = 1 << slot
            if (tick, slot) in switches:
                self.driving = self.driving & ~bit | switches[tick, slot] << slot
            level = self.txds[slot].level_at(tick) if self.driving & bit else 1
            if level != self.given >> slot & 1:
                self.given ^= bit
                self.queue.append((tick + self.delay_ticks, slot, level))
            if place + 1 == len(moves) or moves[place + 1][0] != tick:
                self._judge(tick, slot)

    def _judge(self, tick: int, slot: int) -> None:
        """Drivers against each other are a fault of the board in `slot`, the last to move, known after the delay."""
        driving, given = self.driving, self.given & self.driving
        transceiver = self.transceivers[slot]
        if not driving & (driving - 1):
            self.clashed = 0
        elif not self.clashed and given not in (0, driving) and transceiver is not None:
            self.clashed = 1
            others = driving & ~(1 << slot)
            transceiver.meet(tick + self.delay_ticks, others.bit_length() - 1)
            board = self.devices[slot].board
            board.nets.collect(board.part_index[transceiver.name], self.bus_tick)

    # The PC

    def _check_rxd_is_free(self) -> None:
        if self.transceivers[0] is None:
            problem = "two boards are wired to each other, so a PC can listen and not send"
            raise ValueError(f"net{self.index}: {problem}; give each a part rs485")

    def _takes(self, first_tick: int, end_tick: int, characters: int) -> bool:
        for transceiver in self.transceivers:
            if transceiver is not None:
                transceiver.takes(first_tick, end_tick, characters)
        return True

    def _give(self, tick: int, level: int) -> None:
        self.queue.append((tick + self.delay_ticks, len(self.devices), level))

    def _say(self, slot: int, value: int, tick: int, bits: int, bit_ticks: int) -> None:
        """The board in `slot` has sent a character: noted when all that came before it is known."""
        transceiver = self.transceivers[slot]
        first_tick = max(0, tick - bits * bit_ticks)
        if transceiver is None or transceiver.gives(first_tick, tick, bit_ticks):
            self.said.append((tick, slot, value, bits, bit_ticks))

    def part_values(self, tick: int) -> list[PartValues]:
        values: dict[str, float | int | bool | str] = {}
        for name, device in zip(self.names, self.devices, strict=True):
            values.update({f"{name}.{path}": value for path, value in device.values().items()})
        return [PartValues(self.index, 0, tick, values)] if values else []

    def check_times(self, earliest_tick: int, tick: int) -> None:
        """Raises ValueError unless the line stands at `tick`, and RXD is known for the length of the delay."""
        Medium.check_times(self, earliest_tick, tick)
        if self.bus_tick != tick and not earliest_tick <= self.bus_tick <= tick:
            raise ValueError(f"the line is at tick {self.bus_tick}, at tick {tick}")
        self.check_rxd(self.bus_tick + self.delay_ticks)
