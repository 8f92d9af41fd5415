"""Rules about a robot's answers: their times, form and content."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Unpack

from miro_exact.clock import TICKS_PER_SECOND
from miro_protocol.frames import TelemetryFrame
from miro_protocol.table import BITS_PER_CHARACTER, ROBOT_BIT_TICKS, SYNC, TELEMETRY, Flags
from miro_sim.periods import RobotPeriod
from miro_sim.world.events import Event
from mirotwin.conform.hints import characters, in_a_row, no_answer, number
from mirotwin.conform.observed import Observed, ReceivedAnswer, within
from mirotwin.conform.rule import BOTH, FRAME, FRESHNESS, RECEPTION, THREE, TURNS, Chapter, Topology
from mirotwin.conform.trial_script import Found, Frame, How, Says, TrialScript, ms, over_by

CHAPTER = Chapter("Answers")
BAUD = TICKS_PER_SECOND / ROBOT_BIT_TICKS
BAUD_TOLERANCE = 0.01
"""A timer's reload that is off by one makes 1.3 %. Chosen."""
_HEAD = TELEMETRY.lead + SYNC
_AT_SPEED = 40
"""Questions while a wheel goes 50 counts in a sample: a carry falls into some of them."""


@CHAPTER.rule(
    "P41",
    TURNS,
    presupposes="P42",
    topologies=(*BOTH, Topology(3, (0, 1, 2)), Topology(5, (0, 1, 2, 3, 4))),
    broken="a question is not answered in turn",
)
def in_turn(script: TrialScript) -> None:
    """The robot in slot seq mod N MUST answer a fresh frame of type 3, with that frame's seq and its own slot, and the
    answer MUST be over before the next question can be: 33.37 ms after it.
    """
    script.seq = 59
    for _ in range(10):  # over the wrap of seq, where some robot's turn comes early
        question = script.team(ask=True, gap_ms=36.0)
        addressed = question.seq % script.n
        if addressed in script.topology.slots:
            script.answered(question)
        else:
            script.silent(question.last_tick, over_by(question), f"{question.what} is for robot {addressed}")


@CHAPTER.rule("P42", FRAME, presupposes="P16", broken="an answer is not well formed")
def form(script: TrialScript) -> None:
    """An answer MUST be 19 characters without a pause, at 9615 baud +- 1 %: 55h four times, FFh, 2Dh D4h, HDR to CRC
    whitened, CRC with the layout byte 1Eh.
    """
    for _ in range(3 * script.n):  # whoever it takes itself for
        _formed(script, script.team(ask=True, gap_ms=36.0))
    end = script.now

    @script.expects(end, f"an answer to some of {3 * script.n} questions in a row")
    def any_received(observed: Observed) -> Found:
        if not observed.received:
            yield end, "none"


def _formed(script: TrialScript, question: Frame, then_more: bool = False) -> None:
    """Characters that come then, if any, are formed as an answer. `then_more`: another one may follow at once."""
    until = question.end_tick + ms(56.0)
    wanted = f"an answer of 19 characters without a pause, {_HEAD.hex(' ')} first, at 9615 baud"

    @script.expects(until, wanted)
    def test(observed: Observed) -> Found:
        received: Sequence[Event] = within(observed.received, question.last_tick, until)
        received = received[: TELEMETRY.wire_size] if then_more else in_a_row(received)
        if received and (reason := _badly_formed(received, question, observed)):
            yield received[-1].tick, f"{characters(received)}: {reason}"


def _badly_formed(received: Sequence[Event], question: Frame, observed: Observed) -> str:
    if len(received) != TELEMETRY.wire_size:
        return f"{len(received)} without a pause"
    head = bytes(character.value for character in received)[: len(_HEAD)]
    if head != _HEAD:
        return f"{head.hex(' ')} first"
    if not all(character.good_stop for character in received):
        return "a bad stop bit"
    baud = (
        BITS_PER_CHARACTER * TICKS_PER_SECOND * (len(received) - 1) / (received[-1].tick - received[0].tick)
    )
    if abs(baud - BAUD) > BAUD_TOLERANCE * BAUD:
        return f"{baud:.0f} baud"
    if not within(observed.answers, received[0].tick - 1, received[-1].tick):
        return no_answer(received, question.seq)
    return ""


