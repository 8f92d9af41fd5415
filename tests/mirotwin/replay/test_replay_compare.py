"""`mirotwin replay --compare`: how strictly a replay is compared, what is told of it, and the first instruction."""

import json

import msgspec
import pytest

from miro_protocol.frames import TeamFrame, encode
from miro_sim.scenario.file import load
from miro_sim.world.world import World
from mirotwin.recording import recorder as recording_recorder
from mirotwin.recording.recorder import Recorder, source_of
from tests.mirotwin.conftest import SHORT, hex_file
from tests.mirotwin.replay.rig import built
from tests.mirotwin.replay.test_replay_command import IDLE_FOR_EVER, rewritten
from tests.mirotwin.verify.checks.rig import needs_sdcc, own_image


@pytest.fixture(scope="module")
def silent(mirotwin, tmp_path_factory):
    """A recording of a link that loses most frames: the failsafe stops the robot now and then."""
    folder = tmp_path_factory.mktemp("silent")
    scenario = folder / "silent.toml"
    text = SHORT.replace("bit_error_rate = 2e-3", "bit_error_rate = 8e-3")
    scenario.write_text(text.replace("duration_s = 0.2", "duration_s = 1.5"))
    options = ("--seed", 5, "--out", folder / "out", "-q", "--no-figure")
    assert mirotwin("run", scenario, *options)[0] == 0
    return folder / "out" / "run.mcap"


@pytest.fixture(scope="module")
def late(tmp_path_factory):
    return built(tmp_path_factory.mktemp("late"), "late").path


@pytest.fixture(scope="module")
def slower(tmp_path_factory):
    return built(tmp_path_factory.mktemp("slower"), "slower").path


@pytest.mark.parametrize("kind", ["bits", "bytes", "commands", "wheels"])
def test_a_recording_replays_alike_under_every_rule(mirotwin, silent, kind):
    code, out, err = mirotwin("replay", silent, "--compare", kind, "-q")
    assert (code, err) == (0, "")
    assert "equals the recorded one in all 45 control periods" in out
    assert ("within" in out) == (kind != "bits")


@pytest.mark.slow
@needs_sdcc
def test_a_build_that_is_only_slower_has_no_difference_under_commands(mirotwin, silent, slower):
    assert mirotwin("replay", silent, "--firmware", slower, "-q")[0] == 4
    code, out, err = mirotwin("replay", silent, "--firmware", slower, "--compare", "commands", "-q")
    assert (code, err) == (0, "")
    assert "(commands, within 0.5 ms)" in out
    code, _, err = mirotwin(
        *("replay", silent, "--firmware", slower, "--compare", "commands", "--within-ms", "0.001", "-q")
    )
    assert code == 4
    assert "the code of the two images lies at other addresses" in err


@needs_sdcc
def test_firmware_with_another_constant_is_told_by_instruction_and_c_line(mirotwin, silent, late):
    sources = late.parent.parent / "firmware"
    code, out, err = mirotwin(
        *("replay", silent, "--firmware", late, "--sources", sources, "--compare", "commands")
    )
    assert code == 4
    assert "lm629 left command: recorded LTRJ 1Fh 0400 at tick " in err
    changed = next(line for line in err.splitlines() if "the first changed instruction" in line)
    assert "_failsafe_tick+" in changed
    assert "failsafe.c:" in changed
    assert "`if (age == FAILSAFE_STOP_MS) {`: MOV A,#6Eh" in changed
    assert "`if (age == FAILSAFE_STOP_MS + 15) {`: MOV A,#7Dh" in err
    assert "behind it ACC: recorded 110, replayed 125" in err
    assert "they go on at different places after tick " in err
    assert "CJNE A,_age," in err
    assert "/net0/robot0/lm629 right command" in out
    assert "--all lists them" in out


@needs_sdcc
def test_json_holds_the_same_and_nothing_else_is_on_stdout(mirotwin, silent, late):
    command = ("replay", silent, "--firmware", late, "--compare", "commands", "--json")
    code, out, _ = mirotwin(*command)
    document = json.loads(out)
    assert (code, document["exit_code"]) == (4, 4)
    assert (document["compare"], document["within_ms"]) == ("commands", 0.5)
    assert document["firmware"]["recorded"] != document["firmware"]["replayed"]
    assert document["periods"] == {"recorded": 45, "replayed": 45}
    assert document["first"]["channel"] == "lm629 left command"
    assert document["first"] == {
        key: value for key, value in document["channels"][0].items() if key != "count"
    }
    assert sum(channel["count"] for channel in document["channels"]) == document["count"] > 1
    assert "differences" not in document
    changed = document["instruction"]["changed"]
    assert [place["text"] for place in changed["places"]] == ["MOV A,#6Eh", "MOV A,#7Dh"]
    assert changed["values"] == [{"name": "ACC", "values": [110, 125]}]
    every = json.loads(mirotwin(*command, "--all")[1])
    assert len(every["differences"]) == every["count"] == document["count"]


