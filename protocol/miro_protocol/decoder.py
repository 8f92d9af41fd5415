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

__all__ = [
    "RUN_LIMIT", "Damaged", "Decoder", "Event", "Reason", "Received", "Scanner", "Symbol", "TelemetryDecoder",
]  # fmt: skip


class Decoder(Scanner):
    """What a robot hears, in a network of `n` robots (3 or 5)."""

    def __init__(self, n: int) -> None:
        super().__init__(downlink(n))


class TelemetryDecoder(Scanner):
    """What the host hears from its robots."""

    def __init__(self) -> None:
        super().__init__(TELEMETRY)
