"""A buffer of received bytes that drops what comes in when it is full, as the driver of a serial port does."""

from __future__ import annotations

BUFFER_BYTES = 65_536
"""68 s of a robot that sends all the time."""


class ByteFifo:
    """At most `limit` bytes. `dropped`: how many found it full."""

    def __init__(self, limit: int = BUFFER_BYTES) -> None:
        self.limit = limit
        self.data = bytearray()
        self.dropped = 0

    def __len__(self) -> int:
        return len(self.data)

    def add(self, data: bytes) -> None:
        """Appends what there is room for, and drops the rest."""
        room = self.limit - len(self.data)
        self.data += data[:room]
        self.dropped += max(0, len(data) - room)

    def take(self, count: int) -> bytes:
        """Removes up to `count` bytes from the front."""
        taken = bytes(self.data[:count])
        del self.data[:count]
        return taken

    def clear(self) -> None:
        self.data.clear()
