"""A processor with parts around it, wired as a board file says.

    CPU ── port latches ──> nets ──> parts          `port_written`, then waves (parts/nets.py)
    CPU <── `set_external` <── nets <── parts       at their events, and at what the CPU writes

The CPU runs alone up to the first event of a part that may come to one of its pins; the other parts may be behind it
meanwhile. An instruction waits for an event if it begins in a cycle whose S5P2, tick 9, is not before it (P2). A run to
a tick does what happens before it; what a test puts then comes first on its tick, between two instructions.
"""

from __future__ import annotations

from collections.abc import Sequence
from operator import itemgetter
from typing import Any

from miro_exact.clock import CYCLE_TICKS
from miro_exact.plugins import PluginError
from miro_exact.raised import raised
from miro_robot.board_spec import BoardSpec
from miro_robot.empty_board import FAULTS_KEPT, EmptyBoard
from miro_robot.event_log import FAULT
from miro_robot.faults import FaultKind, FirmwareFault
from miro_robot.image import Image
from miro_robot.mcs51.cpu import REPLAN
from miro_robot.parts.netlist import Netlist
from miro_robot.parts.nets import Nets
from miro_robot.parts.part import Part

_CONTENTION = int(FaultKind.NET_CONTENTION)
_BEHIND_TICKS = 96  # more than an instruction: so far parts may be behind the CPU
_FAULTS_KEPT = FAULTS_KEPT
_order_and_kind = itemgetter(0, 1)


