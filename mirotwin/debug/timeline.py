"""A run as a timeline: any instruction of it can be gone to, forwards and backwards.

A run is bits, so going back is going forward again from a saved state. A moment is a machine cycle at which the
processor in focus stands between two instructions. States are saved at the end of each control period, and every 2 ms
of a period that is looked at closely; what does not differ from the state before is shared, and when they take more
than their budget, every second one of the older half goes.

    checkpoint ──► load ──► run, asking at marked instructions ──► hits ──► go to the first or the last one
"""

from __future__ import annotations

import bisect
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from typing import NamedTuple

from miro_exact.clock import CONTROL_PERIOD_TICKS, CYCLE_TICKS, NEVER_TICK
from miro_exact.state import Flat
from miro_robot.board import Board
from miro_robot.event_log import REACHED, EventLog
from miro_robot.mcs51.cpu import BREAKPOINT, Cpu
from miro_robot.mcs51.execute import Executor
from miro_sim.world.conditions import Condition
from miro_sim.world.events import Event, HostLog
from miro_sim.world.waits import WaitExpired
from mirotwin.rerun.inspected_run import BareRun, RobotRun

BUDGET_BYTES = 16 << 20
CLOSE_TICKS = 48_000  # 2 ms
_PAGE = 4096
_NOWHERE: tuple[int, ...] = ()
_LONGEST_CYCLES = 4  # of an instruction
_WAKES = frozenset((0, *range(0x03, 0x34, 8)))  # where a processor that slept goes on


class Core(NamedTuple):
    """A processor of the run: of a robot, or the bare one."""

    name: str
    cpu: Cpu
    board: Board | None


class Hit(NamedTuple):
    """Something that was asked for is true in `cycle` of processor `core`, before the next instruction."""

    cycle: int
    core: int
    found: object


Ask = Callable[[Core], object]
"""Asked before an instruction: None, or what is found."""


class Trap:
    """What is asked of a processor: `ask`, before each instruction at one of `addresses`, or (None) before any."""

    def __init__(self, addresses: Collection[int] | None, ask: Ask) -> None:
        self.addresses = None if addresses is None else frozenset(addresses)
        self.ask = ask


class _Asking:
    """Runs a processor as its `run` does, and asks on the way. `others`: where its owner has marks of its own.

    `tell` gets (cycle, what was found), and says whether that is enough.
    """

    def __init__(
        self,
        core: Core,
        trap: Trap,
        tell: Callable[[int, object], bool],
        others: Callable[[], Collection[int]],
    ) -> None:
        self.core = core
        self.trap = trap
        self.tell = tell
        self.others = others
        self.done = False

    def run(self, until_cycle: int) -> int:
        """See `Inspector` of the processor."""
        if self.trap.addresses is None:
            return self._run_each(until_cycle)
        cpu, others = self.core.cpu, self.others()
        marks = tuple(self.trap.addresses.difference(others))
        while True:
            reason = self._run_marked(() if self.done else marks, until_cycle)
            if reason != BREAKPOINT:
                return reason
            if cpu.pc in self.trap.addresses:
                self._ask()
            if cpu.pc in others:
                return reason
            reason = Executor.run(cpu, cpu.cycles + 1)
            if reason or cpu.cycles >= until_cycle:
                return reason

    def _run_marked(self, marks: tuple[int, ...], until_cycle: int) -> int:
        self.core.cpu.mark(marks)
        try:
            return Executor.run(self.core.cpu, until_cycle)
        finally:
            self.core.cpu.unmark(marks)

    def _run_each(self, until_cycle: int) -> int:
        cpu, others = self.core.cpu, self.others()
        wakes = tuple(_WAKES.difference(others))
        reason = 0
        while not reason and cpu.cycles < until_cycle:
            if cpu.idle or cpu.powered_down:
                reason = self._run_marked(wakes, until_cycle)
                reason = 0 if reason == BREAKPOINT and cpu.pc not in others else reason
                continue
            if not self.done:
                self._ask()
            reason = Executor.run(cpu, until_cycle if self.done else cpu.cycles + 1)
        return reason

    def _ask(self) -> None:
        cpu = self.core.cpu
        if self.core.board is not None:
            self.core.board.sync(cpu.cycles * CYCLE_TICKS)
        found = self.trap.ask(self.core)
        if found is not None:
            self.done = self.tell(cpu.cycles, found)


