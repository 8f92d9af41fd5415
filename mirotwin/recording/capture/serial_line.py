"""Decodes characters (8N1) from the levels of wires; an unknown bit length is estimated from the edges."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from miro_exact.clock import TICKS_PER_SECOND
from miro_exact.inputs import InputError
from mirotwin.recording.capture.pieces import Facts, Piece, peeked

HEAD_CHANGES = 1 << 13
"""Changes of all wires from which the length of a bit is fitted."""
_SHORTEST = 8
"""Pulses of a wire that carries characters."""
_FRAME_BITS = 10
STANDARD_BAUDS = (
    *(300, 600, 1200, 2400, 4800, 9600, 14400, 19200, 28800, 38400, 57600, 76800, 115200, 230400, 250000),
    *(460800, 500000, 921600, 1000000),
)


class Change(NamedTuple):
    """Level of the wire `line` from `tick` on; the level before the first change is unknown."""

    tick: int
    line: int
    level: int


def standard_baud(baud: float) -> int:
    """The usual baud rate within 3 %, else 0."""
    return next((usual for usual in STANDARD_BAUDS if abs(baud / usual - 1) < 0.03), 0)


class _Wire:
    """The decoder of one wire."""

    def __init__(self, line: int, bit_ticks: float, idle: int) -> None:
        self.line = line
        self.bit_ticks = bit_ticks
        self.idle = idle
        self.level = idle
        self.start_tick = 0
        self.bit = -1  # under way: 0 start, 1 to 8 data, 9 stop; -1 none
        self.byte = 0

    def change(self, tick: int, level: int) -> Iterator[Piece]:
        """The characters that are over at `tick`, when the level changes."""
        yield from self.run_to(tick)
        fell = level != self.idle and self.level == self.idle
        self.level = level
        if self.bit < 0 and fell:
            self.start_tick, self.bit, self.byte = tick, 0, 0

    def run_to(self, tick: int) -> Iterator[Piece]:
        """Samples the level, which did not change since, to `tick`."""
        while self.bit >= 0 and self.start_tick + (self.bit + 0.5) * self.bit_ticks < tick:
            mark = self.level == self.idle
            if self.bit == 0 and mark:  # a spike
                self.bit = -1
            elif self.bit == _FRAME_BITS - 1:
                yield Piece(self.start_tick, "", bytes([self.byte]), self.line, not mark)
                self.bit = -1
            else:
                if self.bit:
                    self.byte |= mark << self.bit - 1
                self.bit += 1


def characters_of(changes: Iterator[Change], names: Sequence[str], facts: Facts) -> Iterator[Piece]:
    """The characters on the wires. Raises InputError where no wire carries any, or the requested one is not there."""
    lines = _requested(names, facts)
    wanted = (change for change in changes if change.line in lines)
    head, all_changes = peeked(wanted, HEAD_CHANGES)
    wires = _wires(head, names, facts)
    last_tick = head[-1].tick if head else 0
    for change in all_changes:
        last_tick = change.tick
        if change.line in wires:
            yield from wires[change.line].change(change.tick, change.level)
    for wire in wires.values():
        yield from wire.run_to(last_tick + round(_FRAME_BITS * wire.bit_ticks) + 1)


def _requested(names: Sequence[str], facts: Facts) -> set[int]:
    numbers = {name.lower(): number for number, name in enumerate(names)}
    for channel in facts.channels:
        if channel.lower() not in numbers:
            there = ", ".join(names[:16])
            raise InputError(facts.label, f"has no channel {channel!r}", f"there is {there}")
    return {numbers[channel.lower()] for channel in facts.channels} or set(range(len(names)))


def _wires(head: Sequence[Change], names: Sequence[str], facts: Facts) -> dict[int, _Wire]:
    wires: dict[int, _Wire] = {}
    for line in sorted({change.line for change in head}):
        own = [change for change in head if change.line == line]
        pulses = [after.tick - change.tick for change, after in pairwise(own)]
        bit_ticks = TICKS_PER_SECOND / facts.baud if facts.baud else fitted_bit(pulses[1:] or pulses)
        if not bit_ticks or len(own) < 2:
            continue
        wires[line] = _Wire(line, bit_ticks, _idle(own, bit_ticks))
        name = names[line]
        if not wires[line].idle:
            facts.tell(f"{facts.label}: {name} is low when idle: read as inverted")
        if not facts.baud:
            baud = TICKS_PER_SECOND / bit_ticks
            facts.tell(
                f"{facts.label}: {name}: {standard_baud(baud) or round(baud)} baud, fitted to its edges"
            )
        facts.spacing_ticks = round(_FRAME_BITS * bit_ticks)
    if not wires:
        there = f"no channel carries characters ({', '.join(names[:16])})" if names else "has no channel"
        remedy = "name the rate and the channel, --baud RATE --wire NAME" if names else "export a channel"
        raise InputError(facts.label, there, remedy)
    return wires


def _idle(own: Sequence[Change], bit_ticks: float) -> int:
    """The level of the longest pulse, if it is longer than any in a character; else the usual one."""
    length, level = max((after.tick - change.tick, change.level) for change, after in pairwise(own))
    return level if length > _FRAME_BITS * bit_ticks else 1


def fitted_bit(pulses: Sequence[int]) -> float:
    """Ticks of a bit of which the pulses of a character are multiples; 0 for too few pulses."""
    lengths = sorted(pulse for pulse in pulses if pulse > 0)
    if len(lengths) < _SHORTEST:
        return 0
    shortest = lengths[len(lengths) // 50]
    single = [length for length in lengths if 0.7 * shortest <= length <= 1.4 * shortest]
    bit = float(single[len(single) // 2])
    for most in (3.5, 9.5):
        near = [(length, round(length / bit)) for length in lengths if 0.6 * bit < length < most * bit]
        bit = sum(length * count for length, count in near) / sum(count * count for _, count in near)
    return bit
