"""The language of rules: frames that a network's host sends in a trial, and expectations on its robots.

    frame = script.team()                 velocities that no frame before it had
    script.obeyed(frame)                  expected of each robot of the network
    script.wait(5.0)
    script.ignored(script.team(wrong={3: 0x10}))

A trial is open-loop: the frames do not depend on the robots. So all frames, and the tick at which each expectation
ends, are known in advance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TypedDict, Unpack

from miro_exact.clock import CONTROL_PERIOD_TICKS, HOST_CHARACTER_TICKS
from miro_protocol.actions import Action, Power, Reset
from miro_protocol.frames import TelemetryFrame, asking_step, seal
from miro_protocol.robot_rules import ACTING_TICKS
from miro_protocol.table import (
    FAILSAFE_STOP_TICKS,
    SEQ_MODULUS,
    TICKS_PER_MS,
    Format,
    FrameType,
    Opcode,
    downlink,
)
from miro_protocol.transmission import DOWN, Transmission
from miro_robot.lm629.commands import BY_NAME
from mirotwin.conform.hints import (
    characters,
    in_a_row,
    in_words,
    no_answer,
    number,
    payload_of,
    wheels_instead,
)
from mirotwin.conform.observed import Observed, ReceivedAnswer, Words, within
from mirotwin.conform.rule import Topology
from mirotwin.verify.checks.orders import Order, saturated

_LTRJ = BY_NAME["LTRJ"].opcode
_VELOCITY = 0x08
"""In the low byte of LTRJ's control word: a velocity follows."""
BOOTED_MS = 40.0
"""A robot is ready for its first frame so long after power-on (a camera frame and a little more). Chosen."""
ACTING_MS = ACTING_TICKS / TICKS_PER_MS
GAP_MS = ACTING_MS + 2.0
"""From the end of a frame to the start of the next, unless a rule sets another gap: time for the robots to act."""
Pairs = tuple[tuple[int, int], ...]
Found = Iterator[tuple[int, str]]
"""Failures of an expectation: tick, and a text about the wrong behaviour. The first one counts."""
Test = Callable[[Observed], Found]
Says = Callable[[TelemetryFrame, ReceivedAnswer, Observed], str]
"""The error in an answer's content, or ""."""


@dataclass(frozen=True, slots=True)
class Frame:
    """Characters on the air. `last_tick`: start bit of the last one; `end_tick`: end of its stop bit.

    `before`: the velocities of the last frame that contained velocities.
    """

    tick: int
    last_tick: int
    end_tick: int
    seq: int
    words: Pairs
    what: str
    before: Pairs = ()

    def for_robot(self, slot: int) -> tuple[int, int]:
        """The velocities of a robot, as it has to cut them off."""
        left, right = self.words[slot]
        return saturated(left), saturated(right)

    @property
    def acted_tick(self) -> int:
        """Tick at which robots must have acted on it."""
        return self.end_tick + ACTING_TICKS


@dataclass(frozen=True, slots=True)
class TrialExpectation:
    """`test` yields failures. The expectation ends at `tick`: later events change nothing in it.

    `slots`: the robots that it concerns. `by_answers`: it can be judged by the characters that the PC receives.
    """

    tick: int
    wanted: str
    test: Test
    slots: tuple[int, ...]
    by_answers: bool

    def found(self, observed: Observed) -> tuple[int, str] | None:
        """The first failure, or None."""
        return next(self.test(observed), None)


class How(TypedDict, total=False):
    """Options of sending a frame; see `TrialScript.say`."""

    slot: int
    step: int
    fresh: bool
    lead: bytes
    layout: int
    wrong: Mapping[int, int]
    bad_stop: int
    pauses: Mapping[int, float]
    gap_ms: float
    sealed: Callable[[Format, bytes], bytes]


