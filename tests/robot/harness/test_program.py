"""What a fuzz input says to a robot."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_protocol.decoder import Decoder, Received
from miro_protocol.frames import ServiceFrame, TeamFrame, encode
from miro_robot.harness.program import BYTES, FRAMES, MOST_CHARACTERS, MOST_TICKS, SESSION, Program

MS = 24_000


def played(program, data):
    """(value, bad stop bit, reset before it, pause before it) of each character."""
    return [program.character(place) for place in range(program.read(data))]


def wire(program, data):
    return bytes(value for value, *_ in played(program, data))


def test_bytes_are_characters_without_a_pause():
    assert played(Program(BYTES), b"\x00\x55\xff") == [(value, False, False, 0) for value in (0, 0x55, 0xFF)]


def test_a_program_opens_with_characters_that_follow_each_other_from_its_start():
    program = Program(SESSION)
    program.read(b"\x09\x02abc")
    assert program.opens_with(b"ab")
    assert program.opens_with(b"abc")
    assert not program.opens_with(b"ac")
    program.read(b"\x09\x00a")
    assert program.opens_with(b"a")
    assert not program.opens_with(b"abc")
    program.read(b"\x09\x00a\x0a\x00\x09\x00b")
    assert not program.opens_with(b"ab")


@pytest.mark.parametrize("robots", [3, 5])
def test_frames_are_sealed_as_the_protocol_encodes_them(robots):
    pairs = tuple((100 * slot - 7, -32767 + slot) for slot in range(robots))
    payload = b"".join(value.to_bytes(2, "little", signed=True) for pair in pairs for value in pair)
    assert wire(Program(FRAMES, robots=robots), b"\x00" + payload) == encode(TeamFrame(0, 1, pairs), robots)
    assert wire(Program(FRAMES, robots=robots), b"\xc7" + payload) == encode(TeamFrame(3, 8, pairs), robots)


def test_a_velocity_that_no_host_sends_goes_out_as_the_next_one():
    sent = wire(Program(FRAMES), b"\x00\x00\x80")
    assert sent == encode(TeamFrame(0, 1, ((-32767, 0), (0, 0), (0, 0))), 3)


def test_a_session_sends_own_velocities_questions_and_service_frames():
    data = b"\x00\x01\x02\x03\x04" + b"\x03\x05\x00" + b"\x05"
    stopped = (0, 0)
    expected = (
        encode(TeamFrame(0, 1, (stopped, (0x0201, 0x0403), stopped)), 3)
        + encode(TeamFrame(3, 2, (stopped, (5, 0x500), stopped)), 3)
        + encode(ServiceFrame.ping(3, 0), 3)
    )
    program = Program(SESSION, slot=1)
    assert wire(program, b"\x00\x01\x02\x03\x04\x03\x05\x00\x00\x05\x05" + bytes(12)) == expected
    assert program.frames == 3
    assert (
        len(wire(program, data)) == 2 * 23
    )  # the end of the input is the end of the last frame's velocities


def test_damage_cut_and_a_bad_stop_bit_concern_the_next_frame_only():
    whole = wire(Program(SESSION), b"\x00\x07\x00\x08\x00\x00\x07\x00\x08\x00")
    program = Program(SESSION)
    damaged = wire(program, b"\x0c\x09\x81" + b"\x00\x07\x00\x08\x00" * 2)
    assert [place for place in range(46) if damaged[place] != whole[place]] == [9]
    assert damaged[9] ^ whole[9] == 0x81
    assert wire(program, b"\x0d\x05" + b"\x00\x07\x00\x08\x00" * 2) == whole[:5] + whole[23:]
    bad = [
        place
        for place, one in enumerate(played(program, b"\x0e\x16" + b"\x00\x07\x00\x08\x00" * 2))
        if one[1]
    ]
    assert bad == [22]


def test_again_repeats_the_bytes_of_the_last_frame():
    sent = wire(Program(SESSION), b"\x00\x07\x00\x08\x00\x08")
    assert sent[:23] == sent[23:]
    assert wire(Program(SESSION), b"\x08\x08") == b""


def test_pauses_add_up_and_raw_characters_follow():
    program = Program(SESSION)
    assert played(program, b"\x0a\x00\x0b\x01\x09\x01\xaa\xbb") == [
        (0xAA, False, False, MS // 10 + 6 * MS),
        (0xBB, False, False, 0),
    ]
    assert program.trailing_ticks == 0
    program.read(b"\x09\x00\xaa\x0b\xff")
    assert program.trailing_ticks == 768 * MS


def test_a_reset_comes_before_the_next_character_and_leaves_time_to_come_up():
    program = Program(SESSION)
    assert played(program, b"\x0f\x09\x00\xaa") == [(0xAA, False, True, 5 * MS + 48)]
    program.read(b"\x09\x00\xaa\x0f")
    assert program.ends_with_reset()
    assert program.trailing_ticks == 5 * MS + 48


def test_another_wire_format_repairs_bodies():
    program = Program(SESSION, repair=lambda body: b"\xc0" + body + b"\xc0")
    assert wire(program, b"\x00\x01\x11\x22") == b"\xc0\x11\x22\xc0"


@given(
    st.binary(max_size=600),
    st.sampled_from([BYTES, FRAMES, SESSION]),
    st.sampled_from([(3, 0), (5, 4), (3, 7)]),
)
def test_any_bytes_are_a_program_within_its_limits(data, how, place):
    robots, slot = place
    program = Program(how, slot, robots)
    first = played(program, data)
    assert len(first) <= MOST_CHARACTERS
    assert all(pause >= 0 for *_, pause in first)
    assert program.length <= MOST_TICKS + program.character_ticks
    assert program.length == len(first) * program.character_ticks + sum(pause for *_, pause in first)
    assert played(program, memoryview(data)) == first


@given(st.binary(max_size=300))
def test_every_frame_that_is_sealed_is_valid(data):
    program = Program(FRAMES)
    sent = wire(program, data)
    found = [event for event in Decoder(3).feed(sent, 0) if isinstance(event, Received)]
    assert len(found) == program.frames
