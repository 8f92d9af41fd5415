"""Every step of a CPU as a line: tick, address, place, instruction, and the registers and port pins that it changed."""

from __future__ import annotations

from collections.abc import Callable, Collection

from miro_exact.bad_input import amount
from miro_robot.inspect.symbol_names import SymbolNames
from miro_robot.inspect.watcher import Watcher
from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.opcodes import INTERRUPTS, disassemble

HEADING = f"{'tick':>12}  addr  {'place':<28}  {'instruction':<30}  changed registers"
_STATIC_KEPT = 65536
PORTS = {"P0": 0x80, "P1": 0x90, "P2": 0xA0, "P3": 0xB0}
REGISTERS = ("A", "B", "SP", "PSW", "DPTR", *(f"R{number}" for number in range(8)), *PORTS)


class InstructionTrace(Watcher):
    """Hands one line a step to `write`. `only`: first addresses of functions; others' steps are left out.

    `heading` is the first line, when it begins to look. The last stretch of sleep is written when it looks no longer.

    A register that an instruction left as it was is not named; R0 to R7 are those of the bank selected after it. A
    port shows what the program puts on its pins: `P1.3=0` for one pin that changed, `P1=5A` for several.
    """

    def __init__(
        self,
        names: SymbolNames,
        write: Callable[[str], object],
        only: Collection[int] | None = None,
        heading: str | None = None,
    ) -> None:
        self.names = names
        self.write = write
        self.only = only
        self.heading = heading
        self.code = bytearray()
        self.before: tuple[int, ...] = ()
        self.last = 0  # address of the last instruction: which went to sleep
        self.sleep = (0, 0)  # first cycle of the stretch of sleep to be written yet, and the one after it
        self.static: dict[bytes, str | None] = {}  # by address and code: the part that is always the same

    def attached(self, cpu: Cpu) -> None:
        self.code = bytearray(cpu.code)
        self.before = registers(cpu)
        self.last = cpu.pc
        if self.heading is not None:
            self.write(self.heading)

    def detached(self, cpu: Cpu) -> None:
        self._write_sleep()

    def executed(self, cpu: Cpu, pc: int, start: int) -> None:
        self._write_sleep()
        after = registers(cpu)
        self.last = pc
        code = bytes((pc >> 8, pc & 0xFF, cpu.code_at(pc), cpu.code_at(pc + 1), cpu.code_at(pc + 2)))
        if code not in self.static:
            if len(self.static) >= _STATIC_KEPT:  # a program that changes itself has no end of them
                self.static.clear()
            self.static[code] = self._static(cpu, pc)
        text = self.static[code]
        if text is not None:
            if after == self.before:
                self.write(f"{12 * start:>12}  {text}")
            else:
                self.write(f"{12 * start:>12}  {text:<66}  {_changed(self.before, after)}")
        self.before = after

    def interrupted(self, cpu: Cpu, source: int, pc: int, start: int) -> None:
        self._write_sleep()
        self.before = registers(cpu)
        if self.only is None or self.names.function(pc)[0] in self.only:
            text = f"-- interrupt: {INTERRUPTS[source]}, to {self.names.place(cpu.pc)}"
            self.write(f"{12 * start:>12}  {pc:04X}  {self.names.place(pc):<28}  {text}")

    def slept(self, cpu: Cpu, start: int, end: int) -> None:
        first, until = self.sleep
        self.sleep = (first if first < until == start else start, end)

    def _write_sleep(self) -> None:
        start, end = self.sleep
        self.sleep = (0, 0)
        if start < end and (self.only is None or self.names.function(self.last)[0] in self.only):
            self.write(f"{12 * start:>12}  {'':36}-- asleep for {amount(end - start, 'cycle')}")

    def _static(self, cpu: Cpu, pc: int) -> str | None:
        if self.only is not None and self.names.function(pc)[0] not in self.only:
            return None
        for address in range(pc, pc + 3):  # a program in RAM may have changed itself
            self.code[address & 0xFFFF] = cpu.code_at(address)
        return f"{pc:04X}  {self.names.place(pc):<28}  {disassemble(self.code, pc, self.names)}"


def registers(cpu: Cpu) -> tuple[int, ...]:
    """In the order of REGISTERS; ports at their latches."""
    bank = cpu.bank
    return (
        *(cpu.a, cpu.b, cpu.sp, cpu.psw(), cpu.dptr),
        *(cpu.peek_iram(bank + number) for number in range(8)),
        *(cpu.sfr(address) for address in PORTS.values()),
    )


def _changed(before: tuple[int, ...], after: tuple[int, ...]) -> str:
    each = zip(REGISTERS, before, after, strict=True)
    return " ".join(_change(name, old, value) for name, old, value in each if old != value)


def _change(name: str, old: int, value: int) -> str:
    changed = old ^ value
    if name in PORTS and changed & (changed - 1) == 0:
        pin = changed.bit_length() - 1
        return f"{name}.{pin}={value >> pin & 1}"
    return f"{name}={value:04X}" if name == "DPTR" else f"{name}={value:02X}"
