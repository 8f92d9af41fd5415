"""What may be sent to a robot that can hurt: every window is judged, and the shipped firmware is the judge of that."""

import re
from contextlib import nullcontext
from functools import cache
from itertools import accumulate, pairwise

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_host.wheels import Wheels
from miro_protocol.crc import crc16
from miro_protocol.decoder import Decoder
from miro_protocol.events import Received
from miro_protocol.frames import ServiceFrame, TeamFrame, encode, seal
from miro_protocol.robot_receiver import Freshness
from miro_protocol.table import DOWNLINK, FRESH_AGAIN_TICKS, ROBOT_COUNTS
from miro_protocol.whitening import whiten
from miro_robot.lm629.commands import BY_NAME
from miro_sim.world.world import World
from mirotwin.desk.guard import DeskOptions, Guard
from mirotwin.runs.spec import silent_scenario
from mirotwin.shell.firmware_image import load_firmware
from tests.mirotwin.desk.rig import ROBOT
from tests.naive import guard as naive
from tests.vectors.paths import CASES


@pytest.fixture
def in_tmp(tmp_path, monkeypatch):
    """An empty folder that is the current one."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


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


# ---- streams that a guard let through once -------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "says"),
    [
        (
            "guard-min",
            "tick 1200000: robot 0 told -2.876 and -2.876 m/s (frame 1, 3 robots), which may move",
        ),
        ("guard-service", "tick 1200000: service frame with opcode 1 (frame 1, 3 robots), which may move"),
        ("guard-service-padding", "tick 1200000: service frame with opcode 1 (frame 1, 3 robots), which"),
        ("guard-gap", "tick 1740000: robot 0 told "),
    ],
)
def test_a_stream_with_a_frame_that_no_host_makes_is_refused_before_anything_is_sent(
    mirotwin, in_tmp, name, says
):
    said = mirotwin.refuses("replay", CASES / f"{name}.stream", "--port", ROBOT)
    assert says in said
    assert "give --allow-motion" in said
    assert not (in_tmp / "runs").exists()


@pytest.mark.parametrize("name", ["guard-min", "guard-gap"])
def test_a_wheel_that_a_frame_no_host_makes_drives_too_fast_is_refused(mirotwin, in_tmp, name):
    said = mirotwin.refuses("replay", CASES / f"{name}.stream", "--port", ROBOT, "--allow-motion")
    assert "at most 0.5 m/s are allowed; raise --max-speed" in said


def test_bytes_that_a_step_sends_are_judged_as_all_others(mirotwin, in_tmp):
    frame = encode(TeamFrame(0, 1, ((100, 0), (0, 0), (0, 0))), 3)
    path = in_tmp / "raw.scenario.toml"
    path.write_text(
        'name = "raw"\nduration_s = 1.0\n[[network]]\nhost = "silent"\n'
        'robot = [{slot = 0, reference = {kind = "line", drive_s = 0.0}}]\n'
        f'[[step]]\nsend = "bytes"\nhex = "{frame[:12].hex(" ")}"\n'
        f'[[step]]\npause_ms = 5\n[[step]]\nsend = "bytes"\nhex = "{frame[12:].hex(" ")}"\n'
    )
    code, out, err = mirotwin("test", path, "--port", ROBOT)
    assert code == 2, out + err
    said = (
        r"raw\.scenario\.toml: step 3: tick [0-9]+: robot 0 told 0\.009 and 0\.000 m/s \(frame 1, 3 robots\)"
    )
    assert re.search(f"{said}, which may move a real robot", out)


# ---- every window --------------------------------------------------------------------------------------------


def body(kind, seq, payload, robots):
    return bytes([kind * 64 + seq]) + bytes(payload).ljust(4 * robots, b"\0")


@cache
def _endings():
    """The last two bytes of a body by what they change in its CRC, which is linear."""
    at_rest = crc16(bytes(3))
    return {crc16(b"\0" + n.to_bytes(2, "little")) ^ at_rest: n.to_bytes(2, "little") for n in range(1 << 16)}


def ending_in(wanted, robots, start):
    """A frame whose CRC is these two characters on the air. `start`: its body but for the last two bytes."""
    form = DOWNLINK[robots]
    crc = int.from_bytes(whiten(bytes(form.body_size) + wanted)[-2:], "little")
    ending = _endings()[crc ^ crc16(bytes([form.layout]) + start + bytes(2))]
    frame = seal(form, start + ending)
    assert frame.endswith(wanted)
    return frame


@st.composite
def frames_of_any_content(draw):
    """Whole frames, of which a third lets robots stand."""
    robots, kind, seq = draw(st.sampled_from(ROBOT_COUNTS)), draw(st.integers(0, 3)), draw(st.integers(0, 63))
    payload = draw(
        st.one_of(
            st.just(b""),
            st.builds(lambda slot: bytes([slot]), st.integers(0, 6)),
            st.builds(lambda place: bytes(place) + b"\x01", st.integers(0, 4 * robots - 1)),
            st.just(b"\x00\x80" * (2 * robots)),
            st.binary(min_size=4 * robots, max_size=4 * robots),
        )
    )
    form = DOWNLINK[robots]
    return seal(form, body(kind, seq, payload, robots))[draw(st.sampled_from([0, 5, len(form.lead)])) :]


@st.composite
def overlapping_frames(draw):
    """A frame whose CRC is the sync of another."""
    robots, inner = draw(st.sampled_from(ROBOT_COUNTS)), draw(frames_of_any_content())
    start = body(draw(st.sampled_from([0, 1, 3])), draw(st.integers(0, 63)), b"", robots)[:-2]
    return ending_in(b"\x2d\xd4", robots, start) + inner[inner.find(b"\x2d\xd4") + 2 :]


@st.composite
def damaged_frames(draw):
    """Frames with characters lost, added or changed."""
    data = bytearray(draw(st.one_of(frames_of_any_content(), overlapping_frames())))
    for _ in range(draw(st.integers(1, 3))):
        place, change = draw(st.integers(0, len(data) - 1)), draw(st.integers(0, 3))
        if change == 0:
            data[place] ^= 1 << draw(st.integers(0, 7))
        elif change == 1:
            data.insert(place, draw(st.integers(0, 255)))
        elif change == 2:
            del data[place:]
        else:
            del data[: place + 1]
        if not data:
            break
    return bytes(data)


STANDING_FRAMES = st.builds(
    lambda kind, seq, robots: encode(TeamFrame(kind, seq, ((0, 0),) * robots), robots),
    st.sampled_from([0, 3]),
    st.integers(0, 63),
    st.sampled_from(ROBOT_COUNTS),
)
PIECES = st.one_of(
    STANDING_FRAMES,
    frames_of_any_content(),
    overlapping_frames(),
    damaged_frames(),
    st.binary(max_size=30),
)


@st.composite
def transmissions(draw):
    """Frames, damaged frames and noise, each alone or cut anywhere."""
    pieces = draw(st.lists(PIECES, min_size=1, max_size=6))
    if draw(st.booleans()):
        return pieces
    data = b"".join(pieces)
    cuts = sorted(draw(st.sets(st.integers(1, max(1, len(data))), max_size=8)))
    return [data[start:end] for start, end in pairwise([0, *cuts, None])]


def taken(guard, pieces):
    """The pieces that the guard lets through."""
    some = []
    for piece in pieces:
        try:
            guard.check(piece)
        except BadInput:
            continue
        some.append(piece)
    return some


@pytest.mark.parametrize("desk", [STANDING, MOVING], ids=["standing", "moving"])
@settings(max_examples=300)
@given(transmissions())
def test_what_is_refused_is_what_completes_a_window_that_is_not_allowed(desk, pieces):
    guard, sent = Guard(desk), b""
    limit = desk.max_speed * Wheels().units_per_m_s
    for piece in pieces:
        done = [one for one in naive.frames(sent + piece) if one[0] > len(sent)]
        bad = [
            content
            for _, robots, content in done
            if naive.fastest(content) > limit or not (desk.allow_motion or naive.stands(robots, content))
        ]
        if bad:
            with pytest.raises(BadInput):
                guard.check(piece)
        else:
            assert guard.check(piece) == [content[0] % 64 for _, _, content in done]
            sent += piece


def test_what_was_refused_does_not_count_as_sent():
    frame, guard = team((1, 1)), Guard(STANDING)
    guard.check(frame[:12])
    with pytest.raises(BadInput):
        guard.check(frame[12:] + b"\x55")
    with pytest.raises(BadInput):
        guard.check(frame[12:])


# ---- the robot itself is the judge ---------------------------------------------------------------------------

IDEAL = "network.radio={bit_error_rate=0.0, carrier='on', squelch=true}"
_LTRJ, _LFIL = BY_NAME["LTRJ"].opcode, BY_NAME["LFIL"].opcode
_ACCELERATION, _VELOCITY = 0x20, 0x08
"""In the low byte of LTRJ's control word: these follow, four bytes each."""


