"""Registers that one chip has beside those of the AT89C52: watchdogs, a second DPTR, STC's data flash.

   instruction -> peripherals, which lack the register -> `Bus.extra_read`, `extra_write` -> the board -> these
   these       -> `due_cycle`, `request_stop`          -> the board, which holds the processor, or resets it

The processor stands in a `pause`: while its data flash works (timers and serial port go on), or in the reset pulse of
the watchdog. Both begin between two instructions.

AT89S52 (Atmel 1919D: AUXR and AUXR1 in "Special Function Registers", "Watchdog Timer", "Dual Data Pointer Registers").
Its power-down is left by a reset alone here, as the AT89C52's.
STC89C52 (STC89C51RC/RD+ manual, as quoted by cnblogs.com/jikexianfeng/p/9051953.html, by
blog.csdn.net/weixin_33946020/article/details/86254096 and by sources that use it; the manual itself was not at hand).
"""

from __future__ import annotations

from miro_exact.clock import NEVER_TICK
from miro_exact.state import FLAG, TICK
from miro_robot.mcs51.chip import LAST_CYCLE, Chip

NO_PAUSE, FLASH_PAUSE, RESET_PAUSE = range(3)
_RESET_CYCLES = 9  # 98 periods of the crystal, up to the next whole cycle (1919D, "Using the WDT")
_DP1L, _DP1H = 0x84, 0x85
_P4, _WDT_CONTR, _AUXR, _AUXR1, _WDTRST, _IPH = 0xE8, 0xE1, 0x8E, 0xA2, 0xA6, 0xB7
_ISP_DATA, _ISP_ADDRH, _ISP_ADDRL, _ISP_CMD, _ISP_TRIG, _ISP_CONTR = range(0xE2, 0xE8)
_DPS, _GF2 = 0x01, 0x08  # of AUXR1
_WDIDLE, _AT_AUXR = 0x10, 0x19  # of the AT89S52's AUXR; with DISRTO and DISALE, whose pins no board has
_EXTRAM, _STC_AUXR = 0x02, 0x03  # of the STC89C52's AUXR, with ALEOFF
_AT_PERIOD = 16_383  # of a counter of 14 bits: "overflows when it reaches 16383"
_EN_WDT, _CLR_WDT, _IDLE_WDT, _WDT_FLAG, _PRESCALER = 0x20, 0x10, 0x08, 0x80, 0x07
_STC_COUNTS = 32_768  # of a counter behind the prescaler
_ISPEN, _SWRST, _WAIT = 0x80, 0x20, 0x03  # of ISP_CONTR; the longer waits of WT2 are not used by these chips
_READ, _PROGRAM, _ERASE = 1, 2, 3  # of ISP_CMD
_FLASH_AT, _FLASH_BYTES, _SECTOR_BYTES = 0x2000, 5120, 512
_WAITS = (43, 240, 43_769, 22, 120, 21_885, 11, 60, 10_942, 6, 30, 5_741)  # cycles, by WT and command


