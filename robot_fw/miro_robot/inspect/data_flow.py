"""The origin of the values in a function's registers before each of its instructions, and their later uses.

    entry ──► MOV R7,DPL ──► PUSH AR7 ──► LCALL ──► POP AR7 ──► ..     R7 holds what DPL held at the entry, up to the
                                                                       next instruction that writes it otherwise
Places are direct addresses: R0 to R7 of the function's bank, A, B, DPL, DPH. A call may write what its callee writes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import reduce

import msgspec

from miro_robot.inspect.stack_depth import JMP_TABLE, StackReader
from miro_robot.mcs51.opcodes import LENGTH, ROW, SFRS, TABLE, byte_of_bit, is_call, target

A, B, DPL, DPH, SP = SFRS["ACC"], SFRS["B"], SFRS["DPL"], SFRS["DPH"], SFRS["SP"]
ENTRY = -1
"""Instead of an instruction: the function's caller."""
Origin = tuple[int, int]
"""(instruction, place that it wrote)."""
Held = dict[int, frozenset[Origin]]
_MOST_ORIGINS = 8
_ANY: frozenset[Origin] = frozenset({(-2, -1)})
"""Unknown origin."""
_OPERANDS = {row[0]: (row[3], row[4].split(",")) for row in TABLE}
_COPIES, _CHANGES_NOTHING = ("MOV", "XCH", "PUSH", "POP"), ("CJNE", "JZ", "JNZ", "JB", "JNB", "PUSH", "JMP")


class Effect(msgspec.Struct, frozen=True):
    """Effect of an instruction on places. `moves`: (to, from); `writes`: all places written, including moves.

    `constant`: its immediate number, which may be an address; -1 for none.
    """

    mnemonic: str
    reads: frozenset[int]
    writes: frozenset[int]
    moves: tuple[tuple[int, int], ...] = ()
    constant: int = -1


def effect(code: bytes, address: int, bank: int) -> Effect:
    """The effect of the instruction there, with R0 as the first register of `bank` (0, 8, 16, 24).

    Calls are not followed.
    """
    opcode, first, second = (code[(address + at) & 0xFFFF] for at in range(3))
    mnemonic, words = _OPERANDS[ROW[opcode]]
    places: dict[str, tuple[int, ...]] = {
        "A": (A,), "AB": (A, B), "DPTR": (DPL, DPH), "@DPTR": (), "dir": (first,), "src": (first,), "dst": (second,),
        "Rn": (bank + (opcode & 7),), "bit": (byte_of_bit(first),), "/bit": (byte_of_bit(first),),
    }  # fmt: skip
    reads = {place for word in words for place in places.get(word, ())}
    to = places.get(words[0], ())
    writes = set() if mnemonic in _CHANGES_NOTHING else set(to)
    moves: tuple[tuple[int, int], ...] = ()
    if mnemonic in ("MOV", "MOVX", "MOVC", "CLR", "POP") and "bit" not in words:
        reads -= set(to)  # it is replaced
        source = places.get(words[-1], ()) if mnemonic == "MOV" else ()
        reads |= set(source)
        moves = tuple(zip(to, source, strict=False))
    # XCH A,@Ri swaps with a place that is not known here: only A is written, from anywhere.
    elif mnemonic == "XCH" and words[1] != "@Ri":
        here, other = to[0], places[words[1]][0]
        writes, moves = {here, other}, ((here, other), (other, here))
    # The pointer is read, also where what it points to is written.
    through = "".join(word for word in words if "@" in word)
    reads |= {bank + (opcode & 1)} if "Ri" in through else {DPL, DPH} if "DPTR" in through else set()
    reads |= {A} if "A+" in through else set()
    constant = {"#imm16": first << 8 | second, "#imm": first if LENGTH[opcode] == 2 else second}.get(
        words[-1], -1
    )
    return Effect(mnemonic, frozenset(reads), frozenset(writes), moves, constant)


class Callees:
    """The places that functions may write, including their callees. `code` as in an image."""

    def __init__(self, reader: StackReader) -> None:
        self.reader = reader
        self._known: dict[tuple[int, int], tuple[set[int], list[int]]] = {}

    def writes(self, entry: int, bank: int) -> frozenset[int]:
        """Places that the function at `entry` may write; all registers if its code is not understood."""
        entries = _reached([entry], lambda called: self._own(called, bank)[1])
        return frozenset[int]().union(*(self._own(called, bank)[0] for called in entries))

    def _own(self, entry: int, bank: int) -> tuple[set[int], list[int]]:
        """Places that it writes itself, and the entries of its callees."""
        if (entry, bank) not in self._known:
            code, written, called = self.reader.code, set[int](), []
            reached = self.reader.heights(entry)
            # A jump table may lead anywhere: then nothing survives the call.
            if not reached or any(code[address] == JMP_TABLE for address in reached):
                written |= set(places_of(bank))
            for address in reached:
                written |= effect(code, address, bank).writes
                to = target(code, address) if is_call(code[address]) else None
                called += [] if to is None else [to]
            self._known[entry, bank] = written, called
        return self._known[entry, bank]


