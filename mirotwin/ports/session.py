"""A live session: a world that runs in real time, and the ports through which programs talk to robots or a board.

The world advances in slices of half a millisecond, and programs get their characters at the end of each. A program's
bytes go on the air, or on the wire, at the moment at which they arrive; if the world is behind, at the end of its
control period at the latest. Such a world reports that it is late and catches up as fast as it can: it never skips
time. The recording contains the tick at which bytes went on the air, which is all that a replay needs.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from selectors import BaseSelector

from miro_exact.clock import TICKS_PER_SECOND
from miro_sim.world.world import World
from mirotwin.ports.endpoint import Endpoint, Tell
from mirotwin.ports.put_lines import PutLines
from mirotwin.runs.summary import LiveFigures

FASTEST = 1000.0
"""Virtual seconds in one, at most."""
LATE_S = 0.020
"""Threshold of lateness in seconds: a little more than the 16 ms for which a USB adapter may hold a character."""
SLICE_S = 0.0005
"""Largest extra delay of answers in seconds.

A comparison at a port allows positions to differ by the effect of this delay.
"""
LONGEST_SLICE_S = 0.020


class Pace:
    """Wall time as ticks from when it was made (or `start`ed): `factor` virtual seconds in one, of `clock` ticks each.

    `late_ticks`: the most that a world was behind; `late_s`: virtual time in which it was behind by 20 ms or more.
    """

    def __init__(self, factor: float = 1.0, clock: int = TICKS_PER_SECOND) -> None:
        self.factor = factor
        self.clock = clock
        self.late_ticks = 0
        self.late_s = 0.0
        self._reported_ticks = 0
        self.start(0)

    def start(self, tick: int) -> None:
        """Now is `tick`."""
        self._began_tick = tick
        self._began_s = time.monotonic()

    def tick(self) -> int:
        """The present tick of virtual time by the wall clock."""
        since_s = time.monotonic() - self._began_s
        return self._began_tick + int(since_s * self.factor * self.clock)

    def note(self, from_tick: int, to_tick: int, due_tick: int) -> str:
        """Counts an advance of the world from `from_tick` to `to_tick`, due at `due_tick`. Returns a message about the
        lateness; "" if it is not late, or not twice as late as last reported.
        """
        behind = due_tick - to_tick
        self.late_ticks = max(self.late_ticks, behind)
        if behind < LATE_S * self.clock:
            return ""
        self.late_s += (to_tick - from_tick) / self.clock
        if behind < 2 * self._reported_ticks:
            return ""
        self._reported_ticks = behind
        return f"{1000.0 * behind / self.clock:.0f} ms behind the wall clock"

    def wait_s(self, tick: int) -> float:
        """Wall time until virtual time should be at `tick`; 0 where it should be there already."""
        return max(0, tick - self.tick()) / (self.factor * self.clock)

    def sleep_until(self, tick: int) -> None:
        """Sleeps until virtual time should be at `tick`."""
        time.sleep(self.wait_s(tick))


class Session:
    """Runs `world` until it is over, or `end_tick`; with `once` until all clients have gone.

    `puts`: lines that act on parts of a board.
    """

    def __init__(
        self,
        world: World,
        pace: Pace,
        selector: BaseSelector,
        endpoints: Sequence[Endpoint],
        tell: Tell,
        end_tick: int,
        once: bool = False,
        puts: PutLines | None = None,
    ) -> None:
        self.world = world
        self.pace = pace
        self.selector = selector
        self.endpoints = endpoints
        self.tell = tell
        self.once = once
        self.puts = puts
        self.periods = min(world.periods, -(-end_tick // world.period_ticks))
        self._slice_ticks = max(1, int(min(SLICE_S * pace.factor, LONGEST_SLICE_S) * world.clock))

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
            if self.puts is not None:
                self.puts.exchange(min(due, tick))
            for endpoint in self.endpoints:
                endpoint.exchange(min(due, tick))
                endpoint.push()

    def _advance(self, tick: int, due_tick: int) -> None:
        world, before = self.world, self.world.tick
        if tick <= before:
            return
        world.run_to(tick)
        if behind := self.pace.note(before, tick, due_tick):
            self.tell(f"{tick / world.clock:.3f} s: {behind}")
        received: dict[int, bytes] = {}
        for endpoint in self.endpoints:
            port = endpoint.port
            if port.network not in received:
                received[port.network] = port.received()
            endpoint.deliver(received[port.network])

    def _all_gone(self) -> bool:
        """True if there were clients, all have gone, and their bytes have been sent: closing a port waits for its
        bytes.
        """
        came = any(endpoint.clients for endpoint in self.endpoints)
        return came and not any(endpoint.client or endpoint.port.waiting for endpoint in self.endpoints)

    def live(self) -> LiveFigures:
        """The session's figures for the summary."""
        return LiveFigures(
            realtime=self.pace.factor,
            late_max_ms=1000.0 * self.pace.late_ticks / self.pace.clock,
            late_s=self.pace.late_s,
            plugs=tuple(endpoint.plug() for endpoint in self.endpoints),
        )
