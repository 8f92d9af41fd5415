"""Rules about wheels that do not follow: an encoder wire is broken, or the wheel is blocked.

A trial simulates both by filter gains of 0: the wheel stands still while its LM629's desired position moves on.
"""

from __future__ import annotations

from miro_protocol.frames import TelemetryFrame
from mirotwin.conform.observed import Observed, ReceivedAnswer
from mirotwin.conform.rule import FRESHNESS, Chapter
from mirotwin.conform.rules.boot import keeps_off
from mirotwin.conform.trial_script import Frame, TrialScript, ms

CHAPTER = Chapter("Wheels that do not follow")
_POSITION_ERROR = 0x20
_SPEED = 2000  # 1024 counts away 60 ms after the order
_OFF_MS = 80.0
_GAINS = (400, 40, 3000, 2000)


@CHAPTER.rule("P63", FRESHNESS, presupposes="P35", broken="a wheel that does not follow is not switched off")
def lost(script: TrialScript) -> None:
    """When a wheel is 1024 counts away from where it should be, both motors MUST be off within 20 ms and stay off,
    whatever velocities come, until a fresh frame tells both wheels to stand.
    """
    for left, right in ((_SPEED, 0), (0, _SPEED), (_SPEED, _SPEED)):
        first = _turn_in_vain(script, left, right)
        script.filter(_GAINS, "filter frame with gains")
        for _ in range(3):
            script.team()
        keeps_off(script, first.acted_tick + ms(_OFF_MS), script.now)
        script.team(((0, 0),) * script.n, gap_ms=40.0)


@CHAPTER.rule("P64", FRESHNESS, presupposes="P41 P63")
def lost_is_told(script: TrialScript) -> None:
    """While a wheel is lost, the status of its LM629 in answers MUST show it (20h). After both wheels were told to
    stand, velocities MUST be obeyed again.
    """
    _turn_in_vain(script, _SPEED, 0)
    script.filter(_GAINS, "filter frame with gains")
    script.answered(script.ask(gap_ms=36.0), "status 20h of the left LM629", _shows_error)
    script.team(((0, 0),) * script.n, gap_ms=40.0)
    script.obeyed(script.team())


def _turn_in_vain(script: TrialScript, left: int, right: int) -> Frame:
    """The first of several frames, some with questions, that order wheels without gains to turn."""
    script.filter((0, 0, 0, 0), "filter frame without gains")
    words = script.same(left, right)
    first = script.obeyed(script.team(words, label="team frame to wheels without gains"))
    for _ in range(3):
        script.team(words)
        script.ask(words=words)
    return first


def _shows_error(content: TelemetryFrame, answer: ReceivedAnswer, observed: Observed) -> str:
    return "" if content.status_left & _POSITION_ERROR else f"{content.status_left:02X}h"
