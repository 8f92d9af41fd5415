"""Rules about LM629s that are slow, as the data sheet allows, or that never come up."""

from __future__ import annotations

from collections.abc import Callable

from miro_protocol.table import Flags
from miro_robot.lm629.options import Lm629Options
from mirotwin.conform.rule import Chapter
from mirotwin.conform.rules import FRAME, POWER_ON
from mirotwin.conform.rules.sound import nothing_refused
from mirotwin.conform.seen import Answer, Seen
from mirotwin.conform.talk import Found, Talk

CHAPTER = Chapter("Slow and broken LM629s")
_SLOW = Lm629Options(busy_clocks=600, reset_clocks=9000)
_NEVER_UP = Lm629Options(reset_clocks=1 << 24)  # 2.8 s: the trial is over before


@CHAPTER.rule(
    "P57",
    "LM629s that take the data sheet's longest times, 1.5 ms for a reset and 100 us for a command or a word, MUST be"
    " waited for: the robot does as with others.",
    POWER_ON,
    lm629=_SLOW,
)
def slow(talk: Talk) -> None:
    slot = talk.air.slots[0]
    for _ in range(3):
        talk.obeyed(talk.team())
        talk.answered(talk.ask(slot, gap_ms=36.0), slot, "no flag 20h", _says(0, Flags.INIT_FAILED))
    nothing_refused(talk)


@CHAPTER.rule(
    "P58",
    "With LM629s that do not come out of reset, motors MUST stay off, and a robot MUST answer all the same and say so"
    " (20h).",
    FRAME,
    lm629=_NEVER_UP,
)
def broken(talk: Talk) -> None:
    slot = talk.air.slots[0]
    talk.team(lead=b"")
    talk.answered(talk.ask(slot, gap_ms=36.0), slot, "flag 20h", _says(Flags.INIT_FAILED, Flags.INIT_FAILED))
    both = Flags.INIT_FAILED | Flags.MOTORS_OFF
    for _ in range(2):
        talk.wait(520.0)
        talk.answered(talk.ask(slot, gap_ms=36.0), slot, f"flags {int(both):02X}h", _says(both, both))
    end = talk.now

    def driven(seen: Seen) -> Found:
        for tick, side, chip in seen.chips(0, end):
            if chip.pwm_magnitude:
                return tick, f"the {side} one driven"
        return None

    talk.expect(end, "both motors off", driven)


def _says(wanted: int, among: int) -> Callable[[Answer, Seen], str]:
    def says(answer: Answer, seen: Seen) -> str:
        assert answer.said is not None
        return "" if answer.said.flags & among == wanted else f"{answer.said.flags:02X}h"

    return says
