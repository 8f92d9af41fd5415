"""Rules that take a minute or more of virtual time to try: `mirotwin conform --long`."""

from __future__ import annotations

from miro_exact.clock import CONTROL_PERIOD_TICKS
from mirotwin.verify.conform.rule import THREE, Chapter
from mirotwin.verify.conform.rules import FRESHNESS, TURNS
from mirotwin.verify.conform.trial_script import TrialScript, ms

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
    topologies=THREE,
    presupposes=("P34", "P41"),
)
def many(script: TrialScript) -> None:
    slot = script.topology.slots[0]
    for number in range(1, _FRAMES + 1):
        begun = script.now
        frame = script.ask(slot, gap_ms=0.0) if number % 3 == 0 else script.team(gap_ms=0.0)
        if number % _EACH < 3 or number > _FRAMES - 6:
            script.obeyed(frame)
            if number % 3 == 0:
                script.answered(frame, slot)
        script.wait_until(begun + CONTROL_PERIOD_TICKS)
    script.wait(40.0)


@CHAPTER.rule(
    "P62",
    "After any silence motors MUST stay off, the last frame again MUST NOT be fresh, and one with another seq MUST be.",
    FRESHNESS,
    topologies=THREE,
    presupposes=("P20", "P32"),
)
def ages(script: TrialScript) -> None:
    for silence_ms in _WRAPS_MS:
        last = script.team()
        until = last.end_tick + ms(silence_ms + 40.0)
        script.unchanged(
            last.end_tick + ms(_OFF_MS), until, f"motors off {silence_ms / 1000:.1f} s after the last frame"
        )
        script.wait_until(until)
        script.ignored(script.team(step=0, fresh=False))
        script.wait(20.0)
        script.obeyed(script.team(step=20, what=f"team frame 20 steps on after {silence_ms / 1000:.1f} s"))
