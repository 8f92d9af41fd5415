"""Compares a robot's answers at a port with its twin's answers to the same characters at the same ticks.

An answer comes `delay` after the twin's: radio, adapter, operating system and scheduling. The shortest delay of a talk
is the delay of the path, and is subtracted from all ticks. The extra delay of nearby answers bounds how late the frames
between them may have reached the robot; deviations within this bound are no differences. Positions, `accepted` and
`rejected` are compared by their change from one answer to the next, because a robot on the desk was switched on
earlier.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from operator import attrgetter

import msgspec

from miro_exact.clock import CONTROL_PERIOD_TICKS, LM629_SAMPLE_TICKS
from miro_protocol.decoder import Decoder, TelemetryDecoder
from miro_protocol.events import Received
from miro_protocol.frames import ContentError, TeamFrame, TelemetryFrame
from miro_protocol.table import (
    FAILSAFE_OFF_TICKS,
    FAILSAFE_STOP_TICKS,
    FRESH_AGAIN_TICKS,
    TICKS_PER_MS,
    Flags,
)
from miro_sim.periods import Period
from miro_sim.world.conditions import answer_of
from mirotwin.recording.compare import CompareRule
from mirotwin.recording.difference import Difference
from mirotwin.recording.sequences import LogEntry, Pair, on_air, pairs

WITHIN_TICKS = 20 * TICKS_PER_MS
"""A little more than the 16 ms for which a USB adapter may keep a character."""
ANSWERS = CompareRule(kind="answers", within_ticks=WITHIN_TICKS)
TOGETHER_TICKS = 500 * TICKS_PER_MS
"""Largest distance of answers to the same question; the same slot and number farther apart belong to different
questions.
"""
EARLY_TICKS = 5 * TICKS_PER_MS
"""A robot with a fast crystal may be earlier than its twin by this much."""
LIMITS_TICKS = (FAILSAFE_STOP_TICKS, FRESH_AGAIN_TICKS, FAILSAFE_OFF_TICKS)
GAP_TICKS = 2 * TICKS_PER_MS
"""Within this distance of a time limit a robot and its twin may decide either way: start of counting and rounding
differ.
"""
STATUS = 0xA2
"""Command error, excessive error, motor off: status bits of an LM629 that do not depend on earlier events."""
STATUS_AT_START = 0x22
"""`STATUS` without motor off, for a question that starts motors: the sample after it may precede the answer."""
SLOWING_TICKS = CONTROL_PERIOD_TICKS * 8
"""A wheel's speed is bounded by the largest requested speed in this time: from 1.46 m/s it comes to rest in 243 ms."""
NEAR = 2
"""Answers before and after a window that bound how late frames without an answer were."""


class PortComparison(msgspec.Struct, frozen=True):
    """`robots`: the answers by slot; `unsure_ms`: how well their times are known. `silent`: slots of the twin's robots
    that do not answer at the port; `not_judged`: values that timing uncertainty leaves open.
    """

    robots: dict[int, list[Pair]]
    unsure_ms: float
    differences: list[Difference]
    silent: tuple[int, ...]
    not_judged: int


def compare(
    port: Sequence[Period], twin: Sequence[Period], robots: int, rule: CompareRule = ANSWERS
) -> PortComparison:
    """The answers in a recording made at a port, and in that of the twin."""
    here, there = _by_slot(port), _by_slot(twin)
    sent, until_tick = _Sent(port, robots), port[-1].tick - rule.within_ticks
    judged: list[Difference | None] = []
    beside, unsure = {}, 0
    for slot, answers in sorted(here.items()):
        beside[slot] = _side_by_side(answers, there.pop(slot, []), until_tick)
        late = [
            twin.tick - other.tick for twin, other in beside[slot] if twin is not None and other is not None
        ]
        unsure = max([unsure, *late])
        judged += _judged(beside[slot], late, slot, sent, rule)
    differences = sorted(
        (difference for difference in judged if difference is not None), key=attrgetter("tick")
    )
    return PortComparison(
        beside, unsure / TICKS_PER_MS, differences, tuple(sorted(there)), judged.count(None)
    )


def _by_slot(periods: Sequence[Period]) -> dict[int, list[LogEntry]]:
    """The valid answers that the PC received, each with the tick at which it was complete."""
    decoder, answers = TelemetryDecoder(), defaultdict(list)
    for transmission in on_air(periods, 0, sent=False):
        for event in decoder.feed(transmission.data):
            answer = answer_of(event) if isinstance(event, Received) else None
            if answer is not None:
                text = f"answer of {answer.slot} to {answer.seq}"
                answers[answer.slot].append(LogEntry(transmission.end_tick, text, answer))
    return answers


def _side_by_side(port: Sequence[LogEntry], twin: Sequence[LogEntry], until_tick: int) -> list[Pair]:
    """Pairs of answers, the port's ticks less the shortest delay. After `until_tick` no answer counts as missing."""
    ticks_of = defaultdict(list)
    for answer in port:
        ticks_of[answer.text].append(answer.tick)
    delays = []
    for answer in twin:
        ticks = ticks_of[answer.text]
        index = bisect_left(ticks, answer.tick - EARLY_TICKS)
        delays += [
            tick - answer.tick for tick in ticks[index : index + 1] if tick - answer.tick < TOGETHER_TICKS
        ]
    way = min(delays, default=0)
    shifted = [answer._replace(tick=answer.tick - way) for answer in port]
    both = pairs(shifted, twin, 0, TOGETHER_TICKS)
    return [(here, there) for here, there in both if here or (there and there.tick + way <= until_tick)]