class ChipRegisters:
    """The common part of an AT89S52 and an STC89C52. `due_cycle`: cycle by which the board must call `due`."""

    STATE: dict[str, object] = {
        "auxr": ("i", 0, 0xFF),
        "auxr1": ("i", 0, 0xFF),
        "other_dptr": ("i", 0, 0xFFFF),
        "key": FLAG,
        "watching": FLAG,
        "fed": ("q", -LAST_CYCLE, LAST_CYCLE),
        "flash_cycles": TICK,
        "pause": ("i", 0, 2),
        "pause_end": ("q", 0, LAST_CYCLE),
    }
    NOT_STATE: tuple[str, ...] = ("cpu", "due_cycle", "bites", "first_bite", "last_bite")

    def __init__(self, cpu: Chip) -> None:
        self.cpu = cpu
        self.flash_cycles = 0  # in which the processor stood because of its data flash
        self.bites = 0  # resets by the watchdog, the tick of the first, the cycle of the last
        self.first_bite = 0
        self.last_bite = 0
        self.due_cycle = NEVER_TICK
        self.pause_end = 0
        self.clear()

    def clear(self) -> None:
        """A reset: all as after power-on, but memory."""
        self.auxr = 0
        self.auxr1 = 0
        self.other_dptr = 0
        self.key = 0  # the first of two bytes was written
        self.watching = 0
        self.fed = 0
        self.pause = NO_PAUSE
        self.due_cycle = NEVER_TICK

    def begin(self) -> None:
        """Resets to the state after power-on."""
        self.clear()

    def read(self, address: int) -> int:
        """A register, -1 if the chip has none there."""
        if address == _AUXR:
            return self.auxr
        return self.auxr1 if address == _AUXR1 else -1

    def write(self, address: int, value: int) -> int:
        """0 if the chip has no register there."""
        if address != _AUXR1:
            return 0
        if (value ^ self.auxr1) & _DPS:
            self.other_dptr, self.cpu.dptr = self.cpu.dptr, self.other_dptr
        self.auxr1 = value & self.auxr1_bits()
        return 1

    def auxr1_bits(self) -> int:
        """The bits of AUXR1 that exist."""
        return _DPS

    # Watchdog

    def counts_idle(self) -> int:
        """True if the watchdog counts while the processor sleeps in idle mode."""
        return 1

    def period(self) -> int:
        """Cycles after which a watchdog that is not fed resets the processor."""
        return _AT_PERIOD

    def count(self) -> int:
        """Cycles that the watchdog has counted since power-on."""
        cpu = self.cpu
        return cpu.cycles if self.counts_idle() else cpu.cycles - cpu.idle_cycles + self.flash_cycles

    def feed(self) -> None:
        self.watching = 1
        self.fed = self.count()
        self.plan()

    def plan(self) -> None:
        """Computes `due_cycle`; a run that continues beyond it ends after this instruction."""
        due = NEVER_TICK
        if self.pause:
            due = self.pause_end
        elif self.watching and not self.cpu.powered_down:  # the crystal stands, and with it the watchdog
            due = self.cpu.cycles + self.period() - (self.count() - self.fed)
        if due < self.due_cycle:
            self.cpu.request_stop()
        self.due_cycle = due

    def watches(self) -> int:
        """True if the watchdog will reset the processor though no interrupt wakes it."""
        return 1 if self.watching and (self.counts_idle() or not self.cpu.idle) else 0

    def due(self) -> int:
        """At `due_cycle`, between two instructions: 1 if a reset is to begin now, 2 if it is over."""
        cpu = self.cpu
        done = 0
        if self.pause:
            if cpu.cycles >= self.pause_end:
                done = self.end_pause()
        elif self.watching and not cpu.powered_down and self.count() - self.fed >= self.period():
            self.note_bite()
            done = 1
        self.plan()
        return done

    def note_bite(self) -> None:
        """Counts a reset by the watchdog once, also where a wait goes back and the run repeats it."""
        cycles = self.cpu.cycles
        if cycles > self.last_bite:
            self.first_bite = self.first_bite if self.bites else 12 * cycles
            self.last_bite = cycles
            self.bites += 1

    def end_pause(self) -> int:
        """2 after a reset; the data flash lets the processor go on."""
        if self.pause == FLASH_PAUSE:
            self.cpu.powered_down = 0
        done = 2 if self.pause == RESET_PAUSE else 0
        self.pause = NO_PAUSE
        return done

    def hold(self) -> None:
        """The processor is held in reset: all registers are as after one, until `due` says that it is over."""
        self.clear()
        self.pause = RESET_PAUSE
        self.pause_end = self.cpu.cycles + _RESET_CYCLES
        self.plan()

    def after_load(self) -> None:
        """Raises ValueError for a pause of a processor that does not stand."""
        if self.pause and not self.cpu.powered_down:
            raise ValueError("the processor pauses and does not stand")
        self.due_cycle = NEVER_TICK
        self.plan()


