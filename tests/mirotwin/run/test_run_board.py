"""`mirotwin run` of a board: its files, its table, and runs that go on as if they had never stopped."""

import json
import re

import pytest

from miro_robot.firmware import image_path
from mirotwin.recording.reader import read
from tests.mirotwin.board_files import BOARD, SCENARIO, board_folder

PERIOD_S = 2_400_000 / 11_059_200
ROM = """
chip = "stc89c52"
crystal_hz = 11_059_200
pull_ups = ["P1"]
[parts.rom]
part = "at24c"
pins = { scl = "P1.5", sda = "P1.6" }
"""


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    return board_folder(tmp_path_factory.mktemp("board"))


@pytest.fixture(scope="module")
def finished(mirotwin, scenario):
    mirotwin.succeeds("run", scenario, "--out", scenario.parent / "finished")
    return scenario.parent / "finished"


def test_a_run_of_a_board_writes_a_recording_and_a_summary(finished):
    assert sorted(path.name for path in finished.iterdir()) == ["run.mcap", "summary.json"]
    summary = json.loads((finished / "summary.json").read_bytes())
    recording = read(finished / "run.mcap")
    assert summary["digest"] == recording.digest
    assert summary["simulated_s"] == pytest.approx(3 * PERIOD_S)
    assert (summary["board"], summary["chip"], summary["crystal_hz"]) == ("lamp", "stc89c52", 11_059_200)
    assert summary["serial"] == {"to_board": 0, "from_board": 1}
    assert summary["parts"]["key.closed"] is True


def test_the_recording_holds_the_whole_board_its_bytes_and_the_values_of_its_parts(finished):
    recording = read(finished / "run.mcap")
    assert (recording.source.crystal_hz, recording.source.scenario_name) == (11_059_200, "lamp")
    assert "[board.parts.key]" in recording.source.scenario_text
    assert [sent.data for period in recording.periods for sent in period.wire] == [b"R"]
    assert [list(one.values) for period in recording.periods for one in period.values] == [
        ["key.pressed", "key.closed", "lamp.on", "lamp.flashes"]
    ] * 3


def test_the_same_run_gives_the_same_bytes(mirotwin, finished, scenario, tmp_path):
    assert mirotwin("run", scenario, "--out", tmp_path / "again", "--quiet") == (0, "", "")
    assert (tmp_path / "again" / "run.mcap").read_bytes() == (finished / "run.mcap").read_bytes()


@pytest.mark.parametrize(("baud", "told"), [(9400, None), (9000, 9600)])
def test_a_board_whose_terminal_has_another_rate_than_its_firmware_is_told(mirotwin, tmp_path, baud, told):
    path = board_folder(tmp_path, board=f"{BOARD}[serial]\nbaud = {baud}\n")
    out = mirotwin.succeeds("run", path, "--out", tmp_path / "out")
    assert json.loads((tmp_path / "out" / "summary.json").read_bytes())["serial"].get("firmware_baud") == told
    assert ("the firmware has 9600 baud, [serial] has another rate" in " ".join(out.split())) == bool(told)


def test_the_table_names_what_matters(mirotwin, scenario, tmp_path):
    out = mirotwin.succeeds("run", scenario, "--out", tmp_path / "out")
    for word in (
        "lamp, seed 0",
        "stc89c52, 11.0592 MHz",
        "real time",
        "the last: 'R'",
        "pressed True",
        "lamp.hex",
    ):
        assert word in out


def test_of_a_long_value_the_table_shows_the_beginning(mirotwin, scenario, tmp_path):
    board = tmp_path / "rom.board.toml"
    board.write_text(ROM)
    image = scenario.with_name("lamp.hex")
    out = mirotwin.succeeds("run", board, "--firmware", image, "--for", "1ms", "--out", tmp_path / "out")
    shown = "".join(out.split())
    assert f"content'{'ff' * 50}'..(512characters)" in shown


def test_a_board_file_is_run_with_an_image_for_a_time(mirotwin, scenario, tmp_path):
    board, image = scenario.with_name("lamp.board.toml"), scenario.with_name("lamp.hex")
    for time in ("200ms", "2211840t"):
        out = tmp_path / time
        mirotwin.succeeds("run", board, "--firmware", image, "--for", time, "--out", out, "-q")
        assert json.loads((out / "summary.json").read_bytes())["simulated_s"] == pytest.approx(PERIOD_S)


def test_a_run_that_is_resumed_has_the_bits_of_one_that_never_stopped(mirotwin, finished, scenario, tmp_path):
    mirotwin.succeeds("run", scenario, "--out", tmp_path / "a", "--save-at", "100ms", "--to", "300ms")
    saved = tmp_path / "a" / "at-1105920.world"
    out = mirotwin.succeeds("run", scenario, "--out", tmp_path / "b", "--resume", saved)
    assert read(tmp_path / "b" / "run.mcap").digest == read(finished / "run.mcap").digest
    assert "resumed" in out
    assert "--to 55296000t (5000.000 ms): the run goes from" in mirotwin.refuses(
        "run", scenario, "--out", tmp_path / "c", "--to", "5s"
    )


