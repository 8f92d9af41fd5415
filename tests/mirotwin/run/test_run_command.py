"""`mirotwin run`: the files it writes, frames as pictures, and runs that go on as if they had never stopped."""

import json
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
from PIL import Image

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario.file import load
from miro_sim.world.world import World
from mirotwin.camera.picture import taken
from mirotwin.recording import reader as recording_reader
from mirotwin.recording.reader import read
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


def test_json_and_junit_have_the_run_as_a_case_with_the_place_of_its_failure(mirotwin, tmp_path):
    words = ("--set", "duration_s=0.5", "--expect", "settles_within_s=0.1", "--out", tmp_path / "out", "-q")
    code, out, _ = mirotwin("run", "fig6", *words, "--json", "--junit", tmp_path / "j.xml")
    document = json.loads(out)
    (case,) = document["cases"]
    assert (code, document["verdict"], case["verdict"], case["at_ms"]) == (1, "failed", "failed", 100.1)
    assert document["summary"] == json.loads((tmp_path / "out" / "summary.json").read_text())
    (element,) = ElementTree.parse(tmp_path / "j.xml").iter("testcase")
    assert (element.get("file"), element.get("line")) == (case["file"], str(case["line"]))
    _, out, _ = mirotwin("debug", tmp_path / "out", "--at", f"{case['tick']}t", "-x", "where")
    assert f" {Path(case['file']).name}:{case['line']} in " in out.splitlines()[-1]
    code, out, _ = mirotwin(*case["reproduce"].split()[1:], "--out", tmp_path / "again", "-q")
    assert code == 1


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


def test_the_papers_theory_is_a_line_of_the_table_for_laws_that_it_is_about(mirotwin, tmp_path):
    words = ("run", "fig7", "--set", "duration_s=0.5", "--no-figure", "--out")
    _, polar, _ = mirotwin(*words, tmp_path / "polar")
    _, other, _ = mirotwin(*words, tmp_path / "other", "--set", "law=kanayama")
    assert "theory " in polar
    assert "theory " not in other
    assert json.loads((tmp_path / "other/summary.json").read_text())["theory"]["effort_m_s2"] > 0.0


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
    key = "network[0].robot[1].drive.chassis.track_m"
    said = f"far.toml: {key}: 1e-200 is out of range; must be 0.001 to 10 in metres"
    assert mirotwin.refuses(*words) == said
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


