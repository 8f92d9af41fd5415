"""Finds frames among received characters. Sans-IO: no port, no clock, no thread; characters in, events out.

The rule (README.md, "Reception"): look at the last F characters, sync to CRC. If they start with the sync,
all stop bits are good, the F - 1 spacings are 1040 us +- 50 us and the CRC is good, they are a frame and
the window is emptied. Hence the first undamaged frame after any garbage is taken. Every character belongs
to exactly one event: the `data` of all events, joined, are the characters fed. Cutting the input anywhere
else changes nothing.
"""

from __future__ import annotations

from miro_protocol.events import Damaged, Event, Reason, Received
from miro_protocol.scan import RUN_LIMIT, Scanner, Symbol
from miro_protocol.table import TELEMETRY, downlink
from miro_protocol.transmission import Transmission

__all__ = [
    "RUN_LIMIT", "Damaged", "Decoder", "Event", "Reason", "Received", "Symbol", "TelemetryDecoder",
    "WindowDecoder",
]  # fmt: skip


class WindowDecoder(Scanner):
    """Decoder of one wire format; see `Scanner` for what it can be fed."""

    def hear(self, sent: Transmission) -> list[Event]:
        """The events that the characters of a transmission complete."""
        if sent.bad_stop:
            return self.feed_symbols(sent.symbols())
        return self.feed(sent.data, sent.tick)

    def __repr__(self) -> str:
        counts = f"{self.valid} valid, {self.rejected} rejected, {self.pending} characters pending"
        return f"<decoder {self.format.name}: {counts}>"


class Decoder(WindowDecoder):
    """What a robot hears, in a network of `n` robots (3 or 5)."""

    def __init__(self, n: int) -> None:
        super().__init__(downlink(n))


class TelemetryDecoder(WindowDecoder):
    """What the host hears from its robots."""

    def __init__(self) -> None:
        super().__init__(TELEMETRY)
