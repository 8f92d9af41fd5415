"""A run as a timeline: the debugger can go to any of its instructions, forwards and backwards.

A run is reproducible, so going back means running forward again from a saved state. A moment is a machine cycle at
which the processor in focus is between two instructions. States are saved at the end of each control period, and closer
to what is looked at closely; when they take more than their budget, every second state of the older half goes.

    checkpoint ──► load ──► run, asking at marked instructions ──► hits ──► go to the first or the last one
"""

from __future__ import annotations

import bisect
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from operator import attrgetter, itemgetter
from typing import NamedTuple

from miro_exact.clock import CYCLE_TICKS, NEVER_TICK
from miro_protocol.actions import Put, PutValue
from miro_robot.board import Board
from miro_robot.empty_board import EmptyBoard
from miro_robot.event_log import EventLog
from miro_robot.inspect.marks import MarkInspector
from miro_robot.mcs51.cpu import Cpu
from miro_sim.world.conditions import Condition
from miro_sim.world.device import Device
from miro_sim.world.events import Event, HostLog
from miro_sim.world.robot import Robot
from miro_sim.world.waits import WaitExpired
from mirotwin.runs.inspected_run import InspectedRun
from mirotwin.shell.progress import ProgressBar

BUDGET_BYTES = 16 << 20
CLOSE_TICKS = 48_000  # 2 ms
_TICK, _ORDER = attrgetter("tick"), itemgetter(0, 1)  # of a checkpoint, of a hit
_LONGEST_CYCLES = 4  # of an instruction
_WAKES = frozenset((0, *range(0x03, 0x34, 8)))  # where a processor that slept goes on


class Core(NamedTuple):
    """A processor of the run, on `device`. `robot`, `board`: of a robot; a board alone has neither."""

    name: str
    cpu: Cpu
    device: Device

    @property
    def robot(self) -> Robot | None:
        return self.device if isinstance(self.device, Robot) else None

    @property
    def board(self) -> Board | None:
        return None if self.robot is None else self.robot.board


Position = tuple[int, int]
"""(cycle, processor)."""


class Hit(NamedTuple):
    """A trap's condition is true in `cycle` of processor `core`, before the next instruction."""

    cycle: int
    core: int
    found: object


class Trap(NamedTuple):
    """`ask` is called before each instruction at one of `addresses`: None, or the value of a hit."""

    addresses: Collection[int]
    ask: Callable[[Core], object]


class _Checkpoint(NamedTuple):
    """`puts`: how many of those of the timeline the state has done, or waits for."""

    tick: int
    state: bytes
    log_ends: list[int]
    puts: int


