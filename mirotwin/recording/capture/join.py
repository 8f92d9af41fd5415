"""Joins pieces of a capture to transmissions: times near 0, consecutive characters joined, in the order of time.

Like a receiver, this module takes characters 1040 +- 50 us apart as consecutive, with the step of the file's times
added to the tolerance. A character that would begin before the end of the previous one, because times are coarse or the
sender is faster than the line, is placed right behind it.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from itertools import pairwise
from statistics import median

from miro_exact.bad_input import BadInput
from miro_exact.clock import TICKS_PER_SECOND
from miro_exact.inputs import InputError
from miro_protocol.stream_line import MAX_TICK
from miro_protocol.table import BITS_PER_CHARACTER, SPACING_TICKS, SPACING_TOLERANCE_TICKS
from miro_protocol.transmission import Transmission, character_ticks
from mirotwin.recording.capture.pieces import Facts, Piece, peeked
from mirotwin.recording.capture.serial_line import standard_baud

FAR_TICKS = 10 * TICKS_PER_SECOND
"""A capture that begins later than this is moved by whole seconds."""
LONGEST = 1 << 12
"""Longest transmission in characters; the rest continues in the next."""
_HEAD = 512
_USUAL_BAUD = 9600
_TOLD_TICKS = TICKS_PER_SECOND // 100


class _Open:
    """A transmission that may continue. `next_tick`: expected tick of its next character at the sender's rate."""

    def __init__(self, piece: Piece, tick: int) -> None:
        self.direction = piece.direction
        self.network = piece.line
        self.step = character_ticks(self.direction)
        self.tick = tick
        self.next_tick = tick
        self.data = bytearray()
        self.bad_stop: list[int] = []

    @property
    def end_tick(self) -> int:
        return self.tick + len(self.data) * self.step

    def append(self, piece: Piece, tick: int, spacing_ticks: int) -> None:
        if piece.bad_stop:
            self.bad_stop += range(len(self.data), len(self.data) + len(piece.data))
        self.data += piece.data
        self.next_tick = tick + len(piece.data) * spacing_ticks

    def closed(self) -> Transmission:
        return Transmission(self.tick, self.direction, bytes(self.data), self.network, tuple(self.bad_stop))


