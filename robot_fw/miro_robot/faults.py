"""The kinds of firmware fault, and the record of one.

CPU, LM629 and board detect them; the scenario defines if a fault stops the run.
"""

from __future__ import annotations

from enum import IntEnum

import msgspec


class FaultKind(IntEnum):
    """Numbers are part of recordings: append, never renumber."""

    UNDEFINED_OPCODE = 1
    STACK_OVERFLOW = 2
    STACK_UNDERFLOW = 3
    OUTSIDE_IMAGE = 4
    BUS_CONTENTION = 5
    LM629_BUSY = 6
    LM629_TIMING = 7
    MAIN_LOOP_STARVED = 8
    INTERRUPT_NOT_LEFT = 9
    NET_CONTENTION = 10
    MOVX_WITHOUT_STROBE = 11


STACK_FAULTS = (FaultKind.STACK_OVERFLOW, FaultKind.STACK_UNDERFLOW)

DESCRIPTIONS = {
    FaultKind.UNDEFINED_OPCODE: "executed the undefined opcode A5",
    FaultKind.STACK_OVERFLOW: "ran past the end of its stack",
    FaultKind.STACK_UNDERFLOW: "went below the start of its stack",
    FaultKind.OUTSIDE_IMAGE: "executed outside the loaded image",
    FaultKind.BUS_CONTENTION: "read two LM629 at once: both drove the data bus",
    FaultKind.LM629_BUSY: "wrote to an LM629 while it was busy",
    FaultKind.LM629_TIMING: "violated an LM629 bus timing limit",
    FaultKind.MAIN_LOOP_STARVED: "starved its main loop: interrupts took all of 10 ms",
    FaultKind.INTERRUPT_NOT_LEFT: "ended an interrupt routine with RET, not RETI (its level stays blocked)",
    FaultKind.NET_CONTENTION: "let two outputs of different level drive one net",
    FaultKind.MOVX_WITHOUT_STROBE: "used MOVX while P3.6 or P3.7 was latched low: no strobe, nothing happened",
}


class FirmwareFault(msgspec.Struct, frozen=True):
    """One fault: kind, tick of 24 MHz, address of the instruction, symbol around it ("" if unknown).

    `detail`: further text for people, such as an amount.
    """

    kind: FaultKind
    tick: int
    pc: int
    symbol: str = ""
    detail: str = ""

    def __str__(self) -> str:
        place = f"{self.pc:#06x}" + (f" in {self.symbol}" if self.symbol else "")
        more = f" ({self.detail})" if self.detail else ""
        return f"firmware {DESCRIPTIONS[self.kind]}{more} at {place}, tick {self.tick}"
