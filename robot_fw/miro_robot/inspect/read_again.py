"""The loop that reads a variable again until two values are equal: no interrupt can tear what it returns.

again:  MOV R6,x   MOV R7,x+1   MOV A,R6   CJNE A,x,again   MOV A,R7   CJNE A,x+1,again
"""

from __future__ import annotations

from collections import Counter

from miro_robot.inspect.data_flow import A, effect
from miro_robot.inspect.sanitizer_layout import XRAM
from miro_robot.mcs51.opcodes import LENGTH, ROW, target

_MOST, _BEFORE = 40, 8  # instructions of a loop; bytes of it before the first read
_CJNE, _XRL, _XRL_RN, _JZ, _JNZ = 0xB5, 0x65, 0x68, 0x60, 0x70
_JUMPS = (0x01, 0x02, 0x80)
_DPTR, _NEXT, _MOVX = 0x90, 0xA3, 0xE0
_GOES_ON = ("MOV", "MOVX", "INC", "CLR", "XRL")


def read_again(code: bytes, first: int, variable: range, bank: int = 0) -> range:
    """The instructions of such a loop whose first read is at `first`; none if there is no such loop."""
    held: dict[int, tuple[int, int]] = {}  # place -> byte of the variable, number of the read
    reads = Counter[int]()
    equal: set[int] = set()
    address, dptr, differs = first, variable.start - XRAM, -1

    def value(place: int) -> tuple[int, int] | None:
        if place not in variable:
            return held.get(place)
        reads[place] += 1
        return place, reads[place]

    def goes_back(to: int) -> bool:
        to = _to(code, to) if ROW[code[to]] in _JUMPS else to
        return first - _BEFORE <= to <= first

    for _ in range(_MOST):
        opcode, operand = code[address], code[(address + 1) & 0xFFFF]
        row, done = ROW[opcode], effect(code, address, bank)
        after = (address + LENGTH[opcode]) & 0xFFFF
        if row in (_CJNE, _XRL, _XRL_RN):
            left, right = held.get(A), value(bank + (opcode & 7) if row == _XRL_RN else operand)
            again = left is not None and right is not None and left[0] == right[0] and left[1] != right[1]
            differs = left[0] if again and left is not None else -1
        elif A in done.writes:
            differs = -1
        if row in (_CJNE, _JNZ, _JZ):
            if not goes_back(after if row == _JZ else _to(code, address)) or differs < 0:
                return range(0)
            equal.add(differs)
            if len(equal) == len(variable):
                return range(first, after)
            after = _to(code, address) if row == _JZ else after
        elif row in _JUMPS:
            after = _to(code, address)
        elif done.mnemonic not in _GOES_ON or any(place in variable for place in done.writes):
            return range(0)
        moved = {to: value(source) for to, source in done.moves}
        if row == _MOVX:
            moved[A] = value(XRAM + dptr)
        dptr = done.constant if row == _DPTR else dptr + (row == _NEXT)
        for place in done.writes:
            held.pop(place, None)
        held |= {place: known for place, known in moved.items() if known is not None}
        address = after
    return range(0)


def _to(code: bytes, address: int) -> int:
    """Target of the jump or branch at `address`."""
    absolute = target(code, address)
    after = address + LENGTH[code[address]]
    relative = code[(after - 1) & 0xFFFF]
    return (after + relative - (relative >> 7 << 8)) & 0xFFFF if absolute is None else absolute
