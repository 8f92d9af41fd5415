"""A lower bound of an image's stack depth, from its code alone.

    reset ──► start-up ──► main ──► function ──► function        calls: 2 bytes each, PUSH, room for local variables
    interrupt ──► routine ──► function                           comes on top of wherever the others are

Each instruction that can be reached has the height of the stack above its function's entry, the largest of all ways
to it. What cannot be told from the code is named (`unknown`): jumps by a table, recursion, and SP set in a way that
SDCC does not use. So the result is a lower bound.
"""

from __future__ import annotations

from collections.abc import Iterator

import msgspec

from miro_robot.image import Image
from miro_robot.mcs51.opcodes import LENGTH, goes_on, is_call, is_conditional, target

_SP = 0x81
_RETI, _SJMP = 0x32, 0x80
JMP_TABLE = 0x73
_PUSH, _POP, _INC, _DEC, _MOV_DATA, _MOV_DIRECT = 0xC0, 0xD0, 0x05, 0x15, 0x75, 0x85
_ROOM = (0xE5, _SP, 0x24, -1, 0xF5, _SP)  # MOV A,SP; ADD A,#n; MOV SP,A
_FRAME = (0xE5, _SP, 0xF5, -1, 0x24, -1, 0xF5, _SP)  # with MOV bp,A after the first: the frame pointer is SP
_WRITES = {0x05, 0x15, 0x42, 0x43, 0x52, 0x53, 0x62, 0x63, 0x75, 0x85, 0xC5, 0xD0, 0xD5, 0xF5}
VECTORS = tuple(range(0x03, 0x2C, 8))
_CALL_BYTES = 2
_RAM_BYTES = 0x100
_LONGEST = 3  # bytes of an instruction
_TABLE_JUMPS = (0x02, _SJMP, *range(0x01, 0x100, 0x20))  # LJMP, SJMP and AJMP
_FIRST_OF_VECTORS = (0x02, _RETI, *range(0x01, 0x100, 0x20))  # others run into it from the vector before


class Depth(msgspec.Struct, frozen=True):
    """Bytes above a function's entry, by the deepest way: addresses of the functions on it, and what is unknown."""

    size: int
    path: tuple[int, ...]
    unknown: frozenset[str] = frozenset()


class StackDepth(msgspec.Struct, frozen=True):
    """`main`: from reset on; `interrupt`: the deepest routine, None where the image has none."""

    main: Depth
    interrupt: Depth | None

    @property
    def size(self) -> int:
        """Lower bound in bytes, with the deepest interrupt at the deepest place."""
        return self.main.size + (self.interrupt.size + _CALL_BYTES if self.interrupt else 0)

    @property
    def unknown(self) -> frozenset[str]:
        return self.main.unknown | (self.interrupt.unknown if self.interrupt else frozenset())


class _At(msgspec.Struct, frozen=True):
    """`height` above the entry; `frame`: the height that the frame pointer holds, -1 for none."""

    height: int
    frame: int = -1


