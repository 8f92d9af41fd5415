"""A live session: a world that the wall clock drives, and the ports through which programs talk to its robots.

The world goes on in slices, so that a robot's byte is some milliseconds on its way to a program. When a program's bytes
arrive it is moved on to that very moment first, and they go on the air there. A world that cannot keep pace stays
behind, catches up as fast as it can, and says so: it never skips. The tick at which bytes went on the air is what the
recording keeps; how they came to arrive then is not needed to run it again.
"""

from __future__ import annotations

from collections.abc import Sequence
from selectors import BaseSelector

from miro_exact.clock import CONTROL_PERIOD_TICKS, seconds, ticks
from miro_sim.world.world import World
from mirotwin.ports.endpoint import Endpoint, Tell
from mirotwin.ports.pacing import Pace
from mirotwin.report.summary import LiveFigures

SLICE_S = 0.002
LONGEST_SLICE_TICKS = ticks(0.020)


class Session:
    """Runs `world` until it is over, or `end_tick`; with `once` until all clients have gone."""

    def __init__(
        self,
        world: World,
        pace: Pace,
        selector: BaseSelector,
        endpoints: Sequence[Endpoint],
        tell: Tell,
        end_tick: int,
        once: bool = False,
    ) -> None:
        self.world = world
        self.pace = pace
        self.selector = selector
        self.endpoints = endpoints
        self.tell = tell
        self.once = once
        self.periods = min(world.periods, -(-end_tick // CONTROL_PERIOD_TICKS))
        self._slice_ticks = max(1, min(ticks(SLICE_S * pace.factor), LONGEST_SLICE_TICKS))

    @property
    def finished(self) -> bool:
        return self.world.finished or self.world.index >= self.periods or (self.once and self._all_gone())

    def run(self) -> None:
        """Control period by control period."""
        while not self.finished:
            self.run_to(self.world.period_end)

    def run_to(self, tick: int) -> None:
        """Up to `tick`, as the wall clock goes."""
        world = self.world
        if not world.tick:  # what was opened before took its time
            self.pace.start(0)
        while world.tick < tick and not world.stopped:
            next_tick = world.tick + self._slice_ticks
            self.selector.select(self.pace.wait_s(next_tick))
            due = self.pace.tick()
            self._advance(min(due, tick, next_tick), due)
            for endpoint in self.endpoints:
                endpoint.exchange()

    def _advance(self, tick: int, due_tick: int) -> None:
        before = self.world.tick
        if tick <= before:
            return
        self.world.run_to(tick)
        if behind := self.pace.note(before, tick, due_tick):
            self.tell(f"{seconds(tick):.3f} s: {behind}")
        received: dict[int, bytes] = {}
        for endpoint in self.endpoints:
            port = endpoint.port
            if port.network not in received:
                received[port.network] = port.received()
            endpoint.deliver(received[port.network])
            endpoint.push()

    def _all_gone(self) -> bool:
        """Clients were there, none is, and what they sent has been sent: a port is drained when it is closed."""
        came = any(endpoint.clients for endpoint in self.endpoints)
        return came and not any(endpoint.client or endpoint.port.waiting for endpoint in self.endpoints)

    def live(self) -> LiveFigures:
        """What the summary says of the session."""
        return LiveFigures(
            realtime=self.pace.factor,
            late_max_ms=1000.0 * seconds(self.pace.late_ticks),
            late_s=self.pace.late_s,
            plugs=tuple(endpoint.plug() for endpoint in self.endpoints),
        )
