"""`mirotwin run`: the files it writes, and that nothing is half-written whatever happens."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario.file import load
from miro_sim.world.world import World
from mirotwin.recording import reader as recording_reader
from tests import children
from tests.mirotwin.conftest import SHORT, hex_file

UNDEFINED_OPCODE = b"\xa5"


def test_a_run_writes_a_recording_a_figure_and_a_summary(finished):
    assert sorted(path.name for path in finished.iterdir()) == ["figure.svg", "run.mcap", "summary.json"]
    summary = json.loads((finished / "summary.json").read_bytes())
    recording = recording_reader.read(finished / "run.mcap")
    assert summary["digest"] == recording.digest
    assert (summary["scenario"], summary["seed"]) == ("short", 5)
    assert summary["simulated_s"] == len(recording.periods) * 800_800 / 24e6
    assert recording.source.scenario_text == SHORT
    assert recording.source.seed == 5
    assert recording.source.firmware == image_path().read_bytes()
    assert recording.source.firmware_sha256 == summary["firmware"]["sha256"]
    assert [(one["network"], one["slot"]) for one in summary["robots"]] == [(0, 0), (0, 2)]


def test_recording_changes_nothing_and_leaves_nothing_out(finished, short):
    world = World(load(str(short)).scenario, 5, load_hex(image_path()))
    periods = []
    while not world.finished:
        periods.append(world.step())
    assert recording_reader.read(finished / "run.mcap").periods == tuple(periods)


def test_the_same_run_gives_the_same_bytes_and_a_full_recording_the_same_digest(
    mirotwin, finished, short, tmp_path
):
    assert mirotwin("run", short, "--seed", 5, "--out", tmp_path / "again", "--quiet") == (0, "", "")
    assert mirotwin("run", short, "--seed", 5, "--out", tmp_path / "full", "-q", "--record", "full")[0] == 0
    for name in ("run.mcap", "figure.svg"):
        assert (tmp_path / "again" / name).read_bytes() == (finished / name).read_bytes()
    full = recording_reader.read(tmp_path / "full" / "run.mcap")
    assert full.periods == recording_reader.read(finished / "run.mcap").periods
    assert (tmp_path / "full" / "run.mcap").stat().st_size > 2 * (finished / "run.mcap").stat().st_size


def test_the_table_names_what_matters(mirotwin, short, tmp_path):
    out = mirotwin.succeeds("run", short, "--out", tmp_path / "[out]")
    for word in ("short, seed 0", "real time", "frames sent", "instructions", "digest", "[out]"):
        assert word in out


def test_a_finished_run_in_the_folder_of_its_scenario_and_seed_is_replaced_and_nothing_else(
    mirotwin, short, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "runs" / "short-3"
    again = ("run", short, "--seed", 3, "-q")
    assert mirotwin(*again)[0] == 0
    (folder / "notes.txt").write_text("mine")
    assert mirotwin(*again, "--no-figure")[0] == 0
    assert sorted(path.name for path in folder.iterdir()) == ["notes.txt", "run.mcap", "summary.json"]
    assert "the folder is not empty" in mirotwin.refuses(*again, "--out", folder)
    (folder / "run.mcap").rename(folder / "run.part.mcap")
    assert "parts of an interrupted command (run.part.mcap)" in mirotwin.refuses(*again)
    (folder / "run.part.mcap").unlink()
    assert "the folder is not empty (notes.txt, summary.json)" in mirotwin.refuses(*again)
    assert mirotwin(*again, "--force")[0] == 0


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (":00000001FF\n", ": holds no bytes; "),
        ("hello\n", ":1: is not Intel HEX: "),
        (":03000000020000FC\n:00000001FF\n", ":1: bad checksum FC, expected FB; "),
        (":01200000A53A\n:00000001FF\n", ":1: byte at 0x2000 does not fit 8192 bytes; "),
    ],
)
def test_firmware_that_is_none_is_refused_before_anything_is_written(
    mirotwin, short, tmp_path, content, expected
):
    image = tmp_path / "broken.ihx"
    image.write_text(content)
    err = mirotwin.refuses("run", short, "--firmware", image, "--out", tmp_path / "out")
    assert f"{image}{expected}" in err
    assert [path.name for path in tmp_path.iterdir()] == ["broken.ihx"]


def test_a_firmware_fault_ends_the_run_with_code_3_and_complete_files(mirotwin, short, tmp_path):
    image = hex_file(tmp_path / "faulty.ihx", UNDEFINED_OPCODE)
    err = mirotwin.ends(3, "run", short, "--firmware", image, "--out", tmp_path / "out", "-q")
    assert "mirotwin: firmware fault: net0/robot0: firmware executed the undefined opcode A5 at 0x" in err
    recording = recording_reader.read(tmp_path / "out" / "run.mcap")
    assert len(recording.periods) == 1
    assert json.loads((tmp_path / "out" / "summary.json").read_bytes())["firmware"]["faults"] >= 1
    assert (tmp_path / "out" / "figure.svg").exists()


SHORT_RESET = bytes.fromhex("00 C2A5 D2A5 80FE")  # NOP; CLR P2.5; SETB P2.5; SJMP $
SYMBOLS = """
CSEG                                00000000    00000007 =           7. bytes (REL,CON,CODE)
C:   00000000  _main                              a
C:   00000001  _pulse                             a
"""


def test_a_fault_of_the_board_names_limit_tick_instruction_and_symbol(mirotwin, short, tmp_path):
    image = hex_file(tmp_path / "bad.ihx", SHORT_RESET)
    image.with_suffix(".map").write_text(SYMBOLS)
    code, _, err = mirotwin("run", short, "--firmware", image, "--out", tmp_path / "out", "-q")
    limit = "an LM629 bus timing limit (/RST pulse 500 ns, 1333 ns needed)"
    first = f"firmware fault: net0/robot0: firmware violated {limit}"
    assert (code, err.splitlines()[0]) == (3, f"mirotwin: {first} at 0x0003 in _pulse, tick 36")


def test_a_scenario_may_count_faults_and_go_on(mirotwin, short, tmp_path):
    patient = tmp_path / "patient.toml"
    patient.write_text(short.read_text().replace("duration_s", "stop_on_fault = false\nduration_s"))
    image = hex_file(tmp_path / "bad.ihx", SHORT_RESET)
    err = mirotwin.ends(3, "run", patient, "--firmware", image, "--out", tmp_path / "out", "-q")
    assert err.count("tick 36") == 2
    summary = json.loads((tmp_path / "out" / "summary.json").read_bytes())
    assert summary["firmware"]["faults"] == 2
    assert summary["simulated_s"] > 0.2


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
@pytest.mark.parametrize("arguments", [["scenarios"], ["scenarios", "show", "fig6"], ["--help"], ["info"]])
def test_output_that_cannot_be_written_is_one_line_on_stderr(arguments):
    program = [sys.executable, "-c", "from mirotwin.commands import main; main()", *arguments]
    with Path("/dev/full").open("wb") as full:
        done = children.run(program, stdout=full, stderr=subprocess.PIPE, text=True, timeout=60)
    assert done.returncode == 2
    assert done.stderr == "mirotwin: error: reading or writing failed: No space left on device\n"


@pytest.mark.parametrize("command", [("run", "--out", "out", "-q"), ("fw", "profile")])
def test_parameters_with_which_nothing_can_be_computed_are_bad_input(
    mirotwin, tmp_path, monkeypatch, command
):
    monkeypatch.chdir(tmp_path)
    Path("far.toml").write_text(SHORT + "drive.chassis.track_m = 1e-200\n")
    words = list(command)
    words.insert(2 if command[0] == "fw" else 1, "far.toml")
    code, out, err = mirotwin(*words)
    assert (code, out) == (2, "")
    assert err == (
        "mirotwin: error: far.toml: network[0].robot[1].drive.chassis.track_m: 1e-200 is out of range; must be 0.001"
        " to 10 in metres\n"
    )
    assert [path.name for path in tmp_path.iterdir()] == ["far.toml"]


def test_the_shortest_duration_is_one_control_period(mirotwin, tmp_path):
    scenario = tmp_path / "shortest.toml"
    scenario.write_text(SHORT.replace("duration_s = 0.2", "duration_s = 1e-9"))
    assert mirotwin("run", scenario, "--out", tmp_path / "out", "-q") == (0, "", "")
    assert len(recording_reader.read(tmp_path / "out" / "run.mcap").periods) == 1


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["--seed", "abc"], "Invalid value for '--seed': 'abc' is not a whole number."),
        (["--out", ""], "Invalid value for '-o' / '--out': the path is empty."),
        (["--firmware", ""], "Invalid value for '--firmware': the path is empty."),
        (["--firmware", "no.ihx"], "no.ihx: there is no such file; build it, or give the path of an .ihx or .hex file"),
        (["--firmware", "/dev/null"], "/dev/null: is not a regular file; copy the content to a file first"),
    ],
)  # fmt: skip
def test_an_option_that_means_nothing_is_refused_in_plain_words(mirotwin, short, arguments, expected):
    assert expected in mirotwin.refuses("run", short, *arguments)


@pytest.mark.parametrize("arguments", [["info"], ["scenarios"]])
def test_a_table_in_a_pipe_has_no_trailing_blanks(mirotwin, arguments):
    lines = mirotwin(*arguments)[1].splitlines()
    assert lines
    assert [line for line in lines if line != line.rstrip()] == []


def test_a_run_that_takes_the_default_place_of_another_one_says_so(mirotwin, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    short = ("run", "fig6", "-q", "--no-figure", "--set", "duration_s=0.2")
    assert mirotwin(*short) == (0, "", "")
    assert mirotwin(*short) == (0, "", "")
    err = mirotwin.ends(0, *short, "--set", "network.radio.bit_error_rate=0.01")
    assert err.startswith("mirotwin: note: runs/fig6-0 held a run with other bits (digest ")
    assert err.endswith("..), now replaced; --out keeps both\n")
