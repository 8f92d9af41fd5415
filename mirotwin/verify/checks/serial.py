"""Characters that a serial port received and sent: for checks that judge answers, and for one about sleep."""

from __future__ import annotations

from typing import ClassVar, NamedTuple, TypeVar

from miro_exact.clock import CYCLE_TICKS
from miro_sim.world.events import Event
from mirotwin.verify.checks.interface import Check, Kind, Monitor, Subject, SubjectKind


class Character(NamedTuple):
    """A character that the serial port sent or received. `tick`: RI or TI went up.

    `stop_good`: the stop bit was a mark, if the mode of the serial port detects it.
    """

    value: int
    tick: int
    stop_good: bool = True


C_co = TypeVar("C_co", bound=Check, covariant=True)


class SerialMonitor(Monitor[C_co]):
    """Base of monitors that want all characters: `received` and `sent` since the run is judged, in the order of time.

    `reset_tick`: the processor was reset, for the last time; None if it never was.
    """

    EVENTS = ("received", "transmitted")

    def __init__(self, check: C_co, subject: Subject) -> None:
        super().__init__(check, subject)
        self.received: list[Character] = []
        self.sent: list[Character] = []
        self.reset_tick: int | None = None

    def event(self, event: Event) -> None:
        characters = self.received if event.what == "received" else self.sent
        characters.append(Character(event.value, event.tick, event.good_stop))

    def restarted(self, tick: int) -> None:
        self.reset_tick = tick

    @property
    def received_bytes(self) -> bytes:
        return bytes([character.value for character in self.received])

    @property
    def sent_bytes(self) -> bytes:
        return bytes([character.value for character in self.sent])

    @property
    def sent_since_reset(self) -> bytes:
        """The characters sent after the last reset, which may have cut a character off."""
        since = -1 if self.reset_tick is None else self.reset_tick
        return bytes([character.value for character in self.sent if character.tick > since])


class NeverSleeps(Check, frozen=True, kw_only=True, tag="never_sleeps"):
    """Firmware that sleeps (`IDL`) before the first character sleeps again in the last 30 ms of the run (at 24 MHz)."""

    KIND: ClassVar[Kind] = "liveness"
    SUBJECTS: ClassVar[tuple[SubjectKind, ...]] = ("board",)

    def monitor(self, subject: Subject) -> Monitor[Check]:
        return NeverSleepsMonitor(self, subject)


class NeverSleepsMonitor(Monitor[NeverSleeps]):
    def end(self, tick: int) -> None:
        sleep, cpu = self.subject.sleep, self.subject.cpu
        if sleep is None or sleep.late_cycles < 0:
            self.missed = "the run was over before"
        elif not sleep.sleeps:
            self.missed = "the firmware does not sleep before the first character"
        else:
            self.judged += 1
            if not sleep.slept:
                reason = "the firmware is awake long after the last character"
                self.fail(cpu.cycles * CYCLE_TICKS, "", reason)
