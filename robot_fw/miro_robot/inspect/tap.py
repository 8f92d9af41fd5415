"""Records the wires of a board: levels with the exact ticks of their changes.

Lines, CPU, chips and plant run ahead of each other, so changes are not noted in the order of their ticks;
below the tick that `CpuTap.known` gives, all changes have been noted.
"""

from __future__ import annotations

from collections.abc import Callable

from miro_exact.clock import NEVER_TICK
from miro_robot.board import Board
from miro_robot.inspect.watcher import Watcher
from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.line import Line
from miro_robot.parts.nets import Nets, Observer
from miro_robot.probe import Probe
from miro_robot.processor_board import ProcessorBoard
from miro_robot.wired_board import WiredBoard

_TICKS = 12  # per machine cycle

_RXD, _TXD, _SHIFT, _LATCH, _OUTSIDE, _ASLEEP = 0, 1, 2, 3, 7, 11
OUTSIDE = 7
"""Places of what the outside puts on P0 to P3, from here on."""
_IN_SERVICE, _ROUTINE, _DATA, _SIDE = 12, 14, 20, 21
_CS, _BUSY, _HI, _PWM, _SIGN, _MAGNITUDE, _A, _B, _PER_SIDE = 0, 5, 6, 7, 8, 9, 10, 11, 12
_CHIP_PINS = 5  # /CS, /RD, /WR, PS, /RST, as the board has them
_PLACES = 45
PLACES = (
    *("rxd", "txd", "shift"),
    *(f"latch{port}" for port in range(4)),
    *(f"outside{port}" for port in range(4)),
    *("asleep", "low", "high"),
    *("int0", "timer0", "int1", "timer1", "serial", "timer2"),
    "data",
    *(
        f"{side}.{pin}"
        for side in ("left", "right")
        for pin in ("cs", "rd", "wr", "ps", "rst", "busy", "hi", "pwm", "sign", "magnitude", "a", "b")
    ),
)
"""Names of the places; the nets of a board of parts follow, by number. `shift`: level that the serial port drives onto
RXD in mode 0; `outside`: levels driven onto a port's pins from outside; `low` and `high`: a routine of that priority is
in service.
"""

UNKNOWN = 2
"""Value of a routine's wire for a routine that was already running when recording began."""


def port_pins(levels: list[int], port: int) -> int:
    """The pins of a port, by the levels of all places: the AND of all that drive them."""
    pins = levels[_LATCH + port] & levels[_OUTSIDE + port]
    if port == 3:
        pins &= 0xFC | (levels[_RXD] & levels[_SHIFT]) | levels[_TXD] << 1
    return pins


class BoardTap(Probe):
    """Notes what happens on a board into `events`; `levels` are those noted last."""

    def __init__(self, board: Board, events: list[tuple[int, int, int]]) -> None:
        self.board = board
        self.events = events
        self.levels = [0] * 45
        self.busy_end = [0] * 2
        self.passed_tick = 0
        self.left_edges: list[tuple[int, int, int]] = []
        self.right_edges: list[tuple[int, int, int]] = []

    def attach(self, tick: int) -> None:
        """Records from `tick` on, where `levels` begin. Raises ValueError if another tap is attached."""
        board = self.board
        if board.probe is not None:
            raise ValueError("the wires of this board are watched already; close that waveform first")
        board.probe = self
        board.left.encoder_edges = self.left_edges
        board.right.encoder_edges = self.right_edges
        self._look_at_pins(tick)
        self._look(tick)
        self._start_edges(_SIDE, board.left.encoder.quadrature.pin)
        self._start_edges(_SIDE + _PER_SIDE, board.right.encoder.quadrature.pin)
        self.events.clear()

    def detach(self) -> None:
        self.board.probe = None
        self.board.left.encoder_edges = None
        self.board.right.encoder_edges = None

    def known(self) -> int:
        """The tick below which the board's changes are all noted, whatever the CPU does from there on."""
        board = self.board
        left, right = board.left, board.right
        tick = min(left.next_tick, right.next_tick, left.hi_falls_tick, right.hi_falls_tick)
        if board.plant.next_tick == NEVER_TICK:  # the plant has no next step, so no encoder edge comes
            return tick
        return min(tick, self.passed_tick)

    def moved(self, tick: int) -> None:
        self._look_at_pins(tick)
        self._look(tick)

    def hi_fell(self, tick: int) -> None:
        self._look(tick)

    def passed(self, tick: int) -> None:
        self.passed_tick = tick
        self._take_edges(_SIDE, self.left_edges)
        self._take_edges(_SIDE + _PER_SIDE, self.right_edges)
        self._look(tick)

    def _look_at_pins(self, tick: int) -> None:
        """Samples the wires that only the CPU changes: inputs of the chips, and the bus, where chips answer at once."""
        board = self.board
        self._see(tick, _DATA, board.bank[board.data_bank] & board.bus_levels)
        pins = board._pins()
        for pin in range(_CHIP_PINS):
            self._see(tick, _SIDE + _CS + pin, pins >> pin & 1)
            self._see(tick, _SIDE + _PER_SIDE + _CS + pin, pins >> (_CHIP_PINS + pin) & 1)

    def _look(self, tick: int) -> None:
        """Samples outputs that chips change on their own, and the CPU's pins that follow."""
        board = self.board
        for port in range(4):
            shorted = board.cpu.peripherals.ports.stuck_high[port]
            self._see(tick, _OUTSIDE + port, board.external[port] | shorted)
        self._look_at_chip(tick, 0)
        self._look_at_chip(tick, 1)

    def _look_at_chip(self, tick: int, side: int) -> None:
        board = self.board
        chip = board.right if side else board.left
        place = _SIDE + side * _PER_SIDE
        busy_end = self.busy_end[side]
        if busy_end and busy_end <= tick:
            self._see(busy_end, place + _BUSY, 0)
        self._see(tick, place + _BUSY, 1 if chip.port.is_busy(tick) else 0)
        self.busy_end[side] = chip.port.busy_until if chip.port.busy_until > tick else 0
        self._see(tick, place + _HI, chip.hi)
        self._see(tick, place + _PWM, chip.pwm)
        self._see(tick, place + _SIGN, chip.sign)
        self._see(tick, place + _MAGNITUDE, chip.pwm_magnitude)

    def _start_edges(self, place: int, state: int) -> None:
        """The levels of A and B as reported last; `state` is their place in the order 00, 10, 11, 01."""
        self.levels[place + _A] = ((state + 1) >> 1) & 1
        self.levels[place + _B] = state >> 1

    def _take_edges(self, place: int, edges: list[tuple[int, int, int]]) -> None:
        for tick, a, b in edges:
            self._see(tick, place + _A, a)
            self._see(tick, place + _B, b)
        edges.clear()

    def _see(self, tick: int, place: int, level: int) -> None:
        if level != self.levels[place]:
            self.levels[place] = level
            self.events.append((tick, place, level))


