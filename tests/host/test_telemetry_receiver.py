"""What the PC hears: the last answer of each robot, with counts that do not wrap."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.state import restore, snapshot
from miro_host.telemetry_receiver import TelemetryReceiver, unwrapped
from miro_protocol.frames import TelemetryFrame, encode, seal
from miro_protocol.table import TELEMETRY

CHARACTER_TICKS = 24_960  # ten bits of the robot's UART


def symbols(data, tick):
    return [(byte, True, tick + index * CHARACTER_TICKS) for index, byte in enumerate(data)]


def answer(tick, **fields):
    return symbols(encode(TelemetryFrame(**{"seq": 0, "slot": 0, **fields}), 3), tick)


def test_before_the_first_answer_nothing_is_known():
    assert TelemetryReceiver(3).last == [None, None, None]


def test_the_last_answer_of_each_robot_is_kept():
    receiver = TelemetryReceiver(3)
    receiver.receive(answer(1000, slot=0, seq=3, flags=8, status_left=0x80, accepted=4, rejected=1))
    receiver.receive(answer(800_000, slot=2, seq=5, position_left=10, position_right=0xFFF0))
    receiver.receive(answer(1_600_000, slot=0, seq=6, status_right=0x81, accepted=5, rejected=1))
    first, second, third = receiver.last
    assert second is None
    assert (first.seq, first.flags, first.status_left, first.status_right) == (6, 0, 0, 0x81)
    assert (first.accepted, first.rejected, first.tick) == (5, 1, 1_600_000)
    assert (third.position_left, third.position_right) == (10, -16)


def test_a_damaged_answer_changes_nothing():
    receiver = TelemetryReceiver(3)
    receiver.receive(answer(0, accepted=1))
    before = list(receiver.last)
    damaged = answer(800_000, accepted=2)
    byte, stop, tick = damaged[-1]
    damaged[-1] = (byte ^ 1, stop, tick)
    receiver.receive(damaged)
    assert receiver.last == before


@pytest.mark.parametrize("slot_and_flags", [0x03, 0x07, 0xC0])
def test_an_answer_that_no_robot_of_the_network_gives_changes_nothing(slot_and_flags):
    receiver = TelemetryReceiver(3)
    receiver.receive(symbols(seal(TELEMETRY, bytes([2 << 6, slot_and_flags, *[0] * 8])), 0))
    assert receiver.last == [None, None, None]
    assert receiver.decoder.valid == 1


@given(st.lists(st.integers(-32_767, 32_767), max_size=40))
def test_a_count_is_followed_through_every_wrap_while_steps_are_short(steps):
    true = known = 0
    for step in steps:
        true += step
        known = unwrapped(true & 0xFFFF, known)
        assert known == true


def test_saved_in_the_middle_of_an_answer_the_rest_is_understood():
    whole, first = TelemetryReceiver(3), TelemetryReceiver(3)
    sent = answer(0, slot=1, position_left=0xFFFF) + answer(800_000, slot=1, position_left=0xFFF0)
    whole.receive(sent)
    first.receive(sent[:25])
    second = TelemetryReceiver(3)
    restore(second, snapshot(first))
    second.receive(sent[25:])
    assert second.last == whole.last
    assert second.last[1].position_left == -16
    assert snapshot(second) == snapshot(whole)


def test_answers_of_another_network_are_not_taken_over():
    with pytest.raises(ValueError, match="answers of 5 robots where 3 belong"):
        restore(TelemetryReceiver(3), snapshot(TelemetryReceiver(5)))


def test_what_the_decoder_found_is_handed_on():
    receiver = TelemetryReceiver(3)
    (event,) = receiver.receive(answer(0, slot=1))
    assert event.start_tick == receiver.last[1].tick == 0
