"""The robot's board: one AT89C52, two LM629, the L298 inputs, wired as a board file says.

                 P0 ------- D7-D0 -----------+-------------+
    AT89C52      P2.0-2.4 - PS /RD /WR /CS --+-------------+        the MIRO's wiring (boards/miro.board.toml)
                 P2.5 ----- /RST ------------+-------------+
                                        LM629 left    LM629 right
                 P3.2 /INT0 <-- NOT <------- HI            |
                 P3.3 /INT1 <-- NOT <-------------------- HI
    straps ----> P1.0-1.3                PWM MAG, SIGN  PWM MAG, SIGN
    radio -----> P3.0 RXD                    |             |
    radio <----- P3.1 TXD                `Plant`: MAG -> EN, SIGN -> IN2 and inverted IN1 of the L298; A, B come back

Order on one tick: the plant moves first (its encoder edges reach the decoders), then the left LM629, the right
LM629, the bridge inputs, the interrupt lines, and last what the CPU did to its port pins on that tick. Everything
but the CPU is advanced at its own events only, never "up to now", so reading a part at any time changes no bit.
The CPU never passes an event that may change HI: the chips are then up to 9 ticks ahead of it, or of the end of a run.
"""

from __future__ import annotations

from miro_exact.clock import CYCLE_TICKS, NEVER_TICK
from miro_exact.state import FLAG, TICK
from miro_robot.event_log import FAULT
from miro_robot.faults import STACK_FAULTS, FaultKind, FirmwareFault
from miro_robot.lm629.bus_timing import LIMITS, RESET_PULSE, BusTiming
from miro_robot.lm629.chip import SAMPLE_TICKS, Lm629
from miro_robot.lm629.options import Lm629Options
from miro_robot.mcs51.cpu import REPLAN
from miro_robot.plant import Plant
from miro_robot.probe import Probe
from miro_robot.processor_board import ProcessorBoard
from miro_robot.wiring import CHIP_INPUTS, CONSTANT_BANK, PORTS, SIDES, Wiring

MAIN_LOOP_LIMIT_CYCLES = 20_000
"""10 ms without main loop are a fault: a third of a camera frame is lost."""
FAULTS_KEPT = 1000
"""Number of faults that are recorded; further ones are only counted, so that a loop of faults does not fill
the memory.
"""

_ADDRESS, _RELEASE, _DATA, _STROBE = 8, 10, 11, 12
_SAMPLE, _STROBE_ENDS, _DATA_ENDS, _PAGE_ENDS = 17, 18, 19, 20
"""Ticks into a MOVX: Atmel 8051 Hardware Manual (4316E), section 2.6, and the timing table of external data memory in
the AT89S52 data sheet (1919D), section 28. Neither says when P2 goes back to its latch: rule X2."""
_WR, _RD = 0x40, 0x80  # pins of P3
# Inputs of an LM629 as bits, in the order of CHIP_INPUTS; those of both chips: the left one's, then the right one's.
_CS, _BOTH_STROBES = 0x01, 0x06
_CHIP_PINS, _ALL_PINS, _BOTH_RST = 5, 0x1F, 0x210
_BEHIND_TICKS = 96  # more than an instruction: so far the other parts may be behind the CPU
_AT_PINS = (FaultKind.BUS_CONTENTION, FaultKind.LM629_BUSY, FaultKind.LM629_TIMING)
RESET_PULSE_TICKS = LIMITS[RESET_PULSE].ticks