class TrialScript:
    """The host of network `network`. `now`: when it can speak next; `seq`: of its last fresh frame; `slot`: of its
    first robot.

    `sent`, `done` and `expected` are the result.
    """

    def __init__(self, topology: Topology, network: int = 0) -> None:
        self.topology = topology
        self.n = topology.robots
        self.slot = topology.slots[0]
        self.network = network
        self.form = downlink(topology.robots)
        self.character_ticks = -(-HOST_CHARACTER_TICKS * 1_000_000 // (1_000_000 + topology.baud_offset_ppm))
        self.now = ms(BOOTED_MS)
        self.seq = 20 + network
        self.sent: list[Transmission] = []
        self.done: list[Action] = []
        self.expected: list[TrialExpectation] = []
        self._words = 0
        self._before: Pairs = ()

    # ---- saying --------------------------------------------------------------------------------------------

    def wait(self, time_ms: float) -> None:
        self.now += ms(time_ms)

    def wait_until(self, tick: int) -> None:
        """Raises ValueError where the host still speaks then: a mistake in a rule."""
        if tick < self.now:
            raise ValueError(f"the host speaks until tick {self.now}, not {tick}")
        self.now = tick

    def words(self) -> Pairs:
        """Velocities that were not sent before, different for each wheel; every robot turns on the spot, slowly."""
        self._words += 1
        pairs = []
        for slot in range(self.n):
            speed = 640 + 37 * self._words % 1024 + 301 * slot
            sign = -1 if (self._words + slot) % 2 else 1
            pairs.append((sign * speed, -sign * (speed + 5)))
        return tuple(pairs)

    def team(
        self, words: Pairs | None = None, ask: bool = False, label: str = "", **how: Unpack[How]
    ) -> Frame:
        """A team frame."""
        pairs = self.words() if words is None else words
        kind = FrameType.TEAM_ASK if ask else FrameType.TEAM
        return self.say(kind, payload_of(pairs), label or ("question" if ask else "team frame"), pairs, **how)

    def same(self, left: int, right: int) -> Pairs:
        """New velocities, but for the robots that are there these."""
        there = self.topology.slots
        return tuple((left, right) if slot in there else pair for slot, pair in enumerate(self.words()))

    def ask(self, label: str = "", words: Pairs | None = None, **how: Unpack[How]) -> Frame:
        """A question to the robot in `slot`, with the next number reserved for it."""
        slot = how.get("slot", self.slot)
        how["step"] = asking_step(self.seq, slot, self.n)
        return self.team(words, ask=True, label=label or f"question to robot {slot}", **how)

    def service(self, opcode: int, data: bytes = b"", label: str = "", **how: Unpack[How]) -> Frame:
        payload = (bytes([how.get("slot", self.slot), opcode]) + data).ljust(self.form.payload_size, b"\0")
        return self.say(FrameType.SERVICE, payload, label or f"service frame, opcode {opcode}", **how)

    def ping(self, **how: Unpack[How]) -> Frame:
        """A service frame without an effect."""
        return self.service(Opcode.PING, label="ping", **how)

    def filter(self, words: Words, label: str = "", **how: Unpack[How]) -> Frame:
        """kp, ki, kd and il."""
        data = b"".join(word.to_bytes(2, "little") for word in words)
        return self.service(Opcode.FILTER, data, label, **how)

    def acceleration(self, value: int, label: str = "", **how: Unpack[How]) -> Frame:
        return self.service(Opcode.ACCELERATION, value.to_bytes(4, "little"), label, **how)

    def of_type_2(self, **how: Unpack[How]) -> Frame:
        """A frame that only robots send, with a good CRC."""
        return self.say(FrameType.TELEMETRY, bytes(self.form.payload_size), "frame of type 2", **how)

    def ask_nobody(self, **how: Unpack[How]) -> Frame:
        """A question to a robot that is not there."""
        how["slot"] = next(slot for slot in range(self.n) if slot not in self.topology.slots)
        return self.ask(**how)

    def say(self, kind: int, payload: bytes, label: str, words: Pairs = (), **how: Unpack[How]) -> Frame:
        """A frame with the number of the last fresh frame plus `step`; it becomes the last fresh one unless `fresh` is
        false.

        `lead` replaces its preamble, `layout` the layout byte in its CRC. `wrong`: place -> bits to invert; `bad_stop`:
        place of a character with a bad stop bit; `pauses`: place -> pause in us before that character. Places count
        from the first sync byte, the preamble's are negative. `gap_ms`: silence after it. `sealed`: another way to seal
        it. `slot`: the robot it addresses, if not the first.
        """
        seq = (self.seq + how.get("step", 1)) % SEQ_MODULUS
        self.seq = seq if how.get("fresh", True) else self.seq
        form = replace(self.form, layout=how["layout"]) if "layout" in how else self.form
        sealed = how.get("sealed", seal)(form, bytes([kind * SEQ_MODULUS + seq]) + payload)
        body = bytearray(sealed[len(form.lead) :])
        for place, bits in how.get("wrong", {}).items():
            body[place] ^= bits
        lead = how.get("lead", form.lead)
        tick = self._put(lead + bytes(body), len(lead), how)
        end = self.now
        self.wait(how.get("gap_ms", GAP_MS))
        text = f"{label}, seq {seq}"
        frame = Frame(tick, end - self.character_ticks, end, seq, words, text, self._before)
        self._before = words or self._before
        return frame

    def _put(self, data: bytes, first: int, how: How) -> int:
        """Sends characters of which `first` is the first sync byte; returns the tick of the first one."""
        pauses, bad_stop = how.get("pauses", {}), how.get("bad_stop")
        cuts = sorted({first + place for place in pauses if first + place > 0} | {0, len(data)})
        begun = self.now
        for start, end in pairwise(cuts):
            self.now += round(pauses.get(start - first, 0.0) * TICKS_PER_MS / 1000) if start else 0
            bad = () if bad_stop is None else (first + bad_stop - start,)
            self.characters(data[start:end], tuple(at for at in bad if 0 <= at < end - start))
        return begun

    def characters(self, data: bytes, bad_stop: tuple[int, ...] = ()) -> None:
        """Sends characters; they follow the last sent ones without a pause unless `wait` was called."""
        self.sent.append(Transmission(self.now, DOWN, data, self.network, bad_stop))
        self.now += len(data) * self.character_ticks

    # ---- doing ---------------------------------------------------------------------------------------------

    def hold(self, kind: type[Reset] | type[Power], tick: int, for_ms: float) -> int:
        """Resets the network's first robot, or switches it off, from `tick` on; returns when it is let go."""
        end_tick, level = tick + ms(for_ms), int(kind is Reset)
        self.done.append(kind(tick, self.network, self.slot, level))
        self.done.append(kind(end_tick, self.network, self.slot, 1 - level))
        return end_tick

    # ---- expecting -----------------------------------------------------------------------------------------

    def expects(
        self, tick: int, wanted: str, slots: tuple[int, ...] = (), by_answers: bool = False
    ) -> Callable[[Test], Test]:
        """Stands before the test of an expectation."""

        def keep(test: Test) -> Test:
            self.expected.append(
                TrialExpectation(tick, wanted, test, slots or self.topology.slots, by_answers)
            )
            return test

        return keep

    def obeyed(self, frame: Frame) -> Frame:
        """Both wheels receive the frame's velocities in time. A wheel that receives 0 may also be stopped."""

        @self.expects(
            frame.acted_tick, f"the velocities of {frame.what} at the wheels within {ACTING_MS:g} ms"
        )
        def test(observed: Observed) -> Found:
            orders = observed.both_orders(frame.acted_tick)
            wanted = frame.for_robot(observed.slot)
            if not all(map(obeys, orders, wanted)):
                left, right = map(number, wanted)
                reason = f"{in_words(orders[0])}, {in_words(orders[1])} and not {left}, {right}"
                yield frame.acted_tick, reason + _instead(observed, frame, orders)

        return frame

    def ignored(self, frame: Frame) -> None:
        """The wheels receive no new order."""
        self.unchanged(frame.tick, frame.acted_tick, f"{frame.what} not acted on")

    def unchanged(self, after_tick: int, until_tick: int, wanted: str) -> None:
        """In between no wheel receives another order than its last one."""

        @self.expects(until_tick, wanted)
        def test(observed: Observed) -> Found:
            for order in observed.ordered(after_tick, until_tick):
                before = observed.last_order(order.side, after_tick)
                if (order.what, order.velocity) != (before.what, before.velocity):
                    yield order.tick, f"an order to the {order.side} wheel: {in_words(order)}"

    def untouched(self, frame: Frame, slots: tuple[int, ...] = (), since: Frame | None = None) -> None:
        """The chips receive only commands that read. `since`: the failsafe must not count from that frame."""

        @self.expects(frame.acted_tick, f"{frame.what} not acted on", slots)
        def test(observed: Observed) -> Found:
            for event in observed.wrote(frame.tick, frame.acted_tick):
                text = str(event).partition(" command ")[2]
                if since is not None and abs(event.tick - since.end_tick - FAILSAFE_STOP_TICKS) <= ms(2.0):
                    text += f": the failsafe counts on from {since.what}"
                yield event.tick, text

    def answered(self, question: Frame, wanted: str = "", says: Says | None = None) -> None:
        """Expects that the addressed robot answers in time, with the number of `question`."""
        slot, deadline = question.seq % self.n, over_by(question)

        @self.expects(deadline, wanted or f"an answer to {question.what}", (slot,), by_answers=True)
        def test(observed: Observed) -> Found:
            answers = within(observed.answers, question.last_tick, deadline)
            content = answers[0].content if answers else None
            if not answers:
                yield deadline, _no_answer(observed, question, deadline)
            elif content is None or (content.slot, content.seq) != (slot, question.seq):
                yield answers[0].tick, who(answers[0])
            elif says is not None and (reason := says(content, answers[0], observed)):
                yield answers[0].tick, reason

    def silent(self, after_tick: int, until_tick: int, why: str) -> None:
        """Expects that the PC receives nothing from `after_tick` to `until_tick`."""

        @self.expects(until_tick, f"silence: {why}", by_answers=True)
        def test(observed: Observed) -> Found:
            if received := in_a_row(within(observed.received, after_tick, until_tick)):
                answers = within(observed.answers, received[0].tick, received[-1].tick)
                yield received[0].tick, ": ".join([characters(received), *map(who, answers[:1])])


def _instead(observed: Observed, frame: Frame, orders: tuple[Order, Order]) -> str:
    """The robot's wrong reaction to the frame in words, if it is recognised; else ""."""
    if max(order.tick for order in orders) <= frame.tick:
        late = _obeyed_late(observed, frame)
        if late is not None:
            return f": obeyed {(late - frame.end_tick) / TICKS_PER_MS:.2f} ms after its end"
        wrote = observed.wrote(frame.tick, frame.acted_tick)
        loaded = any(
            command.opcode == _LTRJ and command.data[1:2] and command.data[1] & _VELOCITY for command in wrote
        )
        return ": loaded, but not started (STT)" if loaded else ": no order came"
    mistake = wheels_instead(orders, frame, observed.slot)
    return f": {mistake}" if mistake else ""


def _obeyed_late(observed: Observed, frame: Frame) -> int | None:
    wanted = frame.for_robot(observed.slot)
    for order in observed.ordered(frame.acted_tick, frame.acted_tick + CONTROL_PERIOD_TICKS):
        if all(map(obeys, observed.both_orders(order.tick), wanted)):
            return order.tick
    return None


def who(answer: ReceivedAnswer) -> str:
    """The sender of an answer, for people."""
    content = answer.content
    return (
        "unknown contents"
        if content is None
        else f"an answer of robot {content.slot} to question {content.seq}"
    )


def _no_answer(observed: Observed, question: Frame, deadline: int) -> str:
    received = within(observed.received, question.last_tick, deadline)
    later = within(observed.answers, deadline, observed.end_tick)
    late = next((answer for answer in later if answer.frame.seq == question.seq), None)
    if late is not None and late.frame.start_tick < deadline + CONTROL_PERIOD_TICKS:
        return f"one that is over {(late.tick - question.end_tick) / TICKS_PER_MS:.2f} ms after the question's end"
    if not received:
        return "no answer"
    why = no_answer(received, question.seq)
    return f"{characters(received)}: {why}" if why else f"{characters(received)}, which are no answer"


def ms(time_ms: float) -> int:
    """Ticks."""
    return round(time_ms * TICKS_PER_MS)


def obeys(order: Order, word: int) -> bool:
    """True if the wheel under `order` obeys the radio's velocity `word`."""
    return (order.what == "drive" and order.word == word) or (word == 0 and order.what == "stop")


def over_by(question: Frame) -> int:
    """An answer is over before the next question can be: a camera frame later."""
    return question.end_tick + CONTROL_PERIOD_TICKS
