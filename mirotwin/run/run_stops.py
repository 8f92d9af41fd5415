"""`mirotwin run --save-at .. --resume .. --to ..`: where a run begins, what it saves, and where it ends.

A world that goes on from a saved one has the bits of a run that never stopped. A run that is resumed within a control
period goes on to that period's end first: only whole periods are recorded.
"""

from __future__ import annotations

from collections.abc import Sequence

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS, TICKS_PER_SECOND
from miro_exact.inputs import WORLD_BYTES, read_input
from miro_sim.world.world import World
from mirotwin.shell.outputs import OutputFolder
from mirotwin.shell.times import Time

SUFFIX = ".world"


class Stops:
    """Where a run of `world` stops: it saves into `folder` at each tick of `save_at`, and ends at `to_tick`.

    Raises BadInput for ticks that the run does not come past.
    """

    def __init__(self, save_at: Sequence[Time], to_tick: Time | None, resume: str | None = None) -> None:
        self.save_ticks = sorted({_tick(time) for time in save_at})
        self.to_tick = None if to_tick is None else _tick(to_tick)
        self.resume = resume
        self.resumed = b""
        self.begin_tick = 0

    @property
    def names(self) -> list[str]:
        """The files that it writes."""
        return [f"at-{tick}{SUFFIX}" for tick in self.save_ticks]

    def begin(self, world: World) -> None:
        """Puts `world` to where the saved one is, and to the end of its control period."""
        if self.resume is not None:
            saved = read_input(self.resume, WORLD_BYTES)
            try:
                world.load(saved)
            except ValueError as error:
                remedy = "give the scenario, --set, --seed and --firmware of the run that saved it"
                raise BadInput(self.resume, "", f"cannot be resumed: {error}", remedy) from None
            if world.in_period:
                world.run_to(world.period_end)
            self.resumed, self.begin_tick = world.save(), world.tick
            _forget_commands(world)
        self._check(world)

    def _check(self, world: World) -> None:
        end_tick = world.periods * CONTROL_PERIOD_TICKS
        if self.to_tick is not None:
            if not world.tick < self.to_tick <= end_tick:
                raise _outside(f"--to {self.to_tick}t", world.tick, end_tick)
            end_tick = self.to_tick
        for tick in self.save_ticks:
            if not world.tick < tick <= end_tick:
                raise _outside(f"--save-at {tick}t", world.tick, end_tick)

    def move(self, world: World, folder: OutputFolder) -> None:
        """Runs the world to its end, or to `to_tick`."""
        waiting = list(self.save_ticks)
        end_tick = self.to_tick or world.periods * CONTROL_PERIOD_TICKS
        while not world.finished and world.tick < end_tick:
            world.run_to(min([end_tick, world.period_end, *waiting[:1]]))
            if waiting and world.tick == waiting[0]:
                folder.part(f"at-{waiting.pop(0)}{SUFFIX}").write_bytes(world.save())

    def __bool__(self) -> bool:
        return bool(self.save_ticks or self.to_tick is not None or self.resume is not None)


def _tick(time: Time) -> int:
    return time.ticks(TICKS_PER_SECOND)


def _forget_commands(world: World) -> None:
    """What LM629s were told before is a record of then: whoever begins from what was saved does not have it either."""
    for robot in world.robots:
        robot.board.left.commands.clear()
        robot.board.right.commands.clear()


def _outside(option: str, first_tick: int, end_tick: int) -> BadInput:
    return BadInput(
        "", option, f"the run goes from tick {first_tick} to tick {end_tick}", "give a tick between"
    )
