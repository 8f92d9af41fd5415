"""Finds frames among received characters. Sans-IO: no port, no clock, no thread; characters in, events out.

What belongs here: the sliding window. What does not: what a frame says (`frames.py`) and whether it is news
(`freshness.py`).

The rule (README.md, "Reception"): look at the last F characters, sync to CRC. If they start with the sync,
all stop bits are good, the F - 1 spacings are 1040 us +- 50 us and the CRC is good, they are a frame and
the window is emptied. Hence the first undamaged frame after any garbage is taken. Every character belongs
to exactly one event: the `data` of all events, joined, are the characters fed. Cutting the input anywhere
else changes nothing.

The window is looked at from its other end: wherever the sync stands, the F characters from there on are
tested once they are complete. That is the same rule, in linear time, because `bytes.find` passes over what
is no sync.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum
from typing import cast

from miro_protocol.crc import XOR_OUT, crc16, residue
from miro_protocol.frames import Message, decode_fields, layout_crc
from miro_protocol.table import (
    SEQ_MODULUS,
    SPACING_TICKS,
    SPACING_TOLERANCE_TICKS,
    TELEMETRY,
    Format,
    downlink,
)
from miro_protocol.whitening import whiten

Symbol = tuple[int, bool, int]
"""A received character: byte 0..255, stop bit good, tick of its start bit (24 MHz)."""

INTACT = residue() ^ XOR_OUT  # CRC over HDR, payload and their own CRC
RUN_LIMIT = 4096  # a run of garbage is reported in pieces of so many characters, so that memory stays bounded


class Reason(IntEnum):
    """Why a run of characters is no frame: the furthest that any window starting in it got."""

    NO_SYNC = 0
    CUT_SHORT = 1  # a sync, but the input ended before the frame did
    BAD_STOP_BIT = 2
    BAD_SPACING = 3
    BAD_CRC = 4


@dataclass(frozen=True, slots=True)
class Received:
    """A valid frame. `data` are its characters with the preamble found right before it."""

    data: bytes
    start_tick: int
    """Start bit of data[0]."""
    last_tick: int
    """Start bit of the last character."""
    body: bytes
    """HDR and payload in clear."""

    @property
    def type(self) -> int:
        return self.body[0] // SEQ_MODULUS

    @property
    def seq(self) -> int:
        return self.body[0] % SEQ_MODULUS

    def message(self, n: int) -> Message:
        """What the frame says, in a network of `n` robots; ContentError if that is nothing known."""
        return decode_fields(self.body, n)


@dataclass(frozen=True, slots=True)
class Damaged:
    """A run of characters between frames, preambles of damaged frames included."""

    data: bytes
    reason: Reason
    start_tick: int


Event = Received | Damaged


class WindowDecoder:
    """Decoder of one wire format. Counts `valid` frames and `rejected` windows: all good but the CRC."""

    NOT_STATE = ("format", "_start")

    def __init__(self, form: Format) -> None:
        self.format = form
        self.valid = 0
        self.rejected = 0
        self._start = layout_crc(form)
        # The characters not yet given out, side by side: byte, flaws, time.
        self._data = bytearray()
        self._bad_stop = bytearray()
        self._apart = bytearray()  # 1 = does not follow its predecessor at the right distance
        self._ticks = array("q")
        self._scan = 0  # the first of them at which no window was tested yet
        self._reason = Reason.NO_SYNC
        self._next_tick = 0  # where a character would start that follows at once
        self._paused = True

    def __repr__(self) -> str:
        counts = f"{self.valid} valid, {self.rejected} rejected, {len(self._data)} characters pending"
        return f"<decoder {self.format.name}: {counts}>"

    def feed(self, data: bytes | bytearray, start_tick: int | None = None) -> list[Event]:
        """Characters that follow each other without a pause, with good stop bits.

        `start_tick` is the start bit of the first; without it they follow what came before.
        """
        if not data:
            return []
        step = self.format.character_ticks
        if start_tick is None:
            first, apart = self._next_tick, self._paused
        else:
            first, apart = start_tick, self._is_apart(start_tick)
        self._paused = False
        self._next_tick = first + step * len(data)
        self._ticks.extend(range(first, self._next_tick, step))
        self._data += data
        self._bad_stop += bytes(len(data))
        self._apart.append(apart)
        self._apart += bytes(len(data) - 1)
        return self._events()

    def feed_symbols(self, symbols: Iterable[Symbol]) -> list[Event]:
        """Characters with stop bit and time, as a UART and a timer deliver them."""
        step = self.format.character_ticks
        for byte, stop_good, tick in symbols:
            self._data.append(byte)
            self._bad_stop.append(not stop_good)
            self._apart.append(self._is_apart(tick))
            self._ticks.append(tick)
            self._paused = False
            self._next_tick = tick + step
        return self._events()

    def gap(self) -> None:
        """The line paused for a character's time: what comes next does not follow what came before."""
        if not self._paused:
            self._next_tick += self.format.character_ticks
        self._paused = True

    def flush(self) -> list[Event]:
        """The input has ended: gives out what was pending. The decoder can then be fed again."""
        events: list[Event] = []
        if self._data.find(self.format.sync, self._scan) >= 0:
            self._reason = max(self._reason, Reason.CUT_SHORT)
        if self._data:
            self._give_out_damaged(0, len(self._data), events)
        self._drop(len(self._data))
        self.gap()
        return events

    def snapshot(self) -> dict[str, object]:
        """All that decides what comes next; the same however the input was cut."""
        return {
            "valid": self.valid,
            "rejected": self.rejected,
            "_data": bytes(self._data),
            "_bad_stop": bytes(self._bad_stop),
            "_apart": bytes(self._apart),
            "_ticks": tuple(self._ticks),
            "_scan": self._scan,
            "_reason": int(self._reason),
            "_next_tick": self._next_tick,
            "_paused": self._paused,
        }

    def restore(self, state: dict[str, object]) -> None:
        self.valid = cast(int, state["valid"])
        self.rejected = cast(int, state["rejected"])
        self._data = bytearray(cast(bytes, state["_data"]))
        self._bad_stop = bytearray(cast(bytes, state["_bad_stop"]))
        self._apart = bytearray(cast(bytes, state["_apart"]))
        self._ticks = array("q", cast("tuple[int, ...]", state["_ticks"]))
        self._scan = cast(int, state["_scan"])
        self._reason = Reason(cast(int, state["_reason"]))
        self._next_tick = cast(int, state["_next_tick"])
        self._paused = cast(bool, state["_paused"])

    def _is_apart(self, tick: int) -> bool:
        spacing = tick - self._next_tick + self.format.character_ticks
        return self._paused or abs(spacing - SPACING_TICKS) > SPACING_TOLERANCE_TICKS

    def _events(self) -> list[Event]:
        """Tests every window that is complete and was not tested before."""
        events: list[Event] = []
        data, sync, size = self._data, self.format.sync, self.format.size
        head, scan = 0, self._scan
        while (start := data.find(sync, scan)) >= 0 and start + size <= len(data):
            head = self._shorten_run(head, start, events)
            reason, body = self._test(start)
            if reason is None:
                self._give_out_frame(head, start, body, events)
                head = scan = start + size
            else:
                self._reason = max(self._reason, reason)
                scan = start + 1
        # Nothing can start before an incomplete window, or before a last character that may be half a sync.
        self._scan = start if start >= 0 else max(scan, len(data) - 1)
        self._drop(self._shorten_run(head, len(data) - size + 1, events))
        return events

    def _test(self, start: int) -> tuple[Reason | None, bytes]:
        end = start + self.format.size
        if self._bad_stop.find(1, start, end) >= 0:
            return Reason.BAD_STOP_BIT, b""
        if self._apart.find(1, start + 1, end) >= 0:
            return Reason.BAD_SPACING, b""
        clear = whiten(self._data[start + len(self.format.sync) : end])
        if crc16(clear, self._start) != INTACT:
            self.rejected += 1
            return Reason.BAD_CRC, b""
        self.valid += 1
        return None, clear[:-2]

    def _give_out_frame(self, head: int, sync: int, body: bytes, events: list[Event]) -> None:
        start = self._lead_start(head, sync)
        if start > head:
            self._give_out_damaged(head, start, events)
        end = sync + self.format.size
        events.append(Received(bytes(self._data[start:end]), self._ticks[start], self._ticks[end - 1], body))

    def _lead_start(self, head: int, sync: int) -> int:
        """Where the preamble begins: as many of its last characters as stand intact right before the sync."""
        start = sync
        for expected in reversed(self.format.lead):
            before = start - 1
            intact = before >= head and not self._apart[start] and not self._bad_stop[before]
            if not intact or self._data[before] != expected:
                break
            start = before
        return start

    def _shorten_run(self, head: int, limit: int, events: list[Event]) -> int:
        """Gives out pieces of RUN_LIMIT as long as they end by `limit`; returns the new head."""
        while limit - head >= RUN_LIMIT:
            self._give_out_damaged(head, head + RUN_LIMIT, events)
            head += RUN_LIMIT
        return head

    def _give_out_damaged(self, head: int, end: int, events: list[Event]) -> None:
        events.append(Damaged(bytes(self._data[head:end]), self._reason, self._ticks[head]))
        self._reason = Reason.NO_SYNC

    def _drop(self, count: int) -> None:
        del self._data[:count], self._bad_stop[:count], self._apart[:count], self._ticks[:count]
        self._scan = max(0, self._scan - count)


class Decoder(WindowDecoder):
    """What a robot hears, in a network of `n` robots (3 or 5)."""

    def __init__(self, n: int) -> None:
        super().__init__(downlink(n))


class TelemetryDecoder(WindowDecoder):
    """What the host hears from its robots."""

    def __init__(self) -> None:
        super().__init__(TELEMETRY)
