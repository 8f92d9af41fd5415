"""The rig of one test: its world, links and robots, the checks that judge it, and the report of a failure."""

from __future__ import annotations

import msgspec

from miro_sim.scenario.board import BoardScenario
from miro_sim.world.events import BoardLog, HostLog
from miro_sim.world.machine import Machine
from miro_sim.world.world import World
from mirotwin.runs.failure_place import located
from mirotwin.runs.result import Result
from mirotwin.runs.run import Run
from mirotwin.shell.firmware_image import BOOT_PERIODS, is_up, not_up
from mirotwin.testing.board import BoardUnderTest, SerialUnderTest
from mirotwin.testing.link import Link
from mirotwin.testing.rig_options import RigOptions
from mirotwin.testing.robot import RobotUnderTest
from mirotwin.testing.waiting import WaitFailed, in_words
from mirotwin.verify.cases.artifacts import case_lines, stream_files
from mirotwin.verify.cases.case import Trace
from mirotwin.verify.cases.replay_line import foreign_path
from mirotwin.verify.checks.interface import at

LAST_EVENTS = 240
LAST_LINES = 12
_KEPT = 64
_STATES: dict[tuple[bytes, int, str], bytes] = {}
"""Saved worlds of this process, by scenario, seed and firmware."""


Left = tuple[dict[str, bytes], list[str]]
"""Files of a failed test by name, none where nobody can run it again, and commands that read them."""


class Rig:
    """The world of one test. `links`: by network; `robots`: by network and slot; `tick`: where it ended, -1 before."""

    def __init__(self, options: RigOptions) -> None:
        self.options, self.spec = options, options.spec
        self.run = run_for(options)
        self.world = self.machine = self.run.world
        self.links = [Link(self.world, network.index) for network in self.world.networks]
        self.robots = [RobotUnderTest(self.world, robot.network, robot.slot) for robot in self.world.robots]
        self.board: BoardUnderTest | None = None
        self.serial: SerialUnderTest | None = None
        if isinstance(self.spec.scenario, BoardScenario):
            self.board, self.serial = BoardUnderTest(self.world), SerialUnderTest(self.world)
        for device in (*self.robots, *filter(None, [self.board])):
            device.proofs = self.run.proofs

    @property
    def tick(self) -> int:
        return self.run.tick

    def close(self) -> None:
        """Nothing of a world has to be closed."""

    def judge(self) -> Result:
        """The result of the test's completed run; ends the control period first.

        Raises BadInput for a check that breaks.
        """
        if self.tick < 0:
            self.run.tick = self.world.tick
            if not self.world.stopped and (self.world.in_period or not self.world.finished):
                self.world.run_to(self.world.period_end)
            self.run.finish()
        return self.result()

    def result(self) -> Result:
        """The result so far."""
        return self.run.result()

    def head(self) -> list[str]:
        """Facts about the run, a line each."""
        image, world = self.world.image, self.world
        return [
            f"scenario {world.scenario.name}, seed {world.seed}, {at(self.tick, world.clock)}",
            f"firmware {image.path.name}, {image.sha256[:12]}",
            f"digest {world.digest}",
        ]

    def last_events(self) -> list[str]:
        """The last events up to the end of the test, a line each."""
        return last_events(self.world, self.tick)

    def left(self, caught: BaseException | None, where: str) -> Left:
        """The case, if a check can judge the failure; nothing if the test wrote into a robot's memory.

        `where`: the folder as commands name it.
        """
        if self.written:
            return {}, []
        case = self._case(caught)
        own = foreign_path(self.world.image) is None
        lines = [] if case is None else case_lines(where, own)
        return stream_files(case, self.run.stream(), self.world.image), [*lines]

    @property
    def written(self) -> bool:
        """True if the test wrote into a memory: then its run cannot be repeated from a file."""
        return any(device.written for device in (*self.robots, *filter(None, [self.board])))

    def located(self, caught: BaseException | None, result: Result) -> Result:
        """The result with the C line at which the failed check or wait stopped the device."""
        if isinstance(caught, WaitFailed):
            result = msgspec.structs.replace(result, step_tick=self.tick)
        return result if self.written else located(self.run, result)

    def _case(self, caught: BaseException | None) -> str | None:
        if isinstance(caught, WaitFailed) and caught.expect is not None:
            case = self.run.case_of_expect(caught.expect)
            if case is not None:
                return case
        return self.run.case() if self.run.failures else None

    def __repr__(self) -> str:
        world = self.world
        return f"Rig({world.scenario.name!r}, seed={world.seed}, tick={world.tick})"


def last_events(machine: Machine, end_tick: int) -> list[str]:
    """The last events up to `end_tick` (-1: now), a line each."""
    logs: list[HostLog | BoardLog] = [line.log for line in machine.lines]
    logs += [device.log for device in machine.devices]
    end_tick = machine.tick if end_tick < 0 else end_tick
    events = [
        event for log in logs for _, event in log.since(log.end - LAST_EVENTS) if event.tick <= end_tick
    ]
    events.sort(key=lambda event: event.tick)
    return in_words(events[-LAST_EVENTS:], machine)[-LAST_LINES:]


def run_for(options: RigOptions) -> Run:
    """A new world with a trace of its input, and its checks.

    Its robots have booted; only the first world of its kind waits for the firmware. A robot has booted when its serial
    receiver is on (REN in SCON) at the end of a control period: every robot on a radio must do this, and the rest of
    the period remains for further initialisation.

    Raises BadInput if the firmware does not boot.
    """
    spec = options.spec
    world = spec.world()
    trace = Trace(world)
    scenario = msgspec.json.encode(msgspec.structs.replace(spec.scenario, expect={}))
    key = (scenario, spec.seed, spec.image.sha256)
    # the coverage of the firmware is to count the same however the tests are spread
    watched = any(device.board.cpu.inspector for device in world.devices)
    saved = None if watched or not options.boot else _STATES.get(key)
    if saved is not None:
        world.load(saved)
    run = Run(spec, world, trace)
    run.is_session = True  # the scenario of a test lasts a day; its case ends where the test did
    if options.boot and saved is None:
        _boot(world)
        if not (run.failures or world.faults or watched):  # every test is to see what failed
            if len(_STATES) >= _KEPT:
                del _STATES[next(iter(_STATES))]
            _STATES[key] = world.save()
    return run


def _boot(world: World) -> None:
    for _ in range(BOOT_PERIODS):
        world.step()
        if world.stopped or all(is_up(device.board.cpu) for device in world.devices):
            return
    raise not_up(world.image, "boot=False begins a test at power-on")
