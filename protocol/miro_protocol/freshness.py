"""Is a valid frame fresh? Works on the sequence numbers and ticks of valid frames, never on bytes.

The rule (README.md, "Freshness"): a frame is fresh if its number is 1 to 8 steps (mod 64) past the last
fresh one. 150 ms or more after that one, any other number is fresh; before the first frame, any at all.
A frame that is repeated is not fresh again, so a stuck host does not re-arm a robot whose failsafe
has stopped it.
"""

from __future__ import annotations

from miro_exact.state import Row
from miro_protocol.table import FRESH_AGAIN_TICKS, FRESH_STEPS, SEQ_MODULUS


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
        """Whether the valid frame `seq`, complete at `tick` (24 MHz), is fresh; once for every one."""
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
