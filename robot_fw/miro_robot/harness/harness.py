"""A machine put back to one moment over and over: fed through RXD, run until its firmware sleeps or a deadline.

    saved moment --> machine <-- RXD: levels, as an ideal radio would give them <-- characters of a program
                        |
                        +--> edges between branches, stack, event log --> oracle

Most inputs begin with a frame, and all frames begin alike: that moment is kept too.

A character begins with the end of the one before it or after a pause, and a bad stop bit is space for three quarters of
a bit, as on the air (`miro_sim.radio.sender`): the same characters at the same ticks in a world give the same levels.
"""

from __future__ import annotations

from array import array
from typing import Any

from miro_exact.clock import NEVER_TICK, TICKS_PER_SECOND
from miro_exact.state import Flat
from miro_protocol.table import downlink
from miro_robot.board import Board
from miro_robot.event_log import EventLog
from miro_robot.harness.program import RESET_TICKS, Program
from miro_robot.mcs51.cpu import Cpu
from miro_robot.plant import Plant

LEAD_TICKS = 1200
"""From the saved moment to the first start bit."""
SETTLE_TICKS = 30 * TICKS_PER_SECOND // 1000
"""Longest time after its last character for which firmware that sleeps may stay awake."""
AWAKE_TICKS = 10 * TICKS_PER_SECOND // 1000
"""Length of a run after the last character for firmware that never sleeps, unless another one is requested."""
AHEAD_TICKS = 240  # an instruction and what looks ahead may overrun a stop by so much

DONE, STOPPED, AWAKE = range(3)
"""Results of a run: done; stopped by a fault or the oracle; did not go to sleep."""

_LEAD, _SETTLE, _AWAKE_TICKS, _AHEAD = LEAD_TICKS, SETTLE_TICKS, AWAKE_TICKS, AHEAD_TICKS
_DONE, _STOPPED, _AWAKE = DONE, STOPPED, AWAKE
_LOOK = TICKS_PER_SECOND // 10_000  # how often it is looked at whether firmware sleeps
_WAIT = TICKS_PER_SECOND // 1000  # ... and whether what the oracle waits for came
_BURST = 64  # characters on RXD that are not heard yet
_BAD_STOP, _RESET = 1, 2
_OPENING = downlink(3).lead + downlink(3).sync  # of any number of robots


class LiveOracle:
    """`code`: 0, or the kind of what it found first, by the names that it has for them; `tick`: of that."""

    NOT_STATE: tuple[str, ...] = ("*",)

    def __init__(self) -> None:
        self.code = 0
        self.tick = 0

    def begin(self, tick: int) -> None:
        """The machine was put back to where it was at `tick`."""
        self.code = 0
        self.tick = 0

    def restarted(self, tick: int) -> None:
        """The processor was reset."""

    def look(self, tick: int) -> None:
        """The machine has run to `tick`."""

    def waits(self) -> bool:
        """True if something is still to come, so that the run must not end."""
        return False


class Moment:
    """A moment of a machine, with the events and the edges that were seen on the way to it.

    `tick`: of it, -1 for none.
    """

    NOT_STATE = ("*",)

    def __init__(self, machine: Any, cpu: Cpu, log: EventLog | None) -> None:
        self.cpu = cpu
        self.log = log
        self.tick = -1
        self.flat = Flat(machine)
        self.state = b""
        self.events: list[tuple[int, int, int, int, bytes]] = []
        self.passed = array("i")  # index in the map of edges, how often, index, ..
        self.edge_before = 0
        self.edge_depth = 0
        self.edge_outer = [0] * 8
        self.highest_sp = 0

    def keep(self, tick: int, begun: int, edges: bytes) -> None:
        """Stores the present state.

        The way to it has the events of the log from `begun` on, and `edges`, the counted edges in a map.
        """
        cpu = self.cpu
        self.tick = tick
        self.state = self.flat.save()
        if self.log is not None:
            self.events = [self.log.event(serial) for serial in range(begun, self.log.end)]
        self.passed = array("i", [n for index, count in enumerate(edges) if count for n in (index, count)])
        self.edge_before = cpu.edge_before
        self.edge_depth = cpu.edge_depth
        self.edge_outer[:] = cpu.edge_outer
        self.highest_sp = cpu.highest_sp

    def put(self) -> None:
        """Puts the machine back to it, and adds the edges to the map."""
        cpu = self.cpu
        self.flat.load(self.state)
        for place in range(0, len(self.passed), 2):
            count = cpu.edges[self.passed[place]] + self.passed[place + 1]
            cpu.edges[self.passed[place]] = (count & 0xFF) + (count >> 8)
        cpu.edge_before = self.edge_before
        cpu.edge_depth = self.edge_depth
        cpu.edge_outer[:] = self.edge_outer
        cpu.highest_sp = self.highest_sp

    def tell(self) -> None:
        """Puts the events into the log."""
        if self.log is not None:
            for tick, kind, code, value, data in self.events:
                self.log.note(kind, tick, code, value, data)


