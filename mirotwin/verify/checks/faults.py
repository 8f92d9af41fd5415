"""Four always-on checks, by kinds of firmware fault.

CPU and board detect faults while they run (`miro_robot.faults`), so these checks cost almost nothing.
"""

from __future__ import annotations

from typing import ClassVar

from miro_robot.faults import STACK_FAULTS, FaultKind, FirmwareFault
from miro_robot.lm629.signals import COMMAND_ERROR
from miro_sim.periods import RobotPeriod
from miro_sim.world.events import SIDES
from mirotwin.verify.checks.interface import Check, Kind, Monitor, Subject


class FaultCheck(Check, frozen=True, kw_only=True):
    """Fails for firmware faults of `KINDS`."""

    KIND: ClassVar[Kind] = "safety"
    KINDS: ClassVar[tuple[FaultKind, ...]] = ()
    WANTED: ClassVar[str] = ""

    def monitor(self, subject: Subject) -> Monitor[Check]:
        return FaultMonitor(self, subject)


class NoFault(FaultCheck, frozen=True, kw_only=True, tag="no_fault"):
    """The firmware never does what it must not: no firmware fault of any kind."""

    KINDS = tuple(FaultKind)
    SUBJECTS = ("robot", "board")
    WANTED = "no firmware fault"


class Lm629Protocol(FaultCheck, frozen=True, kw_only=True, tag="lm629_protocol"):
    """The LM629s are used as their data sheet says: timing, never written while busy, one at a time on the bus, and no
    command that they refuse (bit 1 of the status byte, as it is at the start of a control period).
    """

    KINDS = (FaultKind.BUS_CONTENTION, FaultKind.LM629_BUSY, FaultKind.LM629_TIMING)
    WANTED = "the LM629s used as their data sheet says"

    def monitor(self, subject: Subject) -> Monitor[Check]:
        return Lm629Monitor(self, subject)


class MainLoopAlive(FaultCheck, frozen=True, kw_only=True, tag="main_loop_alive"):
    """Interrupts never take all of 10 ms from the main loop. It is always on for robots; of a board it is no fault."""

    SUBJECTS = ("robot", "board")
    KINDS = (FaultKind.MAIN_LOOP_STARVED,)
    WANTED = "a main loop that runs every 10 ms"

    def monitor(self, subject: Subject) -> Monitor[Check]:
        return StarvedMonitor(self, subject) if subject.alone else FaultMonitor(self, subject)


class StackClear(FaultCheck, frozen=True, kw_only=True, tag="stack_clear"):
    """The stack pointer never leaves the stack: what the linker's map gives it, all of internal RAM without a map."""

    SUBJECTS = ("robot", "board")
    KINDS = STACK_FAULTS
    WANTED = "a stack clear of data"


class OneDriver(FaultCheck, frozen=True, kw_only=True, tag="one_driver"):
    """No two outputs of different level drive one net of a board."""

    SUBJECTS = ("board",)
    KINDS = (FaultKind.NET_CONTENTION,)
    WANTED = "one driver a net"


class FaultMonitor(Monitor[FaultCheck]):
    LATER = True

    def __init__(self, check: FaultCheck, subject: Subject) -> None:
        super().__init__(check, subject)
        self.judged = 1

    def fault(self, fault: FirmwareFault) -> None:
        if fault.kind in self.check.KINDS:
            self.fail(fault.tick, self.check.WANTED, str(fault), fault=True)


class StarvedMonitor(Monitor[FaultCheck]):
    """Of a board with parts, which keeps these apart from its faults. `last_tick`: of the last that was judged."""

    def __init__(self, check: FaultCheck, subject: Subject) -> None:
        super().__init__(check, subject)
        self.starved: list[FirmwareFault] = getattr(subject.device.board, "starved", [])
        if not hasattr(subject.device.board, "starved"):
            self.unseen = "the board has no parts, and nobody looks at its main loop"
        self.judged = 1
        self.last_tick = subject.begin_tick - 1

    def until(self, tick: int) -> None:
        for fault in self.starved:
            if self.last_tick < fault.tick < tick:
                self.last_tick = fault.tick
                self.fail(fault.tick, self.check.WANTED, str(fault))

    def end(self, tick: int) -> None:
        self.until(tick + 1)


class Lm629Monitor(FaultMonitor):
    """`refused`: chips whose last status byte reported "command error"."""

    def __init__(self, check: FaultCheck, subject: Subject) -> None:
        super().__init__(check, subject)
        self.refused = (0, 0)

    def period(self, record: RobotPeriod, tick: int) -> None:
        refused = (record.left.status & COMMAND_ERROR, record.right.status & COMMAND_ERROR)
        if refused != self.refused:
            for side, now, before in zip(SIDES, refused, self.refused, strict=True):
                if now > before:
                    reason = f"a command error in the status of the {side} LM629"
                    self.fail(tick, self.check.WANTED, reason)
            self.refused = refused
