"""The run of a page once more, under the eyes of checks and watchers: what a recording does not hold.

The first robot's processor is watched instruction by instruction; the bits of the run do not depend on it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import msgspec

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_robot.image import Image
from miro_robot.inspect.activity import Activity
from miro_robot.inspect.counters import Counters
from miro_robot.inspect.coverage import Counts, counts_of
from miro_robot.inspect.profile import Profile
from miro_robot.inspect.profile import profile as profile_of
from miro_robot.inspect.watcher import attach, detach
from miro_sim.periods import Period
from miro_sim.world.world import World
from mirotwin.firmware.coverage_files import with_debug_files
from mirotwin.report.page.link import LinkLog, LinkMark
from mirotwin.verify.checks.expect import Place
from mirotwin.verify.checks.interface import Check, Expectation, Failure
from mirotwin.verify.checks.watching import Checks


class Fault(msgspec.Struct, frozen=True):
    """What the firmware of a robot did that it must not do."""

    network: int
    slot: int
    tick: int
    text: str


class Again(msgspec.Struct, frozen=True):
    """The result. `image` has its debug files where they are; `robot`: whose processor was watched."""

    periods: list[Period]
    end_tick: int
    digest: str
    verdicts: tuple[Expectation, ...]
    failures: list[Failure]
    faults: list[Fault]
    marks: list[LinkMark]
    image: Image
    robot: str
    profile: Profile
    counts: Counts


def run_again(
    world: World,
    end_tick: int,
    expected: Mapping[Place, Sequence[Check]] | None = None,
    progress: Callable[[int], object] = lambda tick: None,
) -> Again:
    """Runs `world` to `end_tick`, where its checks end, and on to the end of that control period.

    `expected`: the checks; by default those of its scenario. `progress` is told the tick. Raises TransmissionError for
    a script that cannot be sent.
    """
    periods: list[Period] = []
    world.observers.append(periods.append)
    checks, log = Checks(world, expected), LinkLog(world)
    counters, activity = Counters(), Activity()
    cpu = world.networks[0].robots[0].board.cpu
    attach(cpu, counters, activity)
    try:
        while not world.stopped and world.tick < end_tick:
            world.run_to(min(end_tick, (world.index + 1) * CONTROL_PERIOD_TICKS))
            progress(world.tick)
        over_tick = world.tick
        checks.finish()
    finally:
        detach(cpu, counters, activity)
    if not world.stopped and world.in_period:
        world.run_to(world.period_end)
    image = with_debug_files(world.image)
    place = world.networks[0].index, world.networks[0].robots[0].slot
    return Again(
        periods=periods,
        end_tick=over_tick,
        digest=world.digest,
        verdicts=checks.verdicts(),
        failures=checks.failures,
        faults=_faults(world),
        marks=log.marks(),
        image=image,
        robot=f"net{place[0]}/robot{place[1]}",
        profile=profile_of(image, counters, activity),
        counts=counts_of(counters),
    )


def _faults(world: World) -> list[Fault]:
    return [
        Fault(network.index, robot.slot, fault.tick, f"{fault}")
        for network in world.networks
        for robot in network.robots
        for fault in robot.board.faults
    ]