@CHAPTER.rule("P43", TURNS, presupposes="P07 P09 P20 P41", broken="a robot speaks unasked")
def unasked(script: TrialScript) -> None:
    """A robot MUST speak only when it is asked: not on type 0 and 1, not on questions to others, nor on those that are
    not fresh or not valid.
    """
    script.silent(0, script.now, "nobody asks")
    for _ in range(script.n + 1):
        script.team()
        script.ping()
    for other in range(script.n):
        if other != script.slot:
            script.ask(slot=other)
    script.ask(fresh=False, wrong={script.form.size - 1: 0x10})
    script.ask(fresh=False, bad_stop=9)
    script.silent(ms(1.0), script.now, "no question to this robot")
    script.answered(script.ask(gap_ms=36.0))
    after = script.now
    for _ in range(3):
        script.team(ask=True, step=0, fresh=False)
    script.wait(200.0)
    script.silent(after, script.now, "no fresh question")
    script.answered(script.ask(gap_ms=36.0))


@CHAPTER.rule("P44", TURNS, presupposes="P04 P41")
def full_duplex(script: TrialScript) -> None:
    """A robot MUST hear the next frame while it answers, and what it hears MUST NOT disturb its answer."""
    for _ in range(3):
        script.answered(script.ask(gap_ms=0.0))
        script.obeyed(script.team(lead=b"", gap_ms=12.0))
    question = script.ask(gap_ms=0.0)
    script.answered(question, "one whole answer to two questions in a row")
    _formed(script, question, then_more=True)
    script.obeyed(script.ask(lead=b"", gap_ms=40.0))


@CHAPTER.rule("P45", FRAME, presupposes="P32 P43")
def flags(script: TrialScript) -> None:
    """The flags MUST say whether since the last answer the robot stopped (08h, 110 ms) and put its motors off (10h, 500
    ms), and an answer MUST clear them; all other flags are 0.
    """
    both = Flags.STOPPED | Flags.MOTORS_OFF
    _says_flags(script, Flags.MOTORS_OFF, " of power-on")
    for silence_ms, frames, wanted in (
        *((0.0, 0, 0), (0.0, 2, 0), (140.0, 0, Flags.STOPPED), (0.0, 0, 0), (520.0, 0, both), (0.0, 0, 0)),
        *((200.0, 3, Flags.STOPPED), (0.0, 3, 0), (600.0, 2, both), (0.0, 0, 0)),
    ):
        script.wait(silence_ms)
        for _ in range(frames):
            script.team()
        _says_flags(script, wanted)
    script.wait(140.0)
    script.ask_nobody()
    _says_flags(script, Flags.STOPPED, ", which no answer has told,")
    script.wait(140.0)
    question = script.ask(gap_ms=0.0)
    first = f"flags {int(Flags.STOPPED):02X}h in the answer to {question.what}, the first of two in a row"
    script.answered(question, first, flagged(Flags.STOPPED))
    script.ask(lead=b"", gap_ms=40.0)
    _says_flags(script, 0)
    for silence_ms, wanted in ((140.0, Flags.STOPPED), (560.0, both)):
        for _ in range(2):  # what happened twice is reported once
            script.team()
            script.wait(silence_ms)
        _says_flags(script, wanted)


def _says(script: TrialScript, wanted: str, says: Says, **how: Unpack[How]) -> None:
    question = script.ask(**(How(gap_ms=36.0) | how))
    script.answered(question, f"{wanted} in the answer to {question.what}", says)


