"""`mirotwin diff`: what two recordings were made from, and where they differ first; and the page of replay and diff."""

import json
import math
import re
from pathlib import Path

import click
import pytest
from click.testing import CliRunner
from intelhex import IntelHex
from msgspec.structs import replace

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_protocol.frames import encode
from miro_protocol.stream import write
from miro_protocol.transmission import Transmission
from miro_robot.firmware import image_path
from miro_sim.scenario.file import load
from mirotwin.commands import main
from mirotwin.recording.compare import KINDS, WITHIN_COUNTS, WITHIN_COUNTS_PER_SAMPLE, WITHIN_TICKS
from mirotwin.recording.recorder import Recorder, source_of
from tests.mirotwin.conftest import SHORT, hex_file
from tests.mirotwin.replay.rig import STOP_AT, Planted
from tests.mirotwin.replay.test_replay_command import rewritten
from tests.mirotwin.verify.checks.rig import own_image, team


@pytest.fixture(scope="module")
def runs(mirotwin, short, tmp_path_factory):
    """A folder of runs: the short one again, and with one thing changed each."""
    folder = tmp_path_factory.mktemp("runs")
    patched = IntelHex(str(image_path()))
    patched[STOP_AT] = 125
    patched.write_hex_file(str(folder / "patched.ihx"))
    changes = {
        "same": (),
        "seed": ("--seed", 6),
        "gain": ("--set", "network.robot.0.controller.gamma1_per_s=0.5"),
        "longer": ("--set", "duration_s=0.3"),
        "expecting": ("--expect", "frames_accepted_min=1"),
    }
    for name, options in changes.items():
        mirotwin.succeeds("run", short, "--seed", 5, *options, "--out", folder / name, "-q", "--no-figure")
    return folder


def test_two_runs_of_the_same_hold_the_same(mirotwin, finished, runs):
    out = mirotwin.succeeds("diff", finished / "run.mcap", runs / "same" / "run.mcap")
    assert out == "the recordings hold the same in all 6 control periods\n"


def test_what_they_were_made_from_is_told_first_key_by_key(mirotwin, finished, runs):
    code, out, err = mirotwin("diff", finished / "run.mcap", runs / "gain" / "run.mcap")
    assert code == 4
    lines = out.splitlines()
    assert lines[0].split() == ["made", "from", "A", "B"]
    assert lines[1].split() == ["network.0.robot.0.controller.gamma1_per_s", "1.7", "0.5"]
    assert lines[2] == ""
    assert "the recordings differ in control period 1, tick 800800 (0.033367 s), /net0/robot0/control" in err
    where = "tick 800801 (0.033367 s), control period 1: lines[0].devices[0].pilot"
    assert f"their states differ from {where}" in err


def test_another_seed_is_named_and_so_is_the_field_that_shows_it_first(mirotwin, finished, runs):
    code, out, err = mirotwin("diff", finished / "run.mcap", runs / "seed" / "run.mcap", "--json")
    document = json.loads(out)
    assert (code, document["exit_code"], document["period"]) == (4, 4, 0)
    assert document["sources"] == [{"key": "seed", "a": "5", "b": "6"}]
    assert document["state"]["tick"] <= document["first"]["tick"]
    assert document["state"]["fields"]
    assert {"a", "b"} <= set(document["first"])
    assert document["instruction"] is None
    assert "the recordings differ in control period 0" in err


def test_runs_of_other_sources_may_hold_the_same(mirotwin, finished, runs):
    code, out, _ = mirotwin("diff", finished / "run.mcap", runs / "expecting" / "run.mcap")
    assert code == 0
    assert "expect" in out.splitlines()[1]
    assert "the recordings hold the same in all 6 control periods; they were not made from the same" in out


def test_a_longer_run_differs_in_its_length_alone(mirotwin, finished, runs):
    err = mirotwin.ends(4, "diff", finished / "run.mcap", runs / "longer" / "run.mcap")
    assert err == "mirotwin: A has 6 control periods, B has 9\n"
    assert mirotwin("diff", finished / "run.mcap", runs / "longer" / "run.mcap", "--to", "100ms")[0] == 0