class _Sent:
    """The host's transmissions: when each transmission ended, and the velocities of all robots by then."""

    def __init__(self, periods: Sequence[Period], robots: int) -> None:
        decoder = Decoder(robots)
        self.ends: list[int] = []
        self.velocities: list[Sequence[tuple[int, int]]] = []
        velocities: Sequence[tuple[int, int]] = ((0, 0),) * robots
        for transmission in on_air(periods, 0, sent=True):
            for event in decoder.feed(transmission.data):
                try:
                    message = event.message(robots) if isinstance(event, Received) else None
                except ContentError:
                    continue
                if isinstance(message, TeamFrame):
                    velocities = message.velocities
            self.ends.append(transmission.end_tick)
            self.velocities.append(velocities)

    def near_a_limit(self, after_tick: int, until_tick: int, unsure_ticks: int) -> bool:
        """True if a silence in between is so long that a time limit of the robot may or may not be over."""
        first = max(0, bisect_right(self.ends, after_tick) - 1)
        ends = self.ends[first : bisect_left(self.ends, until_tick)]
        gaps = [other - end for end, other in pairwise(ends)]
        return any(abs(gap - limit) < GAP_TICKS + unsure_ticks for gap in gaps for limit in LIMITS_TICKS)

    def rise(self, slot: int, wheel: int, after_tick: int, until_tick: int) -> float:
        """By how much a wheel's velocity rises in all, from rest through those in force in between to rest.

        So many 1/256 counts a sample, times the time by which frames may be late, is how far off a position may be.
        """
        first = bisect_right(self.ends, after_tick - SLOWING_TICKS)
        before_tick, words = 0, [0]
        for index in range(first, bisect_left(self.ends, until_tick)):
            if self.ends[index] - before_tick > FAILSAFE_STOP_TICKS:
                words.append(0)
            before_tick = self.ends[index]
            words.append(self.velocities[index][slot][wheel])
        return sum(abs(word - other) for word, other in pairwise([*words, 0])) / 2


def _judged(
    both: Sequence[Pair], late: Sequence[int], slot: int, sent: _Sent, rule: CompareRule
) -> Iterator[Difference | None]:
    """The differences of one robot and its twin; None for a value that time leaves open. `late`: of each full pair."""

    def differs(tick: int, name: str, mine: int | str | None, twins: int | str | None) -> Difference:
        return Difference(tick, tick // CONTROL_PERIOD_TICKS, 0, slot, name, mine, twins)

    before: tuple[LogEntry, LogEntry] | None = None
    full = 0
    for here, there in both:
        if here is None or there is None:
            answer = here or there  # the first may be to a number that the robot knew
            if answer is not None and (before is not None or not late):
                question = f"to question {answer.item.seq}"
                yield differs(answer.tick, "answer", here and question, there and question)
            continue
        if late[full] > rule.within_ticks:
            yield differs(there.tick, "answer", f"{late[full] / TICKS_PER_MS:.1f} ms late", "in time")
        if before is not None:
            window = before[1].tick, there.tick
            unsure = max(late[max(0, full - 1 - NEAR) : full + NEAR + 1])
            timely = not sent.near_a_limit(*window, unsure)
            for name, (take, wheel) in FIELDS.items():
                mine, twins, within = take(before[0].item, here.item), take(before[1].item, there.item), 0.0
                if wheel is not None:
                    way = sent.rise(slot, wheel, *window) * unsure / LM629_SAMPLE_TICKS / 256
                    within = rule.within_counts + way
                if mine != twins and not timely:
                    yield None
                elif abs(mine - twins) > within:
                    yield differs(there.tick, name, mine, twins)
        before = here, there
        full += 1


def _went(name: str, modulus: int, least: int) -> Callable[[TelemetryFrame, TelemetryFrame], int]:
    """A function for the increase of a wrapping value from one answer to the next."""
    return lambda earlier, later: (getattr(later, name) - getattr(earlier, name) - least) % modulus + least


def _status(name: str) -> Callable[[TelemetryFrame, TelemetryFrame], int]:
    return lambda _, other: (
        getattr(other, name) & (STATUS_AT_START if other.flags & Flags.MOTORS_OFF else STATUS)
    )


FIELDS: dict[str, tuple[Callable[[TelemetryFrame, TelemetryFrame], int], int | None]] = {
    "accepted": (_went("accepted", 1 << 8, 0), None),
    "rejected": (_went("rejected", 1 << 8, 0), None),
    "flags": (lambda here, other: int(other.flags), None),
    "status left": (_status("status_left"), None),
    "status right": (_status("status_right"), None),
    "left moved": (_went("position_left", 1 << 16, -1 << 15), 0),
    "right moved": (_went("position_right", 1 << 16, -1 << 15), 1),
}
"""Compared field -> its change between two answers, and tolerance.

A wheel's position may differ by counts, all else must be equal.
"""
