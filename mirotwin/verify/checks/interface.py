"""The interface of checks: their input, their results, and their declarations.

A check is two classes. Its parameters are a frozen struct whose tag is the check's name and its key in `[expect]`;
their `monitor` method makes a `Monitor`, one for each robot. The monitor is fed in the order of time:

    logs of boards and PC ──► event(event)       of the kinds in EVENTS
    resets, power ──────────► restarted(tick)
    firmware faults ────────► fault(fault)
    control periods ────────► period(record, tick)
    all of it, up to a tick ► until(tick)        what should have happened by now?
    the run is over ────────► end(tick)

and calls `fail` once for each violation, when it begins. There are two kinds: safety (this never happens) fails at the
tick at which it happens; liveness (this happens within a time) at the tick at which the time is over. `judged` counts
how often the check applied: a check that never applied has not passed.

A check only observes. It may read the robot but changes no bit of a run, so its memory is plain attributes and is not
part of a saved world.
"""

from __future__ import annotations

from typing import Any, ClassVar, Generic, Literal, Protocol, TypeVar, get_args

import msgspec

from miro_exact.bad_input import did_you_mean
from miro_exact.clock import TICKS_PER_SECOND, ticks
from miro_exact.plugins import PluginError
from miro_exact.raised import at_place, defined_at
from miro_robot.faults import FirmwareFault
from miro_robot.image import Image
from miro_robot.mcs51.cpu import Cpu
from miro_sim.periods import RobotPeriod
from miro_sim.radio.downlink import Downlink
from miro_sim.scenario.board import BoardScenario
from miro_sim.world.events import Event
from miro_sim.world.robot import Robot
from mirotwin.shell.verdicts import Verdict
from mirotwin.verify.checks.memory import Memory
from mirotwin.verify.checks.sleep import Sleep

Kind = Literal["safety", "liveness"]
SubjectKind = Literal["robot", "board"]
EVENT_KINDS = (
    *("sent", "heard", "answer", "received", "transmitted", "frame", "damaged", "command", "fault"),
    *("reset", "power", "radio", "touch", "start_lost", "wheel_lost"),
)
"""The kinds that `EVENTS` of a monitor may name."""
KEPT = 100
"""Failures of a monitor that are saved; the others are only counted."""


class Failure(msgspec.Struct, frozen=True):
    """`check` failed for a device at `tick`: the wanted and the observed behaviour. `fault`: it is a firmware fault.

    `alone_hz`: the crystal of a board alone, 0 for a robot.
    """

    check: str
    network: int
    slot: int
    tick: int
    wanted: str
    found: str
    fault: bool = False
    alone_hz: int = 0

    @property
    def what(self) -> str:
        """The failure in words."""
        if self.alone_hz and (self.fault or not self.wanted):  # a fault says by itself what is wrong
            return self.found
        return f"wanted {self.wanted}, found {self.found}"

    def __str__(self) -> str:
        if self.alone_hz:
            return f"{self.check}: {at(self.tick, self.alone_hz)}: {self.what}"
        return f"{self.check}: net{self.network}/robot{self.slot}: {at(self.tick)}: {self.what}"


class JudgedDevice(Protocol):
    """A robot, a board alone, or the fuzzer's processor. `board` has a `cpu`."""

    network: int
    slot: int

    @property
    def board(self) -> Any: ...


class Subject(msgspec.Struct, frozen=True):
    """The device that is judged: a robot, or a board alone, which runs `image`. `end_tick`: regular end of the run.
    `clock`: ticks per second. `begin_tick`: earlier events are not judged.

    Of a robot: `robots`: slots of its network; `first_slot`: of the robots that are present there; `radio`: from the PC
    to them. `cut`: the run may be stopped before its end; then missing events do not fail. Of a board alone: `sleep`.
    """

    device: JudgedDevice
    image: Image
    end_tick: int
    robots: int = 0
    first_slot: int = 0
    radio: Downlink | None = None
    cut: bool = False
    clock: int = TICKS_PER_SECOND
    begin_tick: int = 0
    sleep: Sleep | None = None

    @property
    def robot(self) -> Robot:
        """Raises PluginError for a board alone."""
        if not isinstance(self.device, Robot):
            raise PluginError("it looks at the robot of a board alone", "take `subject.device`")
        return self.device

    @property
    def alone(self) -> bool:
        """True if it is a board alone."""
        return not isinstance(self.device, Robot)

    @property
    def cpu(self) -> Cpu:
        cpu: Cpu = self.device.board.cpu
        return cpu

    @property
    def memory(self) -> Memory:
        """The memories of its processor as they are now, variables by their names in C."""
        return Memory(self.cpu, self.image)

    @property
    def network(self) -> int:
        return self.device.network

    @property
    def slot(self) -> int:
        return self.device.slot


class Check(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="check"):
    """Base of every check's parameters.

    Derive with `frozen=True, kw_only=True, tag="name_of_the_check"`, give each key its unit and its range
    (`typing.Annotated` with `msgspec.Meta`), and define `KIND` and `monitor`. `MAIN` is the parameter set by a bare
    value in `[expect]`; a check without one is written `name = true`. `SUBJECTS`: the kinds of device that it can
    judge.
    """

    KIND: ClassVar[Kind]
    MAIN: ClassVar[str] = ""
    MAIN_IS_TABLE: ClassVar[bool] = False
    """A table that does not name MAIN is its value: `pwm_at_least_hz = { "P2.0" = 80 }`."""
    SUBJECTS: ClassVar[tuple[SubjectKind, ...]] = ("robot",)

    @property
    def name(self) -> str:
        return str(self.__struct_config__.tag)

    def problem(self, end_tick: int) -> str:
        """Reason why a run that ends at `end_tick` cannot be judged; "" if it can."""
        return ""

    def problem_alone(self, scenario: BoardScenario) -> str:
        """Reason why it cannot judge this board, as `key: reason; remedy`; "" if it can."""
        return ""

    def monitor(self, subject: Subject) -> Monitor[Check]:
        """A monitor of one robot."""
        raise NotImplementedError


