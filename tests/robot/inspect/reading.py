"""Reads a VCD back with pyvcd's reader, which shares no code with its writer."""

import io
from bisect import bisect_right
from dataclasses import dataclass, field

from vcd.reader import TokenKind, tokenize

Changes = list[tuple[int, int | str]]


@dataclass
class Vcd:
    """`wires`: per wire (its name without scopes) its changes as (tick, level), the first one its initial level."""

    wires: dict[str, Changes] = field(default_factory=dict)
    scopes: dict[str, str] = field(default_factory=dict)
    sizes: set[int] = field(default_factory=set)
    header: dict[str, object] = field(default_factory=dict)
    first_tick: int = 0
    last_tick: int = 0

    def until(self, end_tick):
        """What happened before a tick."""
        return {
            wire: [change for change in changes if change[0] < end_tick]
            for wire, changes in self.wires.items()
        }

    def level_at(self, wire, tick):
        changes = self.wires[wire]
        return changes[bisect_right(changes, tick, key=lambda change: change[0]) - 1][1]


def read(data):
    vcd = Vcd()
    names = {}
    scope = []
    tick = -1
    for token in tokenize(io.BytesIO(data)):
        if token.kind is TokenKind.SCOPE:
            scope.append(token.scope.ident)
        elif token.kind is TokenKind.UPSCOPE:
            scope.pop()
        elif token.kind is TokenKind.VAR:
            assert token.var.reference not in names.values(), "two wires of one name"
            assert token.var.id_code not in names, "two wires with one identifier, which sigrok cannot read"
            names[token.var.id_code] = token.var.reference
            vcd.scopes[token.var.reference] = ".".join(scope)
            vcd.sizes.add(token.var.size)
        elif token.kind is TokenKind.CHANGE_TIME:
            before, tick = tick, tick_of(token.time_change)
            assert tick > before, "time stamps repeat or go back"
            vcd.first_tick = tick if before < 0 else vcd.first_tick
            vcd.last_tick = tick
        elif token.kind is TokenKind.CHANGE_SCALAR:
            changes = vcd.wires.setdefault(names[token.scalar_change.id_code], [])
            level = token.scalar_change.value
            changes.append((tick, int(level) if level in "01" else level))
        elif token.kind in (TokenKind.DATE, TokenKind.TIMESCALE, TokenKind.COMMENT, TokenKind.VERSION):
            vcd.header[token.kind.name.lower()] = token.data
        else:
            assert token.kind in (TokenKind.ENDDEFINITIONS, TokenKind.DUMPVARS, TokenKind.END), token
    assert set(vcd.wires) == set(names.values()), "a wire has no initial level"
    return vcd


def tick_of(nanoseconds):
    """The one tick whose time, rounded down, is this."""
    tick = nanoseconds * 3 // 125
    while tick * 125 // 3 < nanoseconds:
        tick += 1
    assert tick * 125 // 3 == nanoseconds, f"{nanoseconds} ns is no tick"
    return tick