class NetTap:
    """Notes the edges of all nets of a board of parts into `events`, as edges of the ports too."""

    def __init__(self, nets: Nets, events: list[tuple[int, int, int]]) -> None:
        self.nets = nets
        self.events = events
        self.observer = Observer(range(nets.count))
        self.outside = [0xFF] * 4
        self.port_pins: list[list[int]] = [[] for _ in range(nets.count)]  # 8 * port + bit, by net
        for number, net in enumerate(nets.netlist.ports):
            if net >= 0:
                self.port_pins[net].append(number)

    def attach(self) -> list[int]:
        """Records from now on; the levels of the nets."""
        self.nets.observe(self.observer)
        for net in range(self.nets.count):
            self._put_on_ports(net, self.nets.levels[net])
        return list(self.nets.levels[: self.nets.count])

    def detach(self) -> None:
        self.nets.ignore(self.observer)

    def known(self) -> int:
        """The tick below which all edges have been noted: no part has an event before."""
        return self.nets.next_tick

    def take(self) -> None:
        """Moves what was recorded to `events`."""
        for tick, net, level in self.observer.edges:
            self.events.append((tick, _PLACES + net, level))
            for port in self._put_on_ports(net, level):
                self.events.append((tick, _OUTSIDE + port, self.outside[port]))
        self.observer.edges.clear()

    def _put_on_ports(self, net: int, level: int) -> list[int]:
        """The ports on which `outside` changes."""
        for number in self.port_pins[net]:
            mask = 1 << (number & 7)
            self.outside[number >> 3] = self.outside[number >> 3] & ~mask | (mask if level else 0)
        return [number >> 3 for number in self.port_pins[net]]