@cache
def robot_of(robots):
    """A world with a robot that is up in a network of so many, and its state."""
    world = World(silent_scenario((IDEAL, f"network.robots={robots}")), 0, load_firmware(None))
    world.run_for(100 * 24_000)
    return world, world.save()


def ordered(robots, pieces, pauses):
    """What of its gains, acceleration and velocities a robot's motor chips are told by these transmissions."""
    world, begun = robot_of(robots)
    world.load(begun)
    log = world.robot(0, 0).log
    first = log.end
    for piece, pause_ticks in zip(pieces, pauses, strict=False):
        if piece:
            world.inject(piece, at_tick=world.earliest_tick() + pause_ticks)
            world.run_to(world.networks[0].outbox.end_tick(world.networks[0].downlink.free_tick))
    world.run_for(3 * 24_000)
    told = set()
    for _, event in log.since(first, ("command",)):
        if event.opcode == _LFIL:
            told.add("gains")
        elif event.opcode == _LTRJ:
            if event.data[1] & _ACCELERATION:
                told.add("acceleration")
            if event.data[1] & _VELOCITY:
                told.add("0" if not any(event.data[-4:]) else "motion")
    return told


PAUSES = st.lists(
    st.sampled_from([0, 0, 24 * 15, 24 * 90, 24 * 5000, FRESH_AGAIN_TICKS]), min_size=9, max_size=9
)


