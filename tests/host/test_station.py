"""The station's frames, read back with the decoder the robot's firmware is compared against."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.state import snapshot
from miro_host.station import Station
from miro_protocol.decoder import Decoder, Received
from miro_protocol.frames import ServiceFrame, TeamFrame, encode
from miro_protocol.table import FrameType, Opcode

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
