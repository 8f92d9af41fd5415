"""What was sent becomes inputs, and the target hears the same of them; and a folder of inputs of a user's own."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_protocol import stream
from miro_protocol.actions import Reset
from miro_protocol.frames import ServiceFrame, TeamFrame, encode
from miro_protocol.transmission import DOWN, UP, Transmission
from miro_robot.harness.program import FRAMES, INPUTS, SESSION, Program
from mirotwin.fuzz.corpus import read_corpus
from mirotwin.fuzz.inputs import PAUSE_TICKS, SILENCE_TICKS, TOGETHER, input_of, inputs_of, seeds, sent, talks

NUMBERS = st.integers(-32767, 32767)


def sessions(happened):
    return inputs_of("session", happened, 3)


@st.composite
def messages(draw, robots=3):
    seq = draw(st.integers(0, 63))
    if draw(st.booleans()):
        pairs = draw(st.tuples(*[st.tuples(NUMBERS, NUMBERS)] * robots))
        return TeamFrame(draw(st.sampled_from([0, 3])), seq, pairs)
    return ServiceFrame.filter(
        seq, draw(st.integers(0, robots - 1)), *draw(st.tuples(*[st.integers(0, 9)] * 4))
    )


def heard(kind, data, robots=3):
    """The characters of an input, and the pause before each."""
    program = Program(kind, 0, robots)
    found = [program.character(place) for place in range(program.read(data))]
    return bytes(one[0] for one in found), [one[3] for one in found]


@given(st.lists(st.tuples(messages(), st.integers(0, 2_000_000)), min_size=1, max_size=8))
def test_a_session_says_the_same_characters_with_pauses_that_are_right_to_a_step(said):
    transmissions, tick = [], 0
    for message, pause in said:
        transmissions.append(Transmission(tick + pause, DOWN, encode(message, 3)))
        tick = transmissions[-1].end_tick
    characters, pauses = heard(SESSION, input_of("session", transmissions, 3))
    assert characters == b"".join(one.data for one in transmissions)
    size = len(transmissions[0].data)
    for place, (_, pause) in enumerate(said[1:], 1):
        assert abs(pauses[place * size] - pause) <= PAUSE_TICKS
    assert pauses[0] == 0


@given(st.binary(min_size=1, max_size=100))
def test_characters_that_are_no_frame_are_said_as_they_are(data):
    assert heard(SESSION, input_of("session", [Transmission(0, DOWN, data)], 3))[0] == data


@pytest.mark.parametrize("kind", ["bytes", "session"])
def test_characters_before_and_behind_a_frame_stay_where_they_were(kind):
    data = b"\x01\x02" + encode(TeamFrame(0, 5, ((1, 2), (3, 4), (5, 6))), 3) + b"\x03"
    said = [Transmission(0, DOWN, data), Transmission(10**6, DOWN, b"c")]
    assert heard(INPUTS.index(kind), input_of(kind, said, 3))[0] == data + b"c"


def test_a_long_silence_is_as_long():
    frame = encode(TeamFrame(0, 1, ((1, 1),) * 3), 3)
    one = Transmission(0, DOWN, frame)
    other = Transmission(one.end_tick + 700 * 24_000, DOWN, frame)
    _, pauses = heard(SESSION, input_of("session", [one, other], 3))
    assert abs(pauses[len(frame)] - 700 * 24_000) <= SILENCE_TICKS


@given(st.lists(messages(), min_size=1, max_size=6))
def test_frames_keep_their_payloads_and_types(said):
    wire = [Transmission(0, DOWN, encode(message, 3)) for message in said]
    characters, _ = heard(FRAMES, input_of("frames", wire, 3))
    size = len(wire[0].data)
    assert len(characters) == size * len(said)
    if all(
        (b.seq - a.seq) % 64 in range(1, 9) for a, b in zip([TeamFrame(0, 0, ()), *said], said, strict=False)
    ):
        assert characters == b"".join(one.data for one in wire)


def test_a_reset_is_said_in_a_session():
    happened = [Transmission(0, DOWN, b"a"), Reset(10**6, 0, 0, 1), Reset(10**6 + 48, 0, 0, 0)]
    happened += [Transmission(2 * 10**6, DOWN, b"b")]
    program = Program(SESSION)
    count = program.read(input_of("session", happened, 3))
    assert [program.character(place)[2] for place in range(count)] == [False, True]


def test_a_long_recording_becomes_many_short_inputs_and_answers_are_left_out():
    frames = [
        Transmission(10**6 * place, DOWN, encode(TeamFrame(0, place % 64, ((place, 1),) * 3), 3))
        for place in range(30)
    ]
    frames.append(Transmission(10**8, UP, b"answer"))
    found = inputs_of("session", frames, 3)
    assert len(found) == -(-30 // TOGETHER)
    said = b"".join(heard(SESSION, one)[0] for one in found)
    assert said == b"".join(one.data for one in frames[:-1])


@pytest.mark.parametrize("kind", INPUTS)
@pytest.mark.parametrize(("robots", "slot"), [(3, 0), (3, 2), (5, 4)])
def test_each_built_in_seed_is_read_as_what_it_says(kind, robots, slot):
    for talk in talks(robots, slot):
        wire = sent(talk, robots)
        data = input_of(kind, wire, robots)
        assert data in seeds(kind, robots, slot)
        characters, _ = heard(INPUTS.index(kind), data, robots)
        assert len(characters) == sum(len(one.data) for one in wire)
        if kind != "frames":
            assert characters == b"".join(one.data for one in wire)


# A folder of a user's own

FRAME = encode(TeamFrame(0, 1, ((1, 2), (3, 4), (5, 6))), 3)


def test_streams_become_inputs_and_files_of_a_fuzzer_are_taken_as_they_are(tmp_path):
    stream.write(tmp_path / "a.stream", [Transmission(100, DOWN, FRAME), Reset(10**6, 0, 0, 1)])
    (tmp_path / "id:000001,src:0").write_bytes(b"\x06\x01")
    (tmp_path / "queue").mkdir()
    (tmp_path / "queue" / "id:2").write_bytes(b"raw")
    (tmp_path / ".hidden").write_bytes(b"no")
    inputs, notes = read_corpus(tmp_path, sessions)
    assert heard(SESSION, inputs[0])[0] == FRAME
    assert inputs[1:] == [b"\x06\x01", b"raw"]
    assert notes == []


def test_a_recording_becomes_inputs(tmp_path, finished):
    (tmp_path / "run.mcap").write_bytes((finished / "run.mcap").read_bytes())
    inputs, _ = read_corpus(tmp_path, sessions)
    assert len(inputs) == 1
    assert heard(SESSION, inputs[0])[0].count(FRAME[:8]) >= 5


def test_foreign_files_are_passed_over_in_one_line(tmp_path):
    (tmp_path / "good").write_bytes(b"x")
    for name in ("a.png", "b.c", "c.json", "d.txt"):
        (tmp_path / name).write_bytes(b"something")
    inputs, notes = read_corpus(tmp_path, sessions)
    assert inputs == [b"x"]
    assert notes == [f"--corpus {tmp_path}: passed over 4 files that are no inputs: a.png, b.c, c.json, .."]


def test_a_damaged_stream_is_named_with_its_line(tmp_path):
    (tmp_path / "good").write_bytes(b"x")
    (tmp_path / "bad.stream").write_text("# mirotwin stream 1\n12 > zz\n")
    _, (note,) = read_corpus(tmp_path, sessions)
    assert note.startswith(f"--corpus: passed over: {tmp_path}/bad.stream:2:")


@pytest.mark.parametrize(
    ("files", "said"),
    [
        (None, "there is no such folder"),
        ({}, "holds no file"),
        ({"a.png": b"x"}, "no input among 1 file"),
        ({"a": b""}, "no input among 1 file"),
        ({"a": bytes(9000)}, "no input among 1 file"),
    ],
)
def test_a_folder_without_inputs_is_refused(tmp_path, files, said):
    folder = tmp_path / "corpus"
    if files is not None:
        folder.mkdir()
    for name, data in (files or {}).items():
        (folder / name).write_bytes(data)
    with pytest.raises(BadInput, match=said):
        read_corpus(folder, sessions)


def test_a_file_in_the_place_of_the_folder_is_refused(tmp_path):
    (tmp_path / "corpus").write_text("x")
    with pytest.raises(BadInput, match="is no folder"):
        read_corpus(tmp_path / "corpus", sessions)
