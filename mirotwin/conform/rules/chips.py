"""Rules about LM629s that are slow, as the data sheet allows, or that never come up."""

from __future__ import annotations

from miro_protocol.frames import TelemetryFrame
from miro_protocol.table import Flags
from miro_robot.lm629.options import Lm629Options
from mirotwin.conform.observed import Observed, ReceivedAnswer
from mirotwin.conform.rule import FRAME, PORT, POWER_ON, Chapter
from mirotwin.conform.rules.answers import flagged
from mirotwin.conform.rules.sound import nothing_refused
from mirotwin.conform.trial_script import Found, TrialScript

CHAPTER = Chapter("Slow and broken LM629s")
_BUSY = 0x01
_SLOW = Lm629Options(busy_clocks=600, reset_clocks=9000, reset_breakpoint="stays")
_NEVER_FREE = Lm629Options(busy_clocks=1 << 20)  # 175 ms after each command
_NEVER_UP = Lm629Options(reset_clocks=1 << 24)  # 2.8 s: the trial is over before


@CHAPTER.rule("P57", POWER_ON, presupposes="P47", lm629=_SLOW)
def slow(script: TrialScript) -> None:
    """LM629s that take the data sheet's longest times, 1.5 ms for a reset and 100 us for a command or a word, and that
    show C4h after a reset and C0h after RSTI, MUST be waited for: the robot does as with others.
    """
    for _ in range(3):
        script.obeyed(script.team())
        script.answered(script.ask(gap_ms=36.0), "no flag 20h, and status of LM629s that are free", _free)
    for count in range(24):  # a frame at any time between two looks at the chips
        script.obeyed(script.team(gap_ms=1.0 + 0.17 * count))
    nothing_refused(script)


@CHAPTER.rule("P58", FRAME, presupposes="P41", lm629=_NEVER_UP, broken="a broken LM629 is not told of")
def broken(script: TrialScript) -> None:
    """With LM629s that do not come out of reset, motors MUST stay off, and a robot MUST answer all the same and say so
    (20h).
    """
    _tells_of_them(script)


@CHAPTER.rule("P59", PORT, presupposes="P58", lm629=_NEVER_FREE)
def busy(script: TrialScript) -> None:
    """LM629s that stay busy MUST NOT be waited for without end: motors stay off, and a robot answers and says so
    (20h).
    """
    _tells_of_them(script)


def _tells_of_them(script: TrialScript) -> None:
    script.team(lead=b"")
    script.answered(script.ask(gap_ms=36.0), "flag 20h", flagged(Flags.INIT_FAILED, Flags.INIT_FAILED))
    both = Flags.INIT_FAILED | Flags.MOTORS_OFF
    for _ in range(2):
        script.wait(520.0)
        script.answered(script.ask(gap_ms=36.0), f"flags {int(both):02X}h", flagged(both, both))
    end = script.now

    @script.expects(end, "both motors off")
    def driven(observed: Observed) -> Found:
        for tick, side, chip in observed.chips(0, end):
            if chip.pwm_magnitude:
                yield tick, f"the {side} one driven"


def _free(content: TelemetryFrame, answer: ReceivedAnswer, observed: Observed) -> str:
    if content.status_left & _BUSY or content.status_right & _BUSY:
        return f"status {content.status_left:02X}h and {content.status_right:02X}h, read while busy (01h)"
    return flagged(0, Flags.INIT_FAILED)(content, answer, observed)
