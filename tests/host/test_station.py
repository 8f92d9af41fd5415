"""Frames of a network: the station's, read back with the decoder of the firmware's tests, and the answers."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_host.station import Station
from miro_host.telemetry_receiver import TelemetryReceiver, unwrapped
from miro_protocol.decoder import Decoder, Received
from miro_protocol.frames import ServiceFrame, TeamFrame, TelemetryFrame, encode, seal
from miro_protocol.table import TELEMETRY, FrameType, Opcode
from tests.states import restore, snapshot

SIZES = st.sampled_from([3, 5])
VALUES = st.integers(-32767, 32767)
REST = (0, 0)


def decoded(station, frames):
    """Messages a robot gets out of the frames' bytes in one stream."""
    decoder = Decoder(station.n)
    messages = []
    for data in frames:
        decoder.gap()
        messages += [e.message(station.n) for e in decoder.feed(data) if isinstance(e, Received)]
    return messages


@given(SIZES, st.booleans(), st.data())
def test_every_frame_decodes_to_what_was_commanded(n, telemetry, data):
    station = Station(n, telemetry)
    teams = data.draw(st.lists(st.lists(st.tuples(VALUES, VALUES), min_size=n, max_size=n), max_size=5))
    kind = FrameType.TEAM_ASK if telemetry else FrameType.TEAM
    expected = [TeamFrame(kind, seq, tuple(team)) for seq, team in enumerate(teams)]
    frames = [station.frame(team) for team in teams]
    assert frames == [encode(message, n) for message in expected]
    assert decoded(station, frames) == expected


@pytest.mark.parametrize("n", [3, 5])
def test_sequence_numbers_count_through_all_types_and_all_robots_are_asked(n):
    station = Station(n)
    station.request(0, Opcode.PING)
    messages = decoded(station, [station.frame([REST] * n) for _ in range(130)])
    assert [m.seq for m in messages] == [k % 64 for k in range(130)]
    asked = [m.seq % n for m in messages if isinstance(m, TeamFrame)]
    assert all(set(asked[k : k + 2 * n]) == set(range(n)) for k in range(len(asked) - 2 * n))


def test_all_frames_of_a_network_have_the_same_length():
    station = Station(5)
    station.request(4, Opcode.FILTER, (1, 2, 3, 4))
    assert {len(station.frame([REST] * 5)) for _ in range(20)} == {31}


@given(st.lists(st.integers(0, 3), max_size=40))
def test_at_most_every_eighth_frame_is_a_service_frame_and_none_is_lost(requests):
    station = Station(3, telemetry=False)
    asked, frames = 0, []
    for count in requests:
        for _ in range(count):
            station.request(asked % 3, Opcode.ACCELERATION, (asked + 1,))
            asked += 1
        frames.append(station.frame([REST] * 3))
    for _ in range(8 * asked):
        frames.append(station.frame([REST] * 3))
    messages = decoded(station, frames)
    at = [k for k, m in enumerate(messages) if isinstance(m, ServiceFrame)]
    assert [messages[k].values for k in at] == [(k + 1,) for k in range(asked)]
    assert [messages[k].slot for k in at] == [k % 3 for k in range(asked)]
    assert all(later - earlier >= 8 for earlier, later in pairwise(at))


def test_the_first_request_goes_out_with_the_next_frame():
    station = Station(3)
    station.frame([REST] * 3)
    station.request(2, Opcode.PING)
    assert decoded(station, [station.frame([REST] * 3)]) == [ServiceFrame(1, 2, Opcode.PING)]


def test_what_may_not_be_sent_is_refused_and_uses_nothing_up():
    station = Station(3)
    before = snapshot(station)
    with pytest.raises(ValueError, match="slot 1"):
        station.frame([REST, (-32768, 0), REST])
    with pytest.raises(ValueError, match="must be 3 pairs"):
        station.frame([REST] * 2)
    with pytest.raises(ValueError, match="slot"):
        station.request(3, Opcode.PING)
    with pytest.raises(ValueError, match="values"):
        station.request(0, Opcode.FILTER, (1, 2))
    assert snapshot(station) == before
    with pytest.raises(ValueError, match="n = 4"):
        Station(4)


def test_a_station_that_is_saved_goes_on_with_its_numbers_and_the_services_that_wait():
    def frames(station):
        return [station.frame([(1, 2)] * 3) for _ in range(20)]

    whole, other = Station(3), Station(3)
    for count in range(3):
        whole.frame([(1, 2)] * 3)
        whole.request(count, Opcode.FILTER, (1, 2, 3, count))
    restore(other, snapshot(whole))
    assert frames(other) == frames(whole)
    assert snapshot(other) == snapshot(whole)


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
