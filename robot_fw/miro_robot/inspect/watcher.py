"""Runs a CPU step by step and reports each step to watchers.

Each watcher has its own file. The CPU's hot loop stays free of all this: without an inspector it costs one test per
run.
"""

from __future__ import annotations

from miro_robot.mcs51.cpu import Cpu

_VECTOR, _VECTOR_STEP = 3, 8  # interrupt vectors are at 8 * source + 3
_CALL_CYCLES = 2  # of the hardware's LCALL


class Watcher:
    """Base class of watchers. A method is called after the CPU did what its name says; here all do nothing.

    Cycles are machine cycles; the step began in cycle `start` and ended with `cpu.cycles`.
    """

    def attached(self, cpu: Cpu) -> None:
        """The watcher was attached."""

    def resumed(self, cpu: Cpu) -> None:
        """The CPU is where the watcher saw it last, after a piece that was not reported to it (`Inspector.pause`)."""

    def detached(self, cpu: Cpu) -> None:
        """The watcher was detached."""

    def starting(self, cpu: Cpu) -> None:
        """A run begins. The lines hold their input for the run, and all edges of the last one."""

    def executed(self, cpu: Cpu, pc: int, start: int) -> None:
        """The instruction at `pc` was executed."""

    def interrupted(self, cpu: Cpu, source: int, pc: int, start: int) -> None:
        """The hardware called the routine of `source` (0..5: INT0, timer 0, INT1, timer 1, serial, timer 2).

        `pc`: address of the instruction that was next when the interrupt came.
        """

    def slept(self, cpu: Cpu, start: int, end: int) -> None:
        """The CPU was idle or powered down from cycle `start` to before `end`; it may go on sleeping."""

    def ran(self, cpu: Cpu, start: int) -> None:
        """A run that began in cycle `start` has ended. The CPU's output lines are final up to now."""


class Inspector:
    """Runs `cpu` for its watchers. `Cpu.run` hands over to the inspector in `Cpu.inspector`.

    `once`: watchers that have to see each instruction once, also where a wait runs a piece, goes back and runs it again
    in part. The wait pauses them for all passes but the last. `held`: those that are paused now.
    """

    def __init__(self, cpu: Cpu) -> None:
        self.cpu = cpu
        self.watchers: list[Watcher] = []
        self.once: list[Watcher] = []
        self.held: list[Watcher] = []

    def pause(self) -> None:
        """Tells nothing to those that have to see each instruction once."""
        self.held = [watcher for watcher in self.watchers if watcher in self.once]
        self.watchers = [watcher for watcher in self.watchers if watcher not in self.once]

    def resume(self) -> None:
        """Tells them again, where the CPU was when they were paused."""
        held, self.held = self.held, []
        self.watchers = [*self.watchers, *held]
        for watcher in held:
            watcher.resumed(self.cpu)

    def run(self, until_cycle: int) -> int:
        """Like `Cpu.run_alone`, but step by step; with the same final state and the same reason for stopping."""
        cpu = self.cpu
        began = cpu.cycles
        reason = 0
        if began >= until_cycle:
            # No run for the watchers, but the lines are settled as without them.
            return cpu.run_alone(until_cycle)
        for watcher in self.watchers:
            # Before the run: `end_run` forgets the edges on RXD that they read.
            watcher.starting(cpu)
        cpu.begin_run()
        while reason == 0 and cpu.cycles < until_cycle:
            if cpu.idle or cpu.powered_down:
                reason = self._sleep(until_cycle)
            else:
                reason = self._step()
        cpu.end_run()
        for watcher in self.watchers:
            watcher.ran(cpu, began)
        return reason

    def _step(self) -> int:
        """One instruction or interrupt entry."""
        cpu = self.cpu
        pc = cpu.pc
        start = cpu.cycles
        executed = cpu.instructions
        reason = cpu.execute(start + 1)
        # The step may be an interrupt's LCALL, which is no instruction, or none at all, at a mark.
        if cpu.instructions != executed:
            for watcher in self.watchers:
                watcher.executed(cpu, pc, start)
        elif cpu.cycles != start:
            self._tell_interrupted(pc, start)
        return reason

    def _sleep(self, until_cycle: int) -> int:
        """To the interrupt that ends idle mode, or to the end of the run."""
        cpu = self.cpu
        pc = cpu.pc
        start = cpu.cycles
        ended = 0
        cpu.until = until_cycle
        # As `execute` does: while the reason of the last run stands, `boundary` ends at once.
        cpu.stop = 0
        cpu.limit = 0
        while ended == 0 and (cpu.idle or cpu.powered_down):
            ended = cpu.boundary()
        woken = cpu.idle == 0 and cpu.powered_down == 0
        # The LCALL that wakes it has been done in the same boundary.
        end = cpu.cycles - (_CALL_CYCLES if woken else 0)
        if end > start:
            for watcher in self.watchers:
                watcher.slept(cpu, start, end)
        if woken:
            self._tell_interrupted(pc, end)
        return cpu.stop

    def _tell_interrupted(self, pc: int, start: int) -> None:
        source = (self.cpu.pc - _VECTOR) // _VECTOR_STEP
        for watcher in self.watchers:
            watcher.interrupted(self.cpu, source, pc, start)


def attach(cpu: Cpu, *watchers: Watcher) -> Inspector:
    """Reports the steps of `cpu` to `watchers` from now on, besides those attached before."""
    inspector = cpu.inspector
    if not isinstance(inspector, Inspector):
        inspector = Inspector(cpu)
        cpu.inspector = inspector
    inspector.watchers.extend(watchers)
    for watcher in watchers:
        watcher.attached(cpu)
    return inspector


def detach(cpu: Cpu, *watchers: Watcher) -> None:
    """Detaches watchers; without any the CPU runs in its hot loop again."""
    inspector = cpu.inspector
    if isinstance(inspector, Inspector):
        inspector.watchers = [watcher for watcher in inspector.watchers if watcher not in watchers]
        # Paused ones come back: without the inspector `resume` would tell a CPU that runs its hot loop.
        if not inspector.watchers and not inspector.held:
            cpu.inspector = None
        for watcher in watchers:
            watcher.detached(cpu)
