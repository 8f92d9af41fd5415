"""Two worlds side by side: the first tick at which their states differ, and the fields that do.

    found = mirotwin.replay.first_difference(one, other)
    print(found)       # tick 1203 (0.000050 s): lines[0].devices[0].board.cpu.iram[35h] ..

States are compared every millisecond, then within the first millisecond with a difference in shorter steps, down to a
tick. A difference that vanishes between two comparisons, such as a register that is overwritten at once, is not
detected.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from miro_exact.clock import TICKS_PER_SECOND
from mirotwin.recording.difference import moment
from mirotwin.replay.lockstep.fields import FieldDifference, Record, differing

if TYPE_CHECKING:
    from miro_sim.world.world import Mark, World

LOOK_TICKS = 24_000
STEPS_TICKS = (LOOK_TICKS, 1_000, 40, 1)
"""Each within one of the step before."""
NAMED = 3


class StateDifference(Record, frozen=True):
    """The states of two worlds differ at `tick`, in control period `period`, and did not a tick before.

    `fields` is not empty. Where the worlds were made otherwise, that may be tick 0.
    """

    tick: int
    period: int
    fields: tuple[FieldDifference, ...]
    clock: int = TICKS_PER_SECOND

    def __str__(self) -> str:
        more = len(self.fields) - NAMED
        named = "; ".join(str(field) for field in self.fields[:NAMED])
        rest = f"; and {more} more fields" if more > 0 else ""
        return f"{moment(self.tick, self.clock)}, control period {self.period}: {named}{rest}"


class WorldPair:
    """Two worlds at one tick. Raises ValueError for worlds that are not."""

    def __init__(self, world: World, other: World) -> None:
        if world.tick != other.tick:
            raise ValueError(
                f"the worlds stand at ticks {world.tick} and {other.tick}: move them to one tick"
            )
        self.one = world
        self.other = other
        self.alike = world.state.tables() == other.state.tables()

    @property
    def tick(self) -> int:
        return max(self.one.tick, self.other.tick)

    @property
    def over(self) -> bool:
        """True if one of the worlds has ended."""
        return self.one.stopped or self.other.stopped

    def run_to(self, tick: int) -> None:
        self.one.run_to(tick)
        self.other.run_to(tick)

    def differ(self) -> bool:
        if self.alike and self.one.state.hashed() == self.other.state.hashed():
            return False
        return bool(self.fields())  # the digests before may differ, and all else be the same again

    def fields(self) -> tuple[FieldDifference, ...]:
        """The fields that differ, of those that both worlds have."""
        return tuple(differing(self.one, self.other))

    def mark(self) -> tuple[Mark, Mark]:
        return self.one.mark(), self.other.mark()

    def go_back(self, marks: tuple[Mark, Mark]) -> None:
        self.one.go_back(marks[0])
        self.other.go_back(marks[1])

    def narrow(self, step_ticks: int, end_tick: int) -> int | None:
        """Runs both in steps up to `end_tick`. Returns the first step's tick at which they differ, and restores both to
        the step before. None: there is no difference, and both are at the end.
        """
        while self.tick < end_tick and not self.over:
            before = self.mark()
            next_tick = (self.tick // step_ticks + 1) * step_ticks
            self.run_to(min(next_tick, end_tick))
            if self.differ():
                found_tick = self.tick
                self.go_back(before)
                return found_tick
        return None


def first_difference(
    world: World, other: World, until_tick: int | None = None, look_ticks: int = LOOK_TICKS
) -> StateDifference | None:
    """The first tick at which the states of two worlds differ, from their present tick up to `until_tick`.

    Default: to the end of the shorter one. None: no difference at any comparison, every `look_ticks`. Both worlds are
    left at the returned tick. Fields that enter no digest are not compared, such as how early input was announced.
    Worlds of different scenarios are compared in the fields that both have. Both are run back and forth, so their
    observers are called twice for some periods. Raises ValueError if both are not at the same tick, and for an invalid
    `look_ticks`.
    """
    if look_ticks < 1:
        raise ValueError(f"look_ticks is {look_ticks}: give 1 or more")
    pair = WorldPair(world, other)
    if not pair.differ():
        end_tick = world.period_ticks * min(world.periods, other.periods)
        found_tick = end_tick if until_tick is None else until_tick
        for step_ticks in (look_ticks, *(step for step in STEPS_TICKS if step < look_ticks)):
            narrowed_tick = pair.narrow(step_ticks, found_tick)
            if narrowed_tick is None:
                return None
            found_tick = narrowed_tick
        pair.run_to(found_tick)
    fields = pair.fields()
    if not fields:
        return None
    return StateDifference(pair.tick, max(0, pair.tick - 1) // world.period_ticks, fields, world.clock)