class WiredBoard(EmptyBoard):
    """`parts` in the order of their names, on the nets of `netlist`. A run raises PluginError for a part that fails."""

    STATE = {"parts": [Part]}
    NOT_STATE = ("nets", "horizon", "part_index")

    def __init__(
        self,
        spec: BoardSpec,
        image: Image,
        netlist: Netlist,
        parts: Sequence[Part],
        stop_on_fault: bool = True,
        stop_at: tuple[int, ...] = (),
        stop_at_end: bool = False,
    ) -> None:
        self.parts = list(parts)
        self.part_index = {part.name: index for index, part in enumerate(self.parts)}
        self.nets = Nets(netlist, self.parts)
        self.horizon = -1  # of the piece of a run that the CPU is in; -1 between two runs
        EmptyBoard.__init__(self, spec, image, stop_on_fault, stop_at, stop_at_end)
        self._supply(1, 0)

    # Time

    def _run(self, addresses: tuple[int, ...], until_tick: int) -> int:
        reason = EmptyBoard._run(self, addresses, until_tick)
        reached = self.cpu.cycles * CYCLE_TICKS if reason else until_tick
        self.sync(min(reached, until_tick) - 1)
        return reason

    def _run_on(self, marks: tuple[int, ...], until_cycle: int) -> int:
        cpu = self.cpu
        if marks:
            cpu.mark(marks)
        cpu.begin_run()
        try:
            return self._run_pieces(until_cycle)
        finally:
            self.horizon = -1
            cpu.end_run()
            if marks:
                cpu.unmark(marks)

    def _run_pieces(self, until_cycle: int) -> int:
        """In pieces that end at the next event of a part that may reach a port pin."""
        cpu = self.cpu
        while cpu.cycles < until_cycle:
            due = self.nets.reach_tick()
            stop_cycle = min(until_cycle, (due + 2) // CYCLE_TICKS)
            self.horizon = due
            reason = cpu.go_on(stop_cycle)
            if reason != 0 and (reason != REPLAN or self.again):
                return reason
            if reason == 0 and stop_cycle < until_cycle:
                self.sync(due)
        return 0

    def sync(self, tick: int) -> None:
        """Does all that parts have to do by themselves up to and including `tick`."""
        now = self.nets.next_tick()
        while now <= tick:
            self.nets.due(now)
            self._push(now)
            now = self.nets.next_tick()

    def _push(self, tick: int) -> None:
        """What has changed on the nets, to the port pins; and whether the CPU has to look up earlier for the parts."""
        nets = self.nets
        for port in range(4):
            if nets.take_external(port):
                self.cpu.set_external(port, nets.external[port], tick)
        if nets.new_contention >= 0:
            net, nets.new_contention = nets.new_contention, -1
            self._note(_CONTENTION, f"net {nets.names[net]}: {' and '.join(nets.drivers(net))}", tick)
        if nets.faults:
            self._note_faults(tick)
        if self.horizon >= 0:
            due = nets.reach_tick()
            if due < self.horizon:
                self.horizon = due
                self.cpu.replan()

    # From the processor

    def port_written(self, port: int, latch: int, tick: int) -> None:
        nets = self.nets
        if (nets.latches[port] ^ latch) & nets.wired[port]:
            self.sync(tick)
            nets.write_port(port, latch, tick)
            self._push(tick)
        else:
            nets.latches[port] = latch

    def _note_faults(self, tick: int) -> None:
        """What parts have found on this tick: of several parts the first one's, where order and kind are the same."""
        found = sorted(self.nets.faults, key=_order_and_kind)
        self.nets.faults = []
        before = None
        for fault in found:
            if _order_and_kind(fault) != before:
                self._note(fault[1], fault[2], tick)
            before = _order_and_kind(fault)

    def _note(self, kind: int, detail: str, tick: int) -> None:
        """A fault, but while RST or the supply move pins."""
        if self.forced:
            return
        self.fault_count += 1
        pc = self.cpu.at
        self.log.note(FAULT, tick, kind, pc)
        if len(self.faults) < _FAULTS_KEPT:
            symbol = self.image.symbols.name_at(pc)
            self.faults.append(FirmwareFault(FaultKind(kind), tick, pc, symbol, detail))
        if self.stop_on_fault:
            self.cpu.request_stop()

    # Tests

    def put(self, name: str, key: str, value: Any, tick: int) -> None:
        """A test puts a value of a part, between two instructions, before all else at `tick`. Raises PluginError."""
        tick = max(tick, self.cpu.cycles * CYCLE_TICKS)
        self.sync(tick - 1)
        index = self.part_index[name]
        part: Part = self.parts[index]
        try:
            part.put(key, value, tick)
        except (Exception, SystemExit) as error:
            place = f"part {name!r} ({part.keys.name}), tick {tick}: put {key}"
            raise PluginError(f"{place}: {raised(error)}", "repair the part") from error
        self.nets.call(index, tick)
        self._push(tick)

    def value(self, name: str, key: str) -> float | int | bool | str:
        """A value of a part as it is now. Raises PluginError for NaN, and for a part that fails."""
        part: Part = self.parts[self.part_index[name]]
        place = f"part {name!r} ({part.keys.name}), value {key}"
        try:
            value = part.read(key, min(self.cpu.cycles * CYCLE_TICKS, part.next_tick))
        except (Exception, SystemExit) as error:
            raise PluginError(f"{place}: {raised(error)}", "repair the part") from error
        if value != value:
            raise PluginError(f"{place}: is NaN", "repair the part")
        return value

    # Supply

    def set_power(self, on: int) -> None:
        if on != self.powered:
            EmptyBoard.set_power(self, on)
            self.forced = 1
            self._supply(on, self.cpu.cycles * CYCLE_TICKS)
            self.forced = 0

    def _supply(self, on: int, tick: int) -> None:
        """All parts begin, or stand; then the levels that they and the ports make."""
        self.sync(tick - 1)
        for index, part in enumerate(self.parts):
            part.supply(on, tick)
            self.nets.collect(index, tick)
        self.nets.settle(tick)
        self._push(tick)

    # State

    def after_load(self) -> None:
        """Works out the nets again. Raises ValueError for a part that is far behind."""
        EmptyBoard.after_load(self)
        earliest_tick = self.cpu.cycles * CYCLE_TICKS - _BEHIND_TICKS
        for part in self.parts:
            if part.next_tick < earliest_tick:
                raise ValueError(f"part {part.name} has its next event at tick {part.next_tick}")
        for port in range(4):
            self.nets.latches[port] = self.cpu.peripherals.ports.latches[port]
        self.nets.restart()

    def __repr__(self) -> str:
        return f"WiredBoard({self.spec.name}, cycle={self.cpu.cycles}, pc={self.cpu.pc:04X}h, parts={len(self.parts)})"
