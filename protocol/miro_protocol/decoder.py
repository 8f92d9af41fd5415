"""Finds frames among received characters. Sans-IO: no port, no clock, no thread; characters in, events out.

After each character the window of the last F characters, sync to CRC, is tested by the rule in README.md ("Reception").
If it is a frame the window is emptied: hence the first undamaged frame after any garbage is taken. Every character
belongs to exactly one event: the `data` of all events, joined, are the characters fed. Cutting the input anywhere else
changes nothing.

The places of the last bad stop bit and of the last pause are kept, so those two tests are one comparison each; the CRC
is computed only for a window that begins with a sync, over the characters as received: whitening is taken off in the
same step. This takes at most F/2 table steps a character, on any input. The characters since the last event are kept,
at most `run_limit` + F - 1 of them.
"""

from __future__ import annotations

from collections.abc import Iterable

from miro_exact.clock import NEVER_TICK
from miro_exact.state import FLAG, TICK, Queue
from miro_protocol import crc
from miro_protocol.events import Damaged as Damaged
from miro_protocol.events import Event, Reason
from miro_protocol.events import Received as Received
from miro_protocol.table import SPACING_TICKS, SPACING_TOLERANCE_TICKS, TELEMETRY, Format, downlink
from miro_protocol.transmission import Transmission
from miro_protocol.whitening import STRING

Symbol = tuple[int, bool, int]
"""A received character: byte 0..255, stop bit good, tick of its start bit (24 MHz)."""

RUN_LIMIT = 4096  # a run of garbage is reported in pieces of so many characters, so that memory stays bounded
TICK_LIMIT = NEVER_TICK  # ticks beyond +- this are refused: they are 64-bit numbers here
REASONS = tuple(Reason)

_BAD_STOP = 1  # flaws of a character; these are C constants when compiled
_APART = 2  # ... does not follow its predecessor at the right distance
_FRAME = 1  # what a character completed
_RUN = 2
_NO_SYNC = 0  # the members of Reason
_BAD_STOP_BIT = 2
_BAD_SPACING = 3
_BAD_CRC = 4