def test_what_is_only_for_robots_or_missing_is_refused(mirotwin, scenario, tmp_path):
    board = scenario.with_name("lamp.board.toml")
    assert "--frames is for robots" in mirotwin.refuses("run", scenario, "--frames", tmp_path / "frames")
    assert "--record is for robots" in mirotwin.refuses("run", scenario, "--record", "full")
    assert "give --firmware IMAGE.hex" in mirotwin.refuses("run", board, "--for", "1s")
    assert "give --for TIME" in mirotwin.refuses("run", board, "--firmware", scenario.with_name("lamp.hex"))


def test_a_fault_ends_the_run_with_its_own_code(mirotwin, tmp_path):
    path = board_folder(tmp_path, program="MOV SP,#0FFh\nNOP\nDB 0A5h\nSJMP $")
    line = mirotwin.ends(3, "run", path, "--out", tmp_path / "out", "-q")
    assert "firmware fault: firmware executed the undefined opcode A5 at 0x0004" in line
    assert "/fault" in str((tmp_path / "out" / "run.mcap").read_bytes())


def test_faults_are_counted_also_where_the_board_no_longer_keeps_them(mirotwin, tmp_path):
    text = SCENARIO.replace("duration_s = 0.5", "duration_s = 0.005\nstop_on_fault = false")
    path = board_folder(tmp_path, text, program="again:\nDB 0A5h\nSJMP again")
    line = mirotwin.ends(3, "run", path, "--out", tmp_path / "out", "-q")
    summary = json.loads((tmp_path / "out" / "summary.json").read_bytes())
    assert summary["firmware"]["faults"] > 1000
    assert f"(and {summary['firmware']['faults'] - 1} more)" in line


CLOCK = """
from miro_exact.state import TICK
from miro_robot.parts.keys import STRONG, PartKeys, Pin
from miro_robot.parts.part import Part


class Metronome(PartKeys, frozen=True, kw_only=True, tag="metronome"):
    PINS = (Pin("pin", STRONG),)
    READS = {"beats": "so far"}

    def make(self, place):
        return MetronomePart(self, place)


class MetronomePart(Part):
    STATE = {"beats": TICK}

    def __init__(self, keys, place):
        Part.__init__(self, keys, place)
        self.beats = 0

    def start(self, tick):
        self.next_tick = tick + 1000

    def due(self, tick):
        self.beats += 1
        if self.beats == 6000:
            raise RuntimeError("worn out")
        self.next_tick = tick + 1000
"""


def test_a_part_of_ones_own_is_run_and_its_failure_ends_the_run_in_one_line(mirotwin, tmp_path):
    board = 'crystal_hz = 11_059_200\n[parts.beat]\npart = "metronome"\npins = { pin = "P1.0" }\n'
    path = board_folder(tmp_path, "board = 'lamp.board.toml'\nfirmware = 'lamp.hex'\nduration_s = 1", board)
    own = tmp_path / "metronome.py"
    own.write_text(CLOCK)
    words = ("run", path, "--out", tmp_path / "out", "-q")
    assert re.search(
        r"parts\.beat\.part: 'metronome' is not one of the choices; .* one of your own: --part FILE\.py:CLASS",
        mirotwin.refuses(*words),
    )
    err = mirotwin.ends(2, *words, "--part", f"{own}:Metronome")
    assert "the run broke off after 2 control periods" in err
    assert "part 'beat' (metronome), tick 6000000: RuntimeError: worn out (" in err
    recording = read(tmp_path / "out" / "run.part.mcap")
    assert recording.source.plugins[0].startswith("part metronome: metronome.py:Metronome, sources ")
    out = mirotwin("replay", tmp_path / "out" / "run.part.mcap", "--part", f"{own}:Metronome")
    assert (out[0], "the board does the same as recorded in all 2 control periods" in out[1]) == (0, True)
    mirotwin.refuses("replay", tmp_path / "out" / "run.part.mcap")


def test_the_board_of_the_robot_is_run_resumed_and_replayed(mirotwin, tmp_path):
    words = ("run", "miro", "--firmware", image_path(), "--for", "200ms", "-q")
    mirotwin.succeeds(*words, "--out", tmp_path / "a", "--save-at", "50ms")
    mirotwin.succeeds(*words, "--out", tmp_path / "b", "--resume", tmp_path / "a" / "at-1200000.world")
    assert read(tmp_path / "a" / "run.mcap").digest == read(tmp_path / "b" / "run.mcap").digest
    assert "the board does the same" in mirotwin.succeeds("replay", tmp_path / "a")