def shifted(period):
    robot = period.robots[1]
    left = msgspec.structs.replace(robot.left, real_position=robot.left.real_position + 3)
    right = msgspec.structs.replace(robot.right, status=robot.right.status ^ 1)
    changed = msgspec.structs.replace(robot, left=left, right=right)
    return msgspec.structs.replace(period, robots=(period.robots[0], changed))


def test_the_first_of_each_channel_is_listed_and_all_on_request(mirotwin, finished, tmp_path):
    path = rewritten(finished / "run.mcap", tmp_path / "shifted.mcap", shifted)
    code, out, _ = mirotwin("replay", path)
    assert code == 4
    rows = [line.split() for line in out.splitlines() if "/net0/robot2/lm629" in line]
    assert [(row[0], row[-1]) for row in rows] == [("0", "6"), ("0", "6")]
    assert "12 differences in 2 channels; --all lists them" in out
    code, out, _ = mirotwin("replay", path, "--all")
    assert code == 4
    assert len([line for line in out.splitlines() if "/net0/robot2/lm629" in line]) == 12


def test_wheels_have_a_tolerance_in_counts(mirotwin, finished, tmp_path):
    path = rewritten(finished / "run.mcap", tmp_path / "shifted.mcap", shifted)
    wheels = ("replay", path, "--compare", "wheels", "-q")
    assert mirotwin(*wheels)[0] == 0
    assert mirotwin(*wheels, "--within-counts", 3)[0] == 0
    code, _, err = mirotwin(*wheels, "--within-counts", 2)
    assert code == 4
    assert "lm629 left real_position: recorded 3, replayed 0" in err


def test_a_window_leaves_the_rest_out(mirotwin, finished, tmp_path):
    def late_change(period):
        return shifted(period) if period.index == 2 else period

    path = rewritten(finished / "run.mcap", tmp_path / "shifted.mcap", late_change)
    assert mirotwin("replay", path, "-q")[0] == 4
    assert mirotwin("replay", path, "-q", "--to", "60ms")[0] == 0
    assert mirotwin("replay", path, "-q", "--from", "80ms")[0] == 0
    assert mirotwin("replay", path, "-q", "--from", "1601600t", "--to", "1601601t")[0] == 4
    _, out, _ = mirotwin("replay", path, "--to", "60ms")
    assert "in all 2 control periods" in out
    ticks = [int(line.split()[0]) for line in out.splitlines() if line.lstrip()[:1].isdigit()]
    assert 0 < max(ticks) < 1_440_000


def test_another_seed_is_another_run(mirotwin, silent):
    assert mirotwin("replay", silent, "-q", "--seed", 5)[0] == 0
    assert mirotwin("replay", silent, "-q", "--seed", 6)[0] == 4


def test_a_digest_is_compared_where_the_host_was_silent(mirotwin, tmp_path):
    """Then a replay computes all states again; those of a controller's PC it does not."""
    for host, wanted in (("silent", 4), ("controller", 0)):
        scenario = tmp_path / f"{host}.toml"
        scenario.write_text(SHORT.replace("[[network]]", f'[[network]]\nhost = "{host}"', 1))
        folder = tmp_path / host
        assert mirotwin("run", scenario, "--out", folder, "-q", "--no-figure")[0] == 0
        assert mirotwin("replay", folder / "run.mcap", "-q")[0] == 0

        def change(period):
            return msgspec.structs.replace(period, digest="00" * 32) if period.index == 2 else period

        path = rewritten(folder / "run.mcap", tmp_path / f"{host}.mcap", change)
        code, _, err = mirotwin("replay", path, "-q")
        assert code == wanted
        assert ("control period 2, tick 2402400 (0.100100 s), /period digest" in err) == (wanted == 4)
        assert mirotwin("replay", path, "-q", "--compare", "bytes")[0] == 0


def test_a_live_session_with_actions_replays_to_the_same_digests(mirotwin, tmp_path):
    path = tmp_path / "live.toml"
    path.write_text(SHORT.replace("[[network]]", '[[network]]\nhost = "silent"', 1))
    text = load(str(path))
    world = World(text.scenario, 8, own_image())
    source = source_of(text, world)
    with (tmp_path / "live.mcap").open("wb") as stream, Recorder(stream, source) as recorder:
        world.observers.append(recorder.write)
        for seq, tick in enumerate((12_345, 900_001, 2_345_678)):
            world.run_to(tick)
            world.inject(encode(TeamFrame(3, seq + 1, ((500, 500), (0, 0), (-500, 900))), 3))
        world.set_radio("noise")
        world.run_to(world.tick + 99_999)
        world.set_radio("up")
        world.set_reset(0, 0, 2)
        world.run_to(world.tick + 10_000)
        world.set_reset(1, 0, 2)
        while not world.finished:
            world.step()
    code, out, err = mirotwin("replay", tmp_path / "live.mcap", "-q")
    assert (code, err) == (0, "")
    assert "in all 6 control periods" in out
    code, out, err = mirotwin("diff", tmp_path / "live.mcap", tmp_path / "live.mcap")
    assert (code, err) == (0, "")