class Harness:
    """`machine` is what the state tables of are saved: a `Board`, or something that holds a `Cpu`.

    `bit_ticks`: of the line. The machine is where it shall begin, with nothing on RXD. `sleeps`: whether its firmware
    does when it has nothing to do. `after_ticks`: how long a run goes on after its last character at least, -1 for
    what its firmware needs. `device`: who runs a machine that is no `Cpu` alone. It has `run(tick)`, which returns
    whether it stopped, `put(which, value, tick)` and `set_reset(level)`; of a board only `put` is used.
    """

    NOT_STATE = ("*",)

    def __init__(
        self,
        machine: Any,
        cpu: Cpu,
        oracle: LiveOracle,
        bit_ticks: int,
        board: Board | None = None,
        after_ticks: int = -1,
        device: Any = None,
    ) -> None:
        self.machine = machine
        self.device = device
        self.puts = 0  # of the program, that were done
        self.after_ticks = after_ticks
        self.board = board
        self.cpu = cpu
        self.oracle = oracle
        self.bit_ticks = bit_ticks
        cpu.rxd.settled_tick = NEVER_TICK
        cpu.txd.unread = True
        if board is not None and type(board.plant) is Plant:
            board.left.pulses = 0  # the motors are unplugged
            board.right.pulses = 0
        self.begin_tick = 12 * cpu.cycles
        self.now_tick = 0
        self.end_tick = 0  # of the last character of a run
        self.sleeps = 1
        log = None if board is None else board.log
        self._start = Moment(machine, cpu, log)
        self._opening = Moment(machine, cpu, log)
        self._opening_mask = -1  # of the map in which its edges were counted
        cpu.begin_edges()
        self._start.keep(self.begin_tick, 0 if log is None else log.end, b"")
        self._start.put()
        self.sleeps = 1 if self._falls_asleep(self.begin_tick + _SETTLE) else 0
        self.back()

    def back(self) -> None:
        """To the moment at which the harness was made."""
        self._put(self._start)

    def _put(self, moment: Moment) -> None:
        moment.put()
        if self.board is not None:  # what observers could have read would fill the memory
            self.board.faults.clear()
            self.board.left.commands.clear()
            self.board.right.commands.clear()
        self.now_tick = moment.tick
        self.puts = 0
        self.oracle.begin(self.begin_tick)
        moment.tell()

    def play(self, program: Program) -> int:
        """Puts the machine back and sends what the program has read. Returns DONE, STOPPED or AWAKE."""
        first = self._begin(program)
        tick = self.begin_tick + _LEAD + first * 10 * self.bit_ticks
        waiting = first
        for place in range(first, program.count):
            flaws = program.flaws[place]
            pause = program.pauses[place]
            if pause or flaws & _RESET:
                if flaws & _RESET and self._reset(tick):
                    return _STOPPED
                if self._put_values(program, place):
                    return _STOPPED
                tick += pause
                if self._run(tick - _AHEAD):
                    return _STOPPED
                waiting = 0
            elif waiting >= _BURST:
                if self._run(tick - _AHEAD):
                    return _STOPPED
                waiting = 0
            self._character(program.characters[place], flaws & _BAD_STOP, tick)
            tick += 10 * self.bit_ticks
            waiting += 1
        self.end_tick = tick
        if program.ends_with_reset() and self._reset(tick):
            return _STOPPED
        if self._put_values(program, program.count):
            return _STOPPED
        if self._run(tick + program.trailing_ticks):
            return _STOPPED
        return self._settle(tick + program.trailing_ticks)

    def _put_values(self, program: Program, place: int) -> int:
        """Does the puts before a character of the program. 1: the run is over."""
        while self.puts < program.puts and program.put_places[self.puts] == place:
            number = self.puts
            self.puts += 1
            tick = self.begin_tick + _LEAD + program.put_ticks[number] + _AHEAD
            if self._run(tick):
                return 1
            self.device.put(program.put_choices[number], program.put_values[number], tick)
        return 0

    def _begin(self, program: Program) -> int:
        """Puts the machine back. Returns which character of the program comes first."""
        if self.board is None or not self._opens(self.board, program):
            self.back()
            return 0
        self._put(self._opening)
        return len(_OPENING)

    def _opens(self, board: Board, program: Program) -> bool:
        """True if the program begins as all frames do, on a board with neither a probe nor an inspector."""
        if board.probe is not None or self.cpu.inspector is not None or not program.opens_with(_OPENING):
            return False
        if self._opening_mask != self.cpu.edge_mask:
            self._open(board.log)
        return self._opening.tick >= 0

    def _open(self, log: EventLog) -> None:
        """Sends what all frames begin with, and keeps the moment after it; none if that is a mistake already."""
        edges = self.cpu.edges
        counted = bytearray(self.cpu.edge_mask + 1)
        self.cpu.watch_edges(memoryview(counted))
        self.back()
        begun = log.end
        tick = self.begin_tick + _LEAD
        for value in _OPENING:
            self._character(value, 0, tick)
            tick += 10 * self.bit_ticks
        stopped = self._run(tick - _AHEAD)
        self._opening.keep(-1 if stopped else tick - _AHEAD, begun, bytes(counted))
        self._opening_mask = self.cpu.edge_mask
        log.cut(begun)
        self.cpu.watch_edges(edges)

    def _character(self, value: int, bad_stop: int, tick: int) -> None:
        bit = self.bit_ticks
        rxd = self.cpu.rxd
        rxd.append(tick, 0)
        levels = value << 1 | (0 if bad_stop else 0x200)
        for place in range(1, 10):
            tick += bit
            if (levels >> place ^ levels >> place - 1) & 1:
                rxd.append(tick, levels >> place & 1)
        if bad_stop:
            rxd.append(tick + 3 * bit // 4, 1)

    def _reset(self, tick: int) -> int:
        """The reset pin, a little after `tick`."""
        tick += _AHEAD
        if self._run(tick):
            return 1
        self._set_reset(1)
        self._move(tick + RESET_TICKS)
        self._set_reset(0)
        self.oracle.restarted(tick + RESET_TICKS)
        return 0

    def _set_reset(self, level: int) -> None:
        if self.board is not None:
            self.board.set_reset(level)
        elif self.device is not None:
            self.device.set_reset(level)
        elif level:
            self.cpu.hold()
        else:
            self.cpu.reset()

    def _run(self, until: int) -> int:
        """To a tick, and lets the oracle look. 1: a fault, or the oracle has seen enough."""
        if until <= self.now_tick:
            return 0
        stopped = self._move(until)
        self.oracle.look(until)
        return 1 if stopped or self.oracle.code else 0

    def _move(self, until: int) -> int:
        if self.device is not None and self.board is None:
            return self._go_on(until)
        self.cpu.begin_run()
        stopped = self._go_on(until)
        self.cpu.end_run()
        return stopped

    def _go_on(self, until: int) -> int:
        """A piece of a run, between `begin_run` and `end_run` of the CPU."""
        self.now_tick = until
        if self.board is not None:
            return self.board.go_on(until)
        if self.device is not None:
            return 1 if self.device.run(until) else 0
        return self.cpu.go_on((until + 11) // 12)

    def _settle(self, tick: int) -> int:
        """Until the firmware sleeps and the oracle waits for nothing."""
        if self.after_ticks >= 0:
            tick += self.after_ticks
            if self._run(tick):
                return _STOPPED
        if not self.sleeps:
            until = tick if self.after_ticks >= 0 else tick + _AWAKE_TICKS
            return _STOPPED if self._run(until) else _DONE
        if not self._falls_asleep(tick + _SETTLE):
            faulted = self.board is not None and self.board.fault_count > 0
            return _STOPPED if self.oracle.code or faulted else _AWAKE
        latest = self.now_tick + 2 * _SETTLE
        while self.now_tick < latest and self.oracle.waits():
            if self._run(self.now_tick + _WAIT):
                return _STOPPED
        return _DONE

    def _falls_asleep(self, until: int) -> bool:
        """True if it does before `until`; no longer than that."""
        cpu = self.cpu
        stopped = 0
        asleep = 0
        if self.device is None or self.board is not None:
            cpu.begin_run()
        while self.now_tick < until and not stopped and not asleep:
            stopped = self._go_on(self.now_tick + _LOOK)
            cpu.peripherals.sync(cpu.cycles)  # tells of all characters up to now
            self.oracle.look(self.now_tick)
            stopped = stopped or self.oracle.code
            asleep = cpu.idle or cpu.powered_down
        if self.device is None or self.board is not None:
            cpu.end_run()
        return asleep != 0 and not stopped
