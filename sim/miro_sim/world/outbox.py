"""The future transmissions of a network's host: frames of the station, a script, and injected characters.

The transmitter is a serial port: one transmission after the other, in the order of their first start bits. A frame of
the station is dropped and counted while the transmitter is busy; an injected transmission is refused then.

A transmission waits here until its carrier may come up before the tick up to which the air is settled next. What waits
is saved, but no part of the digest: a run does not depend on when it was announced.
"""

from __future__ import annotations

import msgspec

from miro_exact.clock import HOST_CHARACTER_TICKS, TICKS_PER_SECOND
from miro_exact.state import TICK, Rows
from miro_protocol.transmission import DOWN, Transmission

STATION, INJECTED = 0, 1
LATEST_TICK = 86_400 * TICKS_PER_SECOND
"""A day: nothing is announced for a later tick."""
LONGEST_BYTES = 1 << 20
"""Longest transmission in bytes: 18 minutes on the air."""


class Waiting(msgspec.Struct, frozen=True, gc=False):
    """A transmission that waits; `origin` is STATION or INJECTED."""

    sent: Transmission
    origin: int


def _split(waiting: Waiting) -> tuple[int, int, int, bytes]:
    """Tick, origin, number of characters; these, and behind them those whose stop bit is bad, as 1 among 0."""
    sent = waiting.sent
    stops = bytes(place in sent.bad_stop for place in range(len(sent.data))) if sent.bad_stop else b""
    return sent.tick, waiting.origin, len(sent.data), sent.data + stops


def _made(cells: tuple[int, int, int, bytes]) -> Waiting:
    """A transmission of network 0; the outbox sets its own network.

    Raises ValueError for stop bits that do not match the data.
    """
    tick, origin, count, text = cells
    data, stops = text[:count], text[count:]
    if len(stops) not in (0, len(data)):
        raise ValueError(f"has {len(stops)} stop bits for {len(data)} characters")
    bad_stop = tuple(place for place, bad in enumerate(stops) if bad)
    return Waiting(Transmission(tick, DOWN, data, 0, bad_stop), origin)


class Outbox:
    """Transmissions of the host of `network` that wait, in order. `lead_ticks`: key-up of the carrier.

    `character_ticks`: how long each of their characters takes. `dropped`: frames of the station that found the
    transmitter busy.
    """

    STATE = {
        "waiting": Rows(
            *(1 << 20, TICK, ("B", STATION, INJECTED), "I", ("s", 2 * LONGEST_BYTES)),
            split=_split,
            make=_made,
            ordered=True,
        ),
        "dropped": TICK,
    }
    NOT_STATE = ("lead_ticks", "network", "character_ticks")

    def __init__(
        self, lead_ticks: int, network: int = 0, character_ticks: int = HOST_CHARACTER_TICKS
    ) -> None:
        self.character_ticks = character_ticks
        self.lead_ticks = lead_ticks
        self.network = network
        self.waiting: list[Waiting] = []
        self.dropped = 0

    def __repr__(self) -> str:
        waiting = [(entry.sent.tick, entry.sent.data.hex(" ")) for entry in self.waiting]
        return f"Outbox({waiting}, dropped={self.dropped})"

    def post(self, sent: Transmission, free_tick: int) -> bool:
        """A frame of the station; False if the transmitter is busy then, which drops it.

        `free_tick`: when the last transmission on the air is over.
        """
        # No queue: the command of an earlier camera frame would reach the robot late, as if it were new.
        if sent.tick < free_tick or [entry for entry in self.waiting if self._overlap(entry.sent, sent)]:
            self.dropped += 1
            return False
        self.waiting.append(Waiting(sent, STATION))
        self.waiting.sort(key=_tick)
        return True

    def inject(self, sent: Transmission, free_tick: int) -> None:
        """Characters of the caller. Raises ValueError where the transmitter is busy then.

        A frame of the station that waits and begins later gives way.
        """
        if sent.tick < free_tick:
            raise ValueError(f"tick {sent.tick}: the transmitter is busy until tick {free_tick}")
        count = len(self.waiting)
        # `count - 1`, not -1: compiled code does not index from the end (setup.py, `wraparound`).
        # `<=`: the next start bit may begin on the tick on which the last stop bit is over.
        if not count or self._end(self.waiting[count - 1].sent) <= sent.tick:  # a long script comes in order
            self.waiting.append(Waiting(sent, INJECTED))
            return
        for item in self.waiting:
            old = item.sent
            # Who begins first has the line, or it would matter whether the frame was posted before this.
            if self._overlap(old, sent) and (item.origin == INJECTED or old.tick < sent.tick):
                busy = f"is busy from tick {old.tick} to {self._end(old)}"
                size = len(sent.data)
                raise ValueError(
                    f"tick {sent.tick}: the transmitter {busy}; {size} characters end at tick {self._end(sent)}"
                )
        # Only frames of the station are left to overlap: they find the transmitter busy, as in `post`.
        remaining = [item for item in self.waiting if not self._overlap(item.sent, sent)]
        self.dropped += len(self.waiting) - len(remaining)
        self.waiting = remaining
        self.waiting.append(Waiting(sent, INJECTED))
        self.waiting.sort(key=_tick)

    def end_tick(self, free_tick: int) -> int:
        """Tick at which the transmitter is free after everything that waits."""
        count = len(self.waiting)  # in order, and none overlaps another: the last one ends last
        return max(free_tick, self._end(self.waiting[count - 1].sent)) if count else free_tick

    def due(self, until_tick: int) -> list[Transmission]:
        """Takes out what comes up on the air before `until_tick`, in order; what comes then can be announced still."""
        count = 0
        # The carrier comes up `lead_ticks` before the start bit, and other networks hear it from then on.
        while count < len(self.waiting) and self.waiting[count].sent.tick < until_tick + self.lead_ticks:
            count += 1
        taken = [entry.sent for entry in self.waiting[:count]]
        del self.waiting[:count]
        return taken

    def after_load(self) -> None:
        """Raises ValueError unless each transmission holds a byte at least and none begins within another."""
        free_tick = 0
        for place, item in enumerate(self.waiting):
            sent = item.sent
            # `end_tick` and `inject` look at the last one only, which is right only without overlaps.
            if sent.tick < free_tick or not sent.data:
                raise ValueError(
                    f"{len(sent.data)} characters wait for tick {sent.tick}, behind tick {free_tick}"
                )
            free_tick = self._end(sent)
            # A row has no network; the log and the recording name it.
            self.waiting[place] = Waiting(msgspec.structs.replace(sent, network=self.network), item.origin)

    def _end(self, sent: Transmission) -> int:
        """Tick of the end of the last stop bit."""
        return sent.tick + len(sent.data) * self.character_ticks

    def _overlap(self, first: Transmission, second: Transmission) -> bool:
        return first.tick < self._end(second) and second.tick < self._end(first)


def _tick(waiting: Waiting) -> int:
    return waiting.sent.tick