class Board(ProcessorBoard):
    """A robot's electronics, from RXD to the pins of the L298.

    `slot` (0..robots-1) and `robots` (3 or 5) are set by straps. `plant` is what the bridge drives and the encoders
    see. `run(tick)` moves everything on; `cpu.rxd` must be settled beyond that tick.
    """

    STATE = {
        "left": Lm629,
        "right": Lm629,
        "plant": Plant,
        "bank": "13B",
        "external": "4B",
        "bus_levels": ("i", 0, 0xFF),
        "bridge_enable": "2B",
        "bridge_sign": "2B",
        "fault_count": TICK,
        "busy_writes": TICK,
        "contention": FLAG,
        "held": FLAG,
        "powered": FLAG,
    }
    NOT_STATE = (
        "wiring", "latch_address", "latch_mask", "buffer_address", "buffer_mask", "latches", "buffers",
        "data_bank", "watched", "pin_levels", "pin_banks", "pin_bank", "hi_pins", "hi_seen", "forced",
        "probe", "on_movx_bus", "horizon", "strobed", "reset_pins", "stuck", "low_pins", "high_pins",
        # the bus is at rest between two instructions: `after_load` sets both to that
        "left_timing", "right_timing",
    )  # fmt: skip

    def __init__(
        self,
        wiring: Wiring,
        plant: Plant,
        slot: int = 0,
        robots: int = 3,
        options: Lm629Options | None = None,
        stop_on_fault: bool = True,
    ) -> None:
        ProcessorBoard.__init__(self, stop_on_fault)
        self.wiring = wiring
        self.plant = plant
        self.cpu.main_loop_limit = MAIN_LOOP_LIMIT_CYCLES
        self.left = Lm629(options or Lm629Options())
        self.right = Lm629(options or Lm629Options())
        self.left.tell(self.log, 0)
        self.right.tell(self.log, 1)
        self.left_timing = BusTiming()
        self.right_timing = BusTiming()
        self.fault_count = 0
        self.probe: Probe | None = None
        self.horizon = -1  # of the piece of a run that the CPU is in; -1 between two runs
        self.strobed = 0  # a chip is being written or read
        self.reset_pins = _BOTH_RST  # as the chips have them
        self.busy_writes = 0
        self.contention = self.held = 0
        self.forced = 0  # pins change by RST or the supply
        self.powered = 1
        self.bus_levels = 0xFF
        self.bank = bytearray([0xFF] * (CONSTANT_BANK + 1))
        self.external = bytearray([0xFF] * PORTS)
        self.bridge_enable = bytearray(2)
        self.bridge_sign = bytearray(2)
        self.hi_seen = bytearray(2)
        self.stuck = 0  # a port pin that something is wired to is shorted
        self.low_pins, self.high_pins = bytearray(PORTS), bytearray(PORTS)
        self._resolve_outputs(wiring)
        self._resolve_inputs(wiring, slot, robots)
        plant.attach(self.left, self.right)
        self._drive_chips(0)
        self._drive_interrupts(0)

    def _resolve_outputs(self, wiring: Wiring) -> None:
        """Turns nets into what the levels of a bank put on the LM629's inputs, the external bus into address tables."""
        self.data_bank = wiring.data_bank()
        self.pin_levels = [0] * 3328  # 256 of each bank
        self.watched = bytearray(CONSTANT_BANK + 1)
        self.watched[self.data_bank] = 0xFF
        sources = [wiring.chip_input(side, pin) for side in SIDES for pin in CHIP_INPUTS]
        banks = sorted({bank for bank, _, _ in sources})
        self.pin_banks = len(banks)
        self.pin_bank = banks + [0] * (10 - len(banks))
        for index, (bank, bit, inverted) in enumerate(sources):
            for levels in range(256):
                self.pin_levels[256 * bank + levels] |= ((levels >> bit & 1) ^ inverted) << index
            self.watched[bank] |= 1 << bit
        on_p3 = self.watched[3] & (_WR | _RD)
        self.on_movx_bus = 1 if self.watched[0] or self.watched[2] or on_p3 else 0
        self.latches = len(wiring.latch)
        self.latch_address = [latch.address for latch in wiring.latch] + [0] * (8 - len(wiring.latch))
        self.latch_mask = [latch.mask for latch in wiring.latch] + [0] * (8 - len(wiring.latch))
        for index, latch in enumerate(wiring.latch):
            self.bank[PORTS + index] = latch.initial
        self.buffers = min(len(wiring.buffer), 8)
        self.buffer_address = [part.address for part in wiring.buffer[:8]] + [0] * (8 - self.buffers)
        self.buffer_mask = [part.mask for part in wiring.buffer[:8]] + [0] * (8 - self.buffers)

    def _resolve_inputs(self, wiring: Wiring, slot: int, robots: int) -> None:
        """Puts the straps on the CPU's pins and notes which pins follow an LM629's HI."""
        self.hi_pins: list[tuple[int, int, int, int]] = []  # port, mask, inverted, side
        straps = {f"slot.{bit}": slot >> bit & 1 for bit in range(3)}
        straps.update({"three": int(robots == 3), "0": 0, "1": 1})
        for port, bit, source, inverted in wiring.cpu_inputs():
            if source in straps:
                if not straps[source] ^ inverted:
                    self.external[port] &= ~(1 << bit) & 0xFF
            else:
                self.hi_pins.append((port, 1 << bit, inverted, SIDES.index(source[:-3])))
        for port in range(PORTS):
            self.cpu.set_external(port, self.external[port], 0)

    # ---- time ----------------------------------------------------------------------------------------------

    def run(self, until_tick: int) -> int:
        """Moves the whole robot on to `until_tick`. Returns 0, or the CPU's reason for stopping early."""
        self.cpu.begin_run()
        stopped = self.go_on(until_tick)
        self.cpu.end_run()
        return stopped

    def go_on(self, until_tick: int) -> int:
        """A piece of a run, between `begin_run` and `end_run` of the CPU."""
        stopped = 0
        cpu = self.cpu
        until_cycle = (until_tick + CYCLE_TICKS - 1) // CYCLE_TICKS
        while not stopped and cpu.cycles < until_cycle:
            due = min(self._next_interrupt(self.left), self._next_interrupt(self.right))
            horizon = min(until_tick, due)
            self.horizon = horizon
            # An instruction waits for `due` if it begins in a cycle whose S5P2, tick 9, is not before it (P2).
            stopped = cpu.go_on(min(until_cycle, (due + 2) // CYCLE_TICKS))
            if stopped:
                self.sync(min(horizon, cpu.cycles * CYCLE_TICKS))
            else:
                # The CPU waits short of `due`: HI may change there, and its pins have to show that to the next cycle.
                self.sync(due if cpu.cycles < until_cycle else horizon)
            if stopped == REPLAN:
                stopped = 0
        self.horizon = -1
        return stopped

    def _next_interrupt(self, chip: Lm629) -> int:
        """The next tick at which HI may change without the CPU: an unmasked sample, the end of reset, or its
        own end.
        """
        if chip.sample_tick == NEVER_TICK:
            return chip.next_tick
        return min(chip.hi_falls_tick, chip.sample_tick if chip.signals.mask else NEVER_TICK)

    def sync(self, tick: int) -> None:
        """Does everything the plant and the LM629 have to do by themselves up to and including `tick`."""
        while True:
            # Whole PWM pulses in one go. A probe wants to see each edge, so with one they are made one by one.
            if self.probe is None and self.plant.run_pulses(tick):
                self.bridge_enable[0] = self.left.pwm
                self.bridge_enable[1] = self.right.pwm
            now = min(self.left.next_tick, self.right.next_tick, self.plant.next_tick)
            falls = min(self.left.hi_falls_tick, self.right.hi_falls_tick)
            # Not on the tick of an event: the plant has to come there before its chip does both.
            if falls < now and falls <= tick:
                self._let_hi_fall()
                continue
            if now > tick:
                break
            self.plant.advance(now)
            if self.left.next_tick <= now:
                self.left.advance(now)
            if self.right.next_tick <= now:
                self.right.advance(now)
            self._drive_bridge(now)
            if self.left.hi != self.hi_seen[0] or self.right.hi != self.hi_seen[1]:
                self._drive_interrupts(now)
            if self.probe is not None:
                self.probe.passed(now)

    def _let_hi_fall(self) -> None:
        """HI of a chip, or of both, falls before anything else happens. It is no step of the plant."""
        now = min(self.left.hi_falls_tick, self.right.hi_falls_tick)
        if self.left.hi_falls_tick == now:
            self.left.advance(now)
        if self.right.hi_falls_tick == now:
            self.right.advance(now)
        self._drive_interrupts(now)
        if self.probe is not None:
            self.probe.hi_fell(now)

    # ---- RST and supply ------------------------------------------------------------------------------------

    def set_reset(self, level: int) -> None:
        """The level of the CPU's RST pin from now on, between two instructions: 1 holds it in reset.

        The two LM629 have a reset of their own, on a port pin: they go on until the firmware resets them. That all
        ports go high at once is no fault of the firmware.
        """
        self.forced = 1
        if level and not self.held:
            self.cpu.hold()
        elif self.held and not level and self.powered:
            self.cpu.reset()
        self.forced = 0
        self.held = level

    def set_power(self, on: int) -> None:
        """Switches the robot's supply off or on, between two instructions.

        Off, the processor and both LM629 stand and the motors coast; on, all begin as at first, with zeros in RAM.
        """
        if on == self.powered:
            return
        self.powered = on
        self.forced = 1
        if on and not self.held:
            self.cpu.reset()
        if not on:
            self.cpu.hold()
            for address in range(256):
                # Zeros are chosen, so that a run repeats: silicon has anything there (C7).
                self.cpu.poke_iram(address, 0)
        tick = self.cpu.cycles * CYCLE_TICKS
        self.sync(tick)
        self._drive_chips(tick)
        self.forced = 0

    def hold_pin(self, port: int, bit: int, level: int) -> None:
        """Fault, between two instructions: a port pin is shorted to ground (0), to the supply (1), or is whole (-1)."""
        tick = self.cpu.cycles * CYCLE_TICKS
        self._hold_pin(port, bit, level, self.external[port])
        self._note_stuck()
        self.forced = 1
        self._set_pins(port, self.cpu.peripherals.ports.latches[port], tick)
        self.forced = 0
        if self.probe is not None:
            self.probe.moved(tick)

    def _note_stuck(self) -> None:
        """Marks the shorted pins that the board watches; a short of another pin reaches the CPU alone."""
        self.stuck = 0
        for port in range(PORTS):
            self.low_pins[port] = self.stuck_low[port] & self.watched[port]
            self.high_pins[port] = self.stuck_high[port] & self.watched[port]
            self.stuck |= self.low_pins[port] | self.high_pins[port]

    # ---- from chip to bridge and CPU ----------------------------------------------------------------------

    def _drive_bridge(self, tick: int) -> None:
        """L298: EN = PWM magnitude, IN1/IN2 = sign."""
        if self.left.pwm != self.bridge_enable[0] or self.left.sign != self.bridge_sign[0]:
            self._set_bridge(tick, 0, self.left)
        if self.right.pwm != self.bridge_enable[1] or self.right.sign != self.bridge_sign[1]:
            self._set_bridge(tick, 1, self.right)

    def _set_bridge(self, tick: int, side: int, chip: Lm629) -> None:
        self.bridge_enable[side] = chip.pwm
        self.bridge_sign[side] = chip.sign
        # The chip's sign is 1 for negative torque (SNVS781, PWM SIGN).
        self.plant.set_bridge(tick, side, chip.pwm, 1 - chip.sign)

    def _drive_interrupts(self, tick: int) -> None:
        """HI of each LM629 to the CPU pins that it is wired to."""
        self.hi_seen[0] = self.left.hi
        self.hi_seen[1] = self.right.hi
        for port, mask, inverted, side in self.hi_pins:
            high = self.hi_seen[side] != inverted
            levels = self.external[port] | mask if high else self.external[port] & ~mask
            if levels != self.external[port]:
                self.external[port] = levels
                self.cpu.set_external(port, levels, tick)

    # ---- from CPU to chip ---------------------------------------------------------------------------------

    def port_written(self, port: int, latch: int, tick: int) -> None:
        """The CPU's port pins changed: carry them to the LM629."""
        self._set_pins(port, latch, tick)

    def _set_pins(self, port: int, levels: int, tick: int) -> None:
        levels = (levels | self.high_pins[port]) & ~self.low_pins[port]
        changed = self.bank[port] ^ levels
        self.bank[port] = levels
        if changed & self.watched[port]:
            if tick >= self.horizon or self.probe is not None or not self._only_levels(tick):
                self.sync(tick)
                self._drive_chips(tick)

    def _only_levels(self, tick: int) -> bool:
        """Puts PS and data on the chips' pins and returns True, if that is all that changes.

        So it is without a strobe, before and now, while no chip has something to tell (it may have at the horizon).
        Nothing has to be brought up to `tick` for that.
        """
        pins = self._pins()
        left, right = pins & _ALL_PINS, pins >> _CHIP_PINS
        strobed = self.strobed | self._strobes(left) | self._strobes(right)
        if strobed or (pins ^ self.reset_pins) & _BOTH_RST:
            return False
        left, right = left >> 3 & 1, right >> 3 & 1
        data = self.bank[self.data_bank]
        self.left.port.ps, self.left.port.data = left, data
        self.right.port.ps, self.right.port.data = right, data
        broken = self.left_timing.pins(tick, 1, 1, 1, left, data)
        self._note_timing(broken, self.right_timing.pins(tick, 1, 1, 1, right, data), tick)
        return True

    def movx_write(self, address: int, value: int, tick: int) -> None:
        """A bus cycle on P0, P2 and /WR; stores into every output latch that decodes the address."""
        start = tick - _STROBE_ENDS
        page = self.bank[2]
        changed = False
        if self.on_movx_bus:
            self._put_address(address, start)
            self._set_pins(0, value, start + _DATA)
            self._set_pins(3, self.bank[3] & (0xFF ^ _WR), start + _STROBE)
            # /WR rises on the tick on which the latches take their bytes: chips are driven once, with both.
            self.bank[3] |= _WR & ~self.low_pins[3]
            changed = True
        for index in range(self.latches):
            if address & self.latch_mask[index] == self.latch_address[index]:
                changed = changed or self.bank[PORTS + index] != value
                self.bank[PORTS + index] = value
        if changed:
            self.sync(tick)
            self._drive_chips(tick)
        if self.on_movx_bus:
            self._set_pins(0, 0xFF, start + _DATA_ENDS)
            # No sheet says when P2 shows its latch again: two ticks after the strobe (X2).
            self._set_pins(2, page, start + _PAGE_ENDS)

    def movx_read(self, address: int, tick: int) -> int:
        """A bus cycle on P0, P2 and /RD. The LM629 data bus if it is P0 or if an input buffer decodes the address,
        else the pulled-up external bus.
        """
        start = tick - _SAMPLE
        page = self.bank[2]
        if self.on_movx_bus:
            self._put_address(address, start)
            self._set_pins(3, self.bank[3] & (0xFF ^ _RD), start + _STROBE)
        addressed = self.data_bank == 0
        for index in range(self.buffers):
            addressed = addressed or address & self.buffer_mask[index] == self.buffer_address[index]
        value = self.bank[self.data_bank] & self.bus_levels if addressed else 0xFF
        if self.on_movx_bus:
            if addressed:
                self._note_timing(self.left_timing.sampled(tick), self.right_timing.sampled(tick), tick)
            self._set_pins(3, self.bank[3] | _RD, start + _STROBE_ENDS)
            self._set_pins(2, page, start + _PAGE_ENDS)
        return value

    def _put_address(self, address: int, start: int) -> None:
        """The first half of a MOVX: the address, low byte on P0, high byte on P2; then P0 floats."""
        self._set_pins(2, address >> 8, start + _ADDRESS)
        self._set_pins(0, address & 0xFF, start + _ADDRESS)
        self._set_pins(0, 0xFF, start + _RELEASE)

    def _pins(self) -> int:
        """Levels at the inputs of both LM629, bit per pin."""
        pins = 0
        for index in range(self.pin_banks):
            bank = self.pin_bank[index]
            pins |= self.pin_levels[256 * bank + self.bank[bank]]
        return pins

    def _strobes(self, pins: int) -> int:
        """1 while CS and RD or WR are low. Without a strobe, now and before, an LM629 notes PS and data only."""
        return 0 if pins & _CS or pins & _BOTH_STROBES == _BOTH_STROBES else 1

    def _drive_chips(self, tick: int) -> None:
        """Puts the present levels on both chips' pins, then what they answer on the bus."""
        data = self.bank[self.data_bank]
        # Without supply the chips stand, though the ports of the held CPU, /RST among them, are high.
        pins = self._pins() if self.powered else self._pins() & ~_BOTH_RST
        left, right = pins & _ALL_PINS, pins >> _CHIP_PINS
        at_left = self._strobes(left) | self.left.port.writing | self.left.port.reading
        at_right = self._strobes(right) | self.right.port.writing | self.right.port.reading
        broken = self.left_timing.pins(tick, left & 1, left >> 1 & 1, left >> 2 & 1, left >> 3 & 1, data)
        too = self.right_timing.pins(tick, right & 1, right >> 1 & 1, right >> 2 & 1, right >> 3 & 1, data)
        self._note_timing(broken, too, tick)
        if (pins ^ self.reset_pins) & _BOTH_RST:
            self._reset_chips(left, right, tick)
            self.reset_pins = pins & _BOTH_RST
        if at_left or self.left.next_tick <= tick:
            self.left.set_bus(tick, left & 1, left >> 1 & 1, left >> 2 & 1, left >> 3 & 1, data)
        else:
            self.left.port.ps, self.left.port.data = left >> 3 & 1, data
        if at_right or self.right.next_tick <= tick:
            self.right.set_bus(tick, right & 1, right >> 1 & 1, right >> 2 & 1, right >> 3 & 1, data)
        else:
            self.right.port.ps, self.right.port.data = right >> 3 & 1, data
        self.strobed = self.left.port.writing | self.left.port.reading
        self.strobed |= self.right.port.writing | self.right.port.reading
        due = min(self._next_interrupt(self.left), self._next_interrupt(self.right))
        # The CPU runs up to the horizon without looking: it has to know that something may come before.
        if due < self.horizon:  # a reset has begun to end, or a mask has gone
            self.horizon = due
            self.cpu.replan()
        levels = self.left.port.drive if self.left.port.reading else 0xFF
        if self.right.port.reading:
            # Both drive: a low wins, and the fault is `_watch_bus`'s.
            levels &= self.right.port.drive
        self._watch_bus(self.left.port.reading & self.right.port.reading, tick)
        if levels != self.bus_levels:
            self.bus_levels = levels
            if self.data_bank < PORTS:
                self.external[self.data_bank] = levels
                self.cpu.set_external(self.data_bank, levels, tick)
        self._drive_bridge(tick)
        if self.left.hi != self.hi_seen[0] or self.right.hi != self.hi_seen[1]:
            self._drive_interrupts(tick)
        if self.probe is not None:
            self.probe.moved(tick)

    def _watch_bus(self, both_drive: int, tick: int) -> None:
        """Detects forbidden accesses to the LM629s: writing while busy, reading two chips at once."""
        busy_writes = self.left.writes_while_busy + self.right.writes_while_busy
        if busy_writes != self.busy_writes:
            self.busy_writes = busy_writes
            self.fault(FaultKind.LM629_BUSY, self.cpu.at, tick)
        # Where it begins: one fault, not one for each edge while it lasts.
        if both_drive and not self.contention:
            self.fault(FaultKind.BUS_CONTENTION, self.cpu.at, tick)
        self.contention = both_drive

    def _note_timing(self, left: int, right: int, tick: int) -> None:
        """Limits that an edge breaks at the chips, if any: at both it is one fault."""
        if left:
            self._timing_fault(left, self.left_timing.ticks, tick)
        elif right:
            self._timing_fault(right, self.right_timing.ticks, tick)

    def _reset_chips(self, left: int, right: int, tick: int) -> None:
        """/RST of a chip has another level: rising less than 8 LM629 clocks after it fell is a fault, one for both."""
        pulses = [
            tick - chip.reset_tick
            for chip, level in ((self.left, left >> 4), (self.right, right >> 4))
            if level > chip.reset_level and tick - chip.reset_tick < RESET_PULSE_TICKS
        ]
        if pulses:
            self._timing_fault(RESET_PULSE, pulses[0], tick)
        self.left.set_reset(tick, left >> 4)
        self.right.set_reset(tick, right >> 4)

    def _timing_fault(self, limit: int, ticks: int, tick: int) -> None:
        self._note(FaultKind.LM629_TIMING, self.cpu.at, tick, LIMITS[limit].breach(ticks))

    def fault(self, kind: int, pc: int, tick: int) -> None:
        """Notes a firmware fault; the run ends after this instruction when the scenario says so."""
        self._note(kind, pc, tick, self.cpu.stack_said() if kind in STACK_FAULTS else "")

    def _note(self, kind: int, pc: int, tick: int, detail: str) -> None:
        # RST, the supply and a shorted pin move pins as no firmware would: not its fault.
        if not self.forced and not (self.stuck and kind in _AT_PINS):
            self.fault_count += 1
            self.log.note(FAULT, tick, kind, pc)
            if len(self.faults) < FAULTS_KEPT:
                symbol = self.symbols.name_at(pc) if self.symbols is not None else ""
                self.faults.append(FirmwareFault(FaultKind(kind), tick, pc, symbol, detail))
            if self.stop_on_fault:
                self.cpu.request_stop()

    # ---- state --------------------------------------------------------------------------------------------

    def after_load(self) -> None:
        """Works out the latched HI levels and the bus at rest. Raises ValueError for a part at another time."""
        earliest_tick = self.cpu.cycles * CYCLE_TICKS - _BEHIND_TICKS
        self.left.check_times(earliest_tick)
        self.right.check_times(earliest_tick)
        latest_tick = earliest_tick + 2 * _BEHIND_TICKS + SAMPLE_TICKS
        # A plant far behind would take ages to catch up, and one far ahead would not move.
        next_tick = self.plant.next_tick
        if next_tick < earliest_tick or latest_tick < next_tick < NEVER_TICK:
            raise ValueError(f"the plant's next step is at tick {next_tick}, not about {earliest_tick}")
        ProcessorBoard.after_load(self)
        self._note_stuck()
        self.hi_seen[0] = self.left.hi
        self.hi_seen[1] = self.right.hi
        self.reset_pins = self.left.reset_level << 4 | self.right.reset_level << 9
        self.strobed = 0
        self._rest(self.left_timing, self.left)
        self._rest(self.right_timing, self.right)

    def _rest(self, timing: BusTiming, chip: Lm629) -> None:
        self.strobed |= chip.port.writing | chip.port.reading
        timing.rest(chip.port.writing, chip.port.reading, chip.port.ps, chip.port.data)

    def __repr__(self) -> str:
        return (
            f"Board({self.wiring.name}, cycle={self.cpu.cycles}, pc={self.cpu.pc:04X}h, "
            f"left={self.left!r}, right={self.right!r}, faults={self.fault_count})"
        )
