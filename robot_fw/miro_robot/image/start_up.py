"""Finds the stack's first address in an image's start-up code: `MOV SP,#data` on the way from the reset vector.

Jumps are followed, loops are left, calls return: start-up code clears RAM and sets SP before it calls anything that
uses the stack. If an image also writes SP in another way, it may have several stacks (tasks, frames), and no address is
returned.
"""

from __future__ import annotations

from functools import lru_cache

from miro_robot.mcs51.opcodes import LENGTH, ROW, goes_on, is_call, target

_MOST_INSTRUCTIONS = 256
_SP = 0x81
_MOV_DATA, _MOV_DIR, _SJMP = 0x75, 0x85, 0x80
_WRITES = (  # of a direct address in their second byte
    *(0xF5, 0x86, 0x88, 0xD0, 0xC5, 0xD5),  # MOV dir,A; MOV dir,@Ri; MOV dir,Rn; POP; XCH; DJNZ
    *(0x42, 0x43, 0x52, 0x53, 0x62, 0x63),  # ORL, ANL, XRL
)


@lru_cache(32)
def stack_set_up(code: bytes, used: tuple[tuple[int, int], ...]) -> tuple[int, int] | None:
    """(address of the instruction, what it puts into SP); None where none was found, or not the only one."""
    address = 0
    for _ in range(_MOST_INSTRUCTIONS):
        opcode, first, second = (code[(address + offset) & 0xFFFF] for offset in range(3))
        if opcode == _MOV_DATA and first == _SP:
            return (address, second) if second < 0xFF and not _written_elsewhere(code, used, second) else None
        jump = target(code, address) if not is_call(opcode) else None
        if opcode == _SJMP:
            jump = address + 2 + (first ^ 0x80) - 0x80
        if jump is None and not goes_on(opcode):
            return None
        address = (address + LENGTH[opcode] if jump is None else jump) & 0xFFFF
    return None


def _written_elsewhere(code: bytes, used: tuple[tuple[int, int], ...], value: int) -> bool:
    """True if an instruction gives SP anything else, going by the instructions from the begin of each range on."""
    for first, end in used:
        address = first
        while address < end:
            opcode, low, high = (code[(address + offset) & 0xFFFF] for offset in range(3))
            if low == _SP and (ROW[opcode] in _WRITES or (opcode == _MOV_DATA and high != value)):
                return True
            if opcode == _MOV_DIR and high == _SP:
                return True
            address += LENGTH[opcode]
    return False