class Scanner:
    """Decoder of one wire format. Counts `valid` frames and `rejected` windows: all good but the CRC.

    `tolerance_ticks` other than the standard's is for measuring what the spacing rule is worth.
    """

    STATE = {
        "valid": TICK,
        "rejected": TICK,
        "_data": Queue("B", 4160, "_count"),
        "_flaws": Queue("B", 4160, "_count", low=0, high=3),
        "_ticks": Queue("q", 4160, "_count", low=-NEVER_TICK, high=NEVER_TICK),
        "_reason": ("i", 0, len(REASONS) - 1),
        "_next_tick": ("q", -NEVER_TICK, NEVER_TICK),
        "_paused": FLAG,
    }
    NOT_STATE = (
        *("format", "_sync", "_white", "_lead", "_table", "_start", "_intact", "_size", "_step"),
        *("_spacing", "_tolerance", "_run_limit"),
        *("_count", "_last_bad", "_last_apart"),  # follow from _data and _flaws
        "body",  # of the last frame, without whitening
    )

    def __init__(
        self, form: Format, run_limit: int = RUN_LIMIT, tolerance_ticks: int = SPACING_TOLERANCE_TICKS
    ) -> None:
        if not 1 <= run_limit <= RUN_LIMIT:
            raise ValueError(f"run_limit = {run_limit}: must be 1..{RUN_LIMIT}")
        self.format = form
        self._sync = form.sync
        self._lead = form.lead
        self._white = STRING
        self._table = crc.table_of(8)
        # The CRC begins with the layout byte, which is not sent: a frame for 3 robots is none for 5.
        self._start = crc.register(bytes([form.layout]))
        # Over a whole frame with its CRC the register ends here, whatever the frame.
        self._intact = crc.residue()
        self._size = form.size
        self._step = form.character_ticks
        self._spacing = SPACING_TICKS
        self._tolerance = tolerance_ticks
        self._run_limit = run_limit
        # The characters not yet given out, side by side: byte, flaws, time. Room for a run and the window after it.
        self._data = bytearray(4160)
        self._flaws = bytearray(4160)
        self._ticks = [0] * 4160
        self.body = bytearray(64)
        self.begin()

    def __repr__(self) -> str:
        counts = f"{self.valid} valid, {self.rejected} rejected, {self._count} characters pending"
        return f"<decoder {self.format.name}: {counts}>"

    def begin(self) -> None:
        """Resets the decoder: nothing was received yet."""
        self.valid = 0
        self.rejected = 0
        self._clear()
        self._next_tick = 0  # where a character would start that follows at once
        self._paused = True

    def _clear(self) -> None:
        """Drops the characters that wait for their event."""
        self._count = 0
        self._last_bad = -1  # where the last bad stop bit is among them, and the last pause
        self._last_apart = -1
        self._reason = _NO_SYNC

    def take(self, byte: int, bad_stop: bool, tick: int) -> bool:
        """A character, without events: whether it completes a frame, whose HDR and payload then stand in `body`.

        For who judges millions of frames; `tick` is that of the start bit, below 2^62.
        """
        kind = self._put(byte, bad_stop, tick)
        if kind == _FRAME:
            self._read_body(self._count - self._size)
            self._clear()
        elif kind:
            self._give_out(kind, [])
        return kind == _FRAME

    @property
    def pending(self) -> int:
        """Characters fed that belong to no event yet."""
        return self._count

    def feed(self, data: bytes | bytearray, start_tick: int | None = None) -> list[Event]:
        """Characters that follow each other without a pause, with good stop bits.

        `start_tick` is the start bit of the first; without it they follow what came before. ValueError for
        a tick beyond +-2^62.
        """
        events: list[Event] = []
        tick = self._next_tick if start_tick is None else checked_tick(start_tick, 0)
        checked_tick(tick, len(data) * self._step)
        view = memoryview(data)
        for place in range(len(data)):
            kind = self._put(view[place], False, tick)
            if kind:
                self._give_out(kind, events)
            tick += self._step
        return events

    def hear(self, sent: Transmission) -> list[Event]:
        """The events that the characters of a transmission complete."""
        return self.feed_symbols(sent.symbols()) if sent.bad_stop else self.feed(sent.data, sent.tick)

    def feed_symbols(self, symbols: Iterable[Symbol]) -> list[Event]:
        """Characters with stop bit and time, as a UART and a timer deliver them."""
        events: list[Event] = []
        least, most = -TICK_LIMIT, TICK_LIMIT - self._step
        for byte, stop_good, start_tick in symbols:
            if not 0 <= byte <= 255:
                raise ValueError(f"character = {byte}: must be 0..255")
            if not least <= start_tick <= most:
                checked_tick(start_tick, self._step)
            tick = start_tick
            kind = self._put(byte, not stop_good, tick)
            if kind:
                self._give_out(kind, events)
        return events

    def gap(self) -> None:
        """The line paused for a character's time: what comes next does not follow what came before."""
        if not self._paused:
            self._next_tick += self._step
        self._paused = True

    def flush(self) -> list[Event]:
        """The input has ended: gives out what was pending. The decoder can then be fed again."""
        events: list[Event] = []
        if self._reason == _NO_SYNC:
            first = max(0, self._count - self._size + 1)
            if bytes(self._data[first : self._count]).find(self._sync) >= 0:
                self._reason = 1  # CUT_SHORT
        if self._count:
            self._give_out_damaged(self._count, events)
        self._reason = _NO_SYNC
        self.gap()
        return events

    def after_load(self) -> None:
        """Finds the last flaws again. Raises ValueError for more characters than can be pending."""
        if self._count > self._run_limit + self._size - 2:
            raise ValueError(
                f"{self._count} characters are pending, at most {self._run_limit + self._size - 2}"
            )
        self._last_bad = -1
        self._last_apart = -1
        for place in range(self._count):
            if self._flaws[place] & _BAD_STOP:
                self._last_bad = place
            if self._flaws[place] & _APART:
                self._last_apart = place

    def _is_apart(self, tick: int) -> bool:
        spacing = tick - self._next_tick + self._step
        return self._paused or abs(spacing - self._spacing) > self._tolerance

    def _put(self, byte: int, bad_stop: bool, tick: int) -> int:
        """Takes a character; says whether it completed a frame, or a run that is to be given out."""
        place = self._count
        self._data[place] = byte
        self._flaws[place] = 0
        self._ticks[place] = tick
        if bad_stop:
            self._flaws[place] = _BAD_STOP
            self._last_bad = place
        if self._is_apart(tick):
            self._flaws[place] |= _APART
            self._last_apart = place
        self._count = place + 1
        self._paused = False
        self._next_tick = tick + self._step
        start = self._count - self._size
        if start < 0:
            return 0
        if self._data[start] == self._sync[0] and self._data[start + 1] == self._sync[1]:
            reason = self._test(start)
            if reason == _NO_SYNC:
                self.valid += 1
                return _FRAME
            # Reasons are in the order of the tests: a run keeps that of the window which came nearest to a frame.
            if reason > self._reason:
                self._reason = reason
        # Only characters that no window reaches back to any more are given out.
        return _RUN if start + 1 == self._run_limit else 0

    def _test(self, start: int) -> int:
        """Why the window that starts there, with a sync, is no frame; 0 if it is one."""
        if self._last_bad >= start:
            return _BAD_STOP_BIT
        # Not >=: before its first character a frame may have a pause, only the F - 1 spacings inside count.
        if self._last_apart > start:
            return _BAD_SPACING
        register = self._start
        for place in range(self._size - 2):
            # Whitening begins with each frame's HDR, so it can be taken off before anything is known to be a frame.
            byte = self._data[start + 2 + place] ^ self._white[place]
            register = (register >> 8) ^ self._table[(register ^ byte) & 0xFF]
        if register == self._intact:
            return 0
        self.rejected += 1
        return _BAD_CRC

    def _give_out(self, kind: int, events: list[Event]) -> None:
        if kind == _RUN:
            self._give_out_damaged(self._run_limit, events)
            return
        sync = self._count - self._size
        start = self._lead_start(sync)
        end = self._count
        self._read_body(sync)
        body = bytes(self.body[: self._size - 4])
        frame = Received(bytes(self._data[start:end]), self._ticks[start], self._ticks[end - 1], body)
        if start > 0:
            self._give_out_damaged(start, events)
        events.append(frame)
        self._clear()

    def _read_body(self, sync: int) -> None:
        for place in range(self._size - 4):
            self.body[place] = self._data[sync + 2 + place] ^ self._white[place]

    def _lead_start(self, sync: int) -> int:
        """Begin of the preamble: its last intact characters right before the sync."""
        start = sync
        expected = len(self._lead) - 1
        while start > 0 and expected >= 0:
            if self._flaws[start] & _APART or self._flaws[start - 1] & _BAD_STOP:
                break
            if self._data[start - 1] != self._lead[expected]:
                break
            start -= 1
            expected -= 1
        return start

    def _give_out_damaged(self, length: int, events: list[Event]) -> None:
        """Drops the first `length` characters, which are no frame; the others move up."""
        events.append(Damaged(bytes(self._data[:length]), REASONS[self._reason], self._ticks[0]))
        self._reason = _NO_SYNC
        # What is left keeps its order: a frame may begin in the run that is given out.
        for place in range(length, self._count):
            self._data[place - length] = self._data[place]
            self._flaws[place - length] = self._flaws[place]
            self._ticks[place - length] = self._ticks[place]
        self._count -= length
        self._last_bad = max(-1, self._last_bad - length)
        self._last_apart = max(-1, self._last_apart - length)


class Decoder(Scanner):
    """Decodes the characters that a robot receives, in a network of `n` robots (3 or 5)."""

    def __init__(self, n: int) -> None:
        super().__init__(downlink(n))


class TelemetryDecoder(Scanner):
    """Decodes the characters that the host receives from its robots."""

    def __init__(self) -> None:
        super().__init__(TELEMETRY)


def checked_tick(tick: int, length: int) -> int:
    """`tick`, if it and `length` ticks later fit in 64 bits; else raises ValueError."""
    if not -TICK_LIMIT <= tick <= TICK_LIMIT - length:
        raise ValueError(f"tick = {tick}: must be {-TICK_LIMIT}..{TICK_LIMIT}, the last character included")
    return tick