class _Checkpoint(NamedTuple):
    tick: int
    pages: tuple[bytes, ...]
    log_ends: tuple[int, ...]


class _RobotMachine:
    """The world of a robot, as the timeline uses it."""

    def __init__(self, run: RobotRun) -> None:
        self.run = run
        self.world = run.world
        self.robots = [robot for network in run.world.networks for robot in network.robots]
        self.cores = [
            Core(f"net{robot.network}/robot{robot.slot}", robot.board.cpu, robot.board)
            for robot in self.robots
        ]
        self.logs: list[EventLog | HostLog] = [
            *(robot.board.log for robot in self.robots),
            *(network.log for network in run.world.networks),
        ]
        self.focus = next(at for at, core in enumerate(self.cores) if core.cpu is run.cpu)

    @property
    def tick(self) -> int:
        return self.world.tick

    def save(self) -> bytes:
        return self.world.save()

    def load(self, state: bytes, log_ends: tuple[int, ...]) -> None:
        self.world.load(state)
        for robot in self.robots:
            del robot.board.faults[robot.board.fault_count :]
        for log, end in zip(self.logs, log_ends, strict=True):
            log.cut(end)

    def others(self) -> Collection[int]:
        return _NOWHERE


class _BareMachine:
    """The bare processor, as the timeline uses it."""

    def __init__(self, run: BareRun) -> None:
        self.run = run
        self.state = Flat(run.machine)
        self.cores = [Core("processor", run.cpu, None)]
        self.logs: list[EventLog | HostLog] = []
        self.focus = 0

    @property
    def tick(self) -> int:
        return self.run.cpu.cycles * CYCLE_TICKS

    def save(self) -> bytes:
        return self.state.save()

    def load(self, state: bytes, log_ends: tuple[int, ...]) -> None:
        self.state.load(state)
        self.run.resume()

    def others(self) -> Collection[int]:
        return (*self.run.machine.ends, *(() if self.run.until is None else (self.run.until,)))


