"""The serial port in mode 0: a shift register clocked at fosc/12.

Registers and flags are the `Uart`'s.

Timing (4316E section 2.13, mode 0): one full cycle lies between the write that starts it and the first bit;
each bit takes one cycle, lowest first, sampled at S5P2; the shift clock on TXD is low from S3P1 to S6P1; TI
or RI goes up at S1P1 of the tenth cycle after the write. Data leave on RXD: `data` is what the chip drives
there.
"""

from __future__ import annotations

from miro_exact.clock import NEVER_TICK
from miro_exact.state import TICK
from miro_robot.mcs51.line import Line
from miro_robot.mcs51.uart import Uart

_REN, _TI, _RI = 0x10, 0x02, 0x01
_SAMPLE = 9  # S5P2
_CLOCK_FALLS, _CLOCK_RISES = 4, 10  # S3P1, S6P1


class Shift:
    """At most one byte on its way, out or in."""

    STATE = {
        "data": Line,
        "flag": ("i", 0, 2),
        "value": ("i", 0, 0xFF),
        "number": ("i", 0, 8),
        "cycle": TICK,
    }
    NOT_STATE = ("uart",)

    def __init__(self, uart: Uart) -> None:
        self.uart = uart
        self.data = Line()
        self.data.unread = True  # only ever asked for its level of now
        self._begin(0, 0, 0)

    def send(self, value: int, cycle: int) -> None:
        """SBUF was written at the end of the cycle before `cycle`."""
        self._begin(_TI, value, cycle + 1)

    def begin_reception(self, cycle: int) -> None:
        """SCON was written at the end of the cycle before `cycle`: REN without RI starts a reception."""
        if self.flag == 0 and self.uart.scon & _REN and not self.uart.scon & _RI:
            self._begin(_RI, 0, cycle + 1)

    def _begin(self, flag: int, value: int, cycle: int) -> None:
        self.flag = flag  # what its end sets: TI sending, RI receiving, 0 idle
        self.value = value
        self.number = 0  # bits done
        self.cycle = cycle  # of the next bit

    def sync(self, tick: int) -> None:
        """Everything below `tick`, which begins a cycle."""
        while self.flag and 12 * self.cycle < tick:
            if self.number == 8:
                self._finish()
            else:
                self._bit(12 * self.cycle)

    def _bit(self, tick: int) -> None:
        """Runs one bit cycle that begins at `tick`."""
        uart = self.uart
        if self.flag == _TI:
            self.data.append(tick, (self.value >> self.number) & 1)
        else:
            self.value |= uart.level(tick + _SAMPLE) << self.number
        if uart.latch & 2:
            uart.txd.append(tick + _CLOCK_FALLS, 0)
            uart.txd.append(tick + _CLOCK_RISES, 1)
        self.number += 1
        self.cycle += 1

    def _finish(self) -> None:
        tick = 12 * self.cycle
        flag = self.flag
        self.flag = 0
        self.data.append(tick, 1)
        if flag == _RI:
            self.uart.received = self.value
        self.uart.raise_flag(flag, tick)
        if flag == _TI:
            self.uart.bus.byte_sent(self.value, tick)

    def abort(self, tick: int) -> None:
        """Reset, or another mode, at `tick`: a byte on its way is lost."""
        self.flag = 0
        self.data.append(tick, 1)

    def levels_at(self, tick: int) -> int:
        """Shift clock (bit 1) and data (bit 0) that the register drives at `tick`, if nothing changes until then."""
        since = tick - 12 * (self.cycle - self.number)
        if self.flag == 0 or since >= 96:
            return 3
        if since < 0:  # a byte that another one cut off has left its level
            return 2 | self.data.level_at(tick)
        clock = 0 if _CLOCK_FALLS <= since % 12 < _CLOCK_RISES else 2
        return clock | (self.value >> since // 12 & 1 if self.flag == _TI else 1)

    def edge_after(self, tick: int) -> int:
        """A tick later than that before which neither changes, NEVER_TICK if they will not."""
        first = 12 * (self.cycle - self.number)
        if self.flag == 0 or tick >= first + 96:
            return NEVER_TICK
        if tick < first:
            return first
        phase = (tick - first) % 12
        if phase < _CLOCK_RISES:
            return tick - phase + (_CLOCK_FALLS if phase < _CLOCK_FALLS else _CLOCK_RISES)
        return tick - phase + 12

    def flag_tick(self) -> int:
        """Tick at which TI or RI goes up, NEVER_TICK when idle."""
        return 12 * (self.cycle + 8 - self.number) if self.flag else NEVER_TICK

    def check_times(self, cycle: int) -> None:
        """Raises ValueError unless the register continues at `cycle`."""
        if (self.flag and not cycle <= self.cycle <= cycle + 2) or self.data.last_tick() > 12 * cycle:
            raise ValueError(f"the shift register is not at cycle {cycle}")
