"""What the changes of a pin, of a value, or of the text on a wire come to for one condition: pure functions over them.

                    begins with the level           first                             second
    changes ──> feed ─────────────────> matches: (tick, measurement), in order; `found`: what was there instead

A measurement is in the unit of the condition: microseconds, hertz, a share of the period, a level, a value, a text.
Changes are (tick, source, new level or value), in the order of time. A follower is plain data: `save` and `load` it to
go back.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from miro_exact.bad_input import amount
from miro_exact.clock import NEVER_TICK, ms, ticks

if TYPE_CHECKING:
    from miro_sim.world import conditions

Change = tuple[int, Any, Any]
Match = tuple[int, Any]
TEXT_KEPT = 4096
"""Characters that a pattern may reach back."""
TEXT_SHOWN = 60


class Follower:
    """Base. `source`: whose changes it follows; `flip`: 1 for a pin behind an inverter. `clock`: ticks per second.

    `count`: measurements so far; `last`: the last of them, at `last_tick`.
    """

    def __init__(self, source: object, flip: int, clock: int) -> None:
        self.source = source
        self.flip = flip
        self.clock = clock
        self.count = 0
        self.last: Any = None
        self.last_tick = -1

    def feed(self, changes: Iterable[Change], until_tick: int) -> list[Match]:
        """What fits among these changes, and what fits up to `until_tick` because nothing changes."""
        raise NotImplementedError

    def found(self) -> str:
        """What was there, for a message."""
        raise NotImplementedError

    def save(self) -> dict[str, Any]:
        return dict(vars(self))

    def load(self, saved: dict[str, Any]) -> None:
        vars(self).update(saved)

    def in_ms(self, duration_ticks: int) -> str:
        return f"{duration_ticks * 1000 / self.clock:.3f} ms"

    def last_of(self, kind: str, unit: str = "") -> str:
        """`12 pulses, the last 1480 us at 12.000 ms`."""
        if not self.count:
            return f"no {kind}"
        return f"{amount(self.count, kind)}, the last {self.last:.6g}{unit} at {self.in_ms(self.last_tick)}"


class EdgeFollower(Follower):
    """A match is an edge; the measurement its level."""

    def __init__(
        self, condition: conditions.Edge, source: object, flip: int, clock: int, tick: int, level: int
    ) -> None:
        super().__init__(source, flip, clock)
        self.wanted = -1 if condition.level is None else condition.level ^ flip

    def feed(self, changes: Iterable[Change], until_tick: int) -> list[Match]:
        matches: list[Match] = []
        mine, wanted = self.source, self.wanted
        for tick, source, level in changes:
            if source == mine:
                self.count += 1
                self.last_tick, self.last = tick, level ^ self.flip
                if level == wanted or wanted < 0:
                    matches.append((tick, self.last))
        return matches

    def found(self) -> str:
        if not self.count:
            return "no edge"
        last = f"the last to {self.last} at {self.in_ms(self.last_tick)}"
        return f"{amount(self.count, 'edge')}, {last}"


class LevelFollower(Follower):
    """A match is the moment at which a pin has had a level for so long, from the begin or its last edge on."""

    def __init__(
        self, condition: conditions.Level, source: object, flip: int, clock: int, tick: int, level: int
    ) -> None:
        super().__init__(source, flip, clock)
        self.wanted = condition.level
        self.steady_ms = condition.steady_ms
        self.steady_ticks = ms(condition.steady_ms, clock)
        self.longest = 0
        self.level = level
        self.since = tick if level == self.wanted else -1
        self.done = False

    def feed(self, changes: Iterable[Change], until_tick: int) -> list[Match]:
        matches: list[Match] = []
        mine, steady, low = self.source, self.steady_ticks, self.wanted ^ self.flip
        since = self.since
        for tick, source, level in changes:
            if source != mine:
                continue
            if since >= 0:
                if not self.done and since + steady <= tick:
                    matches.append((since + steady, self.steady_ms))
                self.longest = max(self.longest, tick - since)
                since = -1
            if level == low:
                since, self.done = tick, False
            self.level = level ^ self.flip
        if since >= 0 and not self.done:
            self.longest = max(self.longest, until_tick - since)
            if since + steady <= until_tick:
                matches.append((since + steady, self.steady_ms))
                self.done = True
        self.since = since
        return matches

    def found(self) -> str:
        had = f", and at {self.wanted} for {self.in_ms(self.longest)} at most" if self.longest else ""
        return f"it is at {self.level}{had}"


class PulseFollower(Follower):
    """A match is the end of a pulse that began later than the wait; the measurement its width in microseconds."""

    def __init__(
        self, condition: conditions.Pulse, source: object, flip: int, clock: int, tick: int, level: int
    ) -> None:
        super().__init__(source, flip, clock)
        self.wanted = condition.level ^ flip
        self.condition = condition
        self.began = -1

    def feed(self, changes: Iterable[Change], until_tick: int) -> list[Match]:
        matches: list[Match] = []
        mine, wanted, clock, fits = self.source, self.wanted, self.clock, self.condition.fits
        began, width_us, end, count = self.began, self.last, self.last_tick, 0
        for tick, source, level in changes:
            if source != mine:
                continue
            if level == wanted:
                began = tick
            elif began >= 0:
                count += 1
                width_us, end = (tick - began) * 1e6 / clock, tick
                if fits(width_us):
                    matches.append((tick, width_us))
        self.began, self.last, self.last_tick = began, width_us, end
        self.count += count
        return matches

    def found(self) -> str:
        return self.last_of("pulse", " us")


class PeriodFollower(Follower):
    """A match is a rising edge with which a period ends that fits; the measurement its frequency in hertz.

    Where a signal fits that is too slow, it fits as well as soon as it is that: once, with 0 Hz.
    """

    def __init__(
        self, condition: conditions.Frequency, source: object, flip: int, clock: int, tick: int, level: int
    ) -> None:
        super().__init__(source, flip, clock)
        self.high = 1 ^ flip
        self.condition = condition
        self.rise = -1
        slowest_hz = condition.at_least_hz if condition.outside else None
        self.patience = NEVER_TICK if slowest_hz is None else ticks(1.0 / slowest_hz, clock)
        self.late_tick = tick + self.patience

    def feed(self, changes: Iterable[Change], until_tick: int) -> list[Match]:
        matches: list[Match] = []
        mine, high, clock, fits = self.source, self.high, self.clock, self.condition.fits
        rise, late_tick = self.rise, self.late_tick
        for tick, source, level in changes:
            if source != mine or level != high:
                continue
            if tick > late_tick:
                matches.append((late_tick, 0.0))
            elif rise >= 0:
                self.count += 1
                self.last, self.last_tick = clock / (tick - rise), tick
                if fits(self.last):
                    matches.append((tick, self.last))
            rise, late_tick = tick, tick + self.patience
        if until_tick > late_tick:
            matches.append((late_tick, 0.0))
            rise, late_tick = -1, NEVER_TICK
        self.rise, self.late_tick = rise, late_tick
        return matches

    def found(self) -> str:
        return self.last_of("period", " Hz")


class DutyFollower(Follower):
    """A match is a rising edge with which a period ends; the measurement the share of it in which the pin was high."""

    def __init__(
        self, condition: conditions.Duty, source: object, flip: int, clock: int, tick: int, level: int
    ) -> None:
        super().__init__(source, flip, clock)
        self.high = 1 ^ flip
        self.condition = condition
        self.rise = self.fall = -1

    def feed(self, changes: Iterable[Change], until_tick: int) -> list[Match]:
        matches: list[Match] = []
        mine, high, fits = self.source, self.high, self.condition.fits
        rise, fall = self.rise, self.fall
        for tick, source, level in changes:
            if source != mine:
                continue
            if level != high:
                fall = tick
                continue
            if rise >= 0:
                self.count += 1
                self.last, self.last_tick = (fall - rise) / (tick - rise), tick
                if fits(self.last):
                    matches.append((tick, self.last))
            rise = tick
        self.rise, self.fall = rise, fall
        return matches

    def found(self) -> str:
        return self.last_of("period", " high")


class ValueFollower(Follower):
    """A match is the moment at which a value begins to fit, or is looked at first; the measurement the value."""

    def __init__(
        self, condition: conditions.Value, source: object, flip: int, clock: int, tick: int, value: Any
    ) -> None:
        super().__init__(source, flip, clock)
        condition.fits(value)
        self.condition = condition
        self.waiting: list[Change] = [(tick, source, value)]
        self.fitted = False

    def feed(self, changes: Iterable[Change], until_tick: int) -> list[Match]:
        matches: list[Match] = []
        for tick, source, value in [*self.waiting, *changes]:
            if source != self.source:
                continue
            self.last, self.last_tick = value, tick
            fitted, self.fitted = self.fitted, self.condition.fits(value)
            if self.fitted and not fitted:
                matches.append((tick, value))
        self.waiting = []
        return matches

    def found(self) -> str:
        return f"{self.condition.of} = {shown(self.last)}"


class TextFollower(Follower):
    """A match is the character with which the text, or something with the pattern, is complete; what was complete.

    After a match it begins again with the next character.
    """

    def __init__(self, condition: conditions.Text, source: object, clock: int) -> None:
        super().__init__(source, 0, clock)
        self.text = None if condition.text is None else condition.text.encode()
        self.pattern = None if condition.pattern is None else re.compile(condition.pattern.encode())
        self.sent = b""
        self.tail = b""

    def feed(self, changes: Iterable[Change], until_tick: int) -> list[Match]:
        matches: list[Match] = []
        for tick, source, value in changes:
            if source != self.source:
                continue
            self.count += 1
            self.sent = (self.sent + bytes([value]))[-TEXT_KEPT:]
            self.tail = (self.tail + bytes([value]))[-TEXT_SHOWN:]
            complete = self._complete()
            if complete is not None:
                matches.append((tick, readable(complete)))
                self.sent = b""
        return matches

    def _complete(self) -> bytes | None:
        if self.text is not None:
            return self.text if self.sent.endswith(self.text) else None
        assert self.pattern is not None
        match = self.pattern.search(self.sent)
        return None if match is None else match[0]

    def found(self) -> str:
        if not self.count:
            return "nothing was sent"
        before = ".. " if self.count > len(self.tail) else ""
        return f"{amount(self.count, 'character')}: {before}{shown(readable(self.tail))}"


def readable(data: bytes) -> str:
    """Bytes as text; what is no UTF-8 as \\xNN."""
    return data.decode("utf-8", "backslashreplace")


def shown(value: Any) -> str:
    """A value as TOML writes it."""
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, str) else f"{value:.10g}"