def _says_flags(script: TrialScript, wanted: int, since: str = "") -> None:
    _says(script, f"flags {int(wanted):02X}h{since}", flagged(wanted))


def flagged(wanted: int, among: int = 0xFF) -> Says:
    """Among these flags those are set that are `wanted`."""
    return lambda content, *_: "" if content.flags & among == wanted else f"{content.flags:02X}h"


@CHAPTER.rule("P46", FRAME, presupposes="P35 P41")
def status(script: TrialScript) -> None:
    """The status bytes MUST be those of the left and of the right LM629."""
    script.team()
    _says(script, "the chips' status", _status)
    _run_away(script)  # then they differ
    _says(script, "the chips' status", _status, gap_ms=70.0)
    end = script.now

    @script.expects(end, "an excessive error in the left LM629 alone")
    def differ(observed: Observed) -> Found:
        last = observed.periods[-1][1]
        if last.left.status == last.right.status:
            yield end, f"{last.left.status:02X}h in both"


def _run_away(script: TrialScript) -> None:
    """Sends gains of 0 and a fast left wheel, so the desired position runs away from the real one."""
    script.filter((0, 0, 0, 0))
    for _ in range(8):
        script.team(script.same(16000, 50), gap_ms=30.0)


def _status(content: TelemetryFrame, answer: ReceivedAnswer, observed: Observed) -> str:
    before, after = _around(answer, observed)
    left, right = (before.left.status, after.left.status), (before.right.status, after.right.status)
    for side, (earlier, other), others, shown in (
        ("left", left, right, content.status_left),
        ("right", right, left, content.status_right),
    ):
        if earlier == other != shown:
            more = ": that is the other one's" if others == (shown, shown) else ""
            return f"{shown:02X}h and not {earlier:02X}h of the {side} one{more}"
    return ""


def _around(answer: ReceivedAnswer, observed: Observed) -> tuple[RobotPeriod, RobotPeriod]:
    """The robot at the start of the last control period before an answer was requested, and of the first after it."""
    begun = answer.frame.start_tick - ms(14.0)
    before = [record for tick, record in observed.periods if tick <= begun]
    after = [record for tick, record in observed.periods if tick >= answer.tick]
    return before[-1], (after or [observed.periods[-1][1]])[0]


@CHAPTER.rule("P47", FRAME, presupposes="P35 P41", broken="positions in answers are wrong")
def positions(script: TrialScript) -> None:
    """The positions MUST be the low 16 bits of the real positions of both wheels, as they are when the robot
    answers.
    """
    for _ in range(10):  # beyond 65536 counts, one wheel forward and one backward
        script.team(script.same(13000, -12000), gap_ms=50.0)
    _says(script, "the real positions", _positions)
    for _ in range(_AT_SPEED):
        question = script.ask(label="question at speed", words=script.same(13000, -12000), gap_ms=36.0)
        wanted = f"positions of one sample each in the answer to {question.what}"
        script.answered(question, wanted, _read_at_once)
    for _ in range(7):
        script.team(script.same(0, 0), gap_ms=60.0)
    _stands(script)
    _run_away(script)
    _stands(script)


def _stands(script: TrialScript) -> None:
    question = script.ask(words=script.same(0, 0), gap_ms=70.0)
    script.answered(question, f"the real positions in the answer to {question.what}", _positions)


def _positions(content: TelemetryFrame, answer: ReceivedAnswer, observed: Observed) -> str:
    before, after = _around(answer, observed)
    left = (before.left.real_position, after.left.real_position)
    right = (before.right.real_position, after.right.real_position)
    for side, ends, others, position in (
        ("left", left, right, content.position_left),
        ("right", right, left, content.position_right),
    ):
        if not _within(position, ends):
            first, other = (number(end & 0xFFFF) for end in ends)
            where = f"{number(position)} of the {side} wheel, which went from {first} to {other}"
            if _within(position >> 8 | (position & 0xFF) << 8, ends):
                return f"{where}: its bytes are exchanged"
            return f"{where}: that is the other wheel's" if _within(position, others) else where
    return ""


