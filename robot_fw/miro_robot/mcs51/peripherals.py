"""Everything on the chip beside the core, wired together: timers, serial port, interrupts, port pins.

   pins                    parts                   flags
   P3.2 P3.3  INT0 INT1 -> external interrupts --- IE0 IE1 ---+
   P3.2-P3.5  gates, T0 -> timers 0, 1 ----------- TF0 TF1 ---+--> interrupts --> LCALL of the core
   P1.0 P1.1  T2 T2EX ---> timer 2 --------------- TF2 EXF2 --+
                             | overflows of timers 1 and 2,   |
                             v or the crystal: 16x ticks      |
   P3.0 RXD -------------> serial port ----------- RI TI -----+
   P3.1 TXD <------------- (uart, shift)

Registers of the core itself (ACC, PSW, PCON ...) are in `Cpu`.

Timers and serial port are not stepped until one of them could raise a flag (`quiet`) or one of their registers is read
or written (`settle`). Letters are rules in README.md.
"""

from __future__ import annotations

from miro_exact.clock import NEVER_TICK
from miro_exact.state import FLAG, TICK
from miro_robot.mcs51.bus import Bus
from miro_robot.mcs51.interrupts import ExternalInterrupts, Interrupts
from miro_robot.mcs51.ports import Ports
from miro_robot.mcs51.shift import Shift
from miro_robot.mcs51.timer2 import Timer2
from miro_robot.mcs51.timers import Timers
from miro_robot.mcs51.uart import STOPPED_TICK, Uart

_P0 = 0x80
_TCON, _TMOD, _TL0, _TL1, _TH0, _TH1 = 0x88, 0x89, 0x8A, 0x8B, 0x8C, 0x8D
_SCON, _SBUF, _IE, _IP = 0x98, 0x99, 0xA8, 0xB8
_T2CON, _T2MOD, _RCAP2L, _RCAP2H, _TL2, _TH2 = 0xC8, 0xC9, 0xCA, 0xCB, 0xCC, 0xCD
_RCLK, _TCLK = 0x20, 0x10
_S5P2 = 9  # ticks into the cycle: pins are sampled, timer 1 overflows (U2)
_SERIAL, _TIMER2, _BOTH_TIMERS = 0x10, 0x20, 0x0A  # in IE
_REN, _SETTINGS, _RI_TI = 0x10, 0xF0, 0x03  # in SCON
_NO_PERIOD = 1 << 40  # of a clock that stands


