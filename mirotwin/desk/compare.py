"""What a robot at a port answers beside what its twin answers to the same characters at the same ticks.

An answer comes `delay` after the twin's: radio, adapter, operating system and scheduling. The shortest delay of a talk
is what the way costs; what an answer takes longer is how well its time is known, and the question's too. Positions
and flags that this time leaves open are not judged.

Positions, `accepted` and `rejected` are compared by how they change from one answer to the next: a robot on the desk
was switched on some time ago.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise

import msgspec

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_protocol.decoder import Decoder, TelemetryDecoder
from miro_protocol.events import Received
from miro_protocol.frames import ContentError, TeamFrame, TelemetryFrame
from miro_protocol.table import (
    FAILSAFE_OFF_TICKS,
    FAILSAFE_STOP_TICKS,
    FRESH_AGAIN_TICKS,
    ROBOT_COUNTS,
    TICKS_PER_MS,
)
from miro_protocol.transmission import DOWN, Transmission
from miro_sim.periods import Period
from mirotwin.recording.difference import Difference

WITHIN_COUNTS = 20
WITHIN_MS = 20.0
"""A little more than the 16 ms for which a USB adapter may keep a character."""
TOGETHER_TICKS = 500 * TICKS_PER_MS
"""Answers with the same slot and number that are farther apart are to different questions."""
GAP_TICKS = 2 * TICKS_PER_MS
"""So near to a limit of time, a robot and its twin may judge either way: where they count from and what they round."""
STATUS = 0xA2
"""Command error, excessive error, motor off: bits of an LM629's status that do not depend on what was before."""
SAMPLE_TICKS = 8192
SLOWING_TICKS = CONTROL_PERIOD_TICKS * 8
"""A wheel may go as fast as it was told so long ago: from 1.46 m/s it comes to rest in 243 ms."""
NEAR = 2
"""Answers before and after one that tell how late frames were that nobody answered."""
LIMITS_TICKS = (FAILSAFE_STOP_TICKS, FRESH_AGAIN_TICKS, FAILSAFE_OFF_TICKS)


class AnswerTolerance(msgspec.Struct, frozen=True):
    """Positions may be `counts` apart and what time leaves open; answers may come `late_ticks` later than the first."""

    counts: int = WITHIN_COUNTS
    late_ticks: int = int(WITHIN_MS * TICKS_PER_MS)


class TimedAnswer(msgspec.Struct, frozen=True):
    """What was said, and when the PC had heard all of it."""

    tick: int
    said: TelemetryFrame


class AnswerPair(msgspec.Struct, frozen=True):
    """An answer of the robot and of its twin to the same question; None: there is none."""

    port: TimedAnswer | None
    twin: TimedAnswer | None

    @property
    def tick(self) -> int:
        one = self.twin or self.port
        assert one is not None
        return one.tick


class MatchedAnswers(msgspec.Struct, frozen=True):
    """Answers to the same question."""

    port: TimedAnswer
    twin: TimedAnswer


class RobotBesideTwin(msgspec.Struct, frozen=True):
    """A robot beside its twin, by answers. `way_ticks`: the shortest delay; `unsure_ticks`: the most beyond it."""

    slot: int
    pairs: list[AnswerPair]
    way_ticks: int = 0
    unsure_ticks: int = 0


class PortComparison(msgspec.Struct, frozen=True):
    """`silent`: slots of the twin's robots that do not answer at the port; `not_judged`: values that time left open."""

    robots: list[RobotBesideTwin]
    differences: list[Difference]
    silent: tuple[int, ...] = ()
    not_judged: int = 0


def answers(periods: Sequence[Period], network: int = 0) -> list[TimedAnswer]:
    """The valid answers that the PC heard."""
    decoder, found = TelemetryDecoder(), []
    for one in _wire(periods, network):
        if one.direction == DOWN:
            continue
        for event in decoder.feed(one.data):
            if isinstance(event, Received):
                try:
                    said = event.message(max(ROBOT_COUNTS))
                except ContentError:
                    continue
                if isinstance(said, TelemetryFrame):
                    found.append(TimedAnswer(one.end_tick, said))
    return found


