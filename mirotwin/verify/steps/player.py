"""Does the steps of a scenario in a world, in virtual time, one after the other.

    player = Player(world, steps_of(scenario, origin), origin)
    player.play()                          to the first step that fails, or to the last
    player.finish()                        and on to the end of the run
    player.failure                         None, or what was wanted and what was found

An action takes no time; what it does begins some microseconds later. A wait ends at the tick of its event and leaves
what happens later, also on the same tick, to the next one. So does a pause; what happens in `never`, `hold` and
`silence_for_ms` is past when they end. Once a control period, and before each frame of a stream, the world stops on the
way, which changes nothing of the run.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import msgspec

from miro_exact.clock import CONTROL_PERIOD_TICKS, NEVER_TICK
from miro_sim.scenario.errors import ScenarioError
from miro_sim.world.conditions import Answer, Condition, WheelSpeeds, When, answer_fields, speeds_of
from miro_sim.world.events import Event
from miro_sim.world.waits import SEEN_AT_MOST, WaitExpired
from miro_sim.world.world import World
from mirotwin.verify.checks.monitors import Checks
from mirotwin.verify.steps.keys import (
    CheckStep,
    HoldStep,
    NeverStep,
    PauseStep,
    PowerStep,
    RadioStep,
    ResetStep,
    SaveStep,
    SendStep,
    Step,
    StreamStep,
    WaitStep,
    end_ms,
)
from mirotwin.verify.steps.sender import Host


class StepFailure(msgspec.Struct, frozen=True):
    """`step` failed at `tick`: what was wanted, what was found.

    `begun_tick`: where the step began; `timed_out`: it waited for what did not come.
    """

    step: str
    number: int
    begun_tick: int
    tick: int
    wanted: str
    found: str
    timed_out: bool = False

    def __str__(self) -> str:
        return (
            f"{self.step}: tick {self.tick} ({end_ms(self.tick)}): wanted {self.wanted}, found {self.found}"
        )


class _Failed(Exception):
    """A step was not fulfilled, at a tick."""

    def __init__(self, tick: int, wanted: str, found: str, timed_out: bool = False) -> None:
        super().__init__(wanted, found)
        self.timed_out = timed_out
        self.tick = tick
        self.wanted = wanted
        self.found = found


class Player:
    """`done`: so many steps were. `saved`: by name, what `save` steps kept. `checks`: those that steps began."""

    def __init__(self, world: World, steps: Sequence[Step], origin: str = "") -> None:
        self.world = world
        self.steps = list(steps)
        self.origin = origin
        self.hosts = [Host(world, index) for index in range(len(world.networks))]
        self.done = 0
        self.failure: StepFailure | None = None
        self.saved: dict[str, bytes] = {}
        self.checks: list[Checks] = []

    def play(self) -> None:
        """Does the steps. Raises ScenarioError for one that the file cannot have meant."""
        for step in self.steps[self.done :]:
            begun_tick = self.world.tick
            try:
                if self.world.finished:
                    raise _Failed(begun_tick, "to be done", self._end())
                self._do(step)
            except _Failed as failed:
                self.failure = StepFailure(
                    f"{step}",
                    step.number,
                    begun_tick,
                    failed.tick,
                    failed.wanted,
                    failed.found,
                    failed.timed_out,
                )
                return
            except ValueError as error:
                if isinstance(error, ScenarioError):
                    raise
                what, _, remedy = f"{error}".partition("; ")
                raise ScenarioError(self.origin, f"step {step.number}", what, remedy) from error
            self.done += 1

    def finish(self) -> None:
        """Runs to the end; what goes on by itself goes on. Ends the checks that steps began."""
        world = self.world
        while not world.finished:
            world.run_to(min(world.period_end, self._next_tick()))
            self._top_up()
        for checks in self.checks:
            checks.finish()

    def _do(self, step: Step) -> None:
        world = self.world
        match step:
            case SendStep():
                self.hosts[step.network].send(step.what)
            case StreamStep():
                host = self.hosts[step.network]
                host.stream = None
                if step.stream == "on":
                    host.begin(step)
                    host.top_up()
            case WaitStep():
                self._wait_for(step)
            case NeverStep():
                self._never(step, step.condition, step.condition)
            case HoldStep():
                self._never(step, step.condition, _opposite(step.condition))
            case PauseStep():
                self._pause(world.tick + step.lasts_ticks())
            case CheckStep():
                self._begin_checks(step)
            case RadioStep():
                world.set_radio(step.radio, step.network)
            case ResetStep():
                world.set_reset(step.reset, step.network, self._slot(step.slot, step.network))
            case PowerStep():
                world.set_power(int(step.power == "on"), step.network, self._slot(step.slot, step.network))
            case SaveStep():
                self.saved[step.save] = world.save()

    def _slot(self, slot: int | None, network: int) -> int:
        return self.hosts[network].first_slot if slot is None else slot

    # Waiting

    def _wait_for(self, step: WaitStep) -> None:
        world, wanted = self.world, step.condition
        begun_tick = world.tick
        if step.from_now:
            world.waits.collect()
            world.waits.pass_over()
        until_tick = NEVER_TICK if step.within_ms is None else begun_tick + step.needs_ticks()
        seen: list[Event] = []
        kind = wanted.any_of_its_kind() if step.verb == "expect" else wanted
        event = self._next(kind, until_tick, seen)
        if event is None:
            raise _Failed(world.tick, step.wanted, self._nothing(wanted, seen), timed_out=True)
        if kind != wanted and not wanted.met_by(event):
            raise _Failed(event.tick, step.wanted, self._other(wanted, event))

    def _never(self, step: NeverStep | HoldStep, condition: Condition, forbidden: Condition) -> None:
        world = self.world
        world.waits.collect()
        world.waits.pass_over()
        until_tick = world.tick + step.lasts_ticks()
        event = self._next(forbidden, until_tick, [])
        if event is not None:
            wanted = f"{'no ' if condition is forbidden else ''}{condition} for {step.for_ms:g} ms"
            raise _Failed(event.tick, wanted, self._other(condition, event))
        if world.tick < until_tick:
            raise _Failed(world.tick, f"{step.for_ms:g} ms of it", self._end())

    def _next(self, condition: Condition, until_tick: int, seen: list[Event]) -> Event | None:
        """The next event for which `condition` is true, up to `until_tick`; `seen` gets those before it."""
        world = self.world
        while True:
            stop_tick = min(until_tick, self._next_tick())
            within = None if stop_tick == NEVER_TICK else max(0, stop_tick - world.tick)
            try:
                return world.run_until(condition, within=within)
            except WaitExpired as expired:
                seen += expired.seen
                del seen[:-SEEN_AT_MOST]
            if world.finished or world.tick >= until_tick:
                return None
            self._top_up()

    def _pause(self, until_tick: int) -> None:
        world = self.world
        while world.tick < until_tick and not world.finished:
            longest_tick = world.tick + CONTROL_PERIOD_TICKS
            world.run_to(min(until_tick, longest_tick, self._next_tick()))
            world.waits.collect()
            self._top_up()
        if world.tick < until_tick:
            raise _Failed(world.tick, "time to pass", self._end())

    def _next_tick(self) -> int:
        return min(host.next_tick for host in self.hosts)

    def _top_up(self) -> None:
        for host in self.hosts:
            host.top_up()

    def _begin_checks(self, step: CheckStep) -> None:
        places = [
            (network.index, robot.slot)
            for network in self.world.networks
            for robot in network.robots
            if step.network_ in (None, network.index) and step.slot in (None, robot.slot)
        ]
        self.checks.append(Checks(self.world, dict.fromkeys(places, step.checks)))

    # What was found

    def _end(self) -> str:
        stopped = "a firmware fault has stopped the run" if self.world.stopped else "the run is over"
        return f"that {stopped}"

    def _nothing(self, wanted: Condition, seen: Sequence[Event]) -> str:
        """What there was instead of the event that was wanted."""
        found = [self._end()] if self.world.finished else []
        if isinstance(wanted, WheelSpeeds):
            found.append(self._speeds(wanted))
        found.append(_meanwhile(seen))
        return "; ".join(found)

    def _other(self, wanted: Condition, event: Event) -> str:
        """The event that came instead."""
        if isinstance(wanted, WheelSpeeds):
            return self._speeds(wanted)
        _, _, said = f"{event}".partition(": ")
        if isinstance(wanted, Answer):
            shown = [
                f"{key} = {str(value).lower()}"
                for key, value in answer_fields(event).items()
                if key == "slot" or getattr(wanted, key) is not None
            ]
            said = f"{said} with {', '.join(shown)}"
        return said

    def _speeds(self, wanted: WheelSpeeds) -> str:
        robot = self.world.robot(wanted.network, self._slot(wanted.slot, wanted.network))
        left, right = speeds_of(robot)
        return f"left_m_s = {left:.4f}, right_m_s = {right:.4f}"


def _opposite(speeds: WheelSpeeds) -> Condition:
    """True as soon as the wheels turn otherwise."""
    return When(network=speeds.network, slot=speeds.slot, predicate=lambda robot: not speeds.predicate(robot))


def _meanwhile(seen: Sequence[Event]) -> str:
    """What happened in a wait, in one line: how much of each kind, and what was last."""
    events = [event for event in seen if event.what != "true"]
    if not events:
        return "nothing happened meanwhile"
    counted = Counter(event.what for event in events)
    parts = ", ".join(f"{count} {what}" for what, count in counted.items())
    return f"none of it, but {parts}; the last: {events[-1]}"