class At89s52Registers(ChipRegisters):
    """DP1 84h and 85h, AUXR 8Eh, AUXR1 A2h, WDTRST A6h. 82h and 83h reach the pointer that DPS selects."""

    def read(self, address: int) -> int:
        if address in (_DP1L, _DP1H):
            pointer = self.cpu.dptr if self.auxr1 & _DPS else self.other_dptr
            return pointer >> 8 if address == _DP1H else pointer & 0xFF
        return 0xFF if address == _WDTRST else ChipRegisters.read(self, address)  # WDTRST: write only

    def write(self, address: int, value: int) -> int:
        if address == _WDTRST:
            if value == 0xE1 and self.key:
                self.feed()
            self.key = 1 if value == 0x1E else 0
            return 1
        if address in (_DP1L, _DP1H):
            self.write_dp1(address, value)
            return 1
        if address == _AUXR:
            counted = self.count() - self.fed
            self.auxr = value & _AT_AUXR
            self.fed = self.count() - counted
            self.plan()
            return 1
        return ChipRegisters.write(self, address, value)

    def write_dp1(self, address: int, value: int) -> None:
        pointer = self.cpu.dptr if self.auxr1 & _DPS else self.other_dptr
        pointer = pointer & 0x00FF | value << 8 if address == _DP1H else pointer & 0xFF00 | value
        if self.auxr1 & _DPS:
            self.cpu.dptr = pointer
        else:
            self.other_dptr = pointer

    def counts_idle(self) -> int:
        return 0 if self.auxr & _WDIDLE else 1


