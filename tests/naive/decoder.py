"""The reception rule read aloud: after every character, look at the last F of them. Quadratic and obvious.

Nothing of the decoder under test is used but the event types; CRC and whitening are the bitwise twins.
"""

from miro_protocol.decoder import Damaged, Reason, Received
from tests.naive.crc import crc16, pn9

SYNC = b"\x2d\xd4"
WHITE = pn9(31)


class NaiveDecoder:
    """Windows of `size`, `layout` first in the CRC, `lead` before the sync, garbage cut at `run_limit`."""

    def __init__(self, size, layout, lead, run_limit):
        self.size, self.layout, self.lead, self.run_limit = size, layout, lead, run_limit
        self.run = []  # (byte, stop good, tick, pause before it) since the last event
        self.events = []
        self.rejected = 0
        self.last_tick = None

    def character(self, byte, stop_good, tick, after_gap=False):
        spacing = 0 if self.last_tick is None else tick - self.last_tick
        apart = after_gap or not 990 * 24 <= spacing <= 1090 * 24
        self.last_tick = tick
        self.run.append((byte, stop_good, tick, apart))
        verdict = self.verdict(len(self.run) - self.size)
        if verdict is None:
            self.frame()
            return
        if verdict == Reason.BAD_CRC:
            self.rejected += 1
        if len(self.run) == self.run_limit + self.size - 1:
            self.damaged(self.run_limit)

    def verdict(self, start):
        """Of the window that starts there: None for a frame, else why not."""
        window = self.run[max(start, 0) : max(start, 0) + self.size]
        data = bytes(byte for byte, *_ in window)
        if start < 0 or data[:2] != SYNC:
            return Reason.NO_SYNC
        if len(window) < self.size:
            return Reason.CUT_SHORT
        if not all(stop_good for _, stop_good, _, _ in window):
            return Reason.BAD_STOP_BIT
        if any(apart for *_, apart in window[1:]):
            return Reason.BAD_SPACING
        clear = bytes(a ^ b for a, b in zip(data[2:], WHITE, strict=False))
        if crc16(bytes([self.layout]) + clear[:-2]) != clear[-2] + 256 * clear[-1]:
            return Reason.BAD_CRC
        return None

    def frame(self):
        start = len(self.run) - self.size
        lead = next(count for count in range(len(self.lead), -1, -1) if self.is_lead(start, count))
        window = self.run[start - lead :]
        if start > lead:
            self.damaged(start - lead)
        data = bytes(byte for byte, *_ in window)
        clear = bytes(a ^ b for a, b in zip(data[lead + 2 :], WHITE, strict=False))
        self.events.append(Received(data, window[0][2], window[-1][2], clear[:-2]))
        self.run = []

    def is_lead(self, start, count):
        if count > start:
            return False
        before = self.run[start - count : start]
        data = bytes(byte for byte, *_ in before)
        follows = not any(apart for *_, apart in self.run[start - count + 1 : start + 1]) if count else True
        return data == self.lead[len(self.lead) - count :] and follows and all(good for _, good, *_ in before)

    def damaged(self, count, at_end=False):
        reasons = [self.verdict(start) for start in range(count)]
        if not at_end:  # a frame came, so no window before it was cut short
            reasons = [reason for reason in reasons if reason != Reason.CUT_SHORT]
        data = bytes(byte for byte, *_ in self.run[:count])
        self.events.append(Damaged(data, max(reasons), self.run[0][2]))
        self.run = self.run[count:]

    def flush(self):
        if self.run:
            self.damaged(len(self.run), at_end=True)
        return self.events
