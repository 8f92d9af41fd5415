"""`mirotwin export` of a board: a stream that plays the run again, a capture, CSV of nets and values."""

import csv
from itertools import pairwise

import pytest

from miro_protocol import stream
from miro_protocol.pcapng_reader import iterate
from mirotwin.recording import reader
from mirotwin.runs.job import load_job
from tests.mirotwin import program
from tests.mirotwin.board_files import SCENARIO, board_folder
from tests.mirotwin.report.page.test_board_page import STEPS

EXPECT = "[expect]\nno_fault = true\n"


@pytest.fixture(scope="module")
def lamp(tmp_path_factory, mirotwin):
    """A folder with a board, its image and its recorded run."""
    scenario = board_folder(tmp_path_factory.mktemp("lamp"), SCENARIO + EXPECT + STEPS)
    mirotwin.succeeds("run", scenario, "--out", scenario.parent / "run", "-q")
    return scenario.parent


@pytest.fixture
def export(lamp, tmp_path, mirotwin):
    def call(name, *options, given=None):
        code, _, err = mirotwin("export", given or lamp / "run/run.mcap", "--out", tmp_path / name, *options)
        assert code == 0, err
        return tmp_path / name, err

    return call


def test_the_stream_of_a_board_gives_its_run_again_bit_for_bit(export, lamp):
    file, said = export("run.stream", "-q")
    assert said == ""
    recorded = reader.read(lamp / "run/run.mcap")
    job = load_job(str(file), str(lamp / "lamp.hex"))
    again = job.run(job.end_tick)
    assert again.world.digest == recorded.digest
    assert [one.values for one in again.periods] == [one.values for one in recorded.periods]


def test_the_stream_holds_characters_each_way_and_puts(export):
    text = export("run.stream", "-q")[0].read_text()
    for line in (" < 52\n", " > 68 69\n", " * key.pressed = false\n", " < 68 69\n"):
        assert line in text
    assert len(stream.parse(text).entries) == 4


def test_replay_judges_what_the_stream_expects(export, lamp, mirotwin):
    file, _ = export("run.stream", "-q")
    assert mirotwin("replay", file, "--firmware", lamp / "lamp.hex", "-q")[0] == 0
    assert "give --firmware" in mirotwin.refuses("replay", file)


def test_a_stream_of_a_board_stays_what_it_is(export, lamp, tmp_path):
    first, _ = export("first.stream", "-q")
    again, _ = export("again.stream", "-q", "--firmware", lamp / "lamp.hex", given=first)
    kept = [line for line in first.read_text().splitlines() if " < " not in line]
    assert again.read_text().splitlines() == kept


def test_a_capture_holds_the_characters_and_says_what_it_leaves_out(export):
    file, said = export("run.pcapng")
    with open(file, "rb") as given:
        sent = list(iterate(given.read, "run.pcapng"))
    assert b"".join(one.data for one in sent if one.direction == "<") == b"Rhi"
    assert [one.data for one in sent if one.direction == ">"] == [b"hi"]
    assert "what was put is left out" in said
    assert "ticks of its 11059200 Hz crystal are given in those of 24000000 Hz" in said


def test_csv_holds_each_edge_and_each_value_that_changed(export):
    file, _ = export("run.csv", "-q")
    tables = {path.name for path in file.parent.iterdir()}
    assert tables == {
        f"run-{name}.csv" for name in ("changes", "net0-puts", "net0-values", "net0-wire", "period")
    }
    with open(file.with_name("run-changes.csv"), newline="") as changes:
        rows = list(csv.DictReader(changes))
    ticks = [int(row["tick"]) for row in rows]
    assert ticks == sorted(ticks)
    lamp = [row["value"] for row in rows if (row["kind"], row["name"]) == ("net", "P2.0")]
    assert set(pairwise(lamp)) == {("0", "1"), ("1", "0")}, "levels alternate"
    pressed = [(row["time_s"], row["value"]) for row in rows if row["name"] == "key.pressed"]
    assert [value for _, value in pressed] == ["True", "False"]
    assert float(pressed[1][0]) == pytest.approx(0.0129, abs=1e-3)


def test_foxglove_gets_the_values_as_they_are_recorded(export):
    file, said = export("fox.mcap", "-q")
    assert "is of a board: `/net0/values` has the values of its parts, and there is no scene" in said
    assert b"/net0/values" in file.read_bytes()


def test_the_stream_of_a_board_has_one_table_its_changes(export, lamp):
    first, _ = export("first.stream", "-q")
    file, _ = export("again.csv", "-q", "--firmware", lamp / "lamp.hex", given=first)
    recorded, _ = export("run.csv", "-q", "--channel", "changes")
    assert file.read_text() == recorded.read_text()


def test_a_board_from_a_pipe_is_refused_in_one_line(lamp, tmp_path):
    with open(lamp / "run/run.mcap", "rb") as given:
        done = program.run("export", "-", "--out", tmp_path / "x.csv", stdin=given)
    said = "mirotwin: error: standard input: --as csv: a board is run again for it; give a file, not -\n"
    assert (done.returncode, done.stderr) == (2, said)
