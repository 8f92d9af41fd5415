"""Evaluates one condition from the changes of a pin, of a value, or of the text on a wire, as pure functions.

                    begins with the level           first                             second
    changes ──> feed ─────────────────> matches: (tick, measurement), in order; `found`: what was there instead

A measurement is in the unit of the condition: microseconds, hertz, a share of the period, a level, a value, a text.
Changes are (tick, source, new level or value), in the order of time. A follower is plain data: `save` and `load` it to
go back.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from miro_exact.bad_input import amount
from miro_exact.clock import NEVER_TICK, ms, ticks

if TYPE_CHECKING:
    from miro_sim.world import conditions

Limits = tuple[float | None, float | None]
Change = tuple[int, Any, Any]
Match = tuple[int, Any]
TEXT_KEPT = 4096
"""Characters that a pattern may reach back."""
TEXT_SHOWN = 60
_ENDLESS = 1e300


class Follower:
    """Base of followers. `source`: the pin, value or wire that it follows. `clock`: ticks per second.

    `count`: measurements so far; `last`: the last of them, at `last_tick`.
    """

    NOT_STATE = ("*",)
    FIELDS: tuple[str, ...] = ("count", "last", "last_tick")
    """Attributes that change while it follows."""

    def __init__(self, source: object, clock: int) -> None:
        self.source = source
        self.clock = clock
        self.count = 0
        self.last: Any = None
        self.last_tick = -1

    def feed(self, changes: list[Change], until_tick: int) -> list[Match]:
        """Matches among these changes, and matches up to `until_tick` because nothing changes."""
        raise NotImplementedError

    def found(self) -> str:
        """The observed state, for a message."""
        raise NotImplementedError

    def save(self) -> list[Any]:
        return [getattr(self, name) for name in self.FIELDS]

    def load(self, saved: list[Any]) -> None:
        for name, value in zip(self.FIELDS, saved, strict=True):
            setattr(self, name, value)

    def in_ms(self, duration_ticks: int) -> str:
        return f"{duration_ticks * 1000 / self.clock:.3f} ms"

    def last_of(self, kind: str, unit: str = "") -> str:
        """`12 pulses, the last 1480 us at 12.000 ms`."""
        if not self.count:
            return f"no {kind}"
        return f"{amount(self.count, kind)}, the last {self.last:.6g}{unit} at {self.in_ms(self.last_tick)}"


class PinFollower(Follower):
    """Base of followers of pins, whose source is the number of a net. `flip`: 1 for a pin behind an inverter.

    `least`, `most`: what a measurement must not be below and above, or with `outside` has to.
    """

    def __init__(
        self, source: int, flip: int, clock: int, limits: Limits = (None, None), outside: bool = False
    ) -> None:
        Follower.__init__(self, source, clock)
        self.net = source
        self.flip = flip
        self.hz = float(clock)
        least, most = limits
        self.least = -1.0 if least is None else float(least)
        self.most = _ENDLESS if most is None else float(most)
        self.outside = 1 if outside else 0


class EdgeFollower(PinFollower):
    """A match is an edge; the measurement its level."""

    def __init__(
        self, condition: conditions.Edge, source: int, flip: int, clock: int, tick: int, level: int
    ) -> None:
        PinFollower.__init__(self, source, flip, clock)
        self.wanted = -1 if condition.level is None else condition.level ^ flip

    def feed(self, changes: list[Change], until_tick: int) -> list[Match]:
        matches: list[Match] = []
        count, last_tick, last = 0, 0, 0
        for tick, net, level in changes:
            if net == self.net:
                count += 1
                last_tick, last = tick, level ^ self.flip
                if level == self.wanted or self.wanted < 0:
                    matches.append((tick, last))
        if count:
            self.count += count
            self.last_tick, self.last = last_tick, last
        return matches

    def found(self) -> str:
        if not self.count:
            return "no edge"
        last = f"the last to {self.last} at {self.in_ms(self.last_tick)}"
        return f"{amount(self.count, 'edge')}, {last}"


class LevelFollower(PinFollower):
    """A match is the moment at which a pin has had a level for so long, from the begin or its last edge on."""

    FIELDS = (*Follower.FIELDS, "longest", "level", "since", "done")

    def __init__(
        self, condition: conditions.Level, source: int, flip: int, clock: int, tick: int, level: int
    ) -> None:
        PinFollower.__init__(self, source, flip, clock)
        self.wanted = condition.level
        self.steady_ms = condition.steady_ms
        self.steady_ticks = ms(condition.steady_ms, clock)
        self.longest = 0
        self.level = level
        self.since = tick if level == self.wanted else -1
        self.done = 0

    def feed(self, changes: list[Change], until_tick: int) -> list[Match]:
        matches: list[Match] = []
        wanted = self.wanted ^ self.flip
        for tick, net, level in changes:
            if net != self.net:
                continue
            self._had_until(tick, matches)
            self.level = level ^ self.flip
            self.since = tick if level == wanted else -1
            self.done = 0
        self._had_until(until_tick, matches)
        return matches

    def _had_until(self, tick: int, matches: list[Match]) -> None:
        if self.since < 0:
            return
        self.longest = max(self.longest, tick - self.since)
        if not self.done and self.since + self.steady_ticks <= tick:
            matches.append((self.since + self.steady_ticks, self.steady_ms))
            self.done = 1

    def found(self) -> str:
        had = f", and at {self.wanted} for {self.in_ms(self.longest)} at most" if self.longest else ""
        return f"it is at {self.level}{had}"


class PulseFollower(PinFollower):
    """A match is the end of a pulse that began later than the wait; the measurement its width in microseconds."""

    FIELDS = (*Follower.FIELDS, "began")

    def __init__(
        self, condition: conditions.Pulse, source: int, flip: int, clock: int, tick: int, level: int
    ) -> None:
        limits = (condition.at_least_us, condition.at_most_us)
        PinFollower.__init__(self, source, flip, clock, limits)
        self.wanted = condition.level ^ flip
        self.began = -1

    def feed(self, changes: list[Change], until_tick: int) -> list[Match]:
        matches: list[Match] = []
        began, count, end_tick, width_us = self.began, 0, 0, 0.0
        for tick, net, level in changes:
            if net != self.net:
                continue
            if level == self.wanted:
                began = tick
            elif began >= 0:
                count += 1
                end_tick, width_us = tick, (tick - began) * 1e6 / self.hz
                if self.least <= width_us <= self.most:
                    matches.append((tick, width_us))
        self.began = began
        if count:
            self.count += count
            self.last_tick, self.last = end_tick, width_us
        return matches

    def found(self) -> str:
        return self.last_of("pulse", " us")


class PeriodFollower(PinFollower):
    """A match is a rising edge with which a period ends that fits; the measurement its frequency in hertz.

    Where a signal fits that is too slow, it fits as well as soon as it is that: once, with 0 Hz.
    """

    FIELDS = (*Follower.FIELDS, "rise", "late_tick")

    def __init__(
        self, condition: conditions.Frequency, source: int, flip: int, clock: int, tick: int, level: int
    ) -> None:
        limits = (condition.at_least_hz, condition.at_most_hz)
        PinFollower.__init__(self, source, flip, clock, limits, condition.outside)
        self.high = 1 ^ flip
        self.rise = -1
        slowest_hz = condition.at_least_hz if condition.outside else None
        self.patience = NEVER_TICK if slowest_hz is None else ticks(1.0 / slowest_hz, clock)
        self.late_tick = tick + self.patience

    def feed(self, changes: list[Change], until_tick: int) -> list[Match]:
        matches: list[Match] = []
        rise, late_tick, count, end_tick, hz = self.rise, self.late_tick, 0, 0, 0.0
        for tick, net, level in changes:
            if net != self.net or level != self.high:
                continue
            if tick > late_tick:
                matches.append((late_tick, 0.0))
            elif rise >= 0:
                count += 1
                end_tick, hz = tick, self.hz / (tick - rise)
                if (1 if self.least <= hz <= self.most else 0) != self.outside:
                    matches.append((tick, hz))
            rise, late_tick = tick, tick + self.patience
        if until_tick > late_tick:
            matches.append((late_tick, 0.0))
            rise, late_tick = -1, NEVER_TICK
        self.rise, self.late_tick = rise, late_tick
        if count:
            self.count += count
            self.last_tick, self.last = end_tick, hz
        return matches

    def found(self) -> str:
        return self.last_of("period", " Hz")


class DutyFollower(PinFollower):
    """A match is a rising edge with which a period ends; the measurement the share of it in which the pin was high."""

    FIELDS = (*Follower.FIELDS, "rise", "fall")

    def __init__(
        self, condition: conditions.Duty, source: int, flip: int, clock: int, tick: int, level: int
    ) -> None:
        limits = (condition.at_least, condition.at_most)
        PinFollower.__init__(self, source, flip, clock, limits, condition.outside)
        self.high = 1 ^ flip
        self.rise = -1
        self.fall = -1

    def feed(self, changes: list[Change], until_tick: int) -> list[Match]:
        matches: list[Match] = []
        rise, fall, count, end_tick, share = self.rise, self.fall, 0, 0, 0.0
        for tick, net, level in changes:
            if net != self.net:
                continue
            if level != self.high:
                fall = tick
                continue
            if rise >= 0:
                count += 1
                end_tick, share = tick, 1.0 * (fall - rise) / (tick - rise)
                if (1 if self.least <= share <= self.most else 0) != self.outside:
                    matches.append((tick, share))
            rise = tick
        self.rise, self.fall = rise, fall
        if count:
            self.count += count
            self.last_tick, self.last = end_tick, share
        return matches

    def found(self) -> str:
        return self.last_of("period", " high")


class ValueFollower(Follower):
    """A match is the moment at which a value begins to fit, or is looked at first; the measurement the value."""

    FIELDS = (*Follower.FIELDS, "waiting", "fitted")

    def __init__(
        self, condition: conditions.Value, source: object, flip: int, clock: int, tick: int, value: Any
    ) -> None:
        Follower.__init__(self, source, clock)
        condition.fits(value)
        self.condition = condition
        self.waiting: list[Change] = [(tick, source, value)]
        self.fitted = False

    def feed(self, changes: list[Change], until_tick: int) -> list[Match]:
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

    FIELDS = (*Follower.FIELDS, "sent", "tail")

    def __init__(self, condition: conditions.Text, source: object, clock: int) -> None:
        Follower.__init__(self, source, clock)
        self.text = None if condition.text is None else condition.text.encode()
        self.pattern = None if condition.pattern is None else re.compile(condition.pattern.encode())
        self.sent = b""
        self.tail = b""

    def feed(self, changes: list[Change], until_tick: int) -> list[Match]:
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