def test_two_firmwares_are_compared_by_hash_byte_and_instruction(mirotwin, short, runs, tmp_path):
    noise = ("--set", "network.radio.bit_error_rate=0.008", "--set", "duration_s=1.5", "--seed", 5)
    for name, firmware in (("a", ()), ("b", ("--firmware", runs / "patched.ihx"))):
        options = (*noise, *firmware, "--out", tmp_path / name, "-q", "--no-figure")
        assert mirotwin("run", short, *options)[0] == 0
    command = ("diff", tmp_path / "a" / "run.mcap", tmp_path / "b" / "run.mcap", "--compare", "commands")
    code, out, err = mirotwin(*command)
    assert code == 4
    assert f"firmware code, the first of 1 byte  6Eh at 0x{STOP_AT:04x} in _failsafe_tick+23" in out
    assert "the first changed instruction that is executed: net0/robot0: A tick " in err
    assert "failsafe.c:" in err
    assert "B tick " in err
    assert "MOV A,#7Dh" in err
    assert "--lines-from names the file that they lie beside" in err


@pytest.mark.parametrize("what", ["ram", "float"])
def test_a_bit_that_somebody_changed_is_found_in_its_control_period(
    mirotwin, finished, short, tmp_path, what
):
    """The change is in no recording, so running again shows no tick; the digests show the control period."""
    text = load(str(short))
    tick = 3 * CONTROL_PERIOD_TICKS + 123_456

    def change(of):
        if what == "ram":
            cpu = of.robot(0, 2).board.cpu
            cpu.poke_iram(0xF0, cpu.peek_iram(0xF0) ^ 1)
        else:
            body = of.robot(0, 2).drive.body
            body.x_m = math.nextafter(body.x_m, math.inf)

    world = Planted(text.scenario, 5, own_image()).plant(tick, change)
    source = source_of(text, world)
    path = tmp_path / "planted.mcap"
    with path.open("wb") as stream, Recorder(stream, source) as recorder:
        while not world.finished:
            recorder.write(world.step())
    err = mirotwin.ends(4, "diff", finished / "run.mcap", path, "-q")
    where = "" if what == "float" else " 3203200 (0.133467 s), /period digest"
    assert f"the recordings differ in control period 3, tick{where}" in err
    assert "run again, their states do not differ up to the end of control period" in err


def test_recordings_that_do_not_repeat_are_compared_as_far_as_they_tell(mirotwin, finished, tmp_path):
    def change(period):
        digest = f"{period.index:064x}"
        robot = replace(period.robots[0], accepted=9)
        changed = period.robots if period.index < 2 else (robot, *period.robots[1:])
        return replace(period, digest=digest, robots=changed)

    path = rewritten(finished / "run.mcap", tmp_path / "edited.mcap", change)
    err = mirotwin.ends(4, "diff", finished / "run.mcap", path, "-q", "--from", "60ms")
    assert "/net0/robot0/firmware accepted: A " in err


def test_robots_that_only_one_has_are_named_and_the_others_compared(mirotwin, finished, tmp_path):
    alone = tmp_path / "alone.toml"
    alone.write_text(SHORT.partition("[[network.robot]]\nslot = 2")[0])
    assert mirotwin("run", alone, "--seed", 5, "--out", tmp_path / "out", "-q", "--no-figure")[0] == 0
    err = mirotwin.ends(4, "diff", finished / "run.mcap", tmp_path / "out" / "run.mcap", "-q")
    assert "only A has net0/robot2" in err
    assert "the digests are not compared: their states have another form" in err
    other = tmp_path / "other.toml"
    other.write_text(SHORT.replace("slot = 0", "slot = 1").partition("[[network.robot]]\nslot = 2")[0])
    assert mirotwin("run", other, "--seed", 5, "--out", tmp_path / "other", "-q", "--no-figure")[0] == 0
    err = mirotwin.refuses("diff", tmp_path / "out" / "run.mcap", tmp_path / "other" / "run.mcap")
    assert "the recordings have no robot in common" in err


