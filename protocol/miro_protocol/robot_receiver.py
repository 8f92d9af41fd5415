"""Decodes the characters that a robot's serial port receives: frames, fresh or not, and damage.

The rule (README.md, "Freshness"): a frame is fresh if its number is 1 to 8 steps (mod 64) past the last
fresh one. 150 ms or more after that one, any other number is fresh; before the first frame, any at all.
A frame that is repeated is not fresh again, so a stuck host does not re-arm a robot whose failsafe
has stopped it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from miro_exact.state import Row
from miro_protocol.decoder import Decoder
from miro_protocol.events import Event, Received
from miro_protocol.robot_rules import TO_RI_TICKS
from miro_protocol.table import FRESH_AGAIN_TICKS, FRESH_STEPS, SEQ_MODULUS
from miro_protocol.transmission import Transmission


class Freshness:
    """Counts `accepted` (fresh) and `stale` frames; only fresh ones act and restart the failsafe."""

    STATE = {
        "accepted": "q",
        "stale": "q",
        "last_seq": Row(
            ("b", -1, SEQ_MODULUS - 1),  # -1: None
            split=lambda seq: (-1 if seq is None else seq,),
            make=lambda cells: None if cells[0] < 0 else cells[0],
        ),
        "last_tick": "q",
    }

    def __init__(self) -> None:
        self.accepted = 0
        self.stale = 0
        self.last_seq: int | None = None
        self.last_tick = 0

    def __repr__(self) -> str:
        return f"<freshness: {self.accepted} accepted, {self.stale} stale, last seq {self.last_seq}>"

    def judge(self, seq: int, tick: int) -> bool:
        """True if the valid frame `seq`, complete at `tick` (24 MHz), is fresh; once for every one."""
        fresh = self._is_fresh(seq, tick)
        if fresh:
            self.accepted += 1
            self.last_seq = seq
            self.last_tick = tick
        else:
            self.stale += 1
        return fresh

    def _is_fresh(self, seq: int, tick: int) -> bool:
        if self.last_seq is None:
            return True
        step = (seq - self.last_seq) % SEQ_MODULUS
        if tick - self.last_tick >= FRESH_AGAIN_TICKS:
            return step != 0
        return 1 <= step <= FRESH_STEPS


Reception = tuple[Event, bool | None]
"""A valid frame and whether it is fresh, or damaged characters and None."""


class RobotReceiver:
    """The receiver of a robot in a network of `n` robots, as it is at power-on."""

    def __init__(self, n: int) -> None:
        self.decoder = Decoder(n)
        self.freshness = Freshness()

    def __repr__(self) -> str:
        return f"RobotReceiver({self.decoder!r}, {self.freshness!r})"

    def hear(self, sent: Transmission) -> Sequence[Reception]:
        """The frames and damage that the characters of a transmission complete."""
        return self._judged(self.decoder.hear(sent))

    def character(self, value: int, good_stop: bool, ri_tick: int) -> Sequence[Reception]:
        """The frames and damage completed by a character for which the port sets RI at `ri_tick`, in its stop bit."""
        return self._judged(self.decoder.feed_symbols([(value, good_stop, ri_tick - TO_RI_TICKS)]))

    def flush(self) -> Sequence[Reception]:
        """The frames and damage in the pending characters when no more will come."""
        return self._judged(self.decoder.flush())

    def _judged(self, events: Iterable[Event]) -> list[Reception]:
        return [
            (event, self.freshness.judge(event.seq, event.last_tick) if isinstance(event, Received) else None)
            for event in events
        ]