class Joiner:
    """Joins the pieces of one capture."""

    def __init__(self, pieces: Iterator[Piece], facts: Facts) -> None:
        self.facts = facts
        self._pieces = pieces
        self._open: dict[tuple[int, str], _Open] = {}
        self._done: list[tuple[int, int, Transmission]] = []
        self._count = 0
        self._late_ticks = 0
        self._usual = True

    def transmissions(self) -> Iterator[Transmission]:
        """In the order of time. What cannot be read raises after all before it was given."""
        failure: BadInput | None = None
        try:
            for piece in self._prepared():
                self._take(piece)
                yield from self._ready()
        except BadInput as error:
            failure = error
        for group in self._open.values():
            self._push(group.closed())
        self._open = {}
        yield from self._ready()
        if self._usual and self._late_ticks > _TOLD_TICKS + self.facts.resolution_ticks:
            late_ms = self._late_ticks * 1000 / TICKS_PER_SECOND
            reason = f"characters come faster than the line takes them: up to {late_ms:.0f} ms late"
            self.facts.tell(f"{self.facts.label}: {reason}")
        self.facts.tell_passed_over(bool(self._count or failure))
        if failure is not None:
            raise failure

    def _prepared(self) -> Iterator[Piece]:
        """The pieces with times near 0; they are held until the sender's rate is known from the first of them."""
        head, pieces = peeked(self._pieces, _HEAD, lambda piece: len(piece.data) == 1)
        facts = self.facts
        facts.spacing_ticks = facts.spacing_ticks or (
            BITS_PER_CHARACTER * TICKS_PER_SECOND // facts.baud if facts.baud else fitted_spacing(head)
        )
        baud = BITS_PER_CHARACTER * TICKS_PER_SECOND / (facts.spacing_ticks or SPACING_TICKS)
        self._usual = abs(baud / _USUAL_BAUD - 1) < 0.05
        if not self._usual:
            sent = (
                f"a sender at {standard_baud(baud) or round(baud)} baud, the robots' line has {_USUAL_BAUD}"
            )
            facts.tell(
                f"{facts.label}: {sent}: each transmission begins at its time and takes that of the line"
            )
        first = head[0].tick or 0 if head else 0
        if first >= FAR_TICKS or first < 0:
            facts.offset_s = first // TICKS_PER_SECOND
            facts.tell(f"{facts.label}: {moved_by(facts.offset_s)}")
        offset = facts.offset_s * TICKS_PER_SECOND
        for piece in pieces:
            if piece.tick is not None and abs(piece.tick - offset) > MAX_TICK:
                reason = f"a time of {piece.tick / TICKS_PER_SECOND:g} s"
                remedy = "copy the file again, or name another form with --from-form"
                raise InputError(facts.label, reason, remedy)
            yield (
                piece._replace(tick=max(0, piece.tick - offset))
                if offset and piece.tick is not None
                else piece
            )

    def _take(self, piece: Piece) -> None:
        if not piece.data:
            return
        key = (piece.line, piece.direction)
        group = self._open.get(key)
        tick = piece.tick
        spacing = self.facts.spacing_ticks or (character_ticks(group.direction) if group else SPACING_TICKS)
        if group is not None and self._follows(group, tick, spacing):
            if tick is None:
                tick = group.next_tick
            self._late_ticks = max(self._late_ticks, group.end_tick - tick)
            if len(group.data) >= LONGEST:
                self._push(group.closed())
                group = self._open[key] = _Open(piece, group.end_tick)
            group.append(piece, tick, spacing)
            return
        tick = tick or 0
        if group is not None:
            self._push(self._open.pop(key).closed())
        for other, late in [*self._open.items()]:
            if tick > late.end_tick + 2 * late.step + self.facts.resolution_ticks:
                self._push(self._open.pop(other).closed())
        group = self._open[key] = _Open(piece, tick)
        group.append(piece, tick, spacing)

    def _follows(self, group: _Open, tick: int | None, spacing: int) -> bool:
        if tick is None:
            return True
        if tick < group.tick:  # goes back: another session, or an unsorted capture
            return group.tick - tick <= self.facts.resolution_ticks
        tolerance = SPACING_TOLERANCE_TICKS * spacing // SPACING_TICKS + self.facts.resolution_ticks
        return tick < group.end_tick or abs(tick - group.next_tick) <= tolerance

    def _push(self, sent: Transmission) -> None:
        heapq.heappush(self._done, (sent.tick, self._count, sent))
        self._count += 1

    def _ready(self) -> Iterator[Transmission]:
        """The transmissions before which no further one can come."""
        first = min((group.tick for group in self._open.values()), default=None)
        while self._done and (first is None or self._done[0][0] <= first):
            yield heapq.heappop(self._done)[-1]


def moved_by(offset_s: int) -> str:
    """The words for times that were moved."""
    return f"times are moved by {-offset_s} s, to begin near 0"


def fitted_spacing(head: list[Piece]) -> int:
    """Ticks between the start bits of single characters of a sender at another usual baud rate; 0 for the line's."""
    by_line: dict[tuple[int, str], list[int]] = {}
    for piece in head:
        if len(piece.data) == 1 and piece.tick is not None:
            by_line.setdefault((piece.line, piece.direction), []).append(piece.tick)
    spacings = sorted(
        after - tick for ticks in by_line.values() for tick, after in pairwise(ticks) if after > tick
    )
    if len(spacings) < 8:
        return 0
    shortest = spacings[len(spacings) // 20]
    spacing = round(median(ticks for ticks in spacings if ticks <= shortest * 1.3))
    if abs(spacing - SPACING_TICKS) <= SPACING_TOLERANCE_TICKS:
        return 0
    return spacing if standard_baud(BITS_PER_CHARACTER * TICKS_PER_SECOND / spacing) else 0