def test_half_a_recording_is_compared_as_far_as_it_goes(mirotwin, finished, tmp_path):
    data, half = (finished / "run.mcap").read_bytes(), tmp_path / "half.mcap"
    half.write_bytes(data[: len(data) * 3 // 4])
    err = mirotwin.ends(4, "diff", finished / "run.mcap", half)
    assert "it was cut short" in err
    assert "A has 6 control periods, B has " in err


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"", "offset 0: empty file"),
        (
            b"792000 > 55 55\n",
            "offset 0: not a recording; give a run.mcap, or two images (.ihx); `mirotwin replay",
        ),
        (b"\x89PNG\r\n\x1a\n\0\0", "offset 0: not a recording"),
        (b"\x89MCAP0\r\n" + bytes(100), "offset"),
    ],
)
def test_what_is_no_recording_is_refused_on_either_side(mirotwin, finished, tmp_path, content, expected):
    path = tmp_path / "file"
    path.write_bytes(content)
    for pair in ((path, finished / "run.mcap"), (finished / "run.mcap", path)):
        err = mirotwin.refuses("diff", *pair)
        assert err.startswith(str(path))
        assert expected in err


def test_a_window_in_which_one_of_them_has_nothing_is_refused(mirotwin, finished, short, tmp_path):
    assert mirotwin("run", short, "--seed", 5, "--to", "100ms", "--out", tmp_path / "part", "-q")[0] == 0
    whole, part = finished / "run.mcap", tmp_path / "part" / "run.mcap"
    for given in ((whole, whole, "--from", "90s"), (whole, part, "--from", "110ms", "--to", "150ms")):
        err = mirotwin.refuses("diff", *given)
        assert "the recording ends at tick" in err
        assert err.endswith("; look earlier")


@pytest.mark.parametrize(
    ("window", "count"),
    [(("--from", "1601600t"), "4 control periods"), (("--to", "801t"), "1 control period")],
)
def test_the_periods_of_the_window_are_counted(mirotwin, finished, window, count):
    run = finished / "run.mcap"
    for command in (("diff", run, run), ("replay", run, "-q")):
        assert f"in all {count}" in mirotwin.succeeds(*command, *window)


def test_an_empty_window_is_refused(mirotwin, finished):
    run = finished / "run.mcap"
    assert "the window is empty" in mirotwin.refuses("diff", run, run, "--from", "1s", "--to", "1s")


def test_the_folder_of_a_run_stands_for_its_recording(mirotwin, finished, tmp_path):
    (tmp_path / "run.part.mcap").write_bytes((finished / "run.mcap").read_bytes())
    out = mirotwin.succeeds("diff", finished, tmp_path)
    assert "the recordings hold the same in all 6 control periods" in out


def test_a_folder_without_a_recording_is_refused(mirotwin, finished, tmp_path):
    assert mirotwin.refuses("diff", finished, tmp_path) == f"{tmp_path}: is a folder; name a file in it"


@pytest.fixture(scope="module")
def quiet_for_a_while(tmp_path_factory):
    """A stream after whose last frame the failsafe stops the robot."""
    path = tmp_path_factory.mktemp("streams") / "stop.stream"
    write(path, [Transmission(800_800 * seq, ">", encode(team(seq, 900, 700), 3)) for seq in range(1, 5)])
    return path


def test_two_images_are_run_and_compared_by_behaviour_state_and_instruction(
    mirotwin, runs, quiet_for_a_while
):
    images = image_path(), runs / "patched.ihx"
    code, out, err = mirotwin("diff", *images, "--on", quiet_for_a_while)
    assert code == 4
    assert [line.split()[0] for line in out.splitlines()[:3]] == ["made", "firmware", "firmware"]
    first, state, changed = err.splitlines()[:3]
    assert "the images differ in control period " in first
    assert (
        "/net0/robot1/lm629 left command: A LTRJ 1Fh 0400 at tick " in first or "/net0/robot0/lm629" in first
    )
    assert "their states differ from tick " in state
    assert "the first changed instruction that is executed: " in changed
    assert "failsafe.c:" in changed


def test_images_that_do_the_same_are_the_same_however_they_were_built(mirotwin, runs):
    """On a scenario without radio errors the failsafe never stops a robot: the changed constant has no effect."""
    options = ("--set", "duration_s=0.5", "--set", "network.radio.bit_error_rate=0.0")
    out = mirotwin.succeeds("diff", image_path(), runs / "patched.ihx", *options, "-q")
    assert out == "on fig6, the images do the same in all 15 control periods\n"


