"""Checks of a board's pins, serial port and parts during a whole run."""

from __future__ import annotations

from typing import Annotated, ClassVar

from msgspec import Meta

from miro_sim.scenario.board import BoardScenario
from miro_sim.world.conditions import Frequency, Hz, Text, TextValue, Value
from miro_sim.world.events import Event
from mirotwin.verify.checks.following import Following, unknown_source
from mirotwin.verify.checks.interface import Check, Kind, Monitor, Subject, SubjectKind, in_ms, ms_ticks

Pins = Annotated[dict[str, Hz], Meta(min_length=1)]
Values = Annotated[dict[str, float], Meta(min_length=1)]
WithinMs = Annotated[float, Meta(gt=0.0, le=86_400_000.0)]


class PwmAtLeast(Check, frozen=True, kw_only=True, tag="pwm_at_least_hz"):
    """No period of these pins is longer, from one rising edge to the next. A pin that stands for `off_after_ms` is off,
    which is no period.
    """

    KIND: ClassVar[Kind] = "safety"
    SUBJECTS: ClassVar[tuple[SubjectKind, ...]] = ("board",)
    MAIN: ClassVar[str] = "pins"
    MAIN_IS_TABLE: ClassVar[bool] = True

    pins: Pins
    off_after_ms: WithinMs = 100.0

    def problem_alone(self, scenario: BoardScenario) -> str:
        problems = (unknown_source(Frequency(pin=pin), scenario) for pin in self.pins)
        return next((problem for problem in problems if problem), "")

    def monitor(self, subject: Subject) -> Monitor[Check]:
        return PwmMonitor(self, subject)


class PwmMonitor(Monitor[PwmAtLeast]):
    """`slow`: pins whose last period was too long."""

    def __init__(self, check: PwmAtLeast, subject: Subject) -> None:
        super().__init__(check, subject)
        self._follow(subject.begin_tick)
        self.unseen = next((period.unseen for period in self.periods.values()), "")

    def _follow(self, begin_tick: int) -> None:
        off_hz = 1000.0 / self.check.off_after_ms
        self.periods = {
            pin: Following(Frequency(pin=pin, at_least_hz=off_hz), self.subject, begin_tick)
            for pin in self.check.pins
        }
        self.slow = dict.fromkeys(self.check.pins, False)

    def restarted(self, tick: int) -> None:
        """A reset ends a pulse, which is no fault of the PWM."""
        self.until(tick)
        self._follow(tick)

    def until(self, tick: int) -> None:
        for pin, following in self.periods.items():
            least_hz, slow = self.check.pins[pin], self.slow[pin]
            for end_tick, hz in following.matches(tick):
                self.judged += 1
                if hz < least_hz and not slow:
                    self.fail(
                        end_tick, f"PWM of {pin} at {least_hz:g} Hz or more", f"a period of {hz:.6g} Hz"
                    )
                slow = hz < least_hz
            self.slow[pin] = slow

    def end(self, tick: int) -> None:
        self.until(tick + 1)


class SendsText(Check, frozen=True, kw_only=True, tag="sends_text"):
    """The board sends this text, or what matches the regular expression `pattern`, in time (left out: in the run)."""

    KIND: ClassVar[Kind] = "liveness"
    SUBJECTS: ClassVar[tuple[SubjectKind, ...]] = ("board",)
    MAIN: ClassVar[str] = "text"

    text: TextValue | None = None
    pattern: TextValue | None = None
    within_ms: WithinMs | None = None

    def __post_init__(self) -> None:
        Text(text=self.text, pattern=self.pattern)

    def monitor(self, subject: Subject) -> Monitor[Check]:
        return SendsTextMonitor(self, subject)