def test_a_run_that_takes_the_default_place_of_another_one_says_so(mirotwin, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    short = ("run", "fig6", "-q", "--no-figure", "--set", "duration_s=0.2")
    assert mirotwin(*short) == (0, "", "")
    assert mirotwin(*short) == (0, "", "")
    err = mirotwin.ends(0, *short, "--set", "network.radio.bit_error_rate=0.01")
    assert err.startswith("mirotwin: note: runs/fig6-0 held a run with other bits (digest ")
    assert err.endswith("..), now replaced; --out keeps both\n")


LEARNING = (
    *("--set", "camera.self_calibration=lines", "--set", "network.robot.controller={law = 'body_frame'}"),
    *("--set", "network.robot.estimator={kind = 'ekf'}", "--set", "duration_s=2.0"),
)


def test_what_a_host_learnt_of_camera_and_wheels_stands_beside_the_truth(mirotwin, tmp_path):
    out = mirotwin.succeeds("run", "fig6", "--out", tmp_path, "--no-figure", *LEARNING)
    summary = json.loads((tmp_path / "summary.json").read_bytes())
    (camera,) = summary["calibrations"]
    assert camera["worst_learnt_cm"] < 0.1 < 2.3 < camera["worst_told_cm"] < 2.5
    focal = camera["parameters"]["focal_px"]
    assert abs(focal["learnt"] - focal["true"]) < 0.2 < 2.0 < abs(focal["told"] - focal["true"])
    (wheels,) = summary["wheels"]
    for side in ("left", "right"):
        assert abs(wheels[side]["learnt"] - wheels[side]["true"]) < 0.006
    assert "2.40 cm wrong at worst" in out
    assert "radius left " in out


def test_a_host_that_learns_nothing_says_nothing_of_it(mirotwin, tmp_path):
    mirotwin("run", "fig6", "--out", tmp_path, "--no-figure", "--set", "duration_s=0.2")
    summary = json.loads((tmp_path / "summary.json").read_bytes())
    assert "calibrations" not in summary
    assert "wheels" not in summary


FRAMES = [f"frame-{number:06d}.png" for number in range(6)]


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_every_frame_is_saved_and_the_run_is_the_same(mirotwin, short, finished, tmp_path):
    arguments = ("run", short, "--seed", 5, "-q", "--out", tmp_path / "out")
    assert mirotwin(*arguments, "--frames", tmp_path / "frames") == (0, "", "")
    assert names(tmp_path / "frames") == FRAMES
    assert (tmp_path / "out" / "run.mcap").read_bytes() == (finished / "run.mcap").read_bytes()
    world = World(load(str(short)).scenario, 5, load_hex(image_path()))
    for number, name in enumerate(FRAMES):
        world.run_to(number * CONTROL_PERIOD_TICKS + 1)
        expected = taken(world.networks[0].sight.eye)
        with Image.open(tmp_path / "frames" / name) as image:
            assert (image.size, image.mode, image.format) == ((320, 240), "RGB", "PNG")
            assert image.tobytes() == expected.image().tobytes()


def test_frames_of_several_networks_have_the_network_in_their_names(mirotwin, tmp_path):
    two = tmp_path / "two.toml"
    two.write_text(
        SHORT.replace("duration_s = 0.2", "duration_s = 0.04")
        + '[[network]]\nhost = "silent"\n[[network.robot]]\nslot = 1\nstart_error_x_cm = 60.0\n'
        + 'reference.kind = "line"\n'
    )
    mirotwin.succeeds("run", two, "--out", tmp_path / "out", "--frames", tmp_path / "out" / "frames", "-q")
    frames = [f"net{network}-frame-00000{number}.png" for network in (0, 1) for number in (0, 1)]
    assert names(tmp_path / "out" / "frames") == frames


def test_a_folder_with_content_is_left_alone_unless_it_is_to_be_replaced(mirotwin, short, tmp_path):
    folder = tmp_path / "frames"
    folder.mkdir()
    for name in ("frame-000000.png", "frame-000999.png", "frame-000003.part.png", "mine.png"):
        (folder / name).write_text("before")
    arguments = ("run", short, "-q", "--no-figure", "--out", tmp_path / "out", "--frames", folder)
    there = "frame-000000.png, frame-000003.part.png, frame-000999.png, .."
    remedy = "choose another with --frames, or replace frame-*.png in it with --force"
    assert mirotwin.refuses(*arguments) == f"{folder}: the folder is not empty ({there}); {remedy}"
    assert (len(names(folder)), (tmp_path / "out").exists()) == (4, False)
    assert mirotwin(*arguments, "--force") == (0, "", "")
    assert names(folder) == [*FRAMES, "mine.png"]
    assert (folder / "mine.png").read_text() == "before"


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("--frames", "{short}"), "{short}: exists and is not a folder; choose another folder with --frames"),
        (
            ("--frames", "frames", "--set", "camera.kind=gaussian"),
            "{short}: camera.kind: this camera renders no pixels; choose kind =",
        ),
        (
            ("--frames", "--record-frames"),
            "Invalid value for '--frames': the path is missing before --record-frames; a file of this name is ./--rec",
        ),
        (("--frames", ""), "Invalid value for '--frames': the path is empty."),
    ],
)
def test_frames_that_cannot_be_saved_are_refused_before_anything_is_written(
    mirotwin, short, tmp_path, monkeypatch, options, expected
):
    monkeypatch.chdir(tmp_path)
    err = mirotwin.refuses("run", short, *(option.format(short=short) for option in options))
    assert err.startswith(expected.format(short=short))
    assert names(tmp_path) == []


