"""A run with watchers: one CPU, on a robot of a world or on the bare board, run in slices."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from miro_exact.clock import CONTROL_PERIOD_TICKS, CYCLE_TICKS, TICKS_PER_SECOND
from miro_robot.bare.machine import BareMachine, Ended
from miro_robot.board import Board
from miro_robot.image import Image
from miro_robot.inspect.watcher import Watcher, attach, detach
from miro_robot.mcs51.cpu import Cpu
from miro_sim.world.world import World
from mirotwin.verify.bare.run import BarePlayback

PIECE_TICKS = CONTROL_PERIOD_TICKS


class Run(Protocol):
    """`board` is None on the bare CPU. `end_tick`: tick at which the run ends by itself, None if unknown. `tick_hz`:
    the crystal, one tick a period.
    """

    @property
    def cpu(self) -> Cpu: ...
    @property
    def board(self) -> Board | None: ...
    @property
    def image(self) -> Image: ...
    @property
    def end_tick(self) -> int | None: ...
    @property
    def tick_hz(self) -> int: ...
    @property
    def over(self) -> bool: ...
    def tell_pins(self, told: Callable[[int, int, int], object]) -> None:
        """`told(tick, port, levels)` gets what a file puts on the pins of the bare CPU."""

    def to(self, tick: int) -> None:
        """Moves on to `tick`, or to the end of the run."""


class RobotRun:
    """The robot in place `index` of network `network` (slot order) of a world, which runs as a whole.

    `periods`: after so many control periods it is over (default: as many as the scenario has).
    """

    def __init__(self, world: World, network: int = 0, index: int = 0, periods: int | None = None) -> None:
        self.world = world
        self.network = network
        self.index = index
        self.board: Board | None = world.networks[network].robots[index].board
        self.cpu = world.networks[network].robots[index].board.cpu
        self.image = world.image
        self.end_tick: int | None = (periods or world.periods) * CONTROL_PERIOD_TICKS
        self.tick_hz = TICKS_PER_SECOND

    def tell_pins(self, told: Callable[[int, int, int], object]) -> None:
        """A board drives all its pins itself."""

    @property
    def over(self) -> bool:
        assert self.end_tick is not None
        return self.world.finished or self.world.tick >= self.end_tick

    def to(self, tick: int) -> None:
        assert self.end_tick is not None
        if not self.over:
            self.world.run_to(min(tick, self.end_tick))


class BareRun:
    """An image on the bare CPU; `ended` says how, once it is over."""

    def __init__(self, machine: BareMachine, until: int | None, max_cycles: int | None) -> None:
        self.machine = machine
        self.until = until
        self.max_cycles = max_cycles
        self.board: Board | None = None
        self.cpu = machine.cpu
        self.image = machine.image
        self.ended = Ended.PAUSED
        self.end_tick = None if max_cycles is None else max_cycles * CYCLE_TICKS
        self.tick_hz = machine.input.crystal_hz

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


class CaseRun:
    """A case of a bare processor: what it heard is played to it."""

    def __init__(self, playback: BarePlayback) -> None:
        self.playback = playback
        self.machine = playback.processor
        self.board: Board | None = None
        self.cpu = playback.processor.cpu
        self.image = playback.processor.image
        self.end_tick: int | None = playback.end_tick
        self.tick_hz = playback.line.crystal_hz

    def tell_pins(self, told: Callable[[int, int, int], object]) -> None:
        """Nothing but the serial port hears something."""

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
