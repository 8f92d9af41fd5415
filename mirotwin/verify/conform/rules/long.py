"""Rules that take a minute or more of virtual time to try: `mirotwin conform --long`."""

from __future__ import annotations

from miro_exact.clock import CONTROL_PERIOD_TICKS
from mirotwin.verify.conform.rule import THREE, Chapter
from mirotwin.verify.conform.rules import FRESHNESS, TURNS
from mirotwin.verify.conform.trial_script import Talk, ms

CHAPTER = Chapter("Long trials")
_FRAMES = 2000
_EACH = 100
_OFF_MS = 520.0
_WRAPS_MS = (2560.0, (1 << 23) / 1000, 8542.5, (1 << 24) / 1000, 32768.0, (1 << 25) / 1000, 65536.0)
"""Where counts begin again: 8 bits of 10 ms or of camera frames, 23 to 25 bits of microseconds, 15 or 16 of ms."""


@CHAPTER.rule(
    "P61",
    "However many frames came, the next one MUST be obeyed and the next question answered.",
    TURNS,
    airs=THREE,
    presupposes=("P34", "P41"),
)
def many(talk: Talk) -> None:
    slot = talk.air.slots[0]
    for number in range(1, _FRAMES + 1):
        begun = talk.now
        frame = talk.ask(slot, gap_ms=0.0) if number % 3 == 0 else talk.team(gap_ms=0.0)
        if number % _EACH < 3 or number > _FRAMES - 6:
            talk.obeyed(frame)
            if number % 3 == 0:
                talk.answered(frame, slot)
        talk.wait_until(begun + CONTROL_PERIOD_TICKS)
    talk.wait(40.0)


@CHAPTER.rule(
    "P62",
    "After any silence motors MUST stay off, the last frame again MUST NOT be fresh, and one with another seq MUST be.",
    FRESHNESS,
    airs=THREE,
    presupposes=("P20", "P32"),
)
def ages(talk: Talk) -> None:
    for silence_ms in _WRAPS_MS:
        last = talk.team()
        until = last.end_tick + ms(silence_ms + 40.0)
        talk.unchanged(
            last.end_tick + ms(_OFF_MS), until, f"motors off {silence_ms / 1000:.1f} s after the last frame"
        )
        talk.wait_until(until)
        talk.ignored(talk.team(step=0, fresh=False))
        talk.wait(20.0)
        talk.obeyed(talk.team(step=20, what=f"team frame 20 steps on after {silence_ms / 1000:.1f} s"))
