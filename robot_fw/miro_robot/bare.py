"""A bare board for `mirotwin fw run`: the CPU, 64 KB of external RAM, a terminal on the serial port.

What belongs here: running an image to an address, a limit or its end, feeding its serial input, and dumping
its memory. The robot's board with its motion controllers is `board.py`.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from typing import Any

from miro_robot.faults import FaultKind, FirmwareFault
from miro_robot.image import Image
from miro_robot.mcs51.cpu import BREAKPOINT, Cpu
from miro_robot.mcs51.line import FAR
from miro_robot.mcs51.opcodes import jumps_to_itself
from miro_robot.mcs51.xram import XramBus
from miro_robot.saved import octets, wholes

CRYSTAL_HZ = 24_000_000
_SLICE = 200_000  # cycles between two looks at the world when nothing is to be fed
_LISTENING_SLICE = 1_000  # ... while input waits for somebody to listen
_POLLS = 32  # reads of P3 within such a slice that count as listening on RXD
_MARGIN_TICKS = 240  # the CPU may look this far beyond the end of a run
_FAULTS_KEPT = 100
_RI = 0x01
_EA, _SOURCES = 0x80, 0x3F  # of IE
_CHARACTER_BITS = 10


class Ended(StrEnum):
    """Why a run ended."""

    UNTIL = "until"  # the address asked for is next
    CYCLES = "cycles"  # the limit is reached
    FAULT = "fault"
    PAUSED = "paused"  # where the caller wanted to look; it can go on
    HALTED = "halted"  # nothing can ever make it go on: a jump to itself or asleep, with no interrupt to come


class BareMachine:
    """One AT89C52 with RAM and a terminal.

    `stdin` is sent to the serial port byte by byte: the first as soon as the receiver is on, or software
    polls P3 for a start bit; each next one when RI of the one before was cleared. The rate is the one the
    receiver is programmed for, or `baud`, which also serves a program that measures its first character.
    `output` gets the characters sent. With `code_in_xram`, program and data share one 64 KB space (EA low).
    """

    NOT_STATE = ("image", "loops", "output", "stop_on_fault")

    def __init__(
        self,
        image: Image,
        code_in_xram: bool = False,
        stdin: bytes = b"",
        baud: int | None = None,
        output: Callable[[bytes], object] | None = None,
        stop_on_fault: bool = True,
    ) -> None:
        if baud is not None and not 50 <= baud <= 750_000:
            raise ValueError(f"baud {baud} is outside 50..750000")
        self.image = image
        self.output = output
        self.stop_on_fault = stop_on_fault
        self.loops = _loops(image)
        self.faults: list[FirmwareFault] = []
        self.stdin = stdin
        self.baud = baud
        self.fed = 0  # bytes of stdin sent so far
        self.char_end = 0  # tick at which the last of them ends
        self.polls = 0  # reads of P3 seen so far
        self.next_feed = 0  # cycle at which to look after stdin
        self.next_check = 0  # ... and at which to ask whether the program has ended, which changes nothing
        self.ends: tuple[int, ...] = ()  # where it would end, if it came there before the next check
        self.bus = XramBus(self._sent, self._faulted)
        self.cpu = Cpu(self.bus)
        self.cpu.load(image.code, image.used)
        if code_in_xram:
            self.bus.fill(image.code)
            self.bus.code_of = self.cpu

    def run(
        self,
        until: int | None = None,
        max_cycles: int | None = None,
        progress: Callable[[int], object] | None = None,
        pause: int | None = None,
    ) -> Ended:
        """Until the instruction at `until` is next, or `cycles` >= `max_cycles`, or a fault.

        Without `max_cycles` a dead end (a jump to itself or idle mode that nothing can leave) ends it as well.
        `pause`: cycle at which to come back for the time being.

        `progress` is called with the cycle count every now and then.
        """
        limit = FAR if max_cycles is None else max_cycles
        stop = limit if pause is None else min(limit, pause)
        faults = len(self.faults)
        places = () if until is None else (until,)
        while self.cpu.cycles < stop:
            if self.cpu.cycles >= self.next_feed:
                self.next_feed = self._feed()
            if max_cycles is not None:
                reason = self.cpu.run_until_any(places, min(self.next_feed, stop))
            else:
                if self.cpu.cycles >= self.next_check:
                    if self.cpu.cycles and self.cpu.pc != until and self._halted():
                        return Ended.HALTED
                    self._expect_end()
                end = min(self.next_feed, self.next_check, stop)
                reason = self.cpu.run_until_any((*self.ends, *places), end)
            if reason == BREAKPOINT and self.cpu.pc == until:
                return Ended.UNTIL
            if reason == BREAKPOINT:
                self.cpu.step()
                self.next_check = self.cpu.cycles
            if self.stop_on_fault and len(self.faults) > faults:
                return Ended.FAULT
            if progress is not None:
                progress(self.cpu.cycles)
        return Ended.CYCLES if self.cpu.cycles >= limit else Ended.PAUSED

    def dump(self) -> dict[str, object]:
        """Registers and memories; SFRs by two hex digits, ports at their latches."""
        cpu = self.cpu
        return {
            "pc": cpu.pc,
            "cycles": cpu.cycles,
            "instructions": cpu.instructions,
            "iram_hex": bytes(cpu.peek_iram(address) for address in range(0x100)).hex(),
            "sfr": {f"{address:02x}": cpu.sfr(address) for address in range(0x80, 0x100)},
            "xram_hex": self.bus.content().hex(),
        }

    def _sent(self, value: int, tick: int) -> None:
        if self.output is not None:
            self.output(bytes([value]))

    def _faulted(self, kind: int, pc: int, tick: int) -> None:
        if len(self.faults) < _FAULTS_KEPT:
            symbol = self.image.symbols.name_at(pc)
            self.faults.append(FirmwareFault(FaultKind(kind), tick, pc, symbol))
        if self.stop_on_fault:
            self.cpu.request_stop()

    def _halted(self) -> bool:
        """Nothing is being sent or waits to be received, and no instruction will ever change a thing."""
        cpu = self.cpu
        unread = cpu.sfr(0x98) & _RI or not cpu.chip.bit_ticks()  # then no further character will be sent
        coming = self.fed < len(self.stdin) and not unread
        if coming or 12 * cpu.cycles < self.char_end or cpu.chip.uart.ti_tick() < FAR:
            return False
        if cpu.asleep():
            return True
        return not self._interruptible() and jumps_to_itself(cpu.code_at, cpu.pc)

    def _interruptible(self) -> bool:
        enabled = self.cpu.sfr(0xA8)
        return bool(enabled & _EA and enabled & _SOURCES)

    def _expect_end(self) -> None:
        """Finds out where the program might end, and when to ask again."""
        cpu = self.cpu
        self.ends = ()
        self.next_check = cpu.cycles + _SLICE
        if not self._interruptible():
            self.ends = tuple(place for place in self.loops if jumps_to_itself(cpu.code_at, place))
        if cpu.cycles and cpu.pc in self.ends:  # it is there already; what is being sent may end any time
            self.ends = ()
            self.next_check = cpu.cycles + _LISTENING_SLICE

    def _feed(self) -> int:
        """Puts the next character on RXD if it is time, and says how far to run now."""
        now = self.cpu.cycles
        rxd = self.cpu.rxd
        if self.fed == len(self.stdin):
            rxd.settled_tick = FAR
            return now + _SLICE
        if 12 * now >= self.char_end and self._listening():
            self._send(self.stdin[self.fed], 12 * now + _MARGIN_TICKS)
            self.fed += 1
        end = now + _LISTENING_SLICE
        rxd.settled_tick = 12 * end + _MARGIN_TICKS
        return end

    def _listening(self) -> bool:
        """Whether a character sent now would be heard: by the receiver with RI down, or by software
        polling.
        """
        reads = self.cpu.chip.p3_reads
        polling = reads - self.polls >= _POLLS
        self.polls = reads
        if self.cpu.chip.bit_ticks():
            return not self.cpu.sfr(0x98) & _RI
        return polling and self.baud is not None

    def _send(self, value: int, start: int) -> None:
        """Start bit, eight data bits, stop bit."""
        bits = value << 1 | 1 << (_CHARACTER_BITS - 1)
        for number in range(_CHARACTER_BITS):
            self.cpu.rxd.append(start + self._bit_offset(number), bits >> number & 1)
        self.char_end = start + self._bit_offset(_CHARACTER_BITS)

    def _bit_offset(self, number: int) -> int:
        """Ticks from the start of a character to its bit `number`."""
        if self.baud is None:
            return number * self.cpu.chip.bit_ticks()
        return (2 * number * CRYSTAL_HZ + self.baud) // (2 * self.baud)

    def snapshot(self) -> dict[str, object]:
        return {
            "cpu": self.cpu.snapshot(),
            "bus": self.bus.snapshot(),
            "loaded": bytes(self.cpu.is_loaded(address) for address in range(0x10000)),
            "faults": [(int(fault.kind), fault.tick, fault.pc) for fault in self.faults],
            "stdin": self.stdin,
            "baud": self.baud,
            "fed": self.fed,
            "char_end": self.char_end,
            "polls": self.polls,
            "next_feed": self.next_feed,
            "next_check": self.next_check,
            "ends": self.ends,
        }

    def restore(self, state: dict[str, Any]) -> None:
        self.bus.restore(state["bus"])
        self.cpu.load(self.image.code, ())
        code = self.bus.content() if self.bus.code_of is not None else self.image.code
        for address, loaded in enumerate(octets(state, "loaded", 0x10000)):
            if loaded:
                self.cpu.write_code(address, code[address])
        self.cpu.restore(state["cpu"])
        names = self.image.symbols
        self.faults = [
            FirmwareFault(FaultKind(k), tick, pc, names.name_at(pc)) for k, tick, pc in state["faults"]
        ]
        self.stdin = state["stdin"]
        self.baud = state["baud"]
        self.fed = state["fed"]
        self.char_end = state["char_end"]
        self.polls = state["polls"]
        self.next_feed = state["next_feed"]
        self.next_check = state["next_check"]
        self.ends = tuple(wholes(state, "ends", len(state["ends"]), 0, 0xFFFF))


def _loops(image: Image) -> tuple[int, ...]:
    """Loaded addresses at which a jump to itself stands, among them some in the middle of instructions."""
    return tuple(
        address
        for first, end in image.used
        for address in range(first, end)
        if jumps_to_itself(image.code.__getitem__, address)
    )
