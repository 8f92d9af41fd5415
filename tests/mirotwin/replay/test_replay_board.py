"""`mirotwin replay` and `diff` of boards: recordings, streams, cases."""

import pytest

from miro_protocol import stream
from miro_protocol.actions import Put
from miro_sim.scenario.board_scenario import load_any
from mirotwin.recording.reader import read
from mirotwin.recording.recorder import source_of
from mirotwin.recording.track import Tracks
from mirotwin.runs.run import Run
from mirotwin.runs.spec import RunSpec
from mirotwin.shell.firmware_image import image_for
from tests.mirotwin.board_files import BIT_TICKS, BOARD, SCENARIO, board_folder

STREAM = """# mirotwin stream 3
#: board = "lamp.board.toml"
#: crystal_hz = 11059200
0 * key.pressed = true
120000 > 68 69
400000 * key.pressed = false
"""
WITH_BAUD = BOARD.replace("[straps]", "[serial]\nbaud = 9600\n[straps]")


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    return board_folder(tmp_path_factory.mktemp("board"))


@pytest.fixture(scope="module")
def recorded(scenario):
    """A recording with bytes and puts from outside; the length of a bit is the receiver's."""
    text = load_any(str(scenario))
    run = Run(RunSpec.of(text, image_for(text)))
    world = run.world

    def move():
        world.run_to(200_000)
        world.inject(b"hi")
        world.do(Put(2_500_000, 0, 0, "key.pressed", False))
        while not world.finished:
            world.step()

    path = scenario.with_name("run.mcap")
    with path.open("wb") as file:
        run.record(file, source_of(text, world), Tracks(), move=move)
    return path


def test_a_recording_of_a_board_holds_what_was_sent_and_put(recorded):
    recording = read(recorded)
    wire = [(sent.direction, sent.data) for period in recording.periods for sent in period.wire]
    assert sorted(wire) == [("<", b"R"), ("<", b"hi"), (">", b"hi")]
    assert recording.source.bit_ticks == BIT_TICKS
    assert [action for period in recording.periods for action in period.actions] == [
        Put(2_500_000, 0, 0, "key.pressed", False)
    ]


def test_a_replay_does_the_same_to_the_last_digest(mirotwin, recorded):
    out = mirotwin.succeeds("replay", recorded)
    assert "the board does the same as recorded in all 3 control periods" in out


def test_another_image_or_setting_differs_with_the_value_of_a_part_first(mirotwin, recorded, scenario):
    line = mirotwin.ends(4, "replay", recorded, "--firmware", scenario.with_name("inverted.hex"))
    assert "the replay differs in control period 0, tick 2400000 (0.217014 s), /net0/values lamp.on:" in line
    assert "their states differ from tick" in line
    line = mirotwin.ends(4, "replay", recorded, "--set", "put.key.pressed=false", "-q")
    assert "their states differ from tick 0" in line
    assert "board.parts[0].next_tick (key): " in line


def test_bytes_alone_can_be_compared_and_wheels_cannot(mirotwin, recorded, scenario):
    mirotwin.succeeds(
        "replay", recorded, "--firmware", scenario.with_name("inverted.hex"), "--compare", "bytes"
    )
    assert "compare bits or bytes" in mirotwin.refuses("replay", recorded, "--compare", "wheels")


def test_two_recordings_are_compared(mirotwin, recorded, scenario, tmp_path):
    assert "the recordings hold the same" in mirotwin.succeeds("diff", recorded, recorded)
    mirotwin.succeeds("run", scenario, "--out", tmp_path / "other", "-q")
    assert "/net0/wire" in mirotwin(*("diff", recorded, tmp_path / "other"))[1]


def test_a_stream_names_its_board_and_puts_values(mirotwin, tmp_path):
    board_folder(tmp_path, board=WITH_BAUD)
    path = tmp_path / "hi.stream"
    path.write_text(STREAM)
    assert "passes" in mirotwin.succeeds("replay", path, "--firmware", tmp_path / "lamp.hex")
    assert "is for a board, which has no firmware of its own" in mirotwin.refuses("replay", path)
    out = mirotwin("diff", tmp_path / "lamp.hex", tmp_path / "inverted.hex", "--on", path)
    assert (out[0], "values lamp.on" in out[2]) == (4, True)


WRONG = [
    (
        "crystal_hz = 11059200",
        "crystal_hz = 12000000",
        "its ticks are of a crystal of 12000000 Hz, and the board has",
    ),
    ("#: crystal_hz = 11059200\n", "", "its ticks are of a crystal of 24000000 Hz"),
    ("lamp.board.toml", "none.board.toml", "none.board.toml: no such file"),
    ("lamp.board.toml", "../x.board.toml", "lies outside of the folder"),
    ("0 * key.pressed", "0 * key.presed", "tick 0: key.presed: nothing can be put at 'presed'"),
    ("= false", "= 7", "expected true or false, got a whole number"),
    ("120000 > 68", "120000 > 68\n120001 > 68", "begin before those before them end"),
    ("400000 * ", "400000 *@0/1 ", "is not for the board, which is alone on network 0"),
    ("400000 * key.pressed = false", "400000 *@0 radio down", "a board is on a wire, which has no radio"),
    (
        "#: crystal",
        '#: scenario = "fig6"\n#: crystal',
        "is a scenario of robots, and the stream is for a board",
    ),
]


@pytest.mark.parametrize(("old", "new", "what"), WRONG, ids=range(len(WRONG)))
def test_what_is_wrong_with_a_stream_is_one_line(mirotwin, tmp_path, old, new, what):
    board_folder(tmp_path, board=WITH_BAUD)
    path = tmp_path / "hi.stream"
    path.write_text(STREAM.replace(old, new))
    line = mirotwin.refuses("replay", path, "--firmware", tmp_path / "lamp.hex")
    assert what in line
    assert "hi.stream" in line or "none.board.toml" in line


def test_a_stream_needs_the_length_of_a_bit(mirotwin, scenario, tmp_path):
    board_folder(tmp_path)
    path = tmp_path / "hi.stream"
    path.write_text(STREAM)
    assert "says no bit_ticks, and the board no baud" in mirotwin.refuses(
        "replay", path, "--firmware", tmp_path / "lamp.hex"
    )


def test_a_put_in_a_stream_for_robots_is_refused(mirotwin, tmp_path):
    path = tmp_path / "robots.stream"
    path.write_text("# mirotwin stream 3\n5 * eyes.distance_cm = 60\n")
    assert "is of a part or a pin of a board, and robots have none" in mirotwin.refuses("replay", path)


def test_a_case_of_a_board_gives_its_verdict_again(mirotwin, tmp_path):
    never = 'never_happens = { condition = { event = "heard", byte = 82 }, until_tick = 5_000_000 }\n'
    path = board_folder(tmp_path, SCENARIO + "[expect]\n" + never)
    code, out, _ = mirotwin("test", path, "--artifacts", tmp_path / "left")
    assert (code, "page: " in out) == (1, True)
    (case,) = (tmp_path / "left").glob("*/case.stream")
    given = stream.read(case)
    assert given.header.crystal_hz == 11_059_200
    assert given.header.scenario["board"]["parts"]["key"]["part"] == "button"
    assert "fails as recorded: never_happens" in mirotwin.ends(1, "replay", case)
    silent = board_folder(tmp_path, program="SJMP $").with_name("lamp.hex")
    code, out, _ = mirotwin("replay", case, "--firmware", silent)
    assert (code, "cured: never_happens passes" in out) == (0, True)