def compare(
    port: Sequence[Period], twin: Sequence[Period], robots: int, tolerance: AnswerTolerance, network: int = 0
) -> PortComparison:
    """The answers in a recording made at a port, and in that of the twin."""
    heard, computed = answers(port, network), answers(twin, network)
    there = {answer.said.slot for answer in heard}
    sent = _Sent(port, robots, network)
    found: list[Difference] = []
    telemetries, open_values = [], 0
    for slot in sorted(there):
        mine = [answer for answer in heard if answer.said.slot == slot]
        telemetry = _side_by_side(slot, mine, [one for one in computed if one.said.slot == slot])
        judge = _Judge(telemetry, sent, tolerance, network)
        found += judge.differences()
        open_values += judge.not_judged
        telemetries.append(telemetry)
    silent = tuple(sorted({answer.said.slot for answer in computed} - there))
    found.sort(key=lambda one: one.tick)
    return PortComparison(telemetries, found, silent, open_values)


def _side_by_side(slot: int, port: Sequence[TimedAnswer], twin: Sequence[TimedAnswer]) -> RobotBesideTwin:
    """Pairs in the order of time; each answer stands in one."""
    pairs: list[AnswerPair] = []
    place = 0
    for answer in twin:
        match = _match(port, place, answer)
        if match is None:
            pairs.append(AnswerPair(None, answer))
            continue
        pairs += [AnswerPair(extra, None) for extra in port[place:match]]
        pairs.append(AnswerPair(port[match], answer))
        place = match + 1
    pairs += [AnswerPair(extra, None) for extra in port[place:]]
    delays = [one.port.tick - one.twin.tick for one in pairs if one.port and one.twin]
    way = min(delays, default=0)
    return RobotBesideTwin(slot, pairs, way, max(delays, default=0) - way)


def _match(port: Sequence[TimedAnswer], place: int, twin: TimedAnswer) -> int | None:
    """Where, from `place` on, the robot answers the question that the twin answers."""
    for at in range(place, len(port)):
        if port[at].tick - twin.tick >= TOGETHER_TICKS:
            return None
        if port[at].said.seq == twin.said.seq and twin.tick - port[at].tick < TOGETHER_TICKS:
            return at
    return None


def _wire(periods: Sequence[Period], network: int) -> Iterator[Transmission]:
    for period in periods:
        for one in period.wire:
            if one.network == network:
                yield one


class _Sent:
    """What the host said: when each transmission ended, and the fastest wheel of a robot that it told."""

    def __init__(self, periods: Sequence[Period], robots: int, network: int) -> None:
        decoder = Decoder(robots)
        self.ends: list[int] = []
        self.words: list[list[int]] = []
        words = [0] * robots
        for one in _wire(periods, network):
            if one.direction != DOWN:
                continue
            for event in decoder.feed(one.data):
                if isinstance(event, Received):
                    try:
                        said = event.message(robots)
                    except ContentError:
                        continue
                    if isinstance(said, TeamFrame):
                        words = [max(abs(left), abs(right)) for left, right in said.velocities]
            self.ends.append(one.end_tick)
            self.words.append(words)

    def near_a_limit(self, after_tick: int, until_tick: int, unsure_ticks: int) -> bool:
        """Whether a silence in between is so long that a time limit of the robot may or may not be over."""
        first = max(0, bisect_right(self.ends, after_tick) - 1)
        ends = self.ends[first : bisect_left(self.ends, until_tick)]
        gaps = [other - one for one, other in pairwise(ends)]
        return any(abs(gap - limit) < GAP_TICKS + unsure_ticks for gap in gaps for limit in LIMITS_TICKS)

    def fastest(self, slot: int, after_tick: int, until_tick: int) -> int:
        """Of the velocities in force in between, in 1/256 count per sample."""
        first = bisect_right(self.ends, after_tick - SLOWING_TICKS)
        last = bisect_left(self.ends, until_tick)
        return max((words[slot] for words in self.words[first:last] if slot < len(words)), default=0)