@pytest.mark.parametrize("on", ["short", "finished"])
def test_images_run_a_scenario_or_the_bytes_of_a_recording(mirotwin, short, finished, runs, on):
    given = {"short": short, "finished": finished}[on]
    out = mirotwin.succeeds("diff", image_path(), image_path(), "--on", given, "--json")
    document = json.loads(out)
    assert (document["on"], document["seed"]) == (str(given), {"short": 0, "finished": 5}[on])
    assert (document["periods"], document["count"], document["sources"]) == ({"a": 6, "b": 6}, 0, [])


def test_an_image_that_faults_is_named_with_its_fault_and_has_fewer_periods(mirotwin, tmp_path):
    image = hex_file(tmp_path / "faulty.ihx", b"\xa5")
    err = mirotwin.ends(4, "diff", image_path(), image, "--set", "duration_s=0.2", "-q")
    assert "A has 6 control periods, B has 1" in err
    assert "B: firmware fault: net0/robot0: firmware executed the undefined opcode A5 at 0x0000" in err


def test_an_image_and_a_recording_are_compared_by_replay(mirotwin, finished, tmp_path):
    image = hex_file(tmp_path / "idle.ihx", b"\x80\xfe")
    for pair in ((image, finished), (finished, image)):
        err = mirotwin.refuses("diff", *pair)
        assert (
            f"{image}: is an image, and {finished / 'run.mcap'} a recording; give two images, or use `mirotwin replay "
            in err
        )


@pytest.mark.parametrize("options", [("--seed", "3"), ("--set", "duration_s=1"), ("--on", "fig7")])
def test_how_images_run_is_no_matter_to_recordings(mirotwin, finished, options):
    err = mirotwin.refuses("diff", finished, finished, *options)
    assert f"{options[0]}: is for two images, and a recording has its own; leave it out" in err


def test_answers_are_compared_with_a_twin_only(mirotwin, finished):
    err = mirotwin.refuses("diff", finished, finished, "--compare", "answers")
    assert "--compare answers: is for robots at a port, beside their twin" in err


PAGE = (Path(__file__).parents[3] / "mirotwin/replay/README.md").read_text(encoding="utf-8")


def test_the_example_in_python_prints_what_the_page_says(capsys):
    code = PAGE.split("```python\n")[1].split("```")[0]
    exec(code, {})
    assert capsys.readouterr().out == code.rpartition("# ")[2]


def test_every_rule_and_tolerance_is_there_with_its_default():
    rules = PAGE.partition("`--compare`\n")[2]
    assert tuple(re.findall(r"^\* `(\w+)`(?: \(default\))?: ", rules, re.M))[:5] == KINDS
    for option, default in (
        ("--within-ms", WITHIN_TICKS / 24_000),
        ("--within-counts", WITHIN_COUNTS),
        ("--within-counts-per-sample", WITHIN_COUNTS_PER_SAMPLE),
    ):
        found = re.search(rf"`{option}` ([\d.]+)", PAGE)
        assert float(found[1]) == default


@pytest.mark.parametrize("name", ["replay", "diff"])
def test_every_option_on_the_page_is_one_of_the_commands(name):
    context = click.Context(main)
    options = {
        command: {option for parameter in main.get_command(context, command).params for option in parameter.opts}
        for command in ("replay", "diff", "run")
    }  # fmt: skip
    assert set(re.findall(r"--[a-z][a-z-]+", PAGE)) <= set().union(*options.values())
    own = options[name]
    assert {"--compare", "--json", "--from", "--to", "--all", "--lines-from", "--sources"} <= own


def run(*arguments):
    return CliRunner().invoke(main, list(map(str, arguments))).stdout


def test_every_key_of_the_json_is_on_the_page(tmp_path):
    for seed in (1, 2):
        out = ("--out", tmp_path / f"{seed}", "-q", "--no-figure")
        run("run", "fig6", "--set", "duration_s=0.1", "--seed", seed, *out)
    first, second = (tmp_path / f"{seed}" / "run.mcap" for seed in (1, 2))
    said = set(re.findall(r"`(\w+)`", PAGE.partition("## The JSON document")[2]))
    for arguments in (("replay", first, "--seed", 2), ("diff", first, second)):
        document = json.loads(run(*arguments, "--json", "--all"))
        assert set(document) <= said
        assert set(document["first"]) <= said