class Timeline:
    """`run` from its start on. `interrupted` is asked between pieces: true ends a search where it is."""

    def __init__(self, run: RobotRun | BareRun, interrupted: Callable[[], bool] = lambda: False) -> None:
        self.machine = _RobotMachine(run) if isinstance(run, RobotRun) else _BareMachine(run)
        self.run = run
        self.cores = self.machine.cores
        self.focus = self.machine.focus
        self.interrupted = interrupted
        self._kept: list[_Checkpoint] = []
        self._bytes = 0
        self._loaded: tuple[int, bytes] = (-1, b"")
        self.save()

    @property
    def core(self) -> Core:
        return self.cores[self.focus]

    @property
    def begin_tick(self) -> int:
        """Where the run begins: 0, or where a saved world goes on."""
        return self._kept[0].tick

    @property
    def frontier(self) -> int:
        """How far the run has been."""
        return max(self._kept[-1].tick, self.machine.tick)

    @property
    def tick(self) -> int:
        """Where the processor in focus stands."""
        return self.core.cpu.cycles * CYCLE_TICKS

    # Checkpoints

    @property
    def kept_bytes(self) -> int:
        return self._bytes

    def save(self) -> None:
        """Keeps the state of now, unless it is kept."""
        tick = self.machine.tick
        at = bisect.bisect_left(self._kept, tick, key=_tick)
        if at < len(self._kept) and self._kept[at].tick == tick:
            return
        state = self.machine.save()
        before = self._kept[at - 1].pages if at else ()
        pages = tuple(state[start : start + _PAGE] for start in range(0, len(state), _PAGE))
        shared = tuple(old if new == old else new for new, old in zip(pages, before, strict=False))
        pages = (*shared, *pages[len(shared) :])
        ends = tuple(log.end for log in self.machine.logs)
        self._kept.insert(at, _Checkpoint(tick, pages, ends))
        self._bytes += sum(
            len(page)
            for page, old in zip(pages, (*before, *pages[len(before) :]), strict=False)
            if page is not old
        )
        if self._bytes > BUDGET_BYTES:
            self._thin_out()

    def _thin_out(self) -> None:
        old = len(self._kept) // 2
        del self._kept[1:old:2]
        self._bytes = sum({id(page): len(page) for one in self._kept for page in one.pages}.values())

    def _load(self, at: int) -> None:
        one = self._kept[at]
        if self._loaded[0] != one.tick:
            self._loaded = (one.tick, b"".join(one.pages))
        self.machine.load(self._loaded[1], one.log_ends)

    def _before(self, tick: int) -> int:
        """The last checkpoint before `tick`, or the first one."""
        return max(0, bisect.bisect_left(self._kept, tick, key=_tick) - 1)

    # Moving

    def go_to(self, tick: int) -> None:
        """To the first moment at or behind `tick`, or to the end of the run."""
        at = max(0, bisect.bisect_right(self._kept, tick, key=_tick) - 1)
        if not self._kept[at].tick <= self.machine.tick <= tick:
            self._load(at)
        self._run_to(tick)
        self._settle()

    def _settle(self) -> None:
        """Everything else on to where the processor in focus stands: it may have gone past a tick by an instruction.

        The boards too, which are otherwise as far as the tick before it.
        """
        if not self.run.over:
            self.run.to(self.tick)
            for core in self.cores:
                if core.board is not None:
                    core.board.sync(self.machine.tick)

    def _run_to(self, tick: int, every: int = CONTROL_PERIOD_TICKS) -> None:
        while self.machine.tick < tick and not self.run.over:
            self.run.to(min(tick, (self.machine.tick // every + 1) * every))
            if self.machine.tick % every == 0:
                self.save()

    def _look_closely(self, end_tick: int) -> None:
        """Sees to it that a checkpoint is at most 2 ms before `end_tick`."""
        at = self._before(end_tick)
        if end_tick - self._kept[at].tick > CLOSE_TICKS:
            self._load(at)
            self._run_to(end_tick - CONTROL_PERIOD_TICKS)
            self._run_to(end_tick - 1, CLOSE_TICKS)

    def _land(self, hit: Hit) -> Hit:
        self.focus = hit.core
        self.go_to(hit.cycle * CYCLE_TICKS)
        return hit

    def step(self) -> None:
        """One instruction or interrupt entry; asleep, to the first instruction of what wakes it."""
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
        self._load(self._before(self.tick))
        self._run_to((cycle - _LONGEST_CYCLES) * CYCLE_TICKS)
        before = -1
        while cpu.cycles < cycle:
            before = cpu.cycles
            asleep = cpu.idle or cpu.powered_down
            self.run.to(before * CYCLE_TICKS + 1)
        if before < 0:
            return False
        if not asleep:
            self.go_to(before * CYCLE_TICKS)
        elif self.find_back({self.focus: Trap(None, lambda core: True)}, closely=True) is not None:
            self.step()
        return True

    # Searching

    def find(self, traps: Mapping[int, Trap], until_tick: int = NEVER_TICK) -> Hit | None:
        """Goes on to the first moment behind this one at which a trap, by processor, finds something.

        None, and no further than the end of the run, `until_tick` or an interruption, if there is none.
        """
        now = (self.core.cpu.cycles, self.focus)
        found: list[Hit] = []

        def tell(hit: Hit) -> bool:
            if hit[:2] > now:
                found.append(hit)
            return hit[:2] > now

        while not self.run.over and self.machine.tick < until_tick:
            end_tick = (self.machine.tick // CONTROL_PERIOD_TICKS + 1) * CONTROL_PERIOD_TICKS
            if not self._passes(traps, min(end_tick, until_tick)):
                with self._asking(traps, tell):
                    self.run.to(min(end_tick, until_tick))
            if found:
                return self._land(min(found, key=_order))
            if self.machine.tick == end_tick:
                self.save()
            if self.interrupted():
                break
        self._settle()
        return None

    def _passes(self, traps: Mapping[int, Trap], end_tick: int) -> bool:
        """Runs to `end_tick` without asking, if no instruction that a trap names is executed; else it stays."""
        machine = self.machine
        marks = {at: trap.addresses for at, trap in traps.items() if trap.addresses is not None}
        if not isinstance(machine, _RobotMachine) or len(marks) < len(traps):
            return False
        begin_tick, ends = machine.tick, [robot.board.log.end for robot in machine.robots]
        self.save()
        for at, addresses in marks.items():
            machine.robots[at].marks = tuple(addresses)
        self.run.to(end_tick)
        for robot in machine.robots:
            robot.marks = ()
        logs = zip((robot.board.log for robot in machine.robots), ends, strict=True)
        if all(log.first <= end and not _reached(log, end) for log, end in logs):
            return True
        self._load(bisect.bisect_left(self._kept, begin_tick, key=_tick))
        return False

    def find_back(self, traps: Mapping[int, Trap], closely: bool = False) -> Hit | None:
        """Goes back to the last moment before this one at which a trap finds something; None, at the start of the run
        or where it was interrupted, if there is none. `closely`: it is likely to be near.
        """
        now = (self.core.cpu.cycles, self.focus)
        found: dict[int, Hit] = {}

        def tell(hit: Hit) -> bool:
            if hit[:2] < now:
                found[hit.core] = hit
            return False

        end_tick = self.tick + 1
        while True:
            if closely:
                self._look_closely(end_tick)
            begin_tick = self._kept[self._before(end_tick)].tick
            self._load(self._before(end_tick))
            with self._asking(traps, tell):
                self._run_to(end_tick)
            if found:
                return self._land(max(found.values(), key=_order))
            if begin_tick == self.begin_tick or self.interrupted():
                self.go_to(begin_tick)
                return None
            end_tick = begin_tick

    def until(self, condition: Condition) -> Event | None:
        """Goes on to the first tick at which `condition` is true; None, and no further than the end, if it never is."""
        assert isinstance(self.run, RobotRun)
        while not self.run.over and not self.interrupted():
            with suppress(WaitExpired):
                event = self.run.world.run_until(
                    condition, CONTROL_PERIOD_TICKS - self.machine.tick % CONTROL_PERIOD_TICKS
                )
                self._settle()
                return event
            self.save()
        return None

    def radio_events(self) -> list[Event]:
        """Frames on the air of the network of the robot in focus, up to now."""
        if not isinstance(self.machine, _RobotMachine):
            return []
        network = self.machine.world.networks[self.machine.robots[self.focus].network]
        events = (event for _, event in network.log.since(0, heard=False))
        return [event for event in events if event.what in ("sent", "answer") and event.tick <= self.tick]

    def find_core(self, network: int, slot: int) -> int:
        """The processor of the robot in a slot; the one in focus where there is none."""
        robots = self.machine.robots if isinstance(self.machine, _RobotMachine) else []
        places = [(robot.network, robot.slot) for robot in robots]
        return places.index((network, slot)) if (network, slot) in places else self.focus

    @contextmanager
    def _asking(self, traps: Mapping[int, Trap], tell: Callable[[Hit], bool]) -> Iterator[None]:
        for at, trap in traps.items():
            told = partial(_tell, tell, at)
            self.cores[at].cpu.inspector = _Asking(self.cores[at], trap, told, self.machine.others)
        try:
            yield
        finally:
            for at in traps:
                self.cores[at].cpu.inspector = None


def _tell(tell: Callable[[Hit], bool], core: int, cycle: int, found: object) -> bool:
    return tell(Hit(cycle, core, found))


def _reached(log: EventLog, since: int) -> bool:
    return any(log.event(serial)[1] == REACHED for serial in range(since, log.end))


def _tick(one: _Checkpoint) -> int:
    return one.tick


def _order(hit: Hit) -> tuple[int, int]:
    return hit.cycle, hit.core