class CpuTap(Watcher):
    """Records the events on a CPU, and on its board if there is one, into `events`.

    Begins where it is attached, at `begin_tick`, with `start` as the levels there. After every run it calls `told`.
    """

    def __init__(self, board: ProcessorBoard | None, told: Callable[[], object]) -> None:
        self.told = told
        self.events: list[tuple[int, int, int]] = []
        self.board_tap = BoardTap(board, self.events) if isinstance(board, Board) else None
        self.net_tap = NetTap(board.nets, self.events) if isinstance(board, WiredBoard) else None
        self.begin_tick = -1
        self.start: list[int] = []
        self.levels = [0] * 20
        self.line_ticks = [0] * 3  # of the last edge taken from RXD, TXD, shift
        self.cycles = 0  # the CPU has got so far
        self.routine = [-1] * 2  # whose routine of low, high priority is in service

    def known(self) -> int:
        """The tick below which all changes are noted."""
        tick = _TICKS * self.cycles
        if self.board_tap is not None:
            tick = min(tick, self.board_tap.known())
        return tick if self.net_tap is None else min(tick, self.net_tap.known())

    def detach(self) -> None:
        if self.board_tap is not None:
            self.board_tap.detach()
        if self.net_tap is not None:
            self.net_tap.detach()

    def take(self) -> None:
        """Moves to `events` what the nets have recorded since the CPU ran."""
        if self.net_tap is not None:
            self.net_tap.take()

    def starting(self, cpu: Cpu) -> None:
        self._take_line(_RXD, cpu.rxd, cpu.rxd.settled_tick)
        self._look(cpu)

    def executed(self, cpu: Cpu, pc: int, start: int) -> None:
        self._take_outputs(cpu)
        self._look(cpu)

    def interrupted(self, cpu: Cpu, source: int, pc: int, start: int) -> None:
        tick = _TICKS * start
        self._see(tick, _ASLEEP, 0)
        high = 1 if cpu.peripherals.interrupts.in_service & 2 and not self.levels[_IN_SERVICE + 1] else 0
        self._see(tick, _IN_SERVICE + high, 1)
        self._see(tick, _ROUTINE + source, 1)
        self.routine[high] = source
        self._take_outputs(cpu)

    def slept(self, cpu: Cpu, start: int, end: int) -> None:
        self._take_outputs(cpu)

    def ran(self, cpu: Cpu, start: int) -> None:
        self._take_outputs(cpu)
        self.cycles = cpu.cycles
        self.take()
        self.told()

    def attached(self, cpu: Cpu) -> None:
        """Takes the levels of now."""
        self.begin_tick = _TICKS * cpu.cycles
        self.cycles = cpu.cycles
        if self.board_tap is not None:
            self.board_tap.attach(self.begin_tick)
        for place, line in ((_RXD, cpu.rxd), (_TXD, cpu.txd), (_SHIFT, cpu.peripherals.shift.data)):
            self.levels[place] = line.level_at(self.begin_tick)
            self.line_ticks[place] = self.begin_tick
        nets = [] if self.net_tap is None else self.net_tap.attach()
        for port in range(4):
            self.levels[_LATCH + port] = cpu.peripherals.ports.driven(port)
            self.levels[_OUTSIDE + port] = 0xFF if self.net_tap is None else self.net_tap.outside[port]
        in_service = cpu.peripherals.interrupts.in_service
        for source in range(6):
            self.levels[_ROUTINE + source] = UNKNOWN if in_service else 0
        self.levels[_IN_SERVICE] = in_service & 1
        self.levels[_IN_SERVICE + 1] = in_service >> 1
        self.levels[_ASLEEP] = 1 if cpu.idle or cpu.powered_down else 0
        self.start = [self.levels[place] for place in range(_DATA)]
        if self.board_tap is None:
            self.start += [0] * (_PLACES - _DATA)
        else:
            own = [self.board_tap.levels[place] for place in range(_PLACES)]
            self.start[_OUTSIDE:_ASLEEP] = own[_OUTSIDE:_ASLEEP]
            self.start += own[_DATA:]
        self.start += nets

    def _look(self, cpu: Cpu) -> None:
        """Samples everything that an instruction may have changed, effective from the next cycle."""
        tick = _TICKS * cpu.cycles
        for port in range(4):
            self._see(tick, _LATCH + port, cpu.peripherals.ports.driven(port))
        self._see(tick, _ASLEEP, 1 if cpu.idle or cpu.powered_down else 0)
        in_service = cpu.peripherals.interrupts.in_service
        if in_service & 1 != self.levels[_IN_SERVICE] or in_service >> 1 != self.levels[_IN_SERVICE + 1]:
            self._leave(tick, 0, in_service & 1)
            self._leave(tick, 1, in_service >> 1)
            if not in_service:
                for source in range(6):  # none is, seen to begin or not
                    self._see(tick, _ROUTINE + source, 0)

    def _leave(self, tick: int, high: int, level: int) -> None:
        self._see(tick, _IN_SERVICE + high, level)
        if not level and self.routine[high] >= 0:
            self._see(tick, _ROUTINE + self.routine[high], 0)
            self.routine[high] = -1

    def _take_outputs(self, cpu: Cpu) -> None:
        """Takes the known edges: a line without a listener stores some thousand of them.

        The end of a run settles it.
        """
        self._take_line(_TXD, cpu.txd, _TICKS * cpu.cycles)
        self._take_line(_SHIFT, cpu.peripherals.shift.data, _TICKS * cpu.cycles)

    def _take_line(self, place: int, line: Line, until_tick: int) -> None:
        """The edges below `until_tick` that are new."""
        tick = line.next_edge(self.line_ticks[place])
        while tick < until_tick and tick < NEVER_TICK:
            self._see(tick, place, line.level_at(tick))
            self.line_ticks[place] = tick
            tick = line.next_edge(tick)

    def _see(self, tick: int, place: int, level: int) -> None:
        if level != self.levels[place]:
            self.levels[place] = level
            self.events.append((tick, place, level))
