"""Rules about what a robot says: when, in which form, and what is in it.

Long because every field of the answer has its rule.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import pairwise

from miro_protocol.table import SEQ_MODULUS, SYNC, TELEMETRY, Flags, Opcode
from miro_protocol.transmission import follows
from miro_sim.periods import RobotPeriod
from mirotwin.conform.rule import BOTH, THREE, Air, Chapter
from mirotwin.conform.rules import FRAME, FRESHNESS, RECEPTION, TURNS
from mirotwin.conform.seen import Answer, Seen
from mirotwin.conform.talk import Found, Frame, Talk, ms, over_by

CHAPTER = Chapter("Answers")


@CHAPTER.rule(
    "P41",
    "The robot in slot seq mod N MUST answer a fresh frame of type 3, with that frame's seq and its own slot, and the"
    " answer MUST be over before the next question can be: 33.37 ms after it.",
    TURNS,
    airs=(Air(3, (0, 1, 2)), Air(5, (0, 1, 2, 3, 4))),
)
def in_turn(talk: Talk) -> None:
    talk.seq = 59
    for _ in range(10):  # over the wrap of seq, where some robot's turn comes early
        question = talk.team(ask=True, what="question", gap_ms=36.0)
        talk.answered(question, question.seq % talk.n)


@CHAPTER.rule(
    "P42",
    "An answer MUST be 19 characters without a pause: 55h four times, FFh, 2Dh D4h, HDR to CRC whitened, CRC with the"
    " layout byte 1Eh.",
    FRAME,
)
def form(talk: Talk) -> None:
    for _ in range(3):
        question = talk.ask(talk.air.slots[0], gap_ms=36.0)
        talk.answered(question, talk.air.slots[0])
        _formed(talk, question)


def _formed(talk: Talk, question: Frame, then_more: bool = False) -> None:
    """`then_more`: another answer may follow at once."""
    deadline = over_by(question)
    head = TELEMETRY.lead + SYNC

    def test(seen: Seen) -> Found:
        heard = [one for one in seen.heard if question.last_tick < one.tick <= deadline]
        if then_more:
            heard = heard[: TELEMETRY.wire_size]
        if len(heard) != TELEMETRY.wire_size:
            return deadline, f"{len(heard)} characters"
        found = bytes(one.value for one in heard)[: len(head)]
        if found != head:
            return heard[len(head) - 1].tick, found.hex(" ")
        for before, one in pairwise(heard):
            if not follows(before.tick, one.tick) or not one.good_stop:
                spacing_us = (one.tick - before.tick) / 24
                return (
                    one.tick,
                    f"{spacing_us:.0f} us between two, stop bit {'good' if one.good_stop else 'bad'}",
                )
        return None

    talk.expect(deadline, f"19 characters without a pause, {head.hex(' ')} first", test, (talk.air.slots[0],))


@CHAPTER.rule(
    "P43",
    "A robot MUST speak only when it is asked: not on type 0 and 1, not on questions to others, nor on those that are"
    " not fresh or not valid.",
    TURNS,
)
def unasked(talk: Talk) -> None:
    slot = talk.air.slots[0]
    talk.silent(0, talk.now, "nobody asks")
    for _ in range(talk.n + 1):
        talk.team()
        talk.ping()
    for other in range(talk.n):
        if other != slot:
            talk.ask(other)
    talk.ask(slot, fresh=False, wrong={talk.form.size - 1: 0x10})
    talk.ask(slot, fresh=False, bad_stop=9)
    talk.silent(ms(1.0), talk.now, "no question to this robot")
    question = talk.ask(slot, gap_ms=36.0)
    talk.answered(question, slot)
    after = talk.now
    for _ in range(3):
        talk.team(ask=True, step=0, fresh=False)
    talk.wait(200.0)
    talk.silent(after, talk.now, "no fresh question")
    talk.answered(talk.ask(slot, gap_ms=36.0), slot)


@CHAPTER.rule(
    "P44",
    "A robot MUST hear the next frame while it answers, and what it hears MUST NOT disturb its answer.",
    TURNS,
)
def full_duplex(talk: Talk) -> None:
    slot = talk.air.slots[0]
    for _ in range(3):
        question = talk.ask(slot, gap_ms=0.0)
        talk.answered(question, slot)
        talk.obeyed(talk.team(lead=b"", gap_ms=12.0))
    question = talk.ask(slot, gap_ms=0.0)
    talk.answered(question, slot, "one whole answer to two questions in a row")
    _formed(talk, question, then_more=True)
    talk.obeyed(talk.ask(slot, lead=b"", gap_ms=40.0))


@CHAPTER.rule(
    "P45",
    "The flags MUST say whether since the last answer the robot stopped (08h, 110 ms) and put its motors off (10h,"
    " 500 ms), and an answer MUST clear them; all other flags are 0.",
    FRAME,
)
def flags(talk: Talk) -> None:
    both = Flags.STOPPED | Flags.MOTORS_OFF
    talk.answered(talk.ask(talk.air.slots[0], gap_ms=36.0), talk.air.slots[0])  # its flags tell of power-on
    for silence_ms, frames, wanted in (
        *((0.0, 0, 0), (0.0, 2, 0), (140.0, 0, Flags.STOPPED), (0.0, 0, 0), (520.0, 0, both), (0.0, 0, 0)),
        *((200.0, 3, Flags.STOPPED), (0.0, 3, 0), (600.0, 2, both), (0.0, 0, 0)),
    ):
        talk.wait(silence_ms)
        for _ in range(frames):
            talk.team()
        _says(talk, f"flags {int(wanted):02X}h", partial(_flagged, wanted))
    for silence_ms, wanted in ((140.0, Flags.STOPPED), (560.0, both)):
        for _ in range(2):  # what happened twice is told once
            talk.team()
            talk.wait(silence_ms)
        _says(talk, f"flags {int(wanted):02X}h", partial(_flagged, wanted))


def _says(talk: Talk, wanted: str, says: Callable[[Answer, Seen], str], gap_ms: float = 36.0) -> Frame:
    question = talk.ask(talk.air.slots[0], gap_ms=gap_ms)
    talk.answered(question, talk.air.slots[0], f"{wanted} in the answer to {question.what}", says)
    return question


def _flagged(wanted: int, answer: Answer, seen: Seen) -> str:
    assert answer.said is not None
    return "" if answer.said.flags == wanted else f"{answer.said.flags:02X}h"


@CHAPTER.rule(
    "P46",
    "The status bytes MUST be those of the left and of the right LM629.",
    FRAME,
)
def status(talk: Talk) -> None:
    talk.team()
    _says(talk, "the chips' status", _status)
    _run_away(talk)  # then they differ
    _says(talk, "the chips' status", _status, gap_ms=70.0)
    end = talk.now

    def differ(seen: Seen) -> Found:
        last = seen.periods[-1][1]
        if last.left.status == last.right.status:
            return end, f"{last.left.status:02X}h in both"
        return None

    talk.expect(end, "an excessive error in the left LM629 alone", differ)


def _run_away(talk: Talk) -> None:
    """Gains of 0 and a fast left wheel: its desired position runs away from the real one."""
    slot = talk.air.slots[0]
    talk.service(slot, Opcode.FILTER, bytes(8))
    for _ in range(8):
        talk.team(talk.same(slot, 16000, 50), gap_ms=30.0)


def _status(answer: Answer, seen: Seen) -> str:
    said = answer.said
    assert said is not None
    before, after = _around(answer, seen)
    for side, one, other, found in (
        ("left", before.left.status, after.left.status, said.status_left),
        ("right", before.right.status, after.right.status, said.status_right),
    ):
        if one == other != found:
            return f"{found:02X}h and not {one:02X}h of the {side} one"
    return ""


def _around(answer: Answer, seen: Seen) -> tuple[RobotPeriod, RobotPeriod]:
    """The robot at the begin of the last control period before an answer was asked for, and of the first behind it."""
    begun = answer.frame.start_tick - ms(14.0)
    before = [record for tick, record in seen.periods if tick <= begun]
    after = [record for tick, record in seen.periods if tick >= answer.tick]
    return before[-1], (after or [seen.periods[-1][1]])[0]


@CHAPTER.rule(
    "P47",
    "The positions MUST be the low 16 bits of the real positions of both wheels, as they are when the robot answers.",
    FRAME,
)
def positions(talk: Talk) -> None:
    slot = talk.air.slots[0]
    for _ in range(10):  # beyond 65536 counts, one wheel forward and one backward
        talk.team(talk.same(slot, 13000, -12000), gap_ms=50.0)
    _says(talk, "the real positions", _positions)
    talk.team(talk.same(slot, 0, 0), gap_ms=60.0)
    for _ in range(6):
        talk.team(talk.same(slot, 0, 0), gap_ms=60.0)
    _stands(talk, slot)
    _run_away(talk)
    _stands(talk, slot)


def _stands(talk: Talk, slot: int) -> None:
    question = talk.team(
        talk.same(slot, 0, 0),
        ask=True,
        step=_step_to(talk, slot),
        what=f"question to robot {slot}",
        gap_ms=70.0,
    )
    talk.answered(question, slot, f"the real positions in the answer to {question.what}", _positions)


def _step_to(talk: Talk, slot: int) -> int:
    return next(step for step in range(1, 9) if (talk.seq + step) % SEQ_MODULUS % talk.n == slot)


def _positions(answer: Answer, seen: Seen) -> str:
    said = answer.said
    assert said is not None
    before, after = _around(answer, seen)
    for side, one, other, found in (
        ("left", before.left.real_position, after.left.real_position, said.position_left),
        ("right", before.right.real_position, after.right.real_position, said.position_right),
    ):
        low, high = min(one, other) - 2, max(one, other) + 2
        if (found - low) & 0xFFFF > high - low:
            return f"{found} of the {side} wheel, which went from {one & 0xFFFF} to {other & 0xFFFF}"
    return ""


@CHAPTER.rule(
    "P48",
    "`accepted` MUST count the fresh frames since power-on, the question itself included, and wrap at 256; no other"
    " frame counts.",
    FRAME,
    airs=THREE,
)
def accepted(talk: Talk) -> None:
    count = 0

    def counted(wanted: int) -> None:
        _says(talk, f"accepted {wanted % 256}", partial(_counts, "accepted", wanted))

    for rows, gap_ms in ((5, 12.0), (122, 0.0), (128, 0.0), (3, 12.0)):
        for _ in range(rows):
            talk.team(lead=b"", gap_ms=gap_ms)
        talk.wait(12.0)
        talk.team(step=0, fresh=False, lead=b"")
        talk.team(step=30, fresh=False, lead=b"")
        talk.team(fresh=False, lead=b"", wrong={6: 2})
        talk.ping(lead=b"")
        talk.of_type_2(lead=b"")
        count += rows + 3
        counted(count)


def _counts(name: str, wanted: int, answer: Answer, seen: Seen) -> str:
    assert answer.said is not None
    found = int(getattr(answer.said, name))
    return "" if found == wanted % 256 else f"{found}"


@CHAPTER.rule(
    "P49",
    "`rejected` MUST count the windows whose sync, stop bits and spacings are good and whose CRC is bad, and wrap at"
    " 256; nothing else counts.",
    RECEPTION,
    airs=BOTH,
)
def rejected(talk: Talk) -> None:
    count = 0
    size = talk.form.size

    def counted() -> None:
        _says(talk, f"rejected {count % 256}", partial(_counts, "rejected", count))

    counted()
    for how in ({size - 1: 1}, {2: 0x80}, {size // 2: 0x18}):
        talk.team(fresh=False, wrong=how)
        count += 1
    counted()
    talk.team(step=0, fresh=False)
    talk.team(fresh=False, bad_stop=7, wrong={5: 1})
    talk.team(fresh=False, pauses={9: 200.0}, wrong={5: 1})
    talk.team(fresh=False, wrong={0: 1})
    talk.team(fresh=False, wrong={1: 0x80})
    talk.characters(bytes(40))
    talk.wait(12.0)
    counted()
    for syncs in (40, 90, 150):  # each sync with a whole window behind it is one
        talk.characters(SYNC * syncs)
        count += (2 * syncs - size) // 2 + 1
        talk.wait(20.0)
        counted()


@CHAPTER.rule(
    "P50",
    "A robot MUST answer the first question after a silence too: failsafe and motors off change nothing in it.",
    FRESHNESS,
    airs=THREE,
)
def after_silence(talk: Talk) -> None:
    slot = talk.air.slots[0]
    for silence_ms in (130.0, 700.0):
        talk.answered(talk.ask(slot, gap_ms=36.0), slot)
        talk.wait(silence_ms)
    talk.answered(talk.ask(slot, gap_ms=36.0), slot)
