"""A folder of a user's own: what is an input, and what is said of the rest."""

import pytest

from miro_exact.bad_input import BadInput
from miro_protocol import stream
from miro_protocol.actions import Reset
from miro_protocol.frames import TeamFrame, encode
from miro_protocol.transmission import DOWN, Transmission
from miro_robot.harness.program import SESSION, Program
from mirotwin.fuzz.corpus import read_corpus

FRAME = encode(TeamFrame(0, 1, ((1, 2), (3, 4), (5, 6))), 3)


def characters(data):
    program = Program(SESSION)
    return bytes(program.character(place)[0] for place in range(program.read(data)))


def test_streams_become_inputs_and_files_of_a_fuzzer_are_taken_as_they_are(tmp_path):
    stream.write(tmp_path / "a.stream", [Transmission(100, DOWN, FRAME), Reset(10**6, 0, 0, 1)])
    (tmp_path / "id:000001,src:0").write_bytes(b"\x06\x01")
    (tmp_path / "queue").mkdir()
    (tmp_path / "queue" / "id:2").write_bytes(b"raw")
    (tmp_path / ".hidden").write_bytes(b"no")
    corpus = read_corpus(tmp_path, "session", 3)
    assert characters(corpus.inputs[0]) == FRAME
    assert corpus.inputs[1:] == (b"\x06\x01", b"raw")
    assert corpus.notes == ()


def test_a_recording_becomes_inputs(tmp_path, finished):
    (tmp_path / "run.mcap").write_bytes((finished / "run.mcap").read_bytes())
    corpus = read_corpus(tmp_path, "session", 3)
    assert len(corpus.inputs) == 1
    assert characters(corpus.inputs[0]).count(FRAME[:8]) >= 5


def test_foreign_files_are_passed_over_in_one_line(tmp_path):
    (tmp_path / "good").write_bytes(b"x")
    for name in ("a.png", "b.c", "c.json", "d.txt"):
        (tmp_path / name).write_bytes(b"something")
    corpus = read_corpus(tmp_path, "session", 3)
    assert corpus.inputs == (b"x",)
    assert corpus.notes == (
        f"--corpus {tmp_path}: passed over 4 files that are no inputs: a.png, b.c, c.json, ..",
    )


def test_a_damaged_stream_is_named_with_its_line(tmp_path):
    (tmp_path / "good").write_bytes(b"x")
    (tmp_path / "bad.stream").write_text("# mirotwin stream 1\n12 > zz\n")
    (note,) = read_corpus(tmp_path, "session", 3).notes
    assert note.startswith(f"--corpus: passed over: {tmp_path}/bad.stream:2:")


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda folder: None, "there is no such folder"),
        (lambda folder: folder.write_text("x"), "is no folder"),
        (lambda folder: folder.mkdir(), "holds no file"),
        (
            lambda folder: (folder.mkdir(), (folder / "a.png").write_bytes(b"x")),
            "no input among 1 file",
        ),
        (lambda folder: (folder.mkdir(), (folder / "a").write_bytes(b"")), "no input among 1 file"),
        (lambda folder: (folder.mkdir(), (folder / "a").write_bytes(bytes(9000))), "no input among 1 file"),
    ],
)
def test_a_folder_without_inputs_is_refused(tmp_path, make, said):
    make(tmp_path / "corpus")
    with pytest.raises(BadInput, match=said):
        read_corpus(tmp_path / "corpus", "session", 3)
