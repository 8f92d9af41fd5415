"""A run with watchers: one CPU, on a robot of a world or on the bare board, run in slices."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from miro_exact.clock import CONTROL_PERIOD_TICKS, CYCLE_TICKS, TICKS_PER_SECOND
from miro_robot.bare.machine import BareMachine, Ended
from miro_robot.board import Board
from miro_robot.image import Image
from miro_robot.inspect.watcher import Watcher, attach, detach
from miro_robot.mcs51.cpu import Cpu
from miro_sim.world.world import World
from mirotwin.runs.job import Job
from mirotwin.verify.bare.run import BarePlayback

PIECE_TICKS = CONTROL_PERIOD_TICKS


class Run:
    """A CPU that runs `image`. `board`: around it, None on the bare CPU. `end_tick`: tick at which the run ends by
    itself, None if unknown. `tick_hz`: the crystal, one tick a period.
    """

    def __init__(
        self, cpu: Cpu, image: Image, end_tick: int | None, tick_hz: int, board: Board | None = None
    ) -> None:
        self.cpu = cpu
        self.image = image
        self.end_tick = end_tick
        self.tick_hz = tick_hz
        self.board = board

    @property
    def over(self) -> bool:
        raise NotImplementedError

    def tell_pins(self, told: Callable[[int, int, int], object]) -> None:
        """`told(tick, port, levels)` gets what a file puts on the pins of the bare CPU; nothing else moves them."""

    def to(self, tick: int) -> None:
        """Moves on to `tick`, or to the end of the run."""
        raise NotImplementedError


class RobotRun(Run):
    """The robot in place `index` of network `network` (slot order) of a world, which runs as a whole.

    `end_tick`: it is over with the control period that goes on there (default: with the scenario). `job`: what it
    repeats, if anything.
    """

    def __init__(
        self,
        world: World,
        network: int = 0,
        index: int = 0,
        end_tick: int | None = None,
        job: Job | None = None,
    ) -> None:
        board = world.networks[network].robots[index].board
        periods = world.periods if end_tick is None else -(-end_tick // CONTROL_PERIOD_TICKS)
        super().__init__(board.cpu, world.image, periods * CONTROL_PERIOD_TICKS, TICKS_PER_SECOND, board)
        self.world = world
        self.network = network
        self.index = index
        self.job = job

    @property
    def over(self) -> bool:
        assert self.end_tick is not None
        return self.world.finished or self.world.tick >= self.end_tick

    def to(self, tick: int) -> None:
        assert self.end_tick is not None
        if not self.over:
            self.world.run_to(min(tick, self.end_tick))


class BareRun(Run):
    """An image on the bare CPU; `ended` says how, once it is over."""

    def __init__(self, machine: BareMachine, until: int | None, max_cycles: int | None) -> None:
        end_tick = None if max_cycles is None else max_cycles * CYCLE_TICKS
        super().__init__(machine.cpu, machine.image, end_tick, machine.input.crystal_hz)
        self.machine = machine
        self.until = until
        self.max_cycles = max_cycles
        self.ended = Ended.PAUSED

    def tell_pins(self, told: Callable[[int, int, int], object]) -> None:
        self.machine.pins.told = told

    @property
    def over(self) -> bool:
        return self.ended is not Ended.PAUSED

    def to(self, tick: int) -> None:
        if not self.over:
            pause = -(-tick // CYCLE_TICKS)
            self.ended = self.machine.run(self.until, self.max_cycles, pause=pause)

    def resume(self) -> None:
        """The machine was put back to an earlier moment."""
        self.ended = Ended.PAUSED

    def marks(self) -> tuple[int, ...]:
        """Where it may end: the machine marks these addresses itself."""
        return (*self.machine.ends, *(() if self.until is None else (self.until,)))


class CaseRun(Run):
    """A case of a bare processor: what it heard is played to it."""

    def __init__(self, playback: BarePlayback) -> None:
        self.playback = playback
        self.machine = playback.processor
        cpu, image = self.machine.cpu, self.machine.image
        super().__init__(cpu, image, playback.end_tick, playback.line.crystal_hz)

    @property
    def over(self) -> bool:
        return bool(self.machine.bus.fault_kind) or self.cpu.cycles * CYCLE_TICKS >= self.playback.end_tick

    def to(self, tick: int) -> None:
        if not self.over:
            self.playback.to(min(tick, self.playback.end_tick))

    def resume(self) -> None:
        """The processor was put back to an earlier moment."""
        self.playback.put_back()

    def marks(self) -> tuple[int, ...]:
        """It ends nowhere by itself."""
        return ()


def watch(
    run: Run,
    watchers: Sequence[Watcher],
    first_tick: int = 0,
    end_tick: int | None = None,
    progress: Callable[[int], object] = lambda tick: None,
) -> bool:
    """Runs to `end_tick` (None: to the end) with `watchers` attached from `first_tick` on.

    Returns whether the run reached `first_tick`. Up to there no watcher is attached, so it runs at full speed.
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


def _move(run: Run, end_tick: int | None, progress: Callable[[int], object]) -> None:
    """Runs in slices, so that progress can be reported between them."""
    now = run.cpu.cycles * CYCLE_TICKS
    while not run.over and (end_tick is None or now < end_tick):
        next_tick = (now // PIECE_TICKS + 1) * PIECE_TICKS
        run.to(next_tick if end_tick is None else min(next_tick, end_tick))
        now = max(next_tick, now) if end_tick is None else min(next_tick, end_tick)
        progress(now)