class StackReader:
    """Reads depths from the code of an image. `heights(entry)`: instruction -> bytes above the function's entry."""

    def __init__(self, image: Image) -> None:
        self.code = image.code
        self.used = image.used
        self._known: dict[int, Depth] = {}
        self._under_way: list[int] = []

    def all(self) -> StackDepth:
        """The depth of the whole image."""
        begun = [at for at in VECTORS if self._loaded(at) and self.code[at] in _FIRST_OF_VECTORS]
        interrupts = [self.depth(at) for at in begun]
        deepest = max(interrupts, key=lambda depth: depth.size, default=None)
        return StackDepth(self.depth(0), deepest)

    def depth(self, entry: int) -> Depth:
        """The depth of the function at `entry`, with all its callees."""
        if entry in self._known:
            return self._known[entry]
        if entry in self._under_way:
            return Depth(0, (entry,), frozenset(("recursion",)))
        self._under_way.append(entry)
        best, unknown = Depth(0, (entry,)), set[str]()
        path: tuple[int, ...]
        heights, odd = self._walk(entry)
        unknown |= odd
        for address, height in heights.items():
            size, path = height, (entry,)
            to = target(self.code, address)
            if to is not None and is_call(self.code[address]):
                callee = self.depth(to)
                unknown |= callee.unknown
                size, path = height + _CALL_BYTES + callee.size, (entry, *callee.path)
            elif self.code[address] == _PUSH:
                size += 1
            if size > best.size:
                best = Depth(size, path)
        self._under_way.pop()
        depth = Depth(best.size, best.path, frozenset(unknown))
        if "recursion" not in unknown or not self._under_way:
            self._known[entry] = depth
        return depth

    def heights(self, entry: int) -> dict[int, int]:
        """Bytes above the entry, return address not counted, before each instruction of that function."""
        return self._walk(entry)[0]

    def _walk(self, entry: int) -> tuple[dict[int, int], set[str]]:
        reached: dict[int, _At] = {}
        unknown: set[str] = set()
        waiting = [(entry, _At(0))]
        while waiting:
            address, at = waiting.pop()
            if not self._loaded(address) or (address in reached and reached[address].height >= at.height):
                continue
            if at.height >= _RAM_BYTES:
                unknown.add("a loop that fills the stack")
                continue
            reached[address] = at
            size, after, odd = self._after(address, at)
            unknown |= odd
            if size > _LONGEST:  # several instructions, of which the last one moves SP
                reached.update(dict.fromkeys(range(address, address + size, 2), at))
            if self.code[address] == JMP_TABLE:
                unknown.add("a jump by a table")
            waiting += [(place, after) for place in self.successors(address, size)]
        return {address: at.height for address, at in reached.items()}, unknown

    def successors(self, address: int, size: int = 0) -> list[int]:
        """Addresses of the next instructions after one, or after `size` bytes; calls return."""
        opcode = self.code[address]
        size = size or LENGTH[opcode]
        following = [address + size] if goes_on(opcode) else []
        to = self._branch(address)
        following += [] if to is None else [to]
        return [*following, *self._table(address + size)] if opcode == JMP_TABLE else following

    def _table(self, address: int) -> Iterator[int]:
        """The jumps that follow JMP @A+DPTR one after the other, as SDCC writes a table."""
        while self._loaded(address) and self.code[address] in _TABLE_JUMPS:
            yield address
            address += LENGTH[self.code[address]]

    def _after(self, address: int, at: _At) -> tuple[int, _At, set[str]]:
        """Bytes of code consumed, the state after them, and unknown effects."""
        code = self.code[address : address + len(_FRAME)].ljust(len(_FRAME), b"\0")
        opcode, size, height = code[0], LENGTH[code[0]], at.height
        for form, frame in ((_ROOM, at.frame), (_FRAME, height)):
            if all(want in (-1, byte) for want, byte in zip(form, code, strict=False)):
                room = code[len(form) - 3]
                return len(form), _At(height + (room ^ 0x80) - 0x80, frame), set()
        if opcode == _MOV_DIRECT and code[1] == _SP:  # 85 source destination: the frame pointer is SP
            return size, _At(height, height), set()
        if opcode == _PUSH:
            return size, _At(height + 1, at.frame), set()
        if opcode == _POP and code[1] != _SP:
            return size, _At(height - 1, at.frame), set()
        if not (opcode in _WRITES and _SP in code[1:size]):
            return size, at, set()
        if opcode == _MOV_DATA:
            return size, _At(0), set()
        if opcode in (_INC, _DEC):
            return size, _At(height + (1 if opcode == _INC else -1), at.frame), set()
        if opcode == _MOV_DIRECT and at.frame >= 0:
            return size, _At(at.frame, at.frame), set()
        return size, at, {"SP set by a value that is not known"}

    def _branch(self, address: int) -> int | None:
        """Target of a jump; None for other instructions, and for calls."""
        opcode = self.code[address]
        if opcode == _SJMP or is_conditional(opcode):
            size = LENGTH[opcode]
            return (address + size + (self.code[address + size - 1] ^ 0x80) - 0x80) & 0xFFFF
        return None if is_call(opcode) else target(self.code, address)

    def _loaded(self, address: int) -> bool:
        return any(first <= address < end for first, end in self.used)