class _Judge:
    """Differences of one robot and its twin."""

    def __init__(
        self, telemetry: RobotBesideTwin, sent: _Sent, tolerance: AnswerTolerance, network: int
    ) -> None:
        self.telemetry = telemetry
        self.sent = sent
        self.tolerance = tolerance
        self.network = network
        self.not_judged = 0
        delays = [
            one.port.tick - one.twin.tick - telemetry.way_ticks
            for one in telemetry.pairs
            if one.port is not None and one.twin is not None
        ]
        self._near = [max(delays[max(0, at - NEAR) : at + NEAR + 1]) for at in range(len(delays))]
        """How late the answers around each one were: so late were the frames between them, perhaps."""
        self._place = 0

    def differences(self) -> Iterator[Difference]:
        before: MatchedAnswers | None = None
        for pair in self.telemetry.pairs:
            if pair.port is None or pair.twin is None:
                if (
                    before is not None
                ):  # a robot may not take the first frame of a talk: its number may be known
                    yield self._difference(pair.tick, "answer", _seq(pair.port), _seq(pair.twin))
                continue
            both = MatchedAnswers(pair.port, pair.twin)
            late = self._unsure(both)
            if late > self.tolerance.late_ticks:
                text = f"{late / TICKS_PER_MS:.1f} ms late"
                yield self._difference(pair.tick, "answer", text, "in time")
            if before is not None:
                yield from self._fields(before, both)
            before = both
            self._place += 1

    def _fields(self, before: MatchedAnswers, both: MatchedAnswers) -> Iterator[Difference]:
        unsure = self._near[self._place - 1] + self._near[self._place]
        timely = not self.sent.near_a_limit(before.twin.tick, both.twin.tick, unsure)
        for name, take, exact in _FIELDS:
            mine, twins = take(before.port.said, both.port.said), take(before.twin.said, both.twin.said)
            if mine == twins:
                continue
            if not timely:
                self.not_judged += 1
            elif exact or abs(mine - twins) > self._counts(before, both, unsure):
                yield self._difference(both.twin.tick, name, mine, twins)

    def _counts(self, before: MatchedAnswers, both: MatchedAnswers, unsure_ticks: int) -> float:
        """How far positions may be apart: the tolerance, and how far the fastest wheel goes in the time left open."""
        word = self.sent.fastest(self.telemetry.slot, before.twin.tick, both.twin.tick)
        return self.tolerance.counts + word * unsure_ticks / SAMPLE_TICKS / 256

    def _unsure(self, both: MatchedAnswers) -> int:
        return both.port.tick - both.twin.tick - self.telemetry.way_ticks

    def _difference(
        self, tick: int, name: str, mine: int | str | None, twins: int | str | None
    ) -> Difference:
        index, slot = tick // CONTROL_PERIOD_TICKS, self.telemetry.slot
        return Difference(tick, index, self.network, slot, name, mine, twins)


def _seq(answer: TimedAnswer | None) -> str | None:
    return None if answer is None else f"to question {answer.said.seq}"


def _moved(name: str) -> Callable[[TelemetryFrame, TelemetryFrame], int]:
    """By how much 16 bits of a position went on, as a signed number."""
    return lambda one, other: (getattr(other, name) - getattr(one, name) + 0x8000 & 0xFFFF) - 0x8000


def _counted(name: str) -> Callable[[TelemetryFrame, TelemetryFrame], int]:
    return lambda one, other: (getattr(other, name) - getattr(one, name)) & 0xFF


_FIELDS: tuple[tuple[str, Callable[[TelemetryFrame, TelemetryFrame], int], bool], ...] = (
    ("accepted", _counted("accepted"), True),
    ("rejected", _counted("rejected"), True),
    ("flags", lambda one, other: int(other.flags), True),
    ("status left", lambda one, other: other.status_left & STATUS, True),
    ("status right", lambda one, other: other.status_right & STATUS, True),
    ("left moved", _moved("position_left"), False),
    ("right moved", _moved("position_right"), False),
)
"""Name, what is compared of an answer and the one before, and whether it has to be equal."""
