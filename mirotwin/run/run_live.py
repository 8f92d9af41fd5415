"""`mirotwin run --live`: a run that Foxglove shows while it goes.

The world knows nothing of it: what is sent was recorded, or follows from that.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_sim.periods import Period
from miro_sim.world.world import World
from mirotwin.recording import channels, topics
from mirotwin.recording.channels import TheoryMessage
from mirotwin.report.foxglove import derived, notes
from mirotwin.report.foxglove.derived import Derived, Said
from mirotwin.report.foxglove.messages import ALWAYS, INFO, Log
from mirotwin.report.foxglove.server import Server
from mirotwin.rerun import runner
from mirotwin.rerun.pacing import Pace
from mirotwin.verify.checks.interface import Failure
from mirotwin.verify.checks.monitors import Checks


class LiveView:
    """Sends a run of `world` as it goes, `factor` virtual seconds in one (0: as fast as it can).

    `wait`: the first control period waits for a viewer.
    """

    def __init__(self, server: Server, world: World, checks: Checks, factor: float, wait: bool) -> None:
        self.server = server
        self.world = world
        self.checks = checks
        self.pace = Pace(factor) if factor else None
        self.wait = wait
        self._derived = Derived(world.scenario)
        self._faults: dict[tuple[int, int], int] = {}
        self._failures: set[Failure] = set()
        self._begun = False
        self._early: list[Said] = []  # frames before the first control period

    def period(self, period: Period, theories: Sequence[tuple[int, int, TheoryMessage]]) -> None:
        """A control period is over: sends it when its end has come."""
        found = [
            *(Said(*one) for one in channels.messages(period)),
            *(Said(topics.robot_topic(*one[:2], "theory"), period.tick, one[2]) for one in theories),
            *self._derived.period(period),
            *self._judged(),
        ]
        if not self._begun:
            found = [*self._early, *found]
            self._begin(found, period.tick)
        if self.pace is not None:
            self.pace.sleep_until(period.tick + CONTROL_PERIOD_TICKS)
        self._send(found)
        self.server.tell_time(period.tick)

    def frame(self, network: int, tick: int, png: bytes) -> None:
        """A recorded frame of a camera."""
        found = derived.image(network, tick, png)
        if self._begun:
            self.server.send(found)
        else:
            self._early.append(found)

    def finish(self) -> None:
        """The run is over: what its last moments brought."""
        self._send(self._judged())

    def _begin(self, found: Iterable[Said], tick: int) -> None:
        self._begun = True
        self.server.open([*found, *_rare(self.world)])
        if self.wait:
            self.server.wait_for_viewer()
        if self.pace is not None:
            self.pace.start(tick)

    def _send(self, found: Iterable[Said]) -> None:
        for said in found:
            self.server.send(said)

    def _judged(self) -> Iterator[Said]:
        """New faults of firmwares, and checks that failed."""
        for network, slot, faults in runner.faults_by_robot(self.world):
            told = self._faults.get((network, slot), 0)
            self._faults[network, slot] = len(faults)
            for fault in faults[told:]:
                yield derived.log(fault.tick, notes.of_fault(network, slot, fault.tick, str(fault)))
        for failure in self.checks.failures:
            if failure not in self._failures:
                self._failures.add(failure)
                yield derived.log(failure.tick, notes.of_failure(failure))


def _rare(world: World) -> Iterator[Said]:
    """Messages that nobody gets, for topics that are silent at first: a viewer can ask for what was opened only."""
    yield derived.log(0, Log(ALWAYS, INFO, "", ""))
    for network in world.networks:
        yield Said(topics.wire_topic(network.index), 0, channels.WireMessage(0, "<", "", ()))
        for robot in network.robots:
            seen = channels.MeasurementMessage(0, 0.0, 0.0, 0.0)
            yield Said(topics.robot_topic(network.index, robot.slot, "measurement"), 0, seen)
