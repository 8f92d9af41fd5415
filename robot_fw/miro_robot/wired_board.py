"""A processor with parts around it, wired as a board file says.

    CPU ── port latches ──> nets ──> parts          `port_written`, then waves (parts/nets.py)
    CPU <── `set_external` <── nets <── parts       at their events, and at what the CPU writes

The CPU runs alone up to the first event of a part that may come to one of its pins; the other parts may be behind it
meanwhile. An instruction waits for an event if it begins in a cycle whose S5P2, tick 9, is not before it (P2). A run to
a tick does what happens before it; what a test puts then comes first on its tick, between two instructions. Contention
is judged when a tick is over: after its events, or after what the CPU writes on it.

TXD, the data of mode 0 and the clock of timer 2 do not come from latches. Where something is wired to such a pin, the
serial port or the timer says when its next edge comes if nothing changes, and again after each change of a register
that it depends on (`outputs_changed`). An edge is an event like that of a part that reaches the CPU, and comes last on
its tick. So no register is written while an edge is due that came before.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from operator import attrgetter, itemgetter
from typing import Any

from miro_exact.clock import CYCLE_TICKS, NEVER_TICK
from miro_exact.plugins import PluginError
from miro_exact.raised import raised
from miro_robot.board_spec import BoardSpec
from miro_robot.empty_board import FAULTS_KEPT, EmptyBoard
from miro_robot.faults import FaultKind, FirmwareFault
from miro_robot.image import Image
from miro_robot.mcs51.cpu import REPLAN, STOPPED
from miro_robot.mcs51.opcodes import CYCLES
from miro_robot.parts.netlist import Netlist
from miro_robot.parts.nets import Nets
from miro_robot.parts.own import check_state
from miro_robot.parts.part import Part

_CONTENTION = int(FaultKind.NET_CONTENTION)
_STARVED = int(FaultKind.MAIN_LOOP_STARVED)
_MOVX = (0xE0, 0xE2, 0xE3, 0xF0, 0xF2, 0xF3)  # writes no register but P0, at which nothing is sampled
_TWO_CYCLES = [int(CYCLES[opcode] == 2 and opcode not in _MOVX) for opcode in range(256)]
_order_and_kind = itemgetter(0, 1)
_moves = attrgetter("continuous")
_MOST_VALUE = (1 << 63) - 1  # of an integer, and of its negative
# Ticks into a MOVX (1919D, timing of external data memory, nominal times): rules X1 and X2 of mcs51/README.md.
_ADDRESS, _RELEASE, _DATA, _STROBE = 8, 10, 11, 12
_SAMPLE, _STROBE_ENDS, _DATA_ENDS, _PAGE_ENDS = 17, 18, 19, 20
_RXD, _WR, _RD = 0x01, 0x40, 0x80  # of P3
_OUTPUTS = ((3, 1), (3, 0), (1, 0))  # TXD, data of mode 0, clock of timer 2
_OUTPUT_PORT = [port for port, _ in _OUTPUTS]
_OUTPUT_MASK = [1 << bit for _, bit in _OUTPUTS]
_BEHIND_TICKS = 96  # more than an instruction: so far parts may be behind the CPU


def _plain_type(value: Any) -> Any:
    """The plain type of a value, which may be of a type of numpy; None if it has none."""
    return next((plain for plain in (bool, int, float, str) if isinstance(value, plain)), None)


class WiredBoard(EmptyBoard):
    """`parts` in the order of their names, on the nets of `netlist`. A run raises PluginError for a part that fails.

    `starved`: where interrupts took all of 10 ms from the main loop, which is no fault of a board.
    `outside`: levels that a test puts on port pins that nothing drives; it pulls low, or lets go.
    `drives_rxd`: something on the board drives P3.0, so that nothing else can send to its serial port.
    """

    STATE = {"latched": ("8B", 0, 0xFF), "outside": ("4B", 0, 0xFF), "parts": [Part]}
    NOT_HASHED: tuple[str, ...] = ("outside",)
    NOT_STATE = (
        *("nets", "horizon", "part_index", "pushed", "starved", "on_bus", "drives_rxd", "stuck"),
        # follow from the peripherals
        *("outputs", "output_levels", "output_ticks", "output_tick", "output_put"),
        *("latch_count", "latch_address", "latch_mask", "buffer_count", "buffer_address", "buffer_mask"),
    )

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
        self.outside = [0xFF] * 4
        self.pushed = [0xFF] * 4  # what the CPU was given of the ports
        self.starved: list[FirmwareFault] = []
        self.stuck = 0  # a port pin that something is wired to is shorted
        wired = self.nets.wired
        self.on_bus = 1 if wired[0] or wired[2] or wired[3] & (_WR | _RD) else 0
        self.drives_rxd = int(self.nets.is_output(self.nets.number("P3.0")))
        # Bit per output of `_OUTPUTS` that something is wired to; their levels without latches, by port.
        self.outputs = sum(int(wired[port] >> bit & 1) << place for place, (port, bit) in enumerate(_OUTPUTS))
        self.output_levels = [0xFF] * 4
        self.output_ticks = [NEVER_TICK] * 3  # of the next edges
        self.output_tick = NEVER_TICK  # of the first of them
        self.output_put = -1  # the tick of the last edge
        self._decode(spec)
        EmptyBoard.__init__(self, spec, image, stop_on_fault, stop_at, stop_at_end)
        self.cpu.peripherals.listened = self.outputs
        self.cpu.main_loop_limit = spec.crystal_hz // (100 * CYCLE_TICKS)  # cycles in 10 ms
        self.nets.ports_changed = 0xF  # straps hold pins from the beginning
        self._supply(1, 0)
        self.before_save()

    def _decode(self, spec: BoardSpec) -> None:
        """Addresses of output latches and input buffers."""
        self.latch_address, self.latch_mask, self.latched = [0] * 8, [0] * 8, [0] * 8
        self.buffer_address, self.buffer_mask = [0] * 8, [0] * 8
        self.latch_count, self.buffer_count = len(spec.latches), len(spec.buffers)
        for index, latch in enumerate(spec.latches.values()):
            self.latch_address[index], self.latch_mask[index] = latch.address, latch.mask
            self.nets.write_latch(index, -1, latch.initial)
            self.latched[index] = latch.initial
        for index, buffer in enumerate(spec.buffers.values()):
            self.buffer_address[index], self.buffer_mask[index] = buffer.address, buffer.mask

    # Time

    def _run(self, addresses: tuple[int, ...], until_tick: int) -> int:
        faults = self.fault_count
        reason = EmptyBoard._run(self, addresses, until_tick)
        reached = self.cpu.cycles * CYCLE_TICKS if reason else until_tick
        self.sync(min(reached, until_tick) - 1)
        return STOPPED if self.stop_on_fault and self.fault_count > faults else reason

    def _run_on(self, marks: tuple[int, ...], until_cycle: int) -> int:
        cpu = self.cpu
        cpu.stop_asleep = 0 if self.dead or self.held or not self.powered else 1
        reason = self._go_on(marks, until_cycle)
        cpu.stop_asleep = 0
        return reason

    def _sleep_on(self, until_cycle: int) -> None:
        self._go_on((), until_cycle)

    def _may_wake(self) -> bool:
        return self.input_tick != NEVER_TICK or self.nets.part_count > 0

    def _go_on(self, marks: tuple[int, ...], until_cycle: int) -> int:
        cpu = self.cpu
        if marks:
            cpu.mark(marks)
        cpu.begin_run()
        try:
            reason = self._run_pieces(until_cycle)
            self._catch_up()
            return reason
        finally:
            self.horizon = -1
            cpu.end_run()
            if marks:
                cpu.unmark(marks)

    def _catch_up(self) -> None:
        """The serial port is brought up to the end of the last instruction: so must be what is on its pins."""
        end_tick = self.cpu.cycles * CYCLE_TICKS
        if self.drives_rxd:
            self.sync(end_tick - 1)
        while self.output_tick < end_tick:
            self.sync(self.output_tick)

    def _run_pieces(self, until_cycle: int) -> int:
        """In pieces that end at the next event that may reach a port pin, or that is an edge of an output."""
        cpu = self.cpu
        faults = self.fault_count
        while cpu.cycles < until_cycle:
            due = self._due()
            due_cycle = self._cycle_of(due)
            self.horizon = due
            if self._is_due(due, due_cycle) or self._is_before_write(due_cycle):
                self.sync(due)
                if self.stop_on_fault and self.fault_count > faults:
                    return STOPPED
                continue
            # A cycle before it, too: whether the instruction there goes over it is known there.
            stop_cycle = max(due_cycle - 1, cpu.cycles + 1)
            reason = cpu.go_on(min(until_cycle, stop_cycle))
            if reason != 0 and (reason != REPLAN or self.again):
                return reason
        return 0

    def _due(self) -> int:
        """The next event that bounds the CPU."""
        due = self.nets.reach_tick
        return self.output_tick if self.output_tick // CYCLE_TICKS < self._cycle_of(due) else due

    def _cycle_of(self, due: int) -> int:
        """The first cycle whose S5P2 is not before an event; RXD is looked at between cycles, too, and an edge of an
        output comes before what the next instruction writes.
        """
        return (due if self.drives_rxd or due == self.output_tick else due + 2) // CYCLE_TICKS

    def _is_due(self, due: int, due_cycle: int) -> bool:
        """True if an event is to be handled before the next instruction; a MOVX moves the pins of its bus before it.

        All events of the cycle in which a MOVX begins wait for it: pins are sampled once in that cycle.
        """
        if due_cycle > self.cpu.cycles:
            return False
        waits = self.on_bus and due_cycle == self.cpu.cycles and self.cpu.code_at(self.cpu.pc) in _MOVX
        return not (waits and self.cpu.executes_next())

    def _is_before_write(self, due_cycle: int) -> bool:
        """True if the pins of `due_cycle` are sampled within the next instruction, which may write a register after.

        What the pins do then has to be known first: a flag that they set may be cleared by that instruction.
        """
        return self.cpu.cycles == due_cycle - 1 and _TWO_CYCLES[self.cpu.code_at(self.cpu.pc)] != 0

    def _step(self) -> None:
        cpu = self.cpu
        while self._is_before_write(self._cycle_of(self._due())):
            self.sync(self._due())
        cpu.begin_run()
        cpu.go_on(cpu.cycles + 1)
        self._catch_up()
        cpu.end_run()

    def sync(self, tick: int) -> None:
        """Does all that parts and outputs have to do by themselves up to and including `tick`."""
        nets = self.nets
        while nets.next_tick <= tick or self.output_tick <= tick:
            now = min(nets.next_tick, self.output_tick)
            if nets.next_tick == now:
                nets.due(now)
            if self.output_tick == now:
                self._output_due(now)
            self._push(now)

    # Outputs that do not come from latches

    def _output_due(self, tick: int) -> None:
        peripherals = self.cpu.peripherals
        self.output_put = tick
        for output in range(3):
            if self.output_ticks[output] <= tick:
                self._put_output(output, peripherals.output_at(output, tick), tick)
                self.output_ticks[output] = peripherals.output_after(output, tick)
        self.output_tick = min(self.output_ticks[0], self.output_ticks[1], self.output_ticks[2])

    def _put_output(self, output: int, level: int, tick: int) -> None:
        """The pin is the AND of this level and the latch (4316E section 2.5)."""
        nets, port, mask = self.nets, _OUTPUT_PORT[output], _OUTPUT_MASK[output]
        self.output_levels[port] = self.output_levels[port] & ~mask | (mask if level else 0)
        levels = nets.latches[port] & ~mask
        levels |= self.cpu.peripherals.ports.latches[port] & self.output_levels[port] & mask
        if levels != nets.latches[port]:
            nets.write_port(port, levels, tick)

    def outputs_changed(self, tick: int) -> int:
        """All edges below `tick` have been put, and some beyond it where the change comes from pins sampled then."""
        peripherals = self.cpu.peripherals
        before = max(tick - 1, self.output_put)
        if tick > self.cpu.cycles * CYCLE_TICKS:  # looks again when the CPU is there, if something changes
            for output in range(3):
                foreseen = self.output_ticks[output]
                if self.outputs >> output & 1 and peripherals.output_after(output, before) != foreseen:
                    self.output_ticks[output] = min(foreseen, tick)
                    self.output_tick = min(self.output_tick, tick)
        elif self._goes_otherwise(before):
            self._before(tick)
            for output in range(3):
                if self.outputs >> output & 1:
                    self._put_output(output, peripherals.output_at(output, before), tick)
            self._foresee(before)
            self._push(tick)
        if self.output_tick != NEVER_TICK and self.output_tick < self.horizon + CYCLE_TICKS:
            self.horizon = min(self.horizon, self.output_tick)
            self.cpu.replan()
        return 0

    def _goes_otherwise(self, tick: int) -> bool:
        """True if an output is not as it was put, or its next edge later than `tick` not where it was foreseen.

        The serial port also works its clock out again where nothing changes, as after a timer's register is written
        with the value that it has. Parts must not be brought to that tick then: it may be beyond the end of the run.
        """
        peripherals = self.cpu.peripherals
        for output in range(3):
            if self.outputs >> output & 1:
                level = 1 if self.output_levels[_OUTPUT_PORT[output]] & _OUTPUT_MASK[output] else 0
                if peripherals.output_at(output, tick) != level:
                    return True
                if peripherals.output_after(output, tick) != self.output_ticks[output]:
                    return True
        return False

    def _foresee(self, tick: int) -> None:
        """The next edges later than `tick`."""
        self.output_tick = NEVER_TICK
        for output in range(3):
            if self.outputs >> output & 1:
                self.output_ticks[output] = self.cpu.peripherals.output_after(output, tick)
                self.output_tick = min(self.output_tick, self.output_ticks[output])

    def _push(self, tick: int) -> None:
        """The tick is over: to the CPU what has changed on its pins, and when it has to look up for the parts."""
        nets = self.nets
        if nets.ports_changed:
            for port in range(4):
                if nets.external[port] & self.outside[port] != self.pushed[port]:
                    self._push_port(port, nets.external[port] & self.outside[port], tick)
            nets.ports_changed = 0
        if nets.suspect_count and not self.forced:
            self._judge(tick)
        if nets.faults:
            self._note_faults(tick)
        if nets.reach_tick < self.horizon:
            self.horizon = nets.reach_tick
            self.cpu.replan()

    def _push_port(self, port: int, levels: int, tick: int) -> None:
        """P3.0 is the wire RXD, which the serial port reads between cycles, too."""
        changed = self.pushed[port] ^ levels
        self.pushed[port] = levels
        if port == 3 and changed & _RXD and self.drives_rxd:
            self.cpu.rxd.append(tick, levels & _RXD)
            self.cpu.rxd_changed()
            changed &= ~_RXD
        if changed:
            self.cpu.set_external(port, levels | _RXD if port == 3 else levels, tick)

    # From the processor

    def fault(self, kind: int, pc: int, tick: int) -> None:
        """Interrupts may take what time they like; who wants to know of it looks at `starved`."""
        if kind != _STARVED:
            EmptyBoard.fault(self, kind, pc, tick)
        elif len(self.starved) < FAULTS_KEPT:
            self.starved.append(FirmwareFault(FaultKind(kind), tick, pc, self.image.symbols.name_at(pc)))

    def port_written(self, port: int, latch: int, tick: int) -> None:
        self._put_on_port(port, latch & self.output_levels[port], tick)

    def _put_on_port(self, port: int, latch: int, tick: int) -> None:
        """The levels that the chip drives a port with."""
        nets = self.nets
        if (nets.latches[port] ^ latch) & nets.live[port]:
            self._before(tick)
            nets.write_port(port, latch, tick)
            self._push(tick)
        else:
            nets.latches[port] = latch

    def _before(self, tick: int) -> None:
        """Runs the parts' events before the CPU writes at `tick`; contention on that tick is judged after the write."""
        if self.nets.next_tick <= tick or self.output_tick < tick:
            self.sync(tick - 1)
            if self.nets.next_tick == tick:
                self.nets.due(tick)

    def movx_write(self, address: int, value: int, tick: int) -> None:
        """A bus cycle on P0, P2 and /WR, if something is wired there; latches take their byte as /WR rises."""
        start = tick - _STROBE_ENDS
        if self.on_bus:
            self._put_address(address, start)
            self._put_on_port(0, value, start + _DATA)
            self._put_on_port(3, self.nets.latches[3] & (0xFF ^ _WR), start + _STROBE)
        self._before(tick)
        for index in range(self.latch_count):
            if address & self.latch_mask[index] == self.latch_address[index]:
                self.nets.write_latch(index, self.latched[index], value)
                self.latched[index] = value
        # /WR and the latches in one: parts see both together.
        self.nets.put_latch(3, self.nets.latches[3] | (_WR if self.on_bus else 0))
        self.nets.settle(tick)
        self._push(tick)
        EmptyBoard.movx_write(self, address, value, tick)
        if self.on_bus:
            self._put_on_port(0, 0xFF, start + _DATA_ENDS)
            self._put_on_port(2, self.cpu.peripherals.ports.latches[2], start + _PAGE_ENDS)

    def movx_read(self, address: int, tick: int) -> int:
        """A bus cycle on P0, P2 and /RD, if something is wired there: RAM, an input buffer, or what parts put on P0."""
        start = tick - _SAMPLE
        if self.on_bus:
            self._put_address(address, start)
            self._put_on_port(3, self.nets.latches[3] & (0xFF ^ _RD), start + _STROBE)
        self.sync(tick)
        value = EmptyBoard.movx_read(self, address, tick) & self.nets.external[0]
        for index in range(self.buffer_count):
            if address & self.buffer_mask[index] == self.buffer_address[index]:
                value &= self.nets.buffered(index)
        if self.on_bus:
            self._put_on_port(3, self.nets.latches[3] | _RD, start + _STROBE_ENDS)
            self._put_on_port(2, self.cpu.peripherals.ports.latches[2], start + _PAGE_ENDS)
        return value

    def _put_address(self, address: int, start: int) -> None:
        """The first half of a MOVX: the address, low byte on P0, high byte on P2; then P0 floats."""
        self._before(start + _ADDRESS)
        self.nets.put_latch(2, address >> 8)
        self._put_on_port(0, address & 0xFF, start + _ADDRESS)
        self.nets.settle(start + _ADDRESS)
        self._push(start + _ADDRESS)
        self._put_on_port(0, 0xFF, start + _RELEASE)

    def _judge(self, tick: int) -> None:
        """Contention is a fault where it begins. RST and the supply move pins one after the other: judged after."""
        for net in self.nets.judge():
            if self.stuck:  # a shorted pin's, not the firmware's
                continue
            detail = ""
            if len(self.faults) < FAULTS_KEPT:  # of the others nobody sees it
                detail = f"net {self.nets.names[net]}: {' and '.join(self.nets.drivers(net))}"
            self._note_fault(_CONTENTION, self.cpu.at, tick, detail)

    def _note_faults(self, tick: int) -> None:
        """Reports the parts' faults of this tick; of several parts with the same order and kind the first one's."""
        faults = sorted(self.nets.faults, key=_order_and_kind)
        self.nets.faults = []
        before = None
        no_fault = self.forced or self.stuck  # a shorted pin's, not the firmware's
        for order, kind, detail, ago in faults:
            if (order, kind) != before and not no_fault:
                self._note_fault(kind, self.cpu.at, tick - ago, detail)
            before = (order, kind)

    # Tests

    def put(self, name: str, key: str, value: Any, tick: int) -> int:
        """A test puts a value of a part, or a level on pin `key` of port `name`, between two instructions, before all
        else at `tick`.

        Returns 0, or STOPPED for a fault at which a run stops. Raises PluginError for a part that fails.
        """
        faults = self.fault_count
        tick = max(tick, self.cpu.cycles * CYCLE_TICKS)
        self.sync(tick - 1)
        if name not in self.part_index:
            self._put_pin(int(name[1]), int(key), value, tick)
            return 0
        index = self.part_index[name]
        part: Part = self.parts[index]
        try:
            part.put(key, value, tick)
            if not self.powered:
                part.supply(0, tick)
        except (Exception, SystemExit) as error:
            place = f"part {name!r} ({part.keys.name}), tick {tick}: put {key}"
            raise PluginError(f"{place}: {raised(error)}", "repair the part") from error
        self.nets.collect(index, tick)
        self.nets.settle(tick)
        self._push(tick)
        return STOPPED if self.stop_on_fault and self.fault_count > faults else 0

    def _put_pin(self, port: int, bit: int, level: int, tick: int) -> None:
        self.outside[port] = self.outside[port] & ~(1 << bit) | level << bit
        self._push_port(port, self.nets.external[port] & self.outside[port], tick)

    def hold_pin(self, port: int, bit: int, level: int) -> None:
        """See `ProcessorBoard`."""
        tick = self.cpu.cycles * CYCLE_TICKS
        self.sync(tick - 1)
        self._hold_pin(port, bit, level, self.pushed[port] | (_RXD if port == 3 else 0))
        self._note_stuck()
        self.forced = 1
        self.nets.tie(8 * port + bit, level)
        self.nets.settle(tick)
        self._push(tick)
        self.forced = 0

    def _note_stuck(self) -> None:
        """Of a shorted pin that nothing is wired to no part notices anything."""
        self.stuck = 0
        for port in range(4):
            self.stuck |= (self.stuck_low[port] | self.stuck_high[port]) & self.nets.wired[port]

    def value(self, name: str, key: str) -> float | int | bool | str:
        """A value of a part as it is now, of a plain type. Raises PluginError for what no file can hold (NaN,
        infinities, integers of more than 63 bits), and for a part that fails.
        """
        part: Part = self.parts[self.part_index[name]]
        place = f"part {name!r} ({part.keys.name}), tick {self.cpu.cycles * CYCLE_TICKS}, value {key}"
        try:
            value: Any = part.read(key, min(self.cpu.cycles * CYCLE_TICKS, part.next_tick))
        except (Exception, SystemExit) as error:
            raise PluginError(f"{place}: {raised(error)}", "repair the part") from error
        plain = _plain_type(value)
        if plain is None:
            raise PluginError(f"{place}: is {type(value).__name__}", "return a number, a text or a boolean")
        if plain is float and not isfinite(value):
            raise PluginError(f"{place}: is {'NaN' if value != value else value}", "repair the part")
        if plain is int and not -_MOST_VALUE <= value <= _MOST_VALUE:
            raise PluginError(f"{place}: has more than 63 bits", "repair the part")
        taken: float | int | bool | str = plain(value)
        return taken

    # RST and supply

    def set_reset(self, level: int) -> None:
        EmptyBoard.set_reset(self, level)
        self._push(self.cpu.cycles * CYCLE_TICKS)

    def hold_reset(self, level: int) -> None:
        EmptyBoard.hold_reset(self, level)
        self._push(self.cpu.cycles * CYCLE_TICKS)

    def set_power(self, on: int) -> None:
        """The parts lose their supply before the processor does, and have it after it."""
        if on == self.powered:
            return
        tick = self.cpu.cycles * CYCLE_TICKS
        if not on:
            self._supply(0, tick)
        EmptyBoard.set_power(self, on)
        if on:
            self._supply(1, tick)
        self._push(tick)

    def _supply(self, on: int, tick: int) -> None:
        """All parts begin, or stand, those that move last; then the levels that they and the ports make."""
        self.sync(tick - 1)
        nets = self.nets
        nets.powered = on
        if on:
            for index, latch in enumerate(self.spec.latches.values()):
                nets.write_latch(index, self.latched[index], latch.initial)
                self.latched[index] = latch.initial
        nets.show_all()
        nets.ports_changed = 0xF
        for part in sorted(self.parts, key=_moves):
            try:
                part.supply(on, tick)
            except (Exception, SystemExit) as error:
                place = f"part {part.name!r} ({part.keys.name}), tick {tick}: {'start' if on else 'supply'}"
                if isinstance(error, PluginError):
                    raise PluginError(f"{place}: {error.what}", error.remedy) from error
                raise PluginError(f"{place}: {raised(error)}", "repair the part") from error
            nets.collect(self.part_index[part.name], tick)
        nets.settle(tick)
        self._push(tick)

    # State

    def before_save(self) -> None:
        """Raises PluginError for a part whose attributes are not what its STATE says: it could not go on from that."""
        for part in self.parts:
            if hasattr(part, "__dict__"):  # the table of a compiled class was checked as it was built
                check_state(part, self.cpu.cycles * CYCLE_TICKS)

    def after_load(self) -> None:
        """Works out the nets again. Raises ValueError for a part that is far behind."""
        EmptyBoard.after_load(self)
        earliest_tick = self.cpu.cycles * CYCLE_TICKS - _BEHIND_TICKS
        for part in self.parts:
            if part.next_tick < earliest_tick:
                raise ValueError(f"part {part.name} has its next event at tick {part.next_tick}")
        self.output_put = self.cpu.cycles * CYCLE_TICKS - 1
        for output in range(3):
            port, mask = _OUTPUT_PORT[output], _OUTPUT_MASK[output]
            if self.outputs >> output & 1:
                level = self.cpu.peripherals.output_at(output, self.output_put)
                self.output_levels[port] = self.output_levels[port] & ~mask | (mask if level else 0)
        self._foresee(self.output_put)
        for port in range(4):
            self.nets.latches[port] = self.cpu.peripherals.ports.latches[port] & self.output_levels[port]
            self.nets.note_shorts(port, self.stuck_low[port], self.stuck_high[port])
        self._note_stuck()
        self.nets.powered = self.powered
        self.nets.restart()
        for index in range(self.latch_count):
            self.nets.write_latch(index, -1, self.latched[index])
        self.nets.show_all()
        for port in range(4):
            self.pushed[port] = self.nets.external[port] & self.outside[port]

    def __repr__(self) -> str:
        return f"WiredBoard({self.spec.name}, cycle={self.cpu.cycles}, pc={self.cpu.pc:04X}h, parts={len(self.parts)})"
