"""Robots at a port under the names of a `World`: what a PC can do with them, for steps and tests that know no port.

Time passes as on the wall clock, and an event is known when its characters are there. What needs a robot's inside, or a
switch on it, raises NotObservable.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NoReturn

import msgspec

from miro_exact.clock import CONTROL_PERIOD_TICKS, NEVER_TICK, ticks
from miro_protocol.events import Received
from miro_protocol.table import SEQ_MODULUS
from miro_sim.periods import Period
from miro_sim.scenario.keys import NetworkSpec, Scenario
from miro_sim.world.conditions import Answer, Condition, Heard, Sent
from miro_sim.world.events import Event, HostLog
from miro_sim.world.waits import SEEN_AT_MOST, WaitExpired
from mirotwin.desk.robot_port import RobotPort
from mirotwin.desk.session import Greeting, answer_of, greet

SEEN = (Answer, Heard, Sent)
"""The conditions that a PC can see."""


class NotObservable(Exception):
    """Something of a robot that no port shows."""

    def __init__(self, what: str) -> None:
        super().__init__(f"{what}: not observable on a port")


class PortNetwork(msgspec.Struct, frozen=True):
    """The one network of a port. Nobody sees the inside of its robots."""

    spec: NetworkSpec
    log: HostLog
    index: int = 0
    robots: tuple[()] = ()


class PortWorld:
    """The robots at `port`, whose network and duration are those of `scenario`; tick 0 is after the greeting.

    `accepted` and `rejected` count from there, as from a power-on.
    """

    def __init__(self, port: RobotPort, scenario: Scenario, next_seq: int = 0) -> None:
        self.port = port
        self.scenario = scenario
        spec = scenario.networks[0]
        self.greeting: Greeting = greet(port, spec.robots, next_seq)
        self.began_tick = port.tick
        self.end_tick = max(1, -(-ticks(scenario.duration_s) // CONTROL_PERIOD_TICKS)) * CONTROL_PERIOD_TICKS
        self.networks = [PortNetwork(spec, HostLog(0, lambda tick: tick))]
        self.observers: list[Callable[[Period], object]] = []
        self.stopped = False
        self.faults: tuple[()] = ()
        self._counted = self._counts()
        self._answers = len(port.answers)
        self.waits = PortWaits(self)
        port.listener = self._hear

    def _counts(self) -> dict[int, tuple[int, int]]:
        """By slot, what the counters are at tick 0: as told last, and the questions to others since then."""
        found, last_seq = {}, self.port.guard.last_seq
        for heard in self.port.answers:
            said = answer_of(heard.frame)
            if said is not None:
                found[said.slot] = (said.accepted + (last_seq - said.seq) % SEQ_MODULUS, said.rejected)
        return found

    # ---- time --------------------------------------------------------------------------------------------

    @property
    def tick(self) -> int:
        return self.port.tick - self.began_tick

    @property
    def finished(self) -> bool:
        return self.tick >= self.end_tick

    @property
    def period_end(self) -> int:
        return (self.tick // CONTROL_PERIOD_TICKS + 1) * CONTROL_PERIOD_TICKS

    def run_to(self, tick: int) -> None:
        self.port.run_to(tick + self.began_tick)

    def run_for(self, for_ticks: int) -> None:
        self.run_to(self.tick + for_ticks)

    def run_until(self, condition: Condition, *others: Condition, within: int | None = None) -> Event:
        return self.waits.until([condition, *others], within)

    # ---- sending -----------------------------------------------------------------------------------------

    def earliest_tick(self, network: int = 0) -> int:
        return max(self.tick, self.port.free_tick - self.began_tick)

    def inject(
        self, data: bytes, network: int = 0, at_tick: int | None = None, bad_stop: Sequence[int] = ()
    ) -> int:
        """Sends now, or waits until `at_tick` first; the tick of the first start bit. Raises BadInput."""
        if bad_stop:
            raise NotObservable("a character with a bad stop bit")
        if at_tick is not None:
            self.run_to(at_tick)
        sent = self.port.send(data, due_tick=None if at_tick is None else at_tick + self.began_tick)
        tick = sent.tick - self.began_tick
        self.networks[0].log.note(Event(tick=tick, what="sent", data=data))
        return tick

    # ---- what comes --------------------------------------------------------------------------------------

    def _hear(self, data: bytes, now: int) -> None:
        log, tick = self.networks[0].log, now - self.began_tick
        for byte in data:
            log.note(Event(tick=tick, what="heard", value=byte))
        for heard in self.port.answers[self._answers :]:
            said = answer_of(heard.frame)
            slot = -1 if said is None else said.slot
            log.note(Event(tick=tick, what="answer", value=slot, frame=self._from_zero(heard.frame, slot)))
        self._answers = len(self.port.answers)

    def _from_zero(self, frame: Received, slot: int) -> Received:
        """The answer with counters that began with the greeting; they are its last two bytes."""
        counts = self._counted.get(slot, (0, 0))
        last = bytes(byte - count & 0xFF for byte, count in zip(frame.body[-2:], counts, strict=True))
        return msgspec.structs.replace(frame, body=frame.body[:-2] + last)

    def __getattr__(self, name: str) -> NoReturn:
        if name.startswith("__"):
            raise AttributeError(name)
        raise NotObservable(f"`{name}` of a robot's world")


class PortWaits:
    """Waits on what the PC sees; each event is taken by one of them."""

    def __init__(self, world: PortWorld) -> None:
        self.world = world
        self.read = world.networks[0].log.end
        self.backlog: list[Event] = []

    def collect(self) -> None:
        log = self.world.networks[0].log
        self.backlog += [event for _, event in log.since(self.read)]
        self.read = log.end

    def pass_over(self) -> None:
        """What was collected does not count for the next wait."""
        self.backlog.clear()

    def until(self, conditions: Sequence[Condition], within: int | None) -> Event:
        """The next event for which one of them is true. Raises WaitExpired, NotObservable."""
        for condition in conditions:
            if not isinstance(condition, SEEN):
                raise NotObservable(f"{condition}")
        world = self.world
        begun_tick = world.tick
        deadline = NEVER_TICK if within is None else begun_tick + within
        seen: list[Event] = []
        while True:
            self.collect()
            while self.backlog and self.backlog[0].tick <= deadline:
                event = self.backlog.pop(0)
                if any(condition.met_by(event) for condition in conditions):
                    return event
                seen.append(event)
            if world.finished or world.tick >= deadline:
                why = "the run ended" if world.finished else f"{within} ticks passed"
                raise WaitExpired(conditions, begun_tick, world.tick, why, seen[-SEEN_AT_MOST:])
            world.port.run_to_character(min(deadline, world.end_tick) + world.began_tick)
