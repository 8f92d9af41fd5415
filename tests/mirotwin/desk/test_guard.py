"""What may be sent to a robot that can hurt."""

from contextlib import nullcontext
from itertools import accumulate, pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_host.wheels import Wheels
from miro_protocol.decoder import Decoder
from miro_protocol.events import Received
from miro_protocol.frames import ServiceFrame, TeamFrame, encode
from mirotwin.desk.guard import DeskOptions, Guard

STANDING = DeskOptions(port="COM1")
MOVING = DeskOptions(port="COM1", allow_motion=True, max_speed=0.5)


def team(*pairs, seq=0):
    return encode(TeamFrame(0, seq, (*pairs, *[(0, 0)] * (3 - len(pairs)))), 3)


@pytest.mark.parametrize("place", range(3))
@pytest.mark.parametrize("pair", [(1, 0), (0, -1)])
def test_the_smallest_velocity_of_any_robot_is_refused_where_nothing_may_move(place, pair):
    pairs = [(0, 0)] * 3
    pairs[place] = pair
    with pytest.raises(BadInput, match=f"robot {place} told .* may move a real robot; .*--allow-motion"):
        Guard(STANDING).check(team(*pairs))


@pytest.mark.parametrize(
    "frame", [ServiceFrame.filter(0, 1, 1, 2, 3, 4), ServiceFrame.acceleration(0, 1, 5973)]
)
def test_gains_and_accelerations_count_as_motion(frame):
    with pytest.raises(BadInput, match="service frame with opcode"):
        Guard(STANDING).check(encode(frame, 3))
    Guard(MOVING).check(encode(frame, 3))


def test_what_lets_robots_stand_is_always_allowed():
    guard = Guard(STANDING)
    guard.check(team())
    guard.check(encode(ServiceFrame.ping(1, 0), 3))
    guard.check(bytes(range(256)))


@given(st.integers(-32767, 32767), st.integers(0, 2), st.booleans())
def test_a_wheel_is_refused_above_the_limit_and_only_there(word, slot, right):
    pairs = [(0, 0)] * 3
    pairs[slot] = (0, word) if right else (word, 0)
    fast = abs(word) / Wheels().units_per_m_s > MOVING.max_speed
    refused = pytest.raises(BadInput, match=r"at most 0\.5 m/s are allowed; raise --max-speed")
    with refused if fast else nullcontext():
        Guard(MOVING).check(team(*pairs))


@given(st.lists(st.integers(1, 5), max_size=4))
def test_a_frame_in_pieces_is_read_as_one(sizes):
    data, guard = b"\x55" + team((1, 1)), Guard(STANDING)
    *pieces, last = [data[start:end] for start, end in pairwise([0, *accumulate(sizes), None])]
    for piece in pieces:
        guard.check(piece)
    with pytest.raises(BadInput):
        guard.check(last)


def test_a_frame_for_networks_of_five_is_read_too():
    with pytest.raises(BadInput, match="robot 4 told"):
        Guard(STANDING).check(encode(TeamFrame(0, 0, ((0, 0),) * 4 + ((9, 9),)), 5))


@given(st.integers(0, 63))
def test_stop_frames_are_fresh_after_what_was_sent(seq):
    guard = Guard(MOVING)
    guard.check(team((100, 100), seq=seq))
    found = [event for event in Decoder(3).feed(guard.stop_frames()) if isinstance(event, Received)]
    assert [(event.seq - seq) % 64 for event in found] == [1, 2, 3]
    assert {event.message(3).velocities for event in found} == {((0, 0),) * 3}


def test_before_anything_was_sent_robots_of_both_layouts_are_told_to_stop():
    frames = Guard(STANDING).stop_frames()
    for robots in (3, 5):
        assert [event for event in Decoder(robots).feed(frames) if isinstance(event, Received)]