class Peripherals:
    """All special function registers but the core's; time in machine cycles."""

    STATE = {
        "interrupts": Interrupts,
        "external": ExternalInterrupts,
        "timers": Timers,
        "timer2": Timer2,
        "uart": Uart,
        "shift": Shift,
        "ports": Ports,
        "smod": FLAG,
        "p1": ("i", 0, 0xFF),
        "p3": ("i", 0, 0xFF),
        "short1": ("i", 0, 0xFF),
        "short3": ("i", 0, 0xFF),
        "frozen": FLAG,
        "p3_reads": TICK,
    }
    NOT_HASHED = ("short1", "short3")  # a fault: what comes of it is hashed
    NOT_STATE = (
        "bus",
        "has_timer2",
        "observed",
        "written",
        "pulsed",
        "now",
        "timer_wait",
        "serial_wait",
        "quiet",
        "timer1_free",
        "listened",
    )
    """All but the first and the last, which is wiring, follow from the registers."""

    def __init__(self, bus: Bus) -> None:
        self.bus = bus
        self.interrupts = Interrupts()
        self.external = ExternalInterrupts(self.interrupts)
        self.timers = Timers(self.interrupts)
        self.timer2 = Timer2(self.interrupts)
        self.uart = Uart(bus, self.interrupts)
        self.shift = Shift(self.uart)
        self.ports = Ports()
        self.smod = 0
        self.p1 = 0xFF  # pins as last sampled, without shorts
        self.p3 = 0xFF
        self.short1 = 0  # bits that a short made another level of
        self.short3 = 0
        self.frozen = 0  # power-down: the oscillator stands
        self.written = 0  # cycle of the last write to P1 or P3, whose pins are sampled later
        self.pulsed = 0  # a timer that counts a pin clocks the serial port
        self.now = 0  # cycle below which everything has been done that can be noticed
        self.timer1_free = 0  # it clocks no direction of the serial port: writing timers does not touch that
        self.has_timer2 = 1
        self.observed = 0  # 1 while a register is read by no instruction
        self.listened = 0  # the bus wants to know of `outputs_changed`
        self.p3_reads = 0  # how often the pins of P3 were read: whether software listens on RXD itself
        self.look_again()

    def clear(self, cycle: int) -> None:
        """Reset: all registers but the port latches, which `Cpu` writes."""
        # First what was due before the reset; nothing is, if the oscillator stood.
        self.settle(cycle)
        self.frozen = 0
        self.now = cycle
        self.smod = 0
        self.interrupts.clear()
        self.external.levels = ((self.p3 ^ self.short3) >> 2) & 3  # pins moved on while the oscillator stood
        self.external.write(0, cycle)
        self.timers.clear(cycle)
        self.timer2.clear(cycle)
        self.uart.clear(cycle)
        self.shift.abort(12 * cycle)
        self.timers.set_gates(self.external.levels)
        self.timer2.up = ((self.p1 ^ self.short1) >> 1) & 1
        self.look_again()
        self._set_serial_clock()

    def freeze(self, cycle: int) -> None:
        """Nothing happens from `cycle` on, until `clear`."""
        self.settle(cycle)
        self.frozen = 1
        if self.listened:
            self.bus.outputs_changed(12 * cycle)

    # Time

    def look_again(self) -> None:
        """The next events of timers and serial port must be recomputed (-1)."""
        self.timer_wait = -1  # cycle up to which timers 0 and 1 raise no flag
        self.serial_wait = -1  # tick before which the serial port raises no flag
        self.quiet = -1  # cycle up to which nothing is due

    def sync(self, cycle: int) -> None:
        """Does everything that happens in cycles below `cycle` and that the core can notice."""
        if not self.frozen:
            self.now = cycle
            if cycle > self.quiet:
                self._catch_up(cycle)

    def _catch_up(self, cycle: int) -> None:
        """Something is due below `cycle`, or may be: first of all what pins did, in their own cycles."""
        if self.ports.next_cycle < cycle:
            # Not those of `cycle`: its pins are sampled when the core gets there.
            self.apply_pushes(cycle - 1)
            self.now = cycle
        if self.pulsed:
            self._sync_pulsed(cycle)
        else:
            if cycle > self.timer_wait:
                self.timers.sync(cycle)
                self.timer_wait = self.timers.next_flag(_BOTH_TIMERS)
            if not self.timer2.sleeps:
                self.timer2.sync(cycle)
            if 12 * cycle > self.serial_wait:
                self._settle_serial()
            self._note_quiet()

    def _note_quiet(self) -> None:
        """`timer_wait`, `serial_wait` or the first push is new, or timer 2 sleeps or wakes."""
        self.quiet = -1
        if self.timer2.sleeps and not self.pulsed:
            self.quiet = min(self.serial_wait // 12, self.timer_wait, self.ports.next_cycle)

    def settle(self, cycle: int) -> None:
        """Like `sync`, and also advances timers and serial port to `cycle`."""
        self.sync(cycle)
        if not self.frozen and not self.pulsed:
            self.timers.sync(self.now)
            self.timer2.sync(self.now)
            self._settle_serial()
        else:
            self.serial_wait = self.serial_tick()
        self._note_quiet()

    def _settle_serial(self) -> None:
        """The serial port alone, whose 16x ticks do not ask for the timers."""
        self.uart.sync(12 * self.now)
        if self.shift.flag:
            self.shift.sync(12 * self.now)
        self.serial_wait = self.serial_tick()

    def _sync_pulsed(self, cycle: int) -> None:
        """The serial port gets its 16x ticks one by one from the overflows of a timer that counts a pin."""
        pulse1 = self.timers.next_overflow(1) if self.timers.counts_pin(1) else NEVER_TICK
        pulse2 = self.timer2.next_pin_overflow()
        self.timers.sync(cycle)
        self.timer2.sync(cycle)
        # A counter is known one fall ahead, so there is at most one overflow of each timer here.
        first, second = min(pulse1, pulse2), max(pulse1, pulse2)
        if first < cycle:
            self._pulse(first == pulse1, first == pulse2, first)
        if second < cycle and second != first:
            self._pulse(second == pulse1, second == pulse2, second)
        self.uart.sync(12 * cycle)
        self.look_again()

    def _pulse(self, timer1: int, timer2: int, cycle: int) -> None:
        """Delivers one overflow of timer 1 and/or timer 2 in `cycle`."""
        # SMOD = 0 halves timer 1: every second overflow since the reset is a tick (U1).
        halved = timer1 and not self.smod and self.timers.overflows1 & 1
        ticks1 = 1 if timer1 and not halved else 0
        rx = timer2 if self.timer2.control & _RCLK else ticks1
        tx = timer2 if self.timer2.control & _TCLK else ticks1
        self.uart.pulse(rx, tx, 12 * cycle + _S5P2)

    def next_event(self, now: int) -> int:
        """The next cycle >= `now` at whose begin an interrupt may be due or a push takes effect, or NEVER_TICK.

        The flags of the serial port are waited for though a routine may hold their interrupt off: the bus is told.
        """
        event = min(self.interrupts.next_boundary(now), self.ports.next_cycle)
        if self.frozen:
            return event
        sources = self.interrupts.open()
        if sources & _BOTH_TIMERS:
            # Latched at S5P2 of its cycle, polled in the next, LCALL in the one after: + 2 (4316E section 2.16).
            event = min(event, self.timers.next_flag(sources) + 2)
        if sources & _TIMER2:
            event = min(event, self.timer2.next_flag() + 2)
        if self.interrupts.enabled() & _SERIAL:
            if self.serial_wait < 0:
                self.settle(self.now)
            if self.serial_wait < STOPPED_TICK:
                # S5P2 is tick 9 of a cycle: (tick + 2) // 12 is the first cycle whose S5P2 sees a flag of that tick.
                event = min(event, (self.serial_wait + 2) // 12 + 2)
        return event

    def serial_turn(self) -> int:
        """The first cycle in which more may be known of the next flag of the serial port, which is up to date."""
        tick = min(self.uart.turn_tick(), self.serial_wait)
        return tick // 12 + 1 if tick < STOPPED_TICK else NEVER_TICK

    def serial_tick(self) -> int:
        """A tick before which neither TI nor RI will go up."""
        return min(self.uart.ti_tick(), self.uart.ri_tick(), self.shift.flag_tick())

    def clock_serial(self) -> None:
        """Works out the serial port's 16x ticks again, after anything that they depend on has changed."""
        self.settle(self.now)
        self._set_serial_clock()
        if self.listened:
            self.bus.outputs_changed(12 * self.now)

    def _set_serial_clock(self) -> None:
        """With all parts at the same cycle."""
        self.look_again()
        mode = self.uart.mode()
        self._note_clocks(mode)
        if mode == 0:
            # Mode 0 shifts a bit a machine cycle and needs no 16x clock (shift.py).
            self.uart.set_clock(NEVER_TICK, 0, NEVER_TICK, 0)
            return
        next1 = 12 * self.timers.synced + 1  # mode 2: fosc/32 or fosc/64, in phase with the cycle (U8)
        period1 = 2 if self.smod else 4
        next2 = next1
        period2 = period1
        if mode != 2:
            next1 = self._timer1_tick()
            # Timer 1 counts machine cycles, and SMOD = 0 drops every second overflow (4316E section 2.13).
            period1 = 12 * self.timers.span(1) * (1 if self.smod else 2)
            next2 = self.timer2.next_overflow_tick()
            # As a baud rate generator timer 2 counts fosc / 2, not machine cycles (4316E section 2.12).
            period2 = 2 * self.timer2.span()
        rx2 = self.timer2.control & _RCLK
        tx2 = self.timer2.control & _TCLK
        self.uart.set_clock(
            next2 if rx2 else next1,
            period2 if rx2 else period1,
            next2 if tx2 else next1,
            period2 if tx2 else period1,
        )

    def _note_clocks(self, mode: int) -> None:
        """Sets the clock of the serial port: in modes 1 and 3 a timer, which may count a pin."""
        both = _RCLK | _TCLK
        self.timer1_free = 1 if self.timer2.control & both == both and mode & 1 else 0
        self.pulsed = self.timers.counts_pin(1) | self.timer2.counts_pin() if mode & 1 else 0

    def _timer1_tick(self) -> int:
        """The next overflow of timer 1 that is a 16x tick: with SMOD = 0 every second one since reset (U1)."""
        if self.timers.counts_pin(1):
            return NEVER_TICK
        cycle = self.timers.next_overflow(1)
        if cycle < NEVER_TICK and not self.smod and not self.timers.overflows1 & 1:
            cycle += self.timers.span(1)
        return 12 * cycle + _S5P2 if cycle < NEVER_TICK else NEVER_TICK

    # Pins

    def push(self, port: int, levels: int, tick: int) -> None:
        """The outside puts `levels` on the pins of `port` at `tick`."""
        self.ports.push(port, levels, tick)
        self.quiet = -1

    def apply_pushes(self, now: int) -> None:
        """Lets the outside's pushes up to cycle `now` take effect, each in its own cycle."""
        while self.ports.next_cycle <= now:
            cycle = self.ports.next_cycle
            self.ports.apply(cycle)
            self.sample_pins(cycle)

    def sample_pins(self, cycle: int) -> None:
        """S5P2 of `cycle`: what timers and interrupts see of P1 and P3."""
        ports = self.ports
        p1 = ports.pins(1)
        p3 = ports.pins(3)
        changed1 = p1 ^ self.p1 ^ self.short1
        changed3 = p3 ^ self.p3 ^ self.short3
        # Apart, for the digest: a short that no input notices must change nothing in it.
        self.p1 = ports.latches[1] & ports.outside[1]
        self.p3 = ports.latches[3] & ports.outside[3]
        self.short1 = p1 ^ self.p1
        self.short3 = p3 ^ self.p3
        # T2, T2EX; INT0, INT1, T0, T1. RXD is not among them: the serial port reads its wire between cycles too.
        if not self.frozen and (changed1 & 0x03 or changed3 & 0x3C):
            self._inputs_changed(changed1, changed3, cycle)

    def sample_latches(self, cycle: int) -> None:
        """Samples bits of P1 and P3 that nothing looks at: each write is seen in the cycle after it, not by `cycle`."""
        if self.written < cycle:
            ports = self.ports
            self.p1 = self.p1 & 0x03 | ports.latches[1] & ports.outside[1] & 0xFC
            self.p3 = self.p3 & 0x3F | ports.latches[3] & ports.outside[3] & 0xC0
            self.written = cycle

    def _inputs_changed(self, changed1: int, changed3: int, cycle: int) -> None:
        p1 = self.p1 ^ self.short1
        p3 = self.p3 ^ self.short3
        self.settle(cycle)
        for number in range(2):
            if (changed3 >> (2 + number)) & 1:
                self.external.sample(number, (p3 >> (2 + number)) & 1, cycle)
                self.settle(cycle + 1)
                self.timers.set_gates(self.external.levels)  # a gate acts on the cycle after the sample
            # Counter inputs count falls only (4316E section 2.9).
            if (changed3 >> (4 + number)) & 1 and not (p3 >> (4 + number)) & 1:
                self.timers.fall(number, cycle)
        if changed1 & 1 and not p1 & 1:
            self.timer2.fall(cycle)
        if changed1 & 2:
            self.settle(cycle + 1)
            self.timer2.sample_external((p1 >> 1) & 1)
        self.clock_serial()

    def pin_levels(self, port: int, cycle: int) -> int:
        """The pins of a port at S5P2 of `cycle`, alternate outputs included."""
        levels = self.ports.latches[port] & self.ports.outside[port]
        if port == 3:
            tick = 12 * cycle + _S5P2
            self.p3_reads += 1
            self.settle(cycle + 1)
            rxd = self.uart.level(tick) & self.shift.data.level_at(tick)
            # An alternate output is ANDed with the latch, so a 0 there blocks it (4316E section 2.5).
            levels &= 0xFC | rxd | (self.uart.tx_level << 1)
        elif port == 1 and self.timer2.drives_pin():
            self.settle(cycle + 1)
            levels &= 0xFE | self.timer2.clock_out
        return self.ports.shorted(port, levels)

    def output_at(self, output: int, tick: int) -> int:
        """TXD (0), the data of mode 0 on RXD (1) or the clock of timer 2 on T2 (2) at `tick`, latches left out.

        If nothing changes until then; not before what has been done. TXD of a port that a counter of pins clocks is 1.
        """
        if self.frozen:
            tick = 12 * self.now - 1
        if output == 2:
            return self.timer2.out_at(tick)
        shifted = self.shift.levels_at(tick)
        return shifted & 1 if output else shifted >> 1 & (1 if self.pulsed else self.uart.tx_at(tick))

    def output_after(self, output: int, tick: int) -> int:
        """A tick later than that before which an output does not change, if nothing else does."""
        if self.frozen:
            return NEVER_TICK
        if output == 2:
            return self.timer2.out_after(tick)
        edge = self.shift.edge_after(tick)
        if output == 0:
            edge = min(edge, NEVER_TICK if self.pulsed else self.uart.tx_after(tick))
        return edge

    # Registers

    def read(self, address: int, cycle: int) -> int:
        """A register (port: its latch) with everything below `cycle` done."""
        # 80h, 90h, A0h, B0h: the four ports.
        if address & 0xCF == 0x80:
            return self.ports.latches[(address - _P0) >> 4]
        self.sync(cycle)
        if address == _TCON:
            return self.timers.control | self.external.control
        if address == _SCON:
            return self.uart.scon  # up to date: its flags never wait
        if _TL0 <= address <= _TH1:
            if not self.frozen:
                self.timers.sync(cycle)
            return self.timers.read(address - _TL0)
        if address == _SBUF:
            return self.uart.received
        return self._read_rarely(address, cycle)

    def _read_rarely(self, address: int, cycle: int) -> int:
        """The registers that programs read less often."""
        if address == _IE:
            return self.interrupts.ie
        if address == _IP:
            return self.interrupts.ip
        if address == _TMOD:
            return self.timers.tmod
        if not self.has_timer2:
            return self.bus.extra_read(address)
        if address == _T2CON:
            return self.timer2.control
        if address == _T2MOD:
            return self.timer2.t2mod
        if address in (_RCAP2L, _RCAP2H):
            return (self.timer2.capture >> (8 * (address - _RCAP2L))) & 0xFF
        if address in (_TL2, _TH2):
            if not self.frozen:
                self.timer2.sync(cycle)
            return (self.timer2.count >> (8 * (address - _TL2))) & 0xFF
        return self.bus.extra_read(address)

    def write_bit(self, address: int, mask: int, level: int, cycle: int) -> int:
        """Like `write`, for one bit; the others keep values that hardware has set meanwhile."""
        self.sync(cycle)
        timers = address == _TCON  # what programs do most
        value = self.timers.control | self.external.control if timers else self.read(address, cycle)
        value = value | mask if level else value & (0xFF ^ mask)
        return self._write_timer(_TCON, value, cycle) if timers else self.write(address, value, cycle)

    def write(self, address: int, value: int, cycle: int) -> int:
        """A register that is no port; `cycle` is the first to see it. 0 if no event comes sooner by it."""
        self.sync(cycle)
        if _TCON <= address <= _TH1:
            return self._write_timer(address, value, cycle)
        if address == _SCON and self.uart.mode() != 0 and (value ^ self.uart.scon) & _SETTINGS == 0:
            # the serial port goes on as it was, and waits for what it waited for
            sooner = 1 if value & ~self.uart.scon & _RI_TI else 0
            self.uart.write_scon(value, cycle)
            return sooner
        if address == _IE:
            # Bit 6 of IE, and bits 7 and 6 of IP, do not exist and read 0 (C5).
            self.interrupts.ie = value & 0xBF
        elif address == _IP:
            self.interrupts.ip = value & 0x3F
        elif address != _SCON and address != _SBUF and not (self.has_timer2 and _T2CON <= address <= _TH2):
            self.bus.extra_write(address, value)  # it clocks nothing
            return 0
        else:
            self.settle(cycle)
            self.write_serial(address, value, cycle)
            self.clock_serial()
        return 1

    def _write_timer(self, address: int, value: int, cycle: int) -> int:
        """A register of timers 0 and 1. 0 if no event comes sooner by it."""
        if not self.timer1_free:
            self.settle(cycle)
        self.timers.sync(cycle)
        sooner = 0
        if address == _TCON:
            hastened = self.timers.write_control(value, cycle)
            if (value ^ self.external.control) & 0x0F:
                self.external.write(value, cycle)
                sooner = 1
        elif address == _TMOD:
            hastened = self.timers.write_mode(value)
        else:
            hastened = self.timers.write(address - _TL0, value)
        if hastened:
            self._note_timers()
        if not self.timer1_free:
            self.clock_serial()
            return 1
        return sooner | hastened & self.interrupts.open()

    def _note_timers(self) -> None:
        """A flag of timers 0 and 1 may come at another time."""
        self.timer_wait = self.timers.next_flag(_BOTH_TIMERS)
        self._note_quiet()

    def write_serial(self, address: int, value: int, cycle: int) -> None:
        """A register of the serial port or of timer 2, with both settled."""
        if address == _SCON:
            if (value ^ self.uart.scon) & 0xC0:
                self.shift.abort(12 * cycle)
            self.uart.write_scon(value, cycle)
            if self.uart.mode() == 0:
                self.shift.begin_reception(cycle)
        elif address == _SBUF:
            if self.uart.mode() == 0:
                self.shift.send(value, cycle)
            else:
                self.uart.write_sbuf(value)
        else:
            self._write_timer2(address, value, cycle)

    def _write_timer2(self, address: int, value: int, cycle: int) -> None:
        if address == _T2CON:
            self.timer2.write(value, self.timer2.t2mod, cycle)
        elif address == _T2MOD:
            self.timer2.write(self.timer2.control, value, cycle)
        elif address in (_RCAP2L, _RCAP2H):
            shift = 8 * (address - _RCAP2L)
            self.timer2.capture = self.timer2.capture & 0xFF00 >> shift | value << shift
        elif address in (_TL2, _TH2):
            shift = 8 * (address - _TL2)
            self.timer2.count = self.timer2.count & 0xFF00 >> shift | value << shift

    def bit_ticks(self) -> int:
        """Length of a bit that the receiver expects, 0 while it is off or its clock does not run regularly yet."""
        period = self.uart.rx_period
        if not self.uart.scon & _REN or self.uart.mode() == 0 or period >= _NO_PERIOD:
            return 0
        return 16 * period if self.uart.rx_next <= 12 * self.now + period else 0

    def write_smod(self, smod: int, cycle: int) -> None:
        self.settle(cycle)
        self.smod = smod
        self.clock_serial()

    def write_p3(self, value: int, cycle: int) -> None:
        """The latch of P3 is about to change: what of it concerns the serial port."""
        self.settle(cycle)
        self.uart.write_latch(value & 3, 12 * cycle)
        self.look_again()

    def taken(self, source: int, cycle: int) -> None:
        """The core vectors to a source: the flags that hardware clears."""
        self.interrupts.enter(source)
        if source == 0 or source == 2:
            self.external.taken(source >> 1, cycle)
        elif source == 1 or source == 3:
            self.timers.sync(cycle)
            self.timers.taken(source >> 1, cycle)
            self._note_timers()

    def after_load(self) -> None:
        """Time is where timer 0 is; whether a pin clocks the serial port follows from the modes."""
        self.now = self.timers.synced
        self.look_again()
        self._note_clocks(self.uart.mode())

    def check_times(self, cycle: int) -> None:
        """Raises ValueError unless all parts stand at `cycle`."""
        if self.timers.synced > cycle or self.timer2.synced > cycle:
            raise ValueError(f"timers are ahead of cycle {cycle}")
        if not self.frozen:
            self.uart.check_times(12 * cycle)
            self.shift.check_times(cycle)
