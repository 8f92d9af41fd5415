"""A trial to look at: everything that its robots hear, say and are told."""

from __future__ import annotations

from miro_robot.image import Image
from miro_sim.periods import RobotPeriod
from miro_sim.world.events import Event
from miro_sim.world.world import World
from mirotwin.verify.checks.interface import Check, Monitor, Subject
from mirotwin.verify.checks.monitors import Checks
from mirotwin.verify.conform.observed import Observed
from mirotwin.verify.conform.trial import Trial, run_trial


class Listening(Check, frozen=True, kw_only=True, tag="listening"):
    """Expects nothing."""

    KIND = "safety"

    def monitor(self, subject: Subject) -> Monitor[Check]:
        return Listener(self, subject)


class Listener(Monitor[Listening]):
    """`events`: all of one robot and its host, in the order of time; `observed` has what rules ask about."""

    EVENTS = ("sent", "received", "frame", "command", "heard", "answer", "fault", "reset", "power")

    def __init__(self, check: Listening, subject: Subject) -> None:
        super().__init__(check, subject)
        self.events: list[Event] = []
        self.observed = Observed(subject.robots, subject.slot)

    def event(self, event: Event) -> None:
        self.events.append(event)
        if event.what in ("command", "heard", "answer"):
            self.observed.take(event)

    def restarted(self, tick: int) -> None:
        self.observed.restarted(tick)

    def period(self, record: RobotPeriod, tick: int) -> None:
        self.observed.take_period(tick, record, self.subject.robot.board)

    def end(self, tick: int) -> None:
        self.observed.end_tick = tick


def listen(trial: Trial, image: Image, seed: int) -> list[Listener]:
    """A listener for each robot of the trial, which is run to its end."""
    world = World(trial.scenario, seed, image, trial.script)
    places = [(network.index, robot.slot) for network in world.networks for robot in network.robots]
    checks = Checks(world, {place: [Listening()] for place in places})
    run_trial(world)
    checks.finish()
    return [monitor for monitor in checks.monitors if isinstance(monitor, Listener)]
