"""A wire between a PC, or a terminal, and a board alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from miro_exact.clock import CHARACTER_BITS, CYCLE_TICKS
from miro_exact.state import TICK
from miro_protocol.actions import Action, Fault, PutValue, ScriptItem
from miro_protocol.transmission import UP, Transmission, check_bad_stop, of_symbols
from miro_robot.build import board_of
from miro_robot.empty_board import EmptyBoard
from miro_robot.image import Image
from miro_robot.mcs51.cpu import STOPPED
from miro_robot.mcs51.known_registers import lacking_lines, times
from miro_robot.mcs51.line import Line
from miro_robot.parts.netlist import Netlist
from miro_robot.parts.values import checked_put, checked_read
from miro_robot.parts.wire_part import WirePart
from miro_robot.wired_board import WiredBoard
from miro_sim.periods import PartValues
from miro_sim.radio.params import RXD_STATES
from miro_sim.scenario.board import FASTEST_BIT_TICKS, BoardScenario, check_board
from miro_sim.world.actions import SETTLE_TICKS
from miro_sim.world.changes import Changes, PinPlace, find_pin
from miro_sim.world.device import Device
from miro_sim.world.events import HostLog
from miro_sim.world.medium import Medium, sent_to
from miro_sim.world.outbox import Outbox
from miro_sim.world.terminal import Terminal, moves

_STOP = CHARACTER_BITS - 1
_INVERTED, _AT_1 = RXD_STATES.index("inverted"), RXD_STATES.index("1")


class BoardAlone(Device):
    """A board on a wire. `parts`: keys of its parts, by name. `reads`: path -> part and key of each value. `changes`:
    for its watchers. `line`: of the first of several boards, all of them by their names. `put_stopped`: a put has
    stopped the run; `run` returns it next.
    """

    NOT_STATE = ("sample_ticks", "put_stopped", "parts", "reads", "changes", "line")

    def __init__(self, board: EmptyBoard, network: int, image: Image, slot: int = 0) -> None:
        Device.__init__(self, board, network, slot, image)
        self.line: dict[str, BoardAlone] = {}
        self.board: EmptyBoard
        self.put_stopped = 0
        self.sample_ticks = board.spec.crystal_hz // 1000
        self.parts = {part.name: part.keys for part in board.parts} if isinstance(board, WiredBoard) else {}
        self.reads = {f"{name}.{key}": (name, key) for name, keys in self.parts.items() for key in keys.READS}
        self.changes = Changes(self, board) if isinstance(board, WiredBoard) else None

    def run(self, tick: int) -> int:
        changes = self.changes
        stopped, self.put_stopped = self.put_stopped, 0
        if not stopped and (changes is None or not changes.now):
            return Device.run(self, tick)
        while not stopped and changes.look_tick <= tick:
            stopped = Device.run(self, changes.look_tick)
            if not stopped:
                changes.look_at_grid()
        return stopped or Device.run(self, tick)

    def notes(self) -> list[str]:
        board = self.board
        lines = list(lacking_lines(board.spec.chip, board.lacking_registers()))
        registers = board.registers
        if registers is not None and registers.bites:
            first_s = registers.first_bite / board.spec.crystal_hz
            first = f"first at {first_s:.4f} s"
            lines.append(f"the watchdog reset the processor {times(registers.bites)}, {first}")
        return lines

    def at(self, path: str) -> tuple[BoardAlone, str]:
        """The board of a path, and what the path is there: of several, a board's name is in front (`panel.lamp.on`)."""
        name, _, rest = path.partition(".")
        return (self.line[name], rest) if name in self.line else (self, path)

    def source(self, name: str) -> tuple[Any, str]:
        board, rest = self.at(name)
        return board.changes, rest

    def check_put(self, path: str, value: PutValue) -> None:
        if self.line:
            check_board(path, self.line)
        device, path = self.at(path)
        name, _, _ = checked_put(device.parts, path, value)
        if name in device.parts:
            return
        if not isinstance(device.board, WiredBoard):
            raise ValueError(f"{path}: no board file says what is wired to it; `mirotwin fw run` has --pins")
        if path not in device.board.nets.netlist.free_pins():
            raise ValueError(f"{path}: something is wired to it; put a value of that, or choose another pin")

    def check_fault(self, fault: str) -> None:
        Device.check_fault(self, fault)
        if fault.startswith("pin ") and not isinstance(self.board, WiredBoard):
            raise ValueError(f"{fault}: no board file says what is wired to the pins")

    def put(self, path: str, value: PutValue, tick: int) -> None:
        device, path = self.at(path)
        part, key, taken = checked_put(device.parts, path, value)
        device.put_stopped = device._wired.put(part, key, taken, tick) or device.put_stopped
        if device.changes is not None:
            device.changes.look(tick)

    def value(self, path: str) -> float | int | bool | str:
        device, path = self.at(path)
        part, key = device.reads.get(path) or checked_read(device.parts, path)
        return device._wired.value(part, key)

    def values(self) -> dict[str, float | int | bool | str]:
        return {path: self._wired.value(*part_and_key) for path, part_and_key in self.reads.items()}

    @property
    def _wired(self) -> WiredBoard:
        assert isinstance(self.board, WiredBoard), "a board without parts has no values"
        return self.board

    # Pins

    def find_pin(self, name: str) -> PinPlace:
        """The place of a pin's name. Raises ValueError."""
        device, name = self.at(name)
        netlist = device.board.nets.netlist if isinstance(device.board, WiredBoard) else Netlist()
        return find_pin(device.board.spec, netlist, name)

    def check_pin(self, name: str) -> None:
        if self.line:
            check_board(name, self.line, "pin: ")
        self.find_pin(name)

    def port_pin(self, name: str) -> tuple[int, int]:
        return divmod(self.find_pin(name).port_pin, 8)

    # Going back

    def records(self) -> list[Any]:
        return [*Device.records(self), self.changes and self.changes.records()]

    def put_back(self, records: list[Any]) -> None:
        Device.put_back(self, records)
        if self.changes is not None:
            self.changes.put_back(records[-1])

    def sample_tick(self) -> int:
        """Every millisecond."""
        return (self.board.cpu.cycles * CYCLE_TICKS // self.sample_ticks + 1) * self.sample_ticks

    def __repr__(self) -> str:
        return f"BoardAlone({self.board!r})"


class Wire(Medium):
    """Line `index` with one board on it. `script`: what the host sends; without it and a terminal, who injects.

    The PC hears a character when its stop bit begins. `output` gets each of them then, again where the world goes back.

    `rxd_state`: a fault of the wire to RXD, of `RXD_STATES`, since `rxd_tick`; `whole`: what is on it meanwhile.
    """

    STATE = {
        "terminal": Terminal,
        "bit_ticks": ("q", 0, 1 << 40),
        "busy_tick": TICK,
        "transmissions": TICK,
        "rxd_state": ("i", 0, len(RXD_STATES) - 1),
        "rxd_tick": TICK,
        "whole": Line,
    }
    NOT_HASHED = ("bit_ticks", "rxd_state", "rxd_tick", "whole")  # what comes through the wire is hashed
    NOT_STATE: tuple[str, ...] = ("character_ticks", "output", "between")

    def __init__(
        self,
        scenario: BoardScenario,
        seed: int,
        index: int,
        image: Image,
        script: Sequence[ScriptItem] | None,
    ) -> None:
        stops = (scenario.stop_on_fault, scenario.stop_at, scenario.stop_at_end)
        board = board_of(scenario.board, image, seed, *stops)
        board.sent = self._sent
        sending = sent_to(index, script)
        self.terminal = None if scenario.terminal is None else Terminal(scenario.terminal, board)
        host = "script" if sending is not None else "silent" if self.terminal is None else "terminal"
        self.bit_ticks = scenario.host_bit_ticks  # 0: not known yet
        self.busy_tick = 0
        self.transmissions = 0
        self.rxd_state = self.rxd_tick = 0
        self.whole = Line()
        self.character_ticks = 0  # of the last one that the board sent
        self.output: Callable[[bytes], object] | None = None
        parts = board.parts if isinstance(board, WiredBoard) else []
        self.between = next((part for part in parts if isinstance(part, WirePart)), None)
        outbox = Outbox(0, index, CHARACTER_BITS * self.bit_ticks)
        log = HostLog(index, lambda tick: tick, 0)
        alone = BoardAlone(board, index, image)
        devices = [alone, *self._others(scenario, seed, index, alone)]
        if scenario.terminal is not None:
            alone.pin_moves = moves(scenario.terminal.pins)
        for path, value in sorted(scenario.put.items()):
            alone.put(path, value, 0)
        Medium.__init__(self, index, host, devices, outbox, log)
        if sending and not self.bit_ticks:
            raise ValueError(f"net{index}: how long a bit of the script is must be given (bit_ticks)")
        if self.terminal is not None and script:
            raise ValueError(f"net{index}: a terminal sends; no script can")
        if sending or (self.terminal is not None and self.terminal.may_send):
            self._check_rxd_is_free()
        for sent in sending or ():
            check_bad_stop(sent.bad_stop, len(sent.data))
            self.outbox.inject(sent, 0)

    def _others(self, scenario: BoardScenario, seed: int, index: int, first: BoardAlone) -> list[BoardAlone]:
        """The other boards on the line."""
        return []

    @property
    def board(self) -> EmptyBoard:
        board: EmptyBoard = self.devices[0].board
        return board

    def begin_period(self, tick: int) -> None:
        Medium.begin_period(self, tick)
        for device in self.devices:
            device.board.begin_period()
            if device.changes is not None:
                device.changes.trim()

    def inject(self, data: bytes, at_tick: int | None, now: int, bad_stop: tuple[int, ...]) -> int:
        """See `World.inject`."""
        if self.terminal is not None:
            raise ValueError(f"net{self.index}: a terminal sends; nothing else can")
        self._check_rxd_is_free()
        if not self.bit_ticks:
            self.bit_ticks = self.board.cpu.peripherals.bit_ticks()
            self.outbox.character_ticks = CHARACTER_BITS * self.bit_ticks
        if not self.bit_ticks:
            raise ValueError(f"net{self.index}: the receiver is off, and no bit_ticks are given")
        return Medium.inject(self, data, at_tick, now, bad_stop)

    def _check_rxd_is_free(self) -> None:
        """Raises ValueError if something on the board drives RXD."""
        if isinstance(self.board, WiredBoard) and self.board.drives_rxd:
            drives = "something on the board drives P3.0 (RXD), so nothing can be sent to its serial port"
            raise ValueError(f"net{self.index}: {drives}; wire it to another pin")

    def send(self, sent: Transmission) -> None:
        """Start bit, eight data bits, stop bit; a bad one is space for three quarters of a bit."""
        bit, tick = self.bit_ticks, sent.tick
        self.transmissions += 1
        self.busy_tick = tick + len(sent.data) * CHARACTER_BITS * bit
        if not self._takes(tick, self.busy_tick - bit, len(sent.data)):
            return
        for place, value in enumerate(sent.data):
            for number, level in enumerate((0, *(value >> data_bit & 1 for data_bit in range(8)))):
                self._give(tick + number * bit, level)
            stop_tick = tick + _STOP * bit
            if place in sent.bad_stop:
                self._give(stop_tick, 0)
                stop_tick += 3 * bit // 4
            self._give(stop_tick, 1)
            tick += CHARACTER_BITS * bit

    def _takes(self, first_tick: int, end_tick: int, characters: int) -> bool:
        """True if a transmission reaches the processor."""
        return self.between is None or self.between.takes(first_tick, end_tick, characters)

    def _give(self, tick: int, level: int) -> None:
        """The host's level from `tick` on."""
        if self.rxd_state:
            self.whole.append(tick, level)
            level = level ^ 1 if self.rxd_state == _INVERTED else int(self.rxd_state == _AT_1)
        self.board.cpu.rxd.append(tick, level)

    def check_action(self, action: Action) -> None:
        Medium.check_action(self, action)
        if isinstance(action, Fault) and action.what.startswith("rxd "):
            self._check_rxd_is_free()
            if self.terminal is not None or len(self.devices) > 1:
                raise ValueError(
                    f"net{self.index}: {action.what}: only the wire from a PC to one board can break"
                )

    def set_rxd(self, slot: int, state: int) -> None:
        rxd = self.board.cpu.rxd
        tick = rxd.settled_tick
        real = self.whole if self.rxd_state else rxd
        levels = [(tick, real.level_at(tick)), *(edge for edge in real.edges() if edge[0] > tick)]
        rxd.ticks = [edge for edge in rxd.ticks if edge < tick]
        self.whole.ticks = []
        self.rxd_state, self.rxd_tick = state, tick
        for tick, level in levels:
            self._give(tick, level)

    def reseed(self, seed: int, tick: int, up: bool) -> None:
        for device in self.devices if up else ():
            for part in device.board.parts if isinstance(device.board, WiredBoard) else ():
                part.place.noise.reseed(seed)

    def free_tick(self) -> int:
        return self.busy_tick

    def settle(self, rendezvous_tick: int) -> None:
        if self.terminal is None:
            self.board.cpu.rxd.settled_tick = rendezvous_tick + SETTLE_TICKS
            self.whole.forget(rendezvous_tick + SETTLE_TICKS)  # who mends it looks no further back

    def run(self, tick: int) -> bool:
        """The board to `tick`, in pieces from one look of the terminal to the next."""
        device, board, terminal = self.devices[0], self.board, self.terminal
        if terminal is None:
            return bool(device.run(tick) == STOPPED)
        cpu = board.cpu
        until_cycle = -(-tick // CYCLE_TICKS)
        while cpu.cycles < until_cycle:
            until_tick = tick
            if not board.dead:  # nothing that comes in can make it go on
                if cpu.cycles >= terminal.next_feed:
                    terminal.feed()
                until_tick = min(tick, CYCLE_TICKS * terminal.next_feed)
            if device.run(until_tick) == STOPPED:
                return True
        return False

    def _sent(self, value: int, tick: int, bits: int, bit_ticks: int) -> None:
        """The board has sent a character of `bits` bits, whose stop bit begins at `tick`."""
        first_tick = max(0, tick - bits * bit_ticks)
        if self.between is not None and not self.between.gives(first_tick, tick, bit_ticks):
            return
        self._hear_character(value, tick, first_tick, (bits + 1) * bit_ticks)

    def _hear_character(self, value: int, tick: int, first_tick: int, ticks: int) -> None:
        if self.terminal is not None:
            self.terminal.input.heard(value, tick)
        self.character_ticks = ticks
        self.heard.append((value, True, first_tick))
        self.log.note_heard([(value, True, tick)])
        if self.output is not None:
            self.output(bytes([value]))

    def hear(self, tick: int) -> None:
        """Does nothing: characters were received while the board ran."""

    def end_period(self) -> list[Transmission]:
        transmissions = [*self.sent, *of_symbols(self.heard, UP, self.index, self.character_ticks)]
        self.heard = []
        return transmissions

    def part_values(self, tick: int) -> list[PartValues]:
        device = self.devices[0]
        return [PartValues(self.index, device.slot, tick, device.values())] if device.parts else []

    def link_counts(self) -> tuple[int, int]:
        return self.transmissions, 0

    def check_times(self, earliest_tick: int, tick: int) -> None:
        Medium.check_times(self, earliest_tick, tick)
        if isinstance(self.board, WiredBoard) and self.board.drives_rxd:
            return
        rxd = self.board.cpu.rxd
        settled_tick = rxd.settled_tick
        if self.terminal is None and settled_tick != tick + SETTLE_TICKS and tick:
            raise ValueError(f"RXD is settled up to tick {settled_tick}, at tick {tick}")
        if self.terminal is None and rxd.last_tick() > max(self.busy_tick, self.rxd_tick):
            raise ValueError(f"RXD changes at tick {rxd.last_tick()}, after all that was sent")

    def after_load(self) -> None:
        """Raises ValueError for bits that no receiver can follow."""
        if self.bit_ticks and self.bit_ticks < FASTEST_BIT_TICKS:
            raise ValueError(f"a bit has {self.bit_ticks} ticks")
        self.outbox.character_ticks = CHARACTER_BITS * self.bit_ticks
