"""The place of a failure in the C sources: the line at which `mirotwin debug` opens."""

from __future__ import annotations

from contextlib import suppress

from msgspec.structs import replace

from miro_exact.bad_input import BadInput
from miro_exact.clock import CYCLE_TICKS
from miro_exact.domain import DomainError
from miro_exact.plugins import PluginError
from mirotwin.runs.result import Result
from mirotwin.runs.run import Run
from mirotwin.runs.spec import RunSpec
from mirotwin.shell.debug_files import Place, Places


def located(run: Run, result: Result) -> Result:
    """The result with the place of its first failure. `run` is traced."""
    return located_in(run.as_sent({}), result) if result.failed_tick >= 0 else result


def located_in(spec: RunSpec, result: Result) -> Result:
    """The result with the place of its first failure, of a run by its script. A step fails for the first device."""
    if result.failed_tick < 0:
        return result
    first = result.failures[0] if result.failures and result.step_tick < 0 else None
    place = None if first is None else (first.network, first.slot)
    return replace(result, place=place_at(spec, result.failed_tick, place))


def place_at(spec: RunSpec, tick: int, place: tuple[int, int] | None = None) -> Place | None:
    """The line of the device in `place` (network, slot) at its first instruction from `tick` on.

    None if no debug file contains it, or if a part of the run fails.
    """
    with suppress(BadInput, DomainError, PluginError):
        return _place_at(spec, tick, place)
    return None


def _place_at(spec: RunSpec, tick: int, place: tuple[int, int] | None) -> Place | None:
    world = spec.world()
    devices = {(robot.network, robot.slot): robot for robot in reversed([*world.devices])}
    device = devices[place] if place in devices else world.devices[0]
    cpu = device.board.cpu
    while world.tick < tick and not world.finished:
        world.run_to(min(tick, world.period_end))
    if not world.finished:
        world.run_to(max(world.tick, cpu.cycles * CYCLE_TICKS))
    return Places(device.image).at(cpu.pc)
