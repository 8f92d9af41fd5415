"""What a network's host is going to send: frames of the station, a script, and characters that are injected.

What belongs here: who gets the transmitter. What does not: the air (`radio/`), and when it is settled (`network.py`).
The transmitter is a serial port: one transmission after the other, in the order of their first start bits. A frame of
the station that meets a busy transmitter is dropped and counted; an injected transmission that would is refused.

A transmission waits here until its carrier may come up before the tick up to which the air is settled next. What waits
is saved, but no part of the digest: a run does not depend on when it was announced.
"""

from __future__ import annotations

from typing import Any

from msgspec import convert

from miro_exact.clock import HOST_CHARACTER_TICKS
from miro_exact.saved import LAST_TICK, whole

STATION, INJECTED = 0, 1
LONGEST_BYTES = 1 << 20
"""Of one transmission: 18 minutes on the air."""


class Outbox:
    """Transmissions that wait, as (first start bit, data, STATION or INJECTED). `lead_ticks`: key-up of the carrier.

    `dropped`: frames of the station that found the transmitter busy.
    """

    NOT_STATE = ("lead_ticks",)

    def __init__(self, lead_ticks: int) -> None:
        self.lead_ticks = lead_ticks
        self.waiting: list[tuple[int, bytes, int]] = []
        self.dropped = 0

    def __repr__(self) -> str:
        return f"Outbox({[(tick, data.hex(' ')) for tick, data, _ in self.waiting]}, dropped={self.dropped})"

    def post(self, tick: int, data: bytes, free_tick: int) -> bool:
        """A frame of the station for `tick`; False if the transmitter is busy then, which drops it.

        `free_tick`: when the last transmission on the air is over.
        """
        end = tick + len(data) * HOST_CHARACTER_TICKS
        if tick < free_tick or any(start < end and tick < _end(start, old) for start, old, _ in self.waiting):
            self.dropped += 1
            return False
        self._add(tick, data, STATION)
        return True

    def inject(self, tick: int, data: bytes, free_tick: int) -> None:
        """Characters of the caller's for `tick`. Raises ValueError where the transmitter is busy then.

        A frame of the station that waits and begins later gives way.
        """
        end = tick + len(data) * HOST_CHARACTER_TICKS
        if tick < free_tick:
            raise ValueError(f"tick {tick}: the transmitter is busy until tick {free_tick}")
        for start, old, origin in self.waiting:
            if start < end and tick < _end(start, old) and (origin == INJECTED or start < tick):
                busy = f"is busy from tick {start} to {_end(start, old)}"
                raise ValueError(
                    f"tick {tick}: the transmitter {busy}; {len(data)} characters end at tick {end}"
                )
        self.waiting = [
            (start, old, origin)
            for start, old, origin in self.waiting
            if origin == INJECTED or start >= end or _end(start, old) <= tick or self._drop()
        ]
        self._add(tick, data, INJECTED)

    def _drop(self) -> bool:
        self.dropped += 1
        return False

    def _add(self, tick: int, data: bytes, origin: int) -> None:
        self.waiting.append((tick, data, origin))
        self.waiting.sort(key=lambda one: one[0])

    def end_tick(self, free_tick: int) -> int:
        """When the transmitter is free behind everything that waits."""
        return max([free_tick, *(_end(tick, data) for tick, data, _ in self.waiting)])

    def due(self, until_tick: int) -> list[tuple[int, bytes]]:
        """Takes out what may come up on the air before `until_tick`, in order."""
        count = 0
        while count < len(self.waiting) and self.waiting[count][0] <= until_tick + self.lead_ticks:
            count += 1
        taken = [(tick, data) for tick, data, _ in self.waiting[:count]]
        del self.waiting[:count]
        return taken

    def snapshot(self) -> dict[str, object]:
        return {"waiting": [list(one) for one in self.waiting], "dropped": self.dropped}

    def restore(self, state: dict[str, Any]) -> None:
        """Raises ValueError unless the transmissions are in order and hold at least a byte each."""
        waiting = convert(state["waiting"], list[tuple[int, bytes, int]])
        free_tick = 0
        for tick, data, origin in waiting:
            if not free_tick <= tick <= LAST_TICK or not 0 < len(data) <= LONGEST_BYTES:
                raise ValueError(f"{len(data)} characters wait for tick {tick}, behind tick {free_tick}")
            if origin not in (STATION, INJECTED):
                raise ValueError(f"characters of an unknown origin {origin} wait")
            free_tick = _end(tick, data)
        self.waiting = waiting
        self.dropped = whole(state, "dropped", 0, LAST_TICK)


def _end(tick: int, data: bytes) -> int:
    return tick + len(data) * HOST_CHARACTER_TICKS