class Stc89c52Registers(ChipRegisters):
    """AUXR 8Eh, AUXR1 A2h, IPH B7h (kept, without effect), WDT_CONTR E1h, ISP E2h to E7h, P4 E8h (no pins)."""

    STATE: dict[str, object] = {
        "wdt_contr": ("i", 0, 0xFF),
        "isp_data": ("i", 0, 0xFF),
        "isp_address": ("i", 0, 0xFFFF),
        "isp_cmd": ("i", 0, 0x07),
        "isp_contr": ("i", 0, 0xFF),
        "p4": ("i", 0, 0xFF),
        "iph": ("i", 0, 0xFF),
        "flash": f"{_FLASH_BYTES}B",
    }
    NOT_STATE: tuple[str, ...] = ("xram_bytes",)

    def __init__(self, cpu: Chip) -> None:
        self.xram_bytes = cpu.inner_xram  # while AUXR lets MOVX reach it
        self.flash = bytearray(_FLASH_BYTES)
        self.wdt_contr = 0
        for address in range(_FLASH_BYTES):
            self.flash[address] = 0xFF
        ChipRegisters.__init__(self, cpu)

    def clear(self) -> None:
        ChipRegisters.clear(self)
        self.wdt_contr &= _WDT_FLAG
        self.isp_data = 0xFF
        self.isp_address = 0
        self.isp_cmd = 0
        self.isp_contr = 0
        self.p4 = 0xFF
        self.iph = 0
        self.cpu.inner_xram = self.xram_bytes

    def begin(self) -> None:
        self.wdt_contr = 0
        self.clear()

    def read(self, address: int) -> int:
        if address == _WDT_CONTR:
            return self.wdt_contr
        if address == _P4:
            return self.p4
        if _ISP_DATA <= address <= _ISP_CONTR:
            high, low = self.isp_address >> 8, self.isp_address & 0xFF
            isp = (self.isp_data, high, low, self.isp_cmd, 0xFF, self.isp_contr)  # ISP_TRIG is write only
            return isp[address - _ISP_DATA]
        return self.iph if address == _IPH else ChipRegisters.read(self, address)

    def write(self, address: int, value: int) -> int:
        if address == _WDT_CONTR:
            self.write_watchdog(value)
        elif address == _P4:
            self.p4 = value
        elif _ISP_DATA <= address <= _ISP_CONTR:
            self.write_isp(address, value)
        elif address == _IPH:
            self.iph = value
        elif address == _AUXR:
            self.auxr = value & _STC_AUXR
            self.cpu.inner_xram = 0 if value & _EXTRAM else self.xram_bytes
        else:
            return ChipRegisters.write(self, address, value)
        return 1

    def auxr1_bits(self) -> int:
        return _DPS | _GF2

    # Watchdog

    def write_watchdog(self, value: int) -> None:
        """CLR_WDT clears itself; EN_WDT starts the counter at 0, or stops it."""
        counted = self.count() - self.fed
        self.wdt_contr = value & (0xFF ^ _CLR_WDT) & 0xBF
        if value & _CLR_WDT or not self.watching:
            counted = 0
        self.watching = 1 if value & _EN_WDT else 0
        self.fed = self.count() - counted
        self.plan()

    def counts_idle(self) -> int:
        return 1 if self.wdt_contr & _IDLE_WDT else 0

    def period(self) -> int:
        return _STC_COUNTS << ((self.wdt_contr & _PRESCALER) + 1)

    def hold(self) -> None:
        if not self.isp_contr & _SWRST:
            self.wdt_contr |= _WDT_FLAG
        ChipRegisters.hold(self)

    # Data flash

    def write_isp(self, address: int, value: int) -> None:
        if address == _ISP_DATA:
            self.isp_data = value
        elif address == _ISP_ADDRH:
            self.isp_address = self.isp_address & 0x00FF | value << 8
        elif address == _ISP_ADDRL:
            self.isp_address = self.isp_address & 0xFF00 | value
        elif address == _ISP_CMD:
            self.isp_cmd = value & 0x07
        elif address == _ISP_CONTR:
            self.isp_contr = value & 0xE7
            if (
                value & _SWRST
            ):  # after this instruction; SWBS changes nothing, for there is no monitor to start
                self.due_cycle = 0
                self.cpu.request_stop()
        else:
            if value == 0xB9 and self.key and self.isp_contr & _ISPEN:
                self.command(self.isp_address - _FLASH_AT)
            self.key = 1 if value == 0x46 else 0

    def due(self) -> int:
        return 1 if self.isp_contr & _SWRST else ChipRegisters.due(self)

    def command(self, at: int) -> None:
        """A command of ISP_CMD at a place of the data flash; outside of that none has an effect."""
        command = self.isp_cmd
        if not _READ <= command <= _ERASE or not 0 <= at < _FLASH_BYTES:
            return
        if command == _READ:
            self.isp_data = self.flash[at]
        elif command == _PROGRAM:
            self.flash[at] &= self.isp_data  # clears bits alone
        else:
            first = at - at % _SECTOR_BYTES
            for place in range(first, first + _SECTOR_BYTES):
                self.flash[place] = 0xFF
        cycles = _WAITS[3 * (self.isp_contr & _WAIT) + command - 1]
        self.flash_cycles += cycles
        self.pause = FLASH_PAUSE
        self.pause_end = self.cpu.cycles + cycles
        self.cpu.powered_down = 1  # the core alone: nothing is frozen
        self.plan()

    def after_load(self) -> None:
        self.cpu.inner_xram = 0 if self.auxr & _EXTRAM else self.xram_bytes
        ChipRegisters.after_load(self)
        if self.isp_contr & _SWRST:
            self.due_cycle = 0


def registers_of(chip: str, cpu: Chip) -> ChipRegisters | None:
    """The additional registers of a chip; None if it has none."""
    if chip == "at89s52":
        return At89s52Registers(cpu)
    return Stc89c52Registers(cpu) if chip == "stc89c52" else None
