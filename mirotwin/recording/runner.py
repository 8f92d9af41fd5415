"""Runs a world from its first control period to its last, and records it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from miro_exact.clock import CONTROL_PERIOD_TICKS, LM629_SAMPLE_TICKS
from miro_robot.faults import FirmwareFault
from miro_sim.periods import Period
from mirotwin.recording.channels import SampleMessage
from mirotwin.recording.recorder import Recorder
from mirotwin.shell.program import DONE, FIRMWARE_FAULT, complain

if TYPE_CHECKING:
    from miro_sim.world.world import World  # a hot module: not before the engine was chosen


def run(
    world: World,
    recorder: Recorder | None = None,
    full: bool = False,
    on_period: Callable[[Period], bool | None] = lambda period: None,
    move: Callable[[], object] | None = None,
) -> None:
    """Steps the world until it is finished, or until `on_period` returns True.

    Every period goes to `recorder`, with `full` each LM629 sample as well, and the firmware faults at the
    end, also when something raises: a recording up to then is worth having. `move`: runs the world in its own way,
    which goes together with neither `full` nor an early end by `on_period`.
    """
    try:
        if move is not None:
            _moved(world, recorder, on_period, move)
            return
        while not world.finished:
            if full and recorder is not None:
                _run_samples(world, recorder)
            period = world.step()
            if recorder is not None:
                recorder.write(period)
            if on_period(period):
                break
    finally:
        if recorder is not None:
            for network, slot, faults in faults_by_robot(world):
                recorder.write_faults(network, slot, faults)


def _moved(
    world: World,
    recorder: Recorder | None,
    on_period: Callable[[Period], object],
    move: Callable[[], object],
) -> None:
    """Lets `move` run the world, and hands on each period when it ends."""

    def keep(period: Period) -> None:
        if recorder is not None:
            recorder.write(period)
        on_period(period)

    world.observers.append(keep)
    try:
        move()
    finally:
        world.observers.remove(keep)


def _run_samples(world: World, recorder: Recorder) -> None:
    """Up to the last LM629 sample of the period under way, recording each (they are 8192 ticks apart)."""
    end_tick = (world.index + 1) * CONTROL_PERIOD_TICKS
    first = -(-(world.tick + 1) // LM629_SAMPLE_TICKS) * LM629_SAMPLE_TICKS
    for tick in range(first, end_tick, LM629_SAMPLE_TICKS):
        world.run_to(tick)
        if world.finished:
            return
        for robot in world.robots:
            recorder.write_sample(robot.network, robot.slot, _sample(tick, robot))


def _sample(tick: int, robot: Any) -> SampleMessage:
    left, right = robot.board.left, robot.board.right
    return SampleMessage(
        tick,
        left.desired_position,
        left.real_position,
        left.desired_velocity,
        -left.pwm_magnitude if left.sign else left.pwm_magnitude,
        right.desired_position,
        right.real_position,
        right.desired_velocity,
        -right.pwm_magnitude if right.sign else right.pwm_magnitude,
    )


def faults_by_robot(world: World) -> list[tuple[int, int, list[FirmwareFault]]]:
    """(network, slot, faults) of every robot that has any."""
    faulty = [robot for robot in world.robots if robot.board.faults]
    return [(robot.network, robot.slot, list(robot.board.faults)) for robot in faulty]


def report_faults(world: World) -> int:
    """Says on stderr what the firmware did wrong; returns the exit code."""
    found = faults_by_robot(world)
    for network, slot, faults in found:
        more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
        complain(f"firmware fault: net{network}/robot{slot}: {faults[0]}{more}")
    return FIRMWARE_FAULT if found else DONE