def places_of(bank: int) -> tuple[int, ...]:
    """The places that are followed."""
    return (*range(bank, bank + 8), A, B, DPL, DPH)


class Flow:
    """Data flow of the function at `entry` with the registers of `bank`.

    `held`: instruction -> origins of the values in its places; `live`: instruction -> places that are read before they
    are written.
    """

    def __init__(self, callees: Callees, entry: int, bank: int) -> None:
        self.places = places_of(bank)
        reader = callees.reader
        reached = reader.heights(entry)
        self.effects = {address: effect(reader.code, address, bank) for address in reached}
        for address, does in self.effects.items():
            to = target(reader.code, address) if is_call(reader.code[address]) else None
            if to is not None:  # arguments may be in any of these; SP comes back as it was
                called = Effect(does.mnemonic, frozenset((A, B, DPL, DPH)), callees.writes(to, bank) - {SP})
                # In place of LCALL's own: only then do the registers after a call hold what the callee left.
                self.effects[address] = called
        self.after = {
            address: [to for to in reader.successors(address) if to in reached] for address in reached
        }
        self.before: dict[int, list[int]] = {address: [] for address in reached}
        for address, others in self.after.items():
            for other in others:
                self.before[other].append(address)
        self.held = self._forward(entry)
        self.live = self._backward()

    def leads_to(self, addresses: Iterable[int]) -> set[int]:
        """The instructions from which one of these can be reached, these too."""
        known = (address for address in addresses if address in self.before)
        return _reached(known, self.before.__getitem__)

    def reached_without(self, entry: int, addresses: Iterable[int]) -> set[int]:
        """The instructions that can be reached from the entry before one of these has been executed."""
        stops = set(addresses)
        return _reached([entry], lambda address: () if address in stops else self.after[address])

    def _forward(self, entry: int) -> dict[int, Held]:
        start = {place: frozenset({(ENTRY, place)}) for place in self.places}
        known: dict[int, tuple[Held, tuple[frozenset[Origin], ...]]] = {}
        waiting: list[tuple[int, Held, tuple[frozenset[Origin], ...]]] = [(entry, start, ())]
        while waiting:
            address, held, stack = waiting.pop()
            # A second way to it: each place may hold what either way brought. Sets only grow, so this ends.
            if address in known:
                old, old_stack = known[address]
                held = {place: _either(old[place], held[place]) for place in self.places}
                depth = min(len(old_stack), len(stack))  # their tops are alike
                pairs = zip(old_stack[len(old_stack) - depth :], stack[len(stack) - depth :], strict=True)
                stack = tuple(_either(here, other) for here, other in pairs)
                # Nothing new to hand on: without this a loop would never end.
                if (held, stack) == (old, old_stack):
                    continue
            known[address] = held, stack
            held, stack = self._executed(address, held, stack)
            waiting += [(to, held, stack) for to in self.after[address]]
        return {address: held for address, (held, _) in known.items()}

    def _executed(
        self, address: int, held: Held, stack: tuple[frozenset[Origin], ...]
    ) -> tuple[Held, tuple[frozenset[Origin], ...]]:
        does, after = self.effects[address], dict(held)
        for place in does.writes & after.keys():
            after[place] = frozenset({(address, place)})
        for to, source in does.moves:
            if to in after:
                # From a place that is not followed (RAM, a port): the value begins here.
                after[to] = held.get(source) or frozenset({(address, to)})
        if does.mnemonic == "PUSH":
            (source,) = does.reads
            stack = (*stack, held.get(source, _ANY))
        elif does.mnemonic == "POP":
            (to,) = does.writes
            if to in after:
                # Popped below the entry: it is of the caller, or the stack was set by hand.
                after[to] = stack[-1] if stack else _ANY
            stack = stack[:-1]
        elif SP in does.writes:
            # SP was written: what a later POP gives cannot be told.
            stack = ()
        return after, stack

    def _backward(self) -> dict[int, frozenset[int]]:
        live = {address: does.reads for address, does in self.effects.items()}
        waiting = list(live)
        while waiting:
            address = waiting.pop()
            does = self.effects[address]
            later = reduce(frozenset.union, (live[to] for to in self.after[address]), frozenset[int]())
            needed = does.reads | (later - does.writes)
            if needed != live[address]:
                live[address] = needed
                waiting += self.before[address]
        return live


def _reached(first: Iterable[int], after: Callable[[int], Iterable[int]]) -> set[int]:
    """All places reachable from `first`, including these."""
    reached, waiting = set[int](), [*first]
    while waiting:
        place = waiting.pop()
        if place not in reached:
            reached.add(place)
            waiting += after(place)
    return reached


def _either(here: frozenset[Origin], other: frozenset[Origin]) -> frozenset[Origin]:
    both = here | other
    # Bounded, and `_ANY` absorbs: else a table of cases would make each step cost all of them.
    return _ANY if len(both) > _MOST_ORIGINS or both >= _ANY else both
