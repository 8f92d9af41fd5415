"""What is said at a port as a recording like any other: control periods that hold characters, and no robot's inside."""

from __future__ import annotations

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_protocol.transmission import Transmission
from miro_sim.periods import Period
from mirotwin.desk.robot_port import RobotPort
from mirotwin.recording.recorder import Recorder

SETTLED_TICKS = 2 * CONTROL_PERIOD_TICKS
"""An answer that is whole belongs to no earlier period than this; a question is told when it is sent."""
PORT = "port"
"""`source` of such a recording."""


class PortRecording:
    """Writes each period of a talk when it is over, so that a talk that is broken off is there up to then."""

    def __init__(self, port: RobotPort, recorder: Recorder) -> None:
        self.port = port
        self.recorder = recorder
        self.index = 0
        self._sent = self._received = 0

    def keep(self, until_tick: int | None = None) -> None:
        """The periods that are over by now, or before `until_tick`."""
        port = self.port
        until_tick = port.tick - SETTLED_TICKS if until_tick is None else until_tick
        while (end_tick := (self.index + 1) * CONTROL_PERIOD_TICKS) <= until_tick:
            wire = self._before(end_tick)
            tick = self.index * CONTROL_PERIOD_TICKS
            self.recorder.write(Period(self.index, tick, (), tuple(wire), ""))
            self.index += 1
        self.recorder.flush()

    def finish(self) -> None:
        """All that there is."""
        self.port.end()
        ends = [one.tick for one in (*self.port.sent[-1:], *self.port.received[-1:])]
        self.keep(max(self.port.tick, *ends, CONTROL_PERIOD_TICKS) + CONTROL_PERIOD_TICKS)

    def _before(self, tick: int) -> list[Transmission]:
        """What began before `tick` and was not written yet, in the order of time."""
        found = []
        while self._sent < len(self.port.sent) and self.port.sent[self._sent].tick < tick:
            found.append(self.port.sent[self._sent])
            self._sent += 1
        while self._received < len(self.port.received) and self.port.received[self._received].tick < tick:
            found.append(self.port.received[self._received])
            self._received += 1
        return sorted(found, key=lambda one: one.tick)