def test_firmware_without_symbols_says_what_is_missing(mirotwin, finished, tmp_path):
    image = hex_file(tmp_path / "idle.ihx", IDLE_FOR_EVER)
    code, _, err = mirotwin("replay", finished / "run.mcap", "--firmware", image, "-q")
    assert code == 4
    assert "the images have no symbols of internal RAM in common" in err
    assert f"no symbols of {image}: put its .map, .cdb and .rst beside it" in err


@pytest.mark.parametrize("format", ["2", "5", "next"])
def test_a_recording_of_another_format_is_refused_with_the_reason(
    mirotwin, finished, tmp_path, monkeypatch, format
):
    with monkeypatch.context() as patched:
        patched.setattr(recording_recorder, "FORMAT", format)
        path = rewritten(finished / "run.mcap", tmp_path / "other.mcap", lambda period: period)
    for command in (("replay", path), ("diff", path, finished / "run.mcap"), ("diff", path, path)):
        code, out, err = mirotwin(*command)
        assert (code, out) == (2, "")
        assert f"recording format '{format}'; this program reads format 4" in err


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("--compare", "bit"), "'bit' is not one of 'bits', 'bytes', 'commands', 'wheels'"),
        (("--within-ms", "1"), "--within-ms: does not apply to --compare bits; give --compare bytes or"),
        (("--compare", "wheels", "--within-ms", "1"), "--within-ms: does not apply to --compare wheels"),
        (
            ("--compare", "bytes", "--within-counts", "1"),
            "--within-counts: does not apply to --compare bytes",
        ),
        (("--compare", "bytes", "--within-ms", "nan"), "'nan' is not a number"),
        (("--compare", "bytes", "--within-ms", "x"), "'x' is not a number"),
        (("--compare", "bytes", "--within-ms", "-1"), "-1.0 is not in the range"),
        (("--compare", "wheels", "--within-counts", "1.5"), "'1.5' is not a whole number"),
        (("--from", "2s", "--to", "1s"), "the window is empty; --to must be later"),
        (("--to", "0t"), "the window is empty"),
        (("--from", "1h"), "the recording ends at tick 4804800; look earlier"),
        (
            ("--from", "1"),
            "'1' is not a time; it has no unit: write 1s for seconds, 1t for ticks of the crystal.",
        ),
        (("--from", "1s"), "the recording ends at tick 4804800; look earlier"),
        (("--seed", "-1"), "-1 is not in the range"),
        (("--set", "nonsense=1"), "--set nonsense=1: unknown key"),
        (("--sources", "nowhere"), "there is no such folder"),
        (("--out", "elsewhere"), "--out needs --port."),
        (("--force",), "--force needs --port."),
        (("--lines-from", "nowhere.ihx"), "nowhere.ihx: there is no such file"),
    ],
)
def test_options_that_cannot_be_meant_are_refused_in_one_line(mirotwin, finished, options, expected):
    code, out, err = mirotwin("replay", finished / "run.mcap", *options)
    assert (code, out) == (2, "")
    assert err.startswith("mirotwin: error: ")
    assert err.count("\n") == 1
    assert expected in err


def test_lines_come_from_a_recorded_image_alone(mirotwin, finished, tmp_path):
    image = hex_file(tmp_path / "idle.ihx", IDLE_FOR_EVER)
    for command in (
        ("replay", finished / "run.mcap"),
        ("diff", finished / "run.mcap", finished / "run.mcap"),
    ):
        code, _, err = mirotwin(*command, "--lines-from", image)
        assert code == 2
        assert "--lines-from: is not a recorded image; give one that is, or leave it out" in err


@pytest.mark.parametrize("options", [("--compare", "bytes"), ("--from", "1t"), ("--lines-from", "IMAGE")])
def test_a_text_stream_has_nothing_to_compare_with(mirotwin, tmp_path, options):
    path = tmp_path / "a.stream"
    path.write_text("792000 > 55 55\n")
    image = str(hex_file(tmp_path / "idle.ihx", IDLE_FOR_EVER))
    code, _, err = mirotwin("replay", path, *(image if option == "IMAGE" else option for option in options))
    assert code == 2
    assert "nothing to compare with; leave it out" in err or "is not a recorded image" in err


def test_the_json_of_a_stream_says_that_nothing_was_recorded(mirotwin, tmp_path):
    path = tmp_path / "a.stream"
    path.write_text("792000 > 55 55\n")
    code, out, _ = mirotwin("replay", path, "--json", "--seed", 9, "--to", "70ms")
    document = json.loads(out)
    assert (code, document["exit_code"], document["seed"]) == (0, 0, 9)
    assert document["periods"] == {"recorded": 0, "replayed": 3}
    assert (document["first"], document["instruction"]) == (None, None)