@pytest.mark.parametrize("robots", ROBOT_COUNTS)
@settings(max_examples=60)
@example([seal(DOWNLINK[3], body(0, 1, b"\x00\x80" * 6, 3)), bytes(4)], [0] * 9)
@given(transmissions(), PAUSES)
def test_what_is_let_through_leaves_the_shipped_robot_standing_with_its_gains(robots, pieces, pauses):
    assert ordered(robots, taken(Guard(STANDING), pieces), pauses) <= {"0"}


@pytest.mark.parametrize("robots", ROBOT_COUNTS)
def test_the_robot_moves_where_no_guard_stands_between(robots):
    """Or the test above shows nothing."""
    fast = seal(DOWNLINK[robots], body(0, 1, b"\x00\x80" * (2 * robots), robots))
    gains = encode(ServiceFrame.filter(2, 0, 1, 2, 3, 4), robots)
    assert ordered(robots, [fast, gains], [0, 0]) == {"motion", "gains"}


# ---- stop frames ---------------------------------------------------------------------------------------------


def stop_frames(guard, robots, unsent=0):
    found = Decoder(robots).feed(guard.stop_frames(unsent))
    return [event for event in found if isinstance(event, Received)]


@pytest.mark.parametrize("robots", ROBOT_COUNTS)
@given(st.integers(0, 63), st.integers(0, 63))
def test_stop_frames_are_fresh_whatever_number_the_robot_took_last(robots, sent, accepted):
    guard, robot = Guard(MOVING), Freshness()
    guard.check(encode(TeamFrame(0, sent, ((100, 100),) * robots), robots))
    robot.judge(accepted, 0)
    frames = stop_frames(guard, robots)
    assert {event.message(robots).velocities for event in frames} == {((0, 0),) * robots}
    fresh = [robot.judge(event.seq, 0) for event in frames]
    assert any(fresh)
    if sent == accepted:
        assert all(fresh), "a robot that took the last frame stops by the first one"


def test_stop_frames_go_to_networks_of_every_size_that_was_spoken_to_the_last_one_first():
    guard = Guard(MOVING)
    guard.check(team((100, 100), seq=7))
    assert not stop_frames(guard, 5)
    guard.check(encode(TeamFrame(0, 40, ((100, 100),) * 5), 5))
    assert stop_frames(guard, 3)[0].seq == 8
    assert stop_frames(guard, 5)[0].seq == 41
    assert guard.stop_frames().startswith(encode(TeamFrame(0, 41, ((0, 0),) * 5), 5))


def test_before_anything_was_sent_robots_of_both_layouts_are_told_to_stop():
    for robots in ROBOT_COUNTS:
        assert stop_frames(Guard(STANDING), robots)


@pytest.mark.parametrize("robots", ROBOT_COUNTS)
@pytest.mark.parametrize("taken_back", [0, 3])
def test_stop_frames_complete_no_frame_that_was_begun(robots, taken_back):
    fast = b"\x10\x10" * (2 * robots)
    begun = ending_in(b"\x55\x55", robots, body(0, 5, fast, robots)[:-2])[:-2]
    guard = Guard(STANDING)
    guard.check(begun + b"\xaa" * taken_back)
    sent = begun + guard.stop_frames(taken_back)
    assert all(naive.stands(*one[1:]) for one in naive.frames(sent))
    assert stop_frames(guard, robots, taken_back)


def test_stop_frames_go_out_after_characters_that_were_made_so_that_any_between_would_complete_a_frame():
    fast = body(0, 5, b"\x10\x10" * 6, 3)[:-2]
    sent = b"".join(ending_in(bytes([character]) * 2, 3, fast)[6:-2] for character in range(256))
    guard = Guard(STANDING)
    guard.check(sent)
    assert stop_frames(guard, 3, len(sent))


@settings(max_examples=100)
@given(transmissions(), st.integers(0, 200))
def test_stop_frames_move_no_robot_wherever_what_was_sent_ends(pieces, unsent):
    guard = Guard(STANDING)
    sent = b"".join(taken(guard, pieces))
    stop = guard.stop_frames(unsent)
    for end in range(max(0, len(sent) - unsent), len(sent) + 1):
        cut = sent[max(0, end - 24) : end] + stop
        assert all(naive.stands(*one[1:]) for one in naive.frames(cut))
