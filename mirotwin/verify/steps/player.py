"""Executes the steps of a scenario in a world, in virtual time, one after the other.

    player = player_of(world, steps_of(scenario, origin), origin)
    player.play()                          to the first step that fails, or to the last
    player.finish()                        and on to the end of the run
    player.failure                         None, or the wanted and the observed behaviour

An action takes no time; its effect begins some microseconds later. A wait ends at the tick of its event; later events,
also on the same tick, are left for the next wait. The same holds for a pause. Events during `never`, `hold` and
`silence_for_ms` are consumed. The world stops once a control period, and before each frame of a stream, which does not
change the run.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import takewhile

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS, NEVER_TICK, TICKS_PER_SECOND
from miro_host.wheels import Wheels
from miro_protocol.actions import Fault, Put, PutValue
from miro_robot.image import Image
from miro_sim.scenario.errors import ScenarioError
from miro_sim.world.conditions import (
    Answer,
    Condition,
    Duty,
    Followed,
    Frequency,
    OfPin,
    Reached,
    WheelSpeeds,
    When,
    answer_fields,
    speeds_of,
)
from miro_sim.world.events import Event
from miro_sim.world.machine import Machine, why_not
from miro_sim.world.waits import SEEN_AT_MOST, WaitExpired
from miro_sim.world.world import World
from mirotwin.verify.checks.interface import Check, at, in_ms, ms_ticks
from mirotwin.verify.checks.monitors import Checks
from mirotwin.verify.effect import Proof
from mirotwin.verify.frame_sender import FrameSender
from mirotwin.verify.steps.keys import Step

WHEELS = Wheels()


class Host(FrameSender):
    """The host of one network; its first frame has number 1.

    It sends a stream of team frames. `due_tick`: first start bit of the next frame, which is announced `lead_ticks`
    earlier. `remaining`: frames that it still sends; None: no end.
    """

    def __init__(self, machine: Machine, network: int) -> None:
        super().__init__(machine, network, 0)
        self.first_slot = min(robot.slot for robot in machine.scenario.networks[network].robot)
        self.end()

    def command(self, slot: int, left_m_s: float | None, right_m_s: float | None) -> None:
        """New velocities of one robot; None: as before."""
        left, right = self.velocities[slot]
        left = left if left_m_s is None else WHEELS.counts(left_m_s)
        right = right if right_m_s is None else WHEELS.counts(right_m_s)
        self.velocities[slot] = (left, right)

    # The stream

    def begin(self, every_ticks: int, frames: int | None, ask: bool) -> None:
        """Frames from now on, with the velocities that were sent or commanded last."""
        # Kept for all frames of the stream: how long before its start bit a frame has to be announced.
        self.due_tick = self.machine.earliest_tick(self.network)
        self.lead_ticks = self.due_tick - self.machine.tick
        self.every_ticks, self.ask, self.remaining = every_ticks, ask, frames
        self.top_up()

    def end(self) -> None:
        """Ends the stream of frames."""
        self.due_tick, self.lead_ticks = NEVER_TICK, 0

    @property
    def next_tick(self) -> int:
        """Tick at which the next frame of the stream must be announced."""
        return self.due_tick - self.lead_ticks

    def top_up(self) -> None:
        """Announces the frames that are due."""
        while self.next_tick <= self.machine.tick:
            self.put(self.team(self.ask))
            self.due_tick += self.every_ticks
            if self.remaining is not None:
                self.remaining -= 1
                if not self.remaining:
                    self.end()


class StepFailure(msgspec.Struct, frozen=True):
    """`step` failed at `tick`: wanted and observed behaviour.

    `begun_tick`: begin of the step; `timed_out`: it waited in vain. `clock`: ticks per second.
    """

    step: str
    number: int
    begun_tick: int
    tick: int
    wanted: str
    found: str
    timed_out: bool = False
    clock: int = TICKS_PER_SECOND

    def __str__(self) -> str:
        return f"{self.step}: {at(self.tick, self.clock)}: wanted {self.wanted}, found {self.found}"


class _Failed(Exception):
    """A failed step: tick, wanted and observed behaviour, and True if it waited in vain."""


class Player:
    """Executes the steps of a scenario on a machine.

    `steps`: the steps that the machine can execute and observe, up to the first that it cannot and on which later steps
    depend. `unseen`: a line for each step that it cannot execute or observe. `count`: number of all steps; `done`:
    number of steps done, `took_ticks`: how long each took. `saved`: states of `save` steps, by name. `checks`: checks
    that steps began.
    """

    def __init__(self, machine: Machine, steps: Sequence[Step], origin: str = "") -> None:
        self.machine = machine
        lines = [(step, why_not(machine, step, step.needs)) for step in steps]
        self.unseen = [line for _, line in lines if line]
        # Behind a step that changes the run and cannot be done, the rest would judge another run.
        to_change = takewhile(lambda both: not (both[1] and both[0].CHANGES), lines)
        self.steps = [step for step, line in to_change if not line]
        self.count = len(steps)
        self.origin = origin
        self.hosts = [Host(machine, index) for index in range(len(machine.networks))]
        self.done = 0
        self.took_ticks: list[int] = []
        self.failure: StepFailure | None = None
        self.saved: dict[str, bytes] = {}
        self.checks: list[Checks] = []
        self.proofs: list[Proof] = []  # of faults
        self.found = ""  # what pins, values and text were in the last wait
        self.pressed: dict[str, int] = {}  # until which tick a button is
        # Before the first instruction: how long a level lasts is not known without the edge that began it.
        self._watch_pins()

    @property
    def world(self) -> World:
        """The machine of steps that need more than every machine has."""
        assert isinstance(self.machine, World)
        return self.machine

    def ticks(self, time_ms: float) -> int:
        """Milliseconds to ticks of the machine's clock."""
        return ms_ticks(time_ms, self.machine.clock)

    def run(self) -> None:
        """The whole run: `play`, then `finish`."""
        self.play()
        self.finish()

    def play(self) -> None:
        """Executes the steps. Raises ScenarioError for an impossible step."""
        for step in self.steps[self.done :]:
            begun_tick = self.machine.tick
            try:
                # Not passed over: a step that was never done would count as one that was fulfilled.
                if self.machine.finished:
                    raise _Failed(begun_tick, "to be done", self._end())
                step.do(self)
            except _Failed as failed:
                failure = StepFailure(f"{step}", step.number, begun_tick, *failed.args)
                self.failure = msgspec.structs.replace(failure, clock=self.machine.clock)
                return
            except ValueError as error:
                # It names the file already.
                if isinstance(error, ScenarioError):
                    raise
                reason, _, remedy = f"{error}".removeprefix(f"{self.origin}: ").partition("; ")
                raise ScenarioError(self.origin, f"step {step.number}", reason, remedy) from error
            self.done += 1
            self.took_ticks.append(self.machine.tick - begun_tick)

    def finish(self) -> None:
        """Runs to the end with streams and held buttons continuing, and ends the checks that steps began."""
        machine = self.machine
        while not machine.finished:
            # Not past the next frame of a stream: a frame cannot be announced for a tick that is settled.
            machine.run_to(min(machine.period_end, self._next_tick()))
            self._top_up()
        for checks in self.checks:
            checks.finish()

    def slot(self, slot: int | None, network: int) -> int:
        """The slot, or that of the network's first robot."""
        return self.machine.lines[network].first_slot if slot is None else slot

    # Waiting

    def wait_for(
        self, wanted: Condition, kind: Condition, within_ms: float | None, from_now: bool = False
    ) -> None:
        """On to the first event of `kind`, which has to be the one that is wanted; both may be the same."""
        machine = self.machine
        if from_now:
            self._forget()
        until_tick = NEVER_TICK if within_ms is None else machine.tick + self.ticks(within_ms)
        awaited = f"{wanted}" if within_ms is None else f"{wanted} within {within_ms:g} ms"
        earlier: list[Event] = []
        event = self._next(kind, until_tick, earlier)
        if event is None:
            raise _Failed(machine.tick, awaited, self._nothing(wanted, earlier), True)
        # The first answer decides: a later one that fits is to another question.
        if kind != wanted and not wanted.met_by(event):
            raise _Failed(event.tick, awaited, self._other(wanted, event))

    def hold(self, condition: Condition, for_ms: float, never: bool) -> None:
        """Watches for `for_ms`: the wheels have to keep their speeds, or the condition must `never` become true."""
        machine, forbidden, required = self.machine, condition, f"no {condition}"
        if isinstance(condition, Followed) and not never:
            forbidden, required = condition.opposite(), f"{condition}"
        if isinstance(condition, WheelSpeeds) and not never:
            holds = condition.predicate
            forbidden = When(
                network=condition.network, slot=condition.slot, predicate=lambda robot: not holds(robot)
            )
            required = f"{condition}"
        # First: a `put` of the step before takes 120 ticks, and would itself break the hold.
        self._let_act()
        self._forget()
        until_tick = machine.tick + self.ticks(for_ms)
        event = self._next(forbidden, until_tick, [])
        if event is not None:
            raise _Failed(event.tick, f"{required} for {for_ms:g} ms", self._other(condition, event))
        if isinstance(condition, Frequency | Duty) and not never and self.found.endswith("no period"):
            raise _Failed(machine.tick, f"{required} for {for_ms:g} ms", self.found)
        if machine.tick < until_tick:
            raise _Failed(machine.tick, f"{for_ms:g} ms of it", self._end())

    def _let_act(self) -> None:
        """Runs until the actions of earlier steps have taken effect, so that a following check judges their result."""
        machine = self.machine
        if isinstance(machine, World) and not self.hosts:  # a board
            begun_tick, last_tick = machine.tick, machine.earliest_action_tick
            ticks = [action.tick for line in machine.lines for action in line.actions.waiting]
            done_tick = max((tick for tick in ticks if begun_tick <= tick <= last_tick), default=-1)
            if done_tick >= 0:
                machine.run_to(done_tick + 1)

    def _forget(self) -> None:
        """Passes over the events up to now."""
        # Collect first: `pass_over` leaves out only what has been read from the logs.
        self.machine.waits.collect()
        self.machine.waits.pass_over()

    def _next(self, condition: Condition, until_tick: int, earlier: list[Event]) -> Event | None:
        """The next event for which `condition` is true, up to `until_tick`; `earlier` gets those before it."""
        machine, self.found = self.machine, ""
        while True:
            # In stretches, because a stream of frames goes on while a step waits.
            stop_tick = min(until_tick, self._next_tick())
            within = None if stop_tick == NEVER_TICK else max(0, stop_tick - machine.tick)
            try:
                return machine.run_until(condition, within=within)
            except WaitExpired as expired:
                self.found = expired.found
                earlier += expired.seen
                del earlier[:-SEEN_AT_MOST]
            # After the wait, not before: with 0 ms left an event of this tick still counts.
            if machine.finished or machine.tick >= until_tick:
                return None
            self._top_up()

    def pause(self, for_ms: float) -> None:
        """Lets time pass; the next wait also sees the events of this time."""
        machine, until_tick = self.machine, self.machine.tick + self.ticks(for_ms)
        while machine.tick < until_tick and not machine.finished:
            # Once a period: a log holds 2048 events, and the next wait would miss the first.
            longest_tick = machine.tick + CONTROL_PERIOD_TICKS
            machine.run_to(min(until_tick, longest_tick, self._next_tick()))
            machine.waits.collect()
            self._top_up()
        if machine.tick < until_tick:
            raise _Failed(machine.tick, "time to pass", self._end())

    def _next_tick(self) -> int:
        return min((host.next_tick for host in self.hosts), default=NEVER_TICK)

    def _top_up(self) -> None:
        for host in self.hosts:
            host.top_up()

    def begin_checks(self, checks: Sequence[Check], network: int | None, slot: int | None) -> None:
        """Checks from now on, of the robots in that network and slot; None: of all."""
        places = [
            (robot.network, robot.slot)
            for robot in self.machine.devices
            if network in (None, robot.network) and slot in (None, robot.slot)
        ]
        self.checks.append(Checks(self.world, dict.fromkeys(places, checks)))

    def break_hardware(self, fault: Fault, name: str) -> None:
        """Breaks or repairs hardware as soon as possible; each break must change something, a repair need not."""
        Proof.begin(self.proofs, self.world, name, fault)
        self.machine.do(fault)

    # Parts of a board

    def put(self, values: Sequence[tuple[str, PutValue]]) -> None:
        """Puts values of parts, as soon as possible and on one tick."""
        machine, tick = self.machine, self.machine.earliest_action_tick
        for path, value in values:
            machine.do(Put(tick, 0, 0, path, value))

    def press(self, button: str, for_ms: float) -> None:
        """Presses a button, and lets it go later."""
        machine = self.machine
        tick = machine.earliest_action_tick
        # Its release waits already, and would let this press go too early.
        if tick <= self.pressed.get(button, -1):
            until = in_ms(self.pressed[button], machine.clock)
            raise ValueError(f"{button} is pressed until {until}; let it go before, by pause_ms")
        self.pressed[button] = tick + self.ticks(for_ms)
        machine.do(Put(tick, 0, 0, f"{button}.pressed", True))
        machine.do(Put(self.pressed[button], 0, 0, f"{button}.pressed", False))

    def _watch_pins(self) -> None:
        """Lets the boards record the edges of the pins named in steps, so that a wait knows their levels."""
        for step in self.steps:
            condition = getattr(step, "condition", None)
            if isinstance(condition, OfPin) and "board" in condition.SUBJECTS:
                changes, pin = (
                    (None, "") if self.hosts else self.machine.device(condition.network).source(condition.pin)
                )
                if changes is not None:
                    changes.find(pin)

    # What was found

    def _end(self) -> str:
        stopped = "a firmware fault has stopped the run" if self.machine.stopped else "the run is over"
        return f"that {stopped}"

    def _nothing(self, wanted: Condition, earlier: Sequence[Event]) -> str:
        """Text about the events that happened instead of the wanted one."""
        parts = [self._end()] if self.machine.finished else []
        if isinstance(wanted, WheelSpeeds):
            parts.append(self._speeds(wanted))
        if self.found:
            return "; ".join([*parts, self.found])
        parts.append(_meanwhile(earlier))
        return "; ".join(parts)

    def _other(self, wanted: Condition, event: Event) -> str:
        """The event that came instead."""
        if isinstance(wanted, WheelSpeeds):
            return self._speeds(wanted)
        text = f"{event}".split(": ", 1)[1]
        if not self.hosts:  # of a board alone the place says nothing
            text = text.partition(": ")[2]
        if isinstance(wanted, Answer):
            shown = [
                f"{key} = {str(value).lower()}"
                for key, value in answer_fields(event).items()
                if key == "slot" or getattr(wanted, key) is not None
            ]
            text = f"{text} with {', '.join(shown)}"
        return text

    def _speeds(self, wanted: WheelSpeeds) -> str:
        robot = self.machine.robot(wanted.network, self.slot(wanted.slot, wanted.network))
        left, right = speeds_of(robot)
        return f"left_m_s = {left:.4f}, right_m_s = {right:.4f}"


def _meanwhile(earlier: Sequence[Event]) -> str:
    """The events of a wait in one line: the count of each kind, and the last event."""
    events = [event for event in earlier if event.what != "true"]
    if not events:
        return "nothing happened meanwhile"
    counted = Counter(event.what for event in events)
    parts = ", ".join(f"{count} {kind}" for kind, count in counted.items())
    return f"only {parts}; the last: {events[-1]}"


def player_of(world: World, steps: Sequence[Step], origin: str) -> Player | None:
    """The player of these steps; None where there are none. Raises ScenarioError for a symbol that is unknown."""
    check_symbols(steps, world.image, origin)
    return Player(world, steps, origin) if steps else None


def check_symbols(steps: Sequence[Step], image: Image, origin: str) -> None:
    """Raises ScenarioError for a step that waits for a symbol which the image does not have."""
    for step in steps:
        condition = getattr(step, "condition", None)
        if not isinstance(condition, Reached) or condition.symbol is None:
            continue
        try:
            image.code_address(condition.symbol)
        except BadInput as error:
            reason = f"{error.what} of {image.path}"
            raise ScenarioError(origin, f"step {step.number}.symbol", reason, error.remedy) from None