class Timeline:
    """`run` from its start on. `interrupted` is called between pieces: true ends a search where it is.

    `code_in_ram`: what is executed may change, and lie anywhere.
    """

    def __init__(self, run: InspectedRun) -> None:
        self.run = run
        self.interrupted: Callable[[], bool] = lambda: False
        world, devices = run.world, run.world.devices
        self.cores = [Core(_name(device), device.board.cpu, device) for device in devices]
        self._logs: list[EventLog | HostLog] = [
            *(device.board.log for device in devices),
            *(line.log for line in world.lines),
        ]
        alone = run.device.board
        self.code_in_ram = isinstance(alone, EmptyBoard) and alone.shared
        self.state, self._restore = world.state.save, world.go_on_from
        self.focus = next(at for at, core in enumerate(self.cores) if core.cpu is run.cpu)
        self._begins = [core.cpu.cycles for core in self.cores]
        self._checkpoints: list[_Checkpoint] = []
        self._puts: list[Put] = []
        self.kept_bytes = 0
        self._save()

    @property
    def core(self) -> Core:
        return self.cores[self.focus]

    @property
    def here(self) -> Position:
        return self.core.cpu.cycles, self.focus

    @property
    def at_begin(self) -> bool:
        """True at the begin of the run: at reset, or at the tick of a saved world."""
        return self.core.cpu.cycles == self._begins[self.focus]

    @property
    def tick(self) -> int:
        """The present tick of the processor in focus."""
        return self.core.cpu.cycles * CYCLE_TICKS

    @property
    def everywhere(self) -> Collection[int]:
        """Addresses of possible instructions."""
        if self.code_in_ram:
            return range(0x10000)
        return [address for first, end in self.run.image.used for address in range(first, end)]

    # Checkpoints

    @property
    def _now(self) -> int:
        return self.run.world.tick

    def _save(self) -> None:
        """Saves the present state, unless it is saved already."""
        tick = self._now
        index = bisect.bisect_left(self._checkpoints, tick, key=_TICK)
        if index < len(self._checkpoints) and self._checkpoints[index].tick == tick:
            return
        state = self.state()
        self._checkpoints.insert(
            index, _Checkpoint(tick, state, [log.end for log in self._logs], len(self._puts))
        )
        self.kept_bytes += len(state)
        if self.kept_bytes > BUDGET_BYTES:
            # Never the first one: without it the begin of the run cannot be reached any more.
            del self._checkpoints[1 : len(self._checkpoints) // 2 : 2]
            self.kept_bytes = sum(len(checkpoint.state) for checkpoint in self._checkpoints)

    def _load(self, index: int) -> None:
        checkpoint = self._checkpoints[index]
        self._restore(checkpoint.state)
        # What came after the checkpoint comes again: it must not be in the logs twice.
        for log, end in zip(self._logs, checkpoint.log_ends, strict=True):
            log.cut(end)
        # Later puts are not in that state: without them going on would be another run.
        for put in self._puts[checkpoint.puts :]:
            self.run.world.do(put)
        for core in self.cores:
            # The list is no state, the count is: faults from after this moment would be reported here.
            del core.device.board.faults[core.device.board.fault_count :]

    def _before(self, tick: int) -> int:
        """The last checkpoint before `tick`, or the first one."""
        return max(0, bisect.bisect_left(self._checkpoints, tick, key=_TICK) - 1)

    def _look_closely(self, end_tick: int) -> None:
        """Sees to it that a checkpoint is at most 2 ms before `end_tick`, each one half as far from it as the last."""
        index = self._before(end_tick)
        if end_tick - self._checkpoints[index].tick > CLOSE_TICKS:
            self._load(index)
            while end_tick - self._now > CLOSE_TICKS and not self.run.over:
                self._run_to((self._now + end_tick) // 2)
                self._save()

    def put(self, path: str, value: PutValue) -> int:
        """Puts a value of a part of the board in focus as soon as possible, and forgets what came later; the tick.

        Who goes back and on again finds it put. Raises ValueError.
        """
        device, world = self.core.device, self.run.world
        put = Put(world.earliest_action_tick, device.network, device.slot, path, value)
        world.do(put)
        self._puts.append(put)
        # States from now on were saved without the put.
        self._checkpoints = [checkpoint for checkpoint in self._checkpoints if checkpoint.tick < self._now]
        self.kept_bytes = sum(len(checkpoint.state) for checkpoint in self._checkpoints)
        self._save()
        return put.tick

    # Moving

    def go_to(self, tick: int, stops: Callable[[], bool] = lambda: False) -> bool:
        """To the first moment at or after `tick`, or to the end of the run; whether it came there.

        `stops` is called between two pieces: true ends it where it is.
        """
        # `+ 1`: a checkpoint on the tick itself is the nearest.
        index = self._before(tick + 1)
        # Forward, with no checkpoint in between, it goes on from here: loading would throw work away.
        if not self._checkpoints[index].tick <= self._now <= tick:
            self._load(index)
        self._run_to(tick, stops)
        self._settle()
        return self._now >= tick

    def _settle(self) -> None:
        """Advances everything else to the processor in focus, which may have passed a tick by an instruction.

        Boards are synced too; otherwise they are one tick behind.
        """
        if not self.run.over:
            self.run.to(self.tick)
            for core in self.cores:
                if core.board is not None:
                    core.board.sync(self._now)

    def _run_to(self, tick: int, stops: Callable[[], bool] = lambda: False) -> None:
        while self._now < tick and not self.run.over:
            end_tick = self.run.world.period_end
            # In periods, or nothing would be saved on the way and Ctrl-C would wait for the end of the run.
            self.run.to(min(tick, end_tick))
            if self._now == end_tick:
                self._save()
            if stops():
                break

    def land(self, hit: Hit) -> None:
        """To a hit, with its processor in focus."""
        self.focus = hit.core
        self.go_to(hit.cycle * CYCLE_TICKS)

    @contextmanager
    def staying(self) -> Iterator[None]:
        """Allows moves within the block, and returns to the present moment after it."""
        tick, focus = self.tick, self.focus
        try:
            yield
        finally:
            self.focus = focus
            self.go_to(tick)

    def step(self) -> None:
        """Executes one instruction or interrupt entry; a sleeping processor runs to the first instruction after it
        wakes.
        """
        cpu = self.core.cpu
        if cpu.idle or cpu.powered_down:
            self.find({self.focus: Trap(_WAKES, lambda core: True)})
        elif not self.run.over:
            self.run.to(self.tick + 1)
            self._settle()

    def step_back(self) -> bool:
        """To before the last instruction or interrupt entry, or to the start of sleep; False where there is none."""
        cpu, cycle = self.core.cpu, self.core.cpu.cycles
        self._look_closely(self.tick)
        begin_tick = (cycle - _LONGEST_CYCLES) * CYCLE_TICKS  # where no checkpoint is past the instruction
        # One instruction cannot be undone: it is found by doing those before it again, one by one.
        self._load(self._before(begin_tick + 1))
        self._run_to(begin_tick)
        before = -1
        while cpu.cycles < cycle:
            before, asleep = cpu.cycles, cpu.idle or cpu.powered_down
            self.run.to(before * CYCLE_TICKS + 1)
        if before < 0:
            return False
        self.go_to(before * CYCLE_TICKS)
        # Asleep each cycle is a moment of its own: going back by one would take millions of steps.
        if asleep and self.find_back({self.focus: Trap(self.everywhere, lambda core: True)}):
            self.step()
        return True

    # Searching

    @contextmanager
    def shown(self, label: str, interrupted: Callable[[], bool] = lambda: False) -> Iterator[None]:
        """Within it, what takes more than a second shows a bar, and `interrupted` may end a search."""
        with ProgressBar(label, self.run.end_tick) as bar:

            def is_interrupted() -> bool:
                bar.to(self.tick)
                return interrupted()

            with self.interrupted_by(is_interrupted):
                yield

    @contextmanager
    def interrupted_by(self, interrupted: Callable[[], bool]) -> Iterator[None]:
        """Within it this may end a search."""
        before, self.interrupted = self.interrupted, interrupted
        try:
            yield
        finally:
            self.interrupted = before

    def find(self, traps: Mapping[int, Trap], after: Position | None = None) -> Hit | None:
        """Goes on to the first moment after `after` (default: this one) at which a trap, by processor, finds something.

        None, at the end of the run or where it was interrupted, if there is none.
        """
        here = after or self.here
        # Later than here: the trap at which it stands is asked again before the first instruction.
        with self._asking(traps, lambda hit: hit[:2] > here) as hits:

            def later() -> list[Hit]:
                return [hit for hit in hits if hit[:2] > here]

            self._run_to(NEVER_TICK, lambda: bool(later()) or self.interrupted())
            if not later():
                self._settle()
        # Processors run one after the other in a piece: the first hit that was listed may be a later one.
        hit = min(later(), key=_ORDER, default=None)
        if hit is not None:
            self.land(hit)
        return hit

    def hits_back(self, traps: Mapping[int, Trap], before: Position | None = None) -> Iterator[Hit]:
        """The moments before `before` (default: this one) at which a trap finds something, the latest first.

        Meanwhile it is anywhere; after the last one it stands where the run begins, or where it was interrupted.
        """
        here = before or self.here
        end_tick, first = self.tick + 1, False
        self._look_closely(end_tick)  # where a hit is likely
        while not first:
            index = self._before(end_tick)
            begin_tick, first = self._checkpoints[index].tick, index == 0
            self._load(index)
            with self._asking(traps) as hits:
                self._run_to(end_tick, self.interrupted)
            if self._now < end_tick and not self.run.over:  # of this stretch the latest hits are missing
                begin_tick = end_tick - 1
                break
            # All of a stretch are kept: which is the latest is known only at its end.
            hits.sort(key=_ORDER, reverse=True)
            yield from (hit for hit in hits if hit[:2] < here)
            end_tick, first = begin_tick, first or self.interrupted()
        self.go_to(begin_tick)

    def find_back(self, traps: Mapping[int, Trap], before: Position | None = None) -> Hit | None:
        """Goes back to the first of these; None if there is none."""
        hit = next(self.hits_back(traps, before), None)
        if hit is not None:
            self.land(hit)
        return hit

    def until(self, condition: Condition) -> Event | None:
        """Goes on to the first tick at which `condition` is true; None at the end or where it was interrupted."""
        while not self.run.over and not self.interrupted():
            end_tick = self.run.world.period_end
            if self.run.end_tick is not None:  # of an image it may lie within a period
                end_tick = min(end_tick, self.run.end_tick)
            # One period at a time: between two waits the state is saved, and an interruption is seen.
            with suppress(WaitExpired):
                event = self.run.world.run_until(condition, end_tick - self._now)
                self._settle()
                return event
            self._save()
        self._settle()
        return None

    def radio_events(self) -> list[Event]:
        """Frames on the air of the network of the robot in focus, up to now."""
        if self.core.robot is None:
            return []
        log = self.run.world.lines[self.core.device.network].log
        return [event for _, event in log.since(0, ("sent", "answer")) if event.tick <= self.tick]

    @contextmanager
    def _asking(
        self, traps: Mapping[int, Trap], enough: Callable[[Hit], bool] = lambda hit: False
    ) -> Iterator[list[Hit]]:
        """Lists the hits of the traps within it; a trap with a hit that is `enough` is not called again."""
        hits: list[Hit] = []

        def ask(index: int, trap: Trap) -> bool:
            it = trap.ask(self.cores[index])
            if it is None:
                return False
            hits.append(Hit(self.cores[index].cpu.cycles, index, it))
            return enough(hits[-1])

        asking = [
            MarkInspector(
                self.cores[index].cpu,
                trap.addresses,
                partial(ask, index, trap),
                _own_marks(self.cores[index].device),
            )
            for index, trap in traps.items()
        ]
        try:
            yield hits
        finally:
            # Also after an exception: marks that stay would stop every later run there.
            for watcher in asking:
                watcher.detach()


def _name(device: Device) -> str:
    return f"net{device.network}/robot{device.slot}" if isinstance(device, Robot) else "processor"


def _own_marks(device: Device) -> Callable[[], Collection[int]] | None:
    """Addresses at which the board itself sets marks, for each run."""
    board = device.board
    return board.marks if isinstance(board, EmptyBoard) else None
