"""A run with watchers: one CPU of a world, on a robot or on a board alone, run in slices."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from miro_exact.clock import CONTROL_PERIOD_TICKS, CYCLE_TICKS
from miro_robot.board import Board
from miro_robot.inspect.watcher import Watcher, attach, detach
from miro_sim.scenario.board import MOST_PERIODS
from miro_sim.world.device import Device
from miro_sim.world.wire import Wire
from miro_sim.world.world import World
from mirotwin.runs.job import Job

PIECE_TICKS = CONTROL_PERIOD_TICKS


class InspectedRun:
    """Device `index` of line `network` of a world, which runs as a whole. `board`: the robot's board around its CPU,
    None for a single board. `end_tick`: end of the run (default: of the scenario; None if it has none). `tick_hz`:
    frequency of the crystal, one tick per period. `job`: the job that it repeats, if any.
    """

    def __init__(
        self,
        world: World,
        network: int = 0,
        index: int = 0,
        end_tick: int | None = None,
        job: Job | None = None,
    ) -> None:
        self.world = world
        self.network = network
        self.index = index
        self.job = job
        self.device: Device = world.lines[network].devices[index]
        self.cpu = self.device.board.cpu
        self.image = world.image
        self.board = self.device.board if isinstance(self.device.board, Board) else None
        self.tick_hz = world.clock
        without_end = end_tick is None and world.periods == MOST_PERIODS
        self.end_tick = None if without_end else end_tick or world.periods * world.period_ticks

    @property
    def over(self) -> bool:
        return self.world.finished or (self.end_tick is not None and self.world.tick >= self.end_tick)

    def tell_pins(self, report: Callable[[int, int, int], object]) -> None:
        """`report(tick, port, levels)` is called with the levels that a file puts on the pins of a single board;
        nothing else moves them.
        """
        line = self.world.lines[self.network]
        if isinstance(line, Wire) and line.terminal is not None:
            line.terminal.pins.told = report

    def to(self, tick: int) -> None:
        """Runs to `tick`, or to the end of the run."""
        if not self.over:
            self.world.run_to(tick if self.end_tick is None else min(tick, self.end_tick))


def watch(
    run: InspectedRun,
    watchers: Sequence[Watcher],
    first_tick: int = 0,
    end_tick: int | None = None,
    progress: Callable[[int], object] = lambda tick: None,
) -> bool:
    """Runs to `end_tick` (None: to the end) with `watchers` attached from `first_tick` on.

    Returns True if the run reached `first_tick`. Before that no watcher is attached, so it runs at full speed.
    """
    _move(run, first_tick, progress)
    if run.over:
        return False
    attach(run.cpu, *watchers)
    try:
        _move(run, end_tick, progress)
    finally:
        detach(run.cpu, *watchers)
    return True


def _move(run: InspectedRun, end_tick: int | None, progress: Callable[[int], object]) -> None:
    """Runs in slices, so that progress can be reported between them."""
    now = run.cpu.cycles * CYCLE_TICKS
    while not run.over and (end_tick is None or now < end_tick):
        next_tick = (now // PIECE_TICKS + 1) * PIECE_TICKS
        run.to(next_tick if end_tick is None else min(next_tick, end_tick))
        now = max(next_tick, now) if end_tick is None else min(next_tick, end_tick)
        progress(now)
