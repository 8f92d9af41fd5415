"""How time passes for a program that holds a world: in its calls only, or by the wall clock."""

from __future__ import annotations

import logging
from contextlib import suppress

from miro_exact.clock import CONTROL_PERIOD_TICKS, HOST_CHARACTER_TICKS, TICKS_PER_SECOND
from miro_sim.world.conditions import Heard
from miro_sim.world.waits import WaitExpired
from mirotwin.ports.endpoint import ByteFifo
from mirotwin.ports.radio_port import RadioPort
from mirotwin.rerun.pacing import Pace

CATCH_UP_S = 0.25
"""A call that finds the world behind works on that for so long; the rest is left to later ones."""

_log = logging.getLogger("mirotwin.ports")


class TimePolicy:
    """How time passes. `inbox` gets what the PC receives."""

    def __init__(self, port: RadioPort, inbox: ByteFifo) -> None:
        self.port = port
        self.inbox = inbox

    def catch_up(self) -> None:
        """Before a call looks at anything: to where the world should be now."""
        raise NotImplementedError

    def advance(self, tick: int, for_byte: bool) -> None:
        """Towards `tick`; with `for_byte` not beyond the next byte heard. The caller asks again until it is content."""

    def rest(self, tick: int) -> None:
        """Between two of these, without the world: other threads may have it."""


class VirtualTime(TimePolicy):
    """Virtual time: nothing passes between calls, and a call takes no longer than computing takes."""

    def catch_up(self) -> None:
        self.inbox.add(self.port.received())

    def advance(self, tick: int, for_byte: bool) -> None:
        world = self.port.world
        tick = min(tick, world.tick + CONTROL_PERIOD_TICKS)
        if for_byte:
            with suppress(WaitExpired):
                world.run_until(Heard(network=self.port.network), within=tick - world.tick)
        else:
            world.run_to(tick)
        self.catch_up()


class RealTime(TimePolicy):
    """Real time: the world stands where the wall clock says, as often as a call comes, and a wait is one."""

    def __init__(self, port: RadioPort, inbox: ByteFifo, pace: Pace) -> None:
        super().__init__(port, inbox)
        self.pace = pace

    def catch_up(self) -> None:
        world = self.port.world
        due = self.pace.tick()
        latest = due + int(CATCH_UP_S * self.pace.factor * TICKS_PER_SECOND)
        while world.tick < due and not world.stopped and self.pace.tick() < latest:
            world.run_to(min(due, world.tick + CONTROL_PERIOD_TICKS))
            self.inbox.add(self.port.received())
        if behind := self.pace.note(world.tick, world.tick, self.pace.tick()):
            _log.warning("tick %d: %s", world.tick, behind)

    def rest(self, tick: int) -> None:
        self.pace.sleep_until(min(tick, self.port.world.tick + HOST_CHARACTER_TICKS))