ROOM = "No space left on device; make room, or choose another folder with --frames\n"


@pytest.mark.parametrize(
    ("raised", "code", "said"),
    [
        (KeyboardInterrupt(), 130, "mirotwin: interrupted\n"),
        (OSError(28, "No space left on device"), 2, ROOM),
    ],
)
def test_a_run_that_breaks_off_leaves_whole_frames_only(
    mirotwin, short, tmp_path, monkeypatch, raised, code, said
):
    write = Path.write_bytes

    def breaking(path, data):
        if path.name == "frame-000003.part.png":
            write(path, data[:100])
            raise raised
        return write(path, data)

    monkeypatch.setattr(Path, "write_bytes", breaking)
    folder = tmp_path / "frames"
    words = ("run", short, "-q", "--out", tmp_path / "out", "--frames", folder)
    assert mirotwin.ends(code, *words).endswith(said)
    assert names(folder) == FRAMES[:3]
    assert json.loads((tmp_path / "out" / "summary.part.json").read_bytes())["complete"] is False


QUIET = ("--no-figure", "-q")


def resumed(mirotwin, short, folder, at="100ms", words=()):
    """The folders of a run that saved its world, and of one that went on from there."""
    whole, rest = folder / "whole", folder / "rest"
    mirotwin.succeeds("run", short, "--out", whole, "--save-at", at, *words, *QUIET)
    (saved,) = whole.glob("at-*.world")
    mirotwin.succeeds("run", short, "--out", rest, "--resume", saved, *words, *QUIET)
    return whole, rest


@pytest.fixture(scope="module")
def halves(mirotwin, short, tmp_path_factory):
    return resumed(mirotwin, short, tmp_path_factory.mktemp("halves"))


@pytest.mark.parametrize("at", ["2402400t", "2500001t", "100ms"])
def test_a_resumed_run_has_the_digests_of_one_that_never_stopped(mirotwin, tmp_path, short, at):
    whole, rest = resumed(mirotwin, short, tmp_path, at, ("--seed", 5))
    periods, more = read(whole / "run.mcap").periods, read(rest / "run.mcap").periods
    assert more[1:] == periods[more[1].index :]
    assert more[0].digest == periods[more[0].index].digest
    assert more[0].index in (3, 4)
    mirotwin.succeeds("replay", rest / "run.mcap", "-q")


@pytest.mark.parametrize("to", ["4000000t", "4004000t", "4804800t"])
def test_a_resumed_run_that_is_told_where_to_end_has_the_digest_of_an_unbroken_one(
    mirotwin, tmp_path, short, to
):
    whole, rest = resumed(mirotwin, short, tmp_path, words=("--to", to))
    digests = [json.loads((run / "summary.json").read_text())["digest"] for run in (whole, rest)]
    assert digests[0] == digests[1]
    mirotwin.succeeds("replay", rest / "run.mcap", "-q")


def test_figures_of_a_resumed_run_say_what_time_they_cover(mirotwin, tmp_path, short):
    whole, rest = tmp_path / "whole", tmp_path / "rest"
    _, table, _ = mirotwin("run", short, "--out", whole, "--save-at", "100ms", "--no-figure")
    assert "rms (0.00 s to 0.20 s)" in table
    assert "resumed  " not in table
    saved = whole / "at-2400000.world"
    _, table, _ = mirotwin("run", short, "--out", rest, "--resume", saved, "--no-figure")
    assert "rms (0.10 s to 0.20 s)" in table
    assert "0.10 s to 0.20 s in " in table
    assert "resumed   at 0.10 s" in table
    summary = json.loads((rest / "summary.json").read_text())
    assert summary["resumed_s"] == 2_402_400 / 24e6
    assert summary["realtime_factor"] == (summary["simulated_s"] - summary["resumed_s"]) / summary["wall_s"]


def test_a_resumed_run_is_not_compared_with_a_whole_one(mirotwin, halves):
    said = mirotwin.refuses("diff", *(run / "run.mcap" for run in halves))
    assert "a run that was resumed: it begins with control period 3" in said