class SendsTextMonitor(Monitor[SendsText]):
    EVENTS = ("heard",)

    def __init__(self, check: SendsText, subject: Subject) -> None:
        super().__init__(check, subject)
        condition = Text(text=check.text, pattern=check.pattern)
        within = "" if check.within_ms is None else f" within {check.within_ms:g} ms"
        self.wanted = f"{condition} sent{within}"
        self.following = Following(condition, subject, subject.begin_tick)
        self.until_tick = subject.end_tick
        if check.within_ms is not None:
            self.until_tick = subject.begin_tick + ms_ticks(check.within_ms, subject.clock)
        self.done = False

    def event(self, event: Event) -> None:
        if event.tick <= self.until_tick:
            self.following.heard(event)

    def until(self, tick: int) -> None:
        if not self.done and self.following.matches(tick):
            self.judged, self.done = 1, True
        elif not self.done and tick > self.until_tick:
            self._fail(self.until_tick)

    def end(self, tick: int) -> None:
        self.until(tick + 1)
        if not self.done and not self.subject.cut:
            self._fail(tick)

    def _fail(self, tick: int) -> None:
        self.judged, self.done = 1, True
        self.fail(tick, self.wanted, self.following.found())


class ValueAtMost(Check, frozen=True, kw_only=True, tag="value_at_most"):
    """Values of parts never rise above these, as looked at each 1 / 1000 s and after each put."""

    KIND: ClassVar[Kind] = "safety"
    SUBJECTS: ClassVar[tuple[SubjectKind, ...]] = ("board",)
    MAIN: ClassVar[str] = "values"
    MAIN_IS_TABLE: ClassVar[bool] = True
    WORD: ClassVar[str] = "at most"

    values: Values

    def problem_alone(self, scenario: BoardScenario) -> str:
        problems = (unknown_source(beyond(self, path), scenario) for path in self.values)
        return next((problem for problem in problems if problem), "")

    def monitor(self, subject: Subject) -> Monitor[Check]:
        return LimitMonitor(self, subject)


class ValueAtLeast(ValueAtMost, frozen=True, kw_only=True, tag="value_at_least"):
    """Values of parts never fall below these, as looked at each 1 / 1000 s and after each put."""

    WORD: ClassVar[str] = "at least"


def beyond(check: ValueAtMost, path: str) -> Value:
    """The condition that a value must not fulfil."""
    limit = check.values[path]
    return Value(of=path, below=limit) if isinstance(check, ValueAtLeast) else Value(of=path, above=limit)


class LimitMonitor(Monitor[ValueAtMost]):
    def __init__(self, check: ValueAtMost, subject: Subject) -> None:
        super().__init__(check, subject)
        begin = subject.begin_tick
        self.values = {path: Following(beyond(check, path), subject, begin) for path in check.values}
        self.unseen = next((limit.unseen for limit in self.values.values()), "")
        self.judged = 1

    def until(self, tick: int) -> None:
        for path, following in self.values.items():
            for when, value in following.matches(tick):
                wanted = f"{path} {self.check.WORD} {self.check.values[path]:g}"
                self.fail(when, wanted, f"{value:.10g}")

    def end(self, tick: int) -> None:
        self.until(tick + 1)


class AnswersMonitor(Monitor[Check]):
    """Of a board: characters that it receives are answered. Each starts the time anew, so the last of a text counts.

    `asked_tick`: the stop bit of the last character without an answer; -1: none.
    """

    EVENTS = ("received", "transmitted")

    def __init__(self, check: Check, subject: Subject, within_ms: float) -> None:
        super().__init__(check, subject)
        self.within_ticks = ms_ticks(within_ms, subject.clock)
        self.wanted = f"an answer within {within_ms:g} ms of the last character"
        self.asked_tick = -1

    def event(self, event: Event) -> None:
        self.until(event.tick)
        if event.what == "received":
            self.judged += self.asked_tick < 0
            self.asked_tick = event.tick
        else:
            self.asked_tick = -1

    def restarted(self, tick: int) -> None:
        self.until(tick)
        self.asked_tick = -1

    def until(self, tick: int) -> None:
        if self.asked_tick >= 0 and tick > self.asked_tick + self.within_ticks:
            since = in_ms(self.asked_tick, self.subject.clock)
            self.fail(self.asked_tick + self.within_ticks, self.wanted, f"none to that of {since}")
            self.asked_tick = -1
