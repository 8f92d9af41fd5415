"""Log lines: firmware faults, lost frames and robots, resets. A line is written when a condition begins and when it
ends, not every control period.
"""

from __future__ import annotations

from collections.abc import Iterator

from miro_protocol.actions import Action, Fault, Put, RadioState, Reseed, Reset
from miro_sim.periods import RobotPeriod
from mirotwin.report.foxglove.frames import robot_frame
from mirotwin.report.foxglove.messages import INFO, WARNING, Log, time_of

COUNTER = 1 << 16
"""The firmware's counters start over here."""


class RobotNotes:
    """Compares each control period of one robot with the one before."""

    def __init__(self) -> None:
        self._before: RobotPeriod | None = None
        self._commanded = 0  # periods before this one in which the PC commanded, without a break
        self._measured: bool | None = None

    def add(self, robot: RobotPeriod, tick: int) -> Iterator[Log]:
        """Lines about the control period that began at `tick`."""
        time, name = time_of(tick), robot_frame(robot.network, robot.slot)
        measured = robot.measurement is not None
        if self._measured is not None and measured != self._measured:
            words = "measured again" if measured else "not measured: the robot or the frame was lost"
            yield Log(time, INFO if measured else WARNING, words, name)
        if measured or self._measured is not None:  # nothing is measured before the first frame has arrived
            self._measured = measured
        yield from (Log(time, WARNING, words, name) for words in self._frames(robot))
        self._commanded = self._commanded + 1 if robot.control is not None else 0
        self._before = robot

    def _frames(self, robot: RobotPeriod) -> Iterator[str]:
        """Frames since the exposure before, by the firmware's counters."""
        before = self._before
        if before is None:
            return
        rejected, stale = _more(before.rejected, robot.rejected), _more(before.stale, robot.stale)
        if rejected:
            yield f"{rejected} damaged frames rejected"
        if stale:
            yield f"{stale} valid frames were not fresh"
        missing = robot.accepted is not None and not _more(before.accepted, robot.accepted)
        if missing and self._commanded >= 2 and not rejected and not stale:
            yield "no frame arrived since the last exposure"


def _more(before: int | None, now: int | None) -> int:
    """By how much a counter rose; a counter that is lower started again."""
    if before is None or now is None or (now < before and before < COUNTER // 2):
        return 0
    return (now - before) % COUNTER


def of_action(action: Action) -> Log:
    """The line about an action on a robot, or on the radio of a network."""
    time = time_of(action.tick)
    if isinstance(action, RadioState):
        return Log(time, INFO, f"radio: {action.state}", f"net{action.network}")
    if isinstance(action, Reseed):
        return Log(time, INFO, f"reseed: {action.seed}", f"net{action.network}")
    if isinstance(action, Put):
        return Log(time, INFO, action.text, f"net{action.network}")
    if isinstance(action, Fault):
        return Log(time, INFO, f"hardware: {action.what}", robot_frame(action.network, action.slot))
    if isinstance(action, Reset):
        return Log(time, INFO, f"reset: {action.level}", robot_frame(action.network, action.slot))
    return Log(time, INFO, f"power: {action.on}", robot_frame(action.network, action.slot))