def _read_at_once(content: TelemetryFrame, answer: ReceivedAnswer, observed: Observed) -> str:
    """Each position must be the low word of one RDRP reading. A robot that reads no RDRP is not judged by this."""
    for side, position in (("left", content.position_left), ("right", content.position_right)):
        read = observed.read_positions(side, answer.frame.start_tick - ms(14.0), answer.tick)
        if read and position not in read:
            where = (
                f"{number(position)} of the {side} wheel, of which {', '.join(map(number, read))} was read"
            )
            mixed = any(
                position in (value & 0xFF00 | other & 0xFF, value) for value in read for other in read
            )
            return f"{where}: its bytes are of two samples" if mixed else where
    return _positions(content, answer, observed)


def _within(position: int, ends: tuple[int, int]) -> bool:
    """True if these 16 bits are a position between the ends, with two counts of tolerance."""
    low, high = min(ends) - 2, max(ends) + 2
    return (position - low) & 0xFFFF <= high - low


@CHAPTER.rule("P48", FRAME, presupposes="P17 P34 P40 P41", topologies=THREE)
def accepted(script: TrialScript) -> None:
    """`accepted` MUST count the fresh frames since power-on, the question itself included, and wrap at 256; no other
    frame counts.
    """
    count = 0
    for rows, gap_ms in ((5, 12.0), (122, 0.0), (128, 0.0), (3, 12.0)):
        for _ in range(rows):
            script.team(lead=b"", gap_ms=gap_ms)
        script.wait(12.0)
        script.team(step=0, fresh=False, lead=b"")
        script.team(step=30, fresh=False, lead=b"")
        script.team(fresh=False, lead=b"", wrong={6: 2})
        script.ping(lead=b"")
        script.of_type_2(lead=b"")
        count += rows + 3
        _counts(script, "accepted", count)


def _counts(script: TrialScript, name: str, count: int) -> None:
    def wrong(content: TelemetryFrame, *_: object) -> str:
        value = int(getattr(content, name))
        return "" if value == count % 256 else number(value, 2)

    _says(script, f"{name} {number(count % 256, 2)}", wrong)


@CHAPTER.rule("P49", RECEPTION, presupposes="P06 P13 P41")
def rejected(script: TrialScript) -> None:
    """`rejected` MUST count the windows whose sync, stop bits and spacings are good and whose CRC is bad, and wrap at
    256; nothing else counts.
    """
    count = 0
    size = script.form.size
    _counts(script, "rejected", count)
    for how in ({size - 1: 1}, {2: 0x80}, {size // 2: 0x18}):
        script.team(fresh=False, wrong=how)
        count += 1
    _counts(script, "rejected", count)
    script.team(step=0, fresh=False)
    script.team(fresh=False, bad_stop=7, wrong={5: 1})
    script.team(fresh=False, pauses={9: 200.0}, wrong={5: 1})
    script.team(fresh=False, wrong={0: 1})
    script.team(fresh=False, wrong={1: 0x80})
    script.characters(bytes(40))
    script.wait(12.0)
    _counts(script, "rejected", count)
    for syncs in (40, 90, 150):  # each sync with a whole window after it is one
        script.characters(SYNC * syncs)
        count += (2 * syncs - size) // 2 + 1
        script.wait(20.0)
        _counts(script, "rejected", count)


@CHAPTER.rule("P50", FRESHNESS, presupposes="P41", topologies=THREE)
def after_silence(script: TrialScript) -> None:
    """A robot MUST answer the first question after a silence too: failsafe and motors off change nothing in it."""
    for silence_ms in (130.0, 700.0):
        script.answered(script.ask(gap_ms=36.0))
        script.wait(silence_ms)
    script.answered(script.ask(gap_ms=36.0))
