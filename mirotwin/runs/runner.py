"""Runs a world from its first control period to its last, and records it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from miro_exact.clock import LM629_SAMPLE_TICKS
from miro_sim.periods import Period

if TYPE_CHECKING:
    from miro_sim.world.world import World  # a hot module: not before the engine was chosen
    from mirotwin.recording.channels import SampleMessage
    from mirotwin.recording.recorder import Recorder


def run(
    world: World,
    recorder: Recorder | None = None,
    full: bool = False,
    on_period: Callable[[Period], object] = lambda period: None,
    move: Callable[[], object] | None = None,
) -> None:
    """Steps the world until it is finished, or as `move` does it; `observed` meanwhile.

    With `full` (but not with `move`) each LM629 sample is recorded as well.
    """
    with observed(world, recorder, on_period):
        if move is not None:
            move()
        while move is None and not world.finished:
            if full and recorder is not None:
                _run_samples(world, recorder)
            world.step()


@contextmanager
def observed(
    world: World,
    recorder: Recorder | None = None,
    on_period: Callable[[Period], object] = lambda period: None,
) -> Iterator[None]:
    """Passes every period to `recorder`, and at the end the firmware faults; also after an exception, because a
    recording up to then is useful.
    """

    bit_ticks = 0

    def keep(period: Period) -> None:
        nonlocal bit_ticks
        if recorder is not None:
            recorder.write(period)
            if bit_ticks != world.bit_ticks:
                bit_ticks = world.bit_ticks
                recorder.write_bit_ticks(bit_ticks)
        on_period(period)

    world.observers.append(keep)
    try:
        yield
    finally:
        world.observers.remove(keep)
        if recorder is not None:
            recorder.write_faults(world.devices, alone=not world.robots)


def _run_samples(world: World, recorder: Recorder) -> None:
    """Up to the last LM629 sample of the period under way, recording each (they are 8192 ticks apart)."""
    end_tick = world.period_end
    first = -(-(world.tick + 1) // LM629_SAMPLE_TICKS) * LM629_SAMPLE_TICKS
    for tick in range(first, end_tick, LM629_SAMPLE_TICKS):
        world.run_to(tick)
        if world.finished:
            return
        for robot in world.robots:
            recorder.add("samples", robot.network, robot.slot, _sample(tick, robot.board))


def _sample(tick: int, board: Any) -> SampleMessage:
    from mirotwin.recording.channels import SampleMessage  # loads the library of the format

    values: list[int] = []
    for chip in (board.left, board.right):
        duty = -chip.pwm_magnitude if chip.sign else chip.pwm_magnitude
        values += (chip.desired_position, chip.real_position, chip.desired_velocity, duty)
    return SampleMessage(tick, *values)
