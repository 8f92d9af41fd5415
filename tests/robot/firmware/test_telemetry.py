"""The answer to a poll, as it comes out of TXD."""

from itertools import pairwise

import pytest

from miro_protocol.decoder import Received, TelemetryDecoder
from miro_protocol.frames import TeamFrame, TelemetryFrame, encode
from miro_protocol.table import Flags
from tests.robot.firmware.rig import CHARACTER, Rig


def answers(rig):
    events = TelemetryDecoder().feed_symbols(rig.sent())
    assert all(isinstance(event, Received) for event in events), events
    messages = [event.message(rig.n) for event in events if isinstance(event, Received)]
    assert all(isinstance(message, TelemetryFrame) for message in messages)
    return [message for message in messages if isinstance(message, TelemetryFrame)]


@pytest.mark.parametrize(("slot", "n"), [(0, 3), (2, 3), (4, 5)])
def test_a_robot_answers_when_seq_mod_n_is_its_slot(slot, n):
    rig = Rig(slot, n)
    for seq in range(n):
        rig.team(seq, 10, 20, ask=True, slot=slot)
        rig.run_ms(25)
    assert [(answer.seq, answer.slot) for answer in answers(rig)] == [(slot, slot)]


def test_team_frames_without_the_question_are_not_answered():
    rig = Rig()
    rig.team(0, 10, 20)
    rig.run_ms(25)
    assert rig.sent() == []


def test_the_answer_tells_status_position_and_counters():
    rig = Rig()
    for a, b in [(0, 0), (1, 0), (1, 1), (0, 1), (0, 0), (1, 0)]:
        rig.board.left.set_encoder(rig.now, a, b)
        rig.board.right.set_encoder(rig.now, b, a)
        rig.run_ms(1)
    assert (rig.board.left.real_position, rig.board.right.real_position) == (5, -5)
    for seq in (1, 2, 2):
        rig.team(seq, 0, 0)
    rig.team(3, 0, 0, ask=True)
    rig.run_ms(25)
    (answer,) = answers(rig)
    assert (answer.position_left, answer.position_right) == (5, 0xFFFB)
    assert (answer.accepted, answer.rejected) == (3, 0)
    assert answer.status_left == answer.status_right == 0


def test_flags_tell_what_the_failsafe_did_since_the_last_answer():
    rig = Rig()
    flags = []
    for seq, wait in ((0, 0), (3, 0), (6, 200), (9, 600), (12, 0)):
        rig.run_ms(wait)
        rig.team(seq, 0, 0, ask=True)
        rig.run_ms(25)
        flags.append(answers(rig)[-1].flags)
    assert flags == [Flags.MOTORS_OFF, 0, Flags.STOPPED, Flags.STOPPED | Flags.MOTORS_OFF, 0]


def test_the_characters_of_an_answer_follow_each_other_without_a_gap():
    rig = Rig()
    rig.team(0, 0, 0, ask=True)
    rig.run_ms(25)
    ticks = [tick for _, _, tick in rig.sent()]
    assert len(ticks) == 19
    assert {after - before for before, after in pairwise(ticks)} == {10 * 2496}


def test_it_hears_the_next_frame_while_it_answers():
    rig = Rig()
    rig.team(0, 100, 100, ask=True)
    for seq in (1, 2):
        rig.team(seq, 100 + seq, 100)
    assert len(answers(rig)) == 1
    assert rig.counters == (3, 0, 0)
    assert rig.i16("_last_left") == 102


def test_a_question_that_comes_while_it_answers_is_obeyed_and_counted_and_not_answered():
    rig = Rig()
    rig.run_to(rig.send(encode(TeamFrame(3, 0, ((100, 100),) * 3), 3)) + CHARACTER)
    rig.frame(encode(TeamFrame(3, 3, ((200, 200),) * 3), 3)[6:], settle_ms=50)  # without preamble: 17.7 ms
    assert [answer.seq for answer in answers(rig)] == [0]
    assert rig.i16("_last_left") == 200
    rig.team(6, 0, 0, ask=True)
    rig.run_ms(25)
    assert [(answer.seq, answer.accepted) for answer in answers(rig)] == [(0, 1), (6, 3)]


@pytest.mark.parametrize(
    ("waited_ms", "flags"), [(20, Flags.MOTORS_OFF), (150, Flags.MOTORS_OFF | Flags.STOPPED)]
)
def test_the_first_answer_says_that_motors_were_off_and_whether_110_ms_passed(waited_ms, flags):
    rig = Rig()
    rig.run_ms(waited_ms)
    rig.team(0, 0, 0, ask=True)
    rig.run_ms(25)
    assert [answer.flags for answer in answers(rig)] == [flags]


@pytest.mark.parametrize(("slot", "n"), [(3, 3), (7, 3), (5, 5)])
def test_a_robot_whose_slot_is_not_below_n_hears_and_never_answers_or_moves(slot, n):
    rig = Rig(slot, n)
    for seq in range(2 * n):
        rig.team(seq, 100, 100, ask=True)
        rig.run_ms(25)
    assert rig.sent() == []
    assert rig.counters == (2 * n, 0, 0)
    assert [rig.told(chip) for chip in (rig.board.left, rig.board.right)] == [[], []]