@pytest.mark.parametrize(
    "command",
    [["replay"], ["fw", "trace"], ["fw", "coverage"], ["fw", "vcd", "--out", "a.vcd"]],
    ids=" ".join,
)
def test_what_was_before_a_resumed_run_cannot_be_looked_at(mirotwin, halves, command):
    said = mirotwin.refuses(*command, halves[1] / "run.mcap", "--to", "100ms")
    assert said.endswith(": --to 2400000t: the run begins at tick 2402400; look later")


def test_a_resumed_run_is_looked_at_from_its_begin_on(mirotwin, halves):
    assert mirotwin("replay", halves[1] / "run.mcap", "--to", "2402401t")[0] == 0


def test_a_run_ends_where_it_is_told_to(mirotwin, tmp_path, short):
    assert mirotwin("run", short, "--out", tmp_path / "a", "--to", "2500000t", *QUIET)[0] == 0
    summary = json.loads((tmp_path / "a" / "summary.json").read_text())
    assert summary["simulated_s"] == 2_500_000 / 24e6
    assert len(read(tmp_path / "a" / "run.mcap").periods) == 3


@pytest.mark.parametrize(
    ("to", "frames", "verdict"),
    [
        ("10ms", 1, "not judged"),
        ("150ms", 1, "passed"),
        ("150ms", 99, "not judged"),
        ("4804800t", 99, "failed"),
    ],
)
def test_a_run_that_is_cut_short_does_not_fail_by_frames_to_come(
    mirotwin, tmp_path, short, to, frames, verdict
):
    expect = f"frames_accepted_min={frames}"
    code, _, err = mirotwin("run", short, "--out", tmp_path / "a", "--to", to, "--expect", expect, *QUIET)
    assert (code, f"expectation {verdict}: " in err) == (int(verdict == "failed"), verdict != "passed")
    found = json.loads((tmp_path / "a" / "summary.json").read_text())["expectations"]
    assert verdict in [one["verdict"] for one in found if one["name"] == "frames_accepted_min"]


@pytest.mark.parametrize(
    ("arguments", "what"),
    [
        (("--save-at", "1s"), "--save-at 24000000t (1000.000 ms): the run goes from tick 0 (0.000 ms) to tick "
         "4804800 (200.200 ms); give a time between"),
        (("--to", "0t"), "--to 0t (0.000 ms): the run goes from tick 0 "),
        (("--save-at", "2s", "--to", "100ms"), "the run goes from tick 0 (0.000 ms) to tick 2400000 (100.000 ms)"),
        (("--resume", "{saved}", "--seed", "6"), "cannot be resumed: the saved world has seed 5, this world has 6"),
        (("--resume", "{saved}", "--seed", "5", "--save-at", "1000t"), "goes from tick 2402400 (100.100 ms) to tick"),
        (("--resume", "{short}"), "cannot be resumed: not a saved world, or one of a version of this program"),
        (("--resume", "{saved}.none"), "no such file"),
        (("--save-at", "soon"), "'soon' is not a time; write 2s, 20ms, 341us or 5min, or 48000t for ticks."),
    ],
)  # fmt: skip
def test_what_cannot_be_done_is_refused_and_nothing_is_written(mirotwin, tmp_path, short, arguments, what):
    first = tmp_path / "first"
    mirotwin("run", short, "--out", first, "--seed", 5, "--save-at", "2402400t", *QUIET)
    given = [one.format(saved=first / "at-2402400.world", short=short) for one in arguments]
    err = mirotwin.refuses("run", short, "--out", tmp_path / "second", *given, *QUIET)
    assert what.lower() in err.lower()
    assert not (tmp_path / "second").exists()


def test_full_recordings_do_not_stop(mirotwin, tmp_path, short):
    err = mirotwin.refuses("run", short, "--out", tmp_path / "a", "--record", "full", "--to", "1000t")
    assert "do not go with --record full" in err
