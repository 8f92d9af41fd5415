"""Repeats the run of a page with checks and watchers, for data that a recording does not contain.

The first robot's processor is watched instruction by instruction; the bits of the run do not depend on it.
"""

from __future__ import annotations

from itertools import accumulate

import msgspec

from miro_robot.faults import FirmwareFault
from miro_robot.image import Image
from miro_robot.inspect.counters import Activity, Counters
from miro_robot.inspect.coverage import Counts, counts_of
from miro_robot.inspect.profile import Profile
from miro_robot.inspect.profile import profile as profile_of
from miro_robot.inspect.watcher import attach, detach
from miro_sim.periods import Period
from mirotwin.report.page.board_watch import BoardWatch
from mirotwin.report.page.link import LinkLog, LinkMark
from mirotwin.runs.job import Job
from mirotwin.runs.result import Result
from mirotwin.runs.run import Run, replaying
from mirotwin.shell.debug_files import with_debug_files
from mirotwin.shell.options import plain_parameters
from mirotwin.shell.progress import ProgressBar
from mirotwin.verify.steps.player import Player


class WatchedRun(msgspec.Struct, frozen=True):
    """`digest`: at the end of the last of `periods`; `faults`: network, slot, fault. `image`: with its debug files, if
    they exist; `robot`: the one whose processor was watched. `steps`: begin, end, text, failed, for a run driven by
    steps. `watch`: of a board.
    """

    result: Result
    periods: list[Period]
    digest: str
    faults: list[tuple[int, int, FirmwareFault]]
    marks: list[LinkMark]
    image: Image
    robot: str
    profile: Profile
    counts: Counts
    steps: list[tuple[int, int, str, bool]]
    watch: BoardWatch | None


def run_again(job: Job, until_tick: int | None, quiet: bool) -> WatchedRun:
    """Runs `job` to `until_tick` (None: its end), and on to the end of that control period. Raises BadInput."""
    spec = msgspec.structs.replace(job.spec, until_tick=until_tick)
    with plain_parameters(spec.origin, "replayed"):
        world = spec.world()
    log = LinkLog(world)
    counters, activity = Counters(), Activity()
    device = world.devices[0]
    watch = None if world.robots else BoardWatch(world)
    cpu = device.board.cpu
    attach(cpu, counters, activity)
    total = until_tick or spec.scenario.end_tick
    with ProgressBar("running it again", total, quiet) as bar, replaying(spec.origin, world):
        again = Run(spec, world).play(bar.to)
        detach(cpu, counters, activity)
        if not world.stopped and world.in_period:
            world.run_to(world.period_end)
    image = with_debug_files(world.image)
    return WatchedRun(
        result=again.result(),
        periods=again.periods,
        digest=world.digest,
        faults=[
            (robot.network, robot.slot, fault) for robot in world.devices for fault in robot.board.faults
        ],
        marks=log.marks(),
        image=image,
        robot=f"net{device.network}/robot{device.slot}" if watch is None else spec.scenario.name,
        profile=profile_of(image, counters, activity),
        counts=counts_of(counters),
        steps=[] if again.player is None else _times(again.player),
        watch=watch,
    )


def _times(player: Player) -> list[tuple[int, int, str, bool]]:
    took, failure = player.took_ticks, player.failure
    done = zip(took, accumulate(took), player.steps, strict=False)
    times = [(end - ticks, end, f"{step}", False) for ticks, end, step in done]
    return times + ([] if failure is None else [(failure.begun_tick, failure.tick, failure.step, True)])