C_co = TypeVar("C_co", bound=Check, covariant=True)


class Monitor(Generic[C_co]):
    """Judges one robot by one check. `failures`: the first hundred; `failed`: how many there were."""

    EVENTS: tuple[str, ...] = ()
    """Kinds of event that `event` gets, of `EVENT_KINDS`: of the robot and of its network's PC. `frame` is a valid
    frame at the robot, with value 1 if it is fresh; `damaged` are characters at the robot that are no frame."""
    unseen = ""
    """Reason why no run of this robot can be judged, such as a symbol missing in its image: "not observable"."""
    missed = ""
    """Further reason why the check never applied in this run, if there is one."""
    LATER = False
    """`period` may be called in batches, where no check listens to events of the board. Such a monitor must not read
    the robot except in `period_over` and `end`."""

    def __init__(self, check: C_co, subject: Subject) -> None:
        self.check = check
        self.subject = subject
        self.failures: list[Failure] = []
        self.failed = 0
        self.judged = 0

    def fail(self, tick: int, wanted: str, found: str, fault: bool = False) -> None:
        """Notes a failure at `tick`. Raises TypeError for a tick that is not an int."""
        if not isinstance(tick, int):
            raise TypeError(f"fail() needs the tick as an int, got {tick!r:.40}")
        self.failed += 1
        if len(self.failures) < KEPT:
            subject = self.subject
            alone_hz = subject.clock if subject.alone else 0
            place = (subject.network, subject.slot)
            self.failures.append(Failure(self.check.name, *place, tick, wanted, found, fault, alone_hz))

    def event(self, event: Event) -> None:
        """Something that happened, of the kinds in `EVENTS`."""

    def restarted(self, tick: int) -> None:
        """The robot's processor was reset, or its supply was switched: it has no memory of earlier events."""

    def fault(self, fault: FirmwareFault) -> None:
        """A firmware fault occurred."""

    def period(self, record: RobotPeriod, tick: int) -> None:
        """The robot as it was at `tick`, the start of the control period that is over."""

    def period_over(self) -> None:
        """Called at the end of a control period, when the robot's present state can be read; `period` is called now or
        later.
        """

    def until(self, tick: int) -> None:
        """All events before `tick` have been reported."""

    def end(self, tick: int) -> None:
        """The run is over at `tick`."""

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.check!r}, judged={self.judged}, failed={self.failed})"


def ms_ticks(time_ms: float, clock: int = TICKS_PER_SECOND) -> int:
    """Milliseconds to ticks; fractions are allowed and rounded half up."""
    return ticks(time_ms / 1000.0, clock)


def in_ms(duration_ticks: int, clock: int = TICKS_PER_SECOND) -> str:
    """A duration for people."""
    return f"{duration_ticks * 1000 / clock:.3f} ms"


def at(tick: int, clock: int = TICKS_PER_SECOND) -> str:
    """A tick for people."""
    return f"tick {tick} ({in_ms(tick, clock)})"


class FirstFailure(msgspec.Struct, frozen=True):
    """The earliest failure of a check: robot, tick, wanted and observed behaviour."""

    network: int
    slot: int
    tick: int
    wanted: str
    found: str


class Expectation(msgspec.Struct, frozen=True, omit_defaults=True):
    """The result of a check, over all robots.

    `kind`: safety (never) or liveness (within a time). `verdict`: passed, failed, "not judged" (it never applied in
    this run) or "not observable" (no run of such robots shows it); `reason`: for the last two. `failures`: their
    number; `first`: the earliest.
    """

    name: str
    kind: str
    verdict: Verdict
    failures: int = 0
    first: FirstFailure | None = None
    reason: str = ""


def checked_monitor(check: Check, subject: Subject) -> Monitor[Any]:
    """The monitor of one robot. Raises PluginError if `check` does not return a monitor."""
    monitor: Any = check.monitor(subject)
    place = defined_at(check.monitor)
    if not isinstance(monitor, Monitor):
        reason = at_place(f"`monitor` returned {monitor!r:.40}", place)
        raise PluginError(reason, "return an object of a class that derives from Monitor")
    if not hasattr(monitor, "failures"):
        reason = f"the constructor of {type(monitor).__name__} does not call that of Monitor"
        raise PluginError(
            at_place(reason, defined_at(type(monitor).__init__)), "call super().__init__(check, subject)"
        )
    _check_events(monitor, place)
    return monitor


def problem_of_class(struct: type[Check]) -> str:
    """The part that the class of a check lacks, or the empty string."""
    name = f"{struct.__module__}.{struct.__name__}"
    if getattr(struct, "KIND", None) not in get_args(Kind):
        return f"{name} has no KIND: write KIND = 'safety' (never) or 'liveness' (within a time)"
    if struct.monitor is Check.monitor:
        return f"{name} has no method `monitor`"
    return ""


def _check_events(monitor: Monitor[Any], place: str) -> None:
    events: Any = monitor.EVENTS
    name = f"EVENTS of {type(monitor).__name__}"
    if not isinstance(events, tuple | list | set | frozenset):
        raise PluginError(at_place(f"{name} is {events!r:.40}", place), f"write ({events!r:.40},)")
    for kind in events:
        if kind not in EVENT_KINDS:
            reason = at_place(f"{name} names {kind!r:.40}, which is no event", place)
            raise PluginError(
                reason, did_you_mean(str(kind), EVENT_KINDS, f"there are {', '.join(EVENT_KINDS)}")
            )
