"""Worlds whose robots are up: each test gets its own, and only the first one of its kind waits for the firmware.

A robot is up when its serial receiver is on (REN in SCON) at the end of a control period: that asks nothing of the
firmware but what a robot on a radio has to do, and leaves it the rest of the period for what comes after.
"""

from __future__ import annotations

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_sim.world.world import World
from mirotwin.testing.robot import is_up
from mirotwin.verify.cases.trace import Trace
from mirotwin.verify.checks.monitors import Checks
from mirotwin.verify.wanted import Wanted

BOOT_PERIODS = 8
"""Control periods, of 33.4 ms, that a firmware may take."""
_KEPT = 64
_STATES: dict[tuple[bytes, int, str], bytes] = {}
"""Saved worlds of this process, by scenario, seed and firmware."""


def world_for(wanted: Wanted) -> tuple[World, Trace, Checks]:
    """A new world, what goes into it, and the checks of all that happens in it.

    Raises BadInput where the firmware does not come up.
    """
    world = World(wanted.scenario, wanted.seed, wanted.image)
    trace = Trace(world)
    if not wanted.boot:
        return world, trace, Checks(world, wanted.expected)
    scenario = msgspec.json.encode(msgspec.structs.replace(wanted.scenario, expect={}))
    key = (scenario, wanted.seed, wanted.image.sha256)
    if key in _STATES and not _watched(world):
        world.load(_STATES[key])
        return world, trace, Checks(world, wanted.expected)
    checks = Checks(world, wanted.expected)
    _boot(world)
    seen = checks.failures or world.faults  # every test is to see them
    if not seen and not _watched(world):
        if len(_STATES) >= _KEPT:
            del _STATES[next(iter(_STATES))]
        _STATES[key] = world.save()
    return world, trace, checks


def _watched(world: World) -> bool:
    """Whether the coverage of the firmware is taken: it is to count the same however the tests are spread."""
    return any(robot.board.cpu.inspector for network in world.networks for robot in network.robots)


def _boot(world: World) -> None:
    robots = [robot for network in world.networks for robot in network.robots]
    for _ in range(BOOT_PERIODS):
        world.step()
        if world.stopped or all(is_up(robot) for robot in robots):
            return
    waited_ms = BOOT_PERIODS * CONTROL_PERIOD_TICKS / 24_000
    what = f"the firmware has not turned its serial receiver on {waited_ms:.0f} ms after power-on"
    raise BadInput(world.image.path, "", what, "boot=False begins a test at power-on")
