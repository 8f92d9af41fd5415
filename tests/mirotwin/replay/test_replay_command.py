"""`mirotwin replay`: the same bytes give the same robot, and where they do not it says so, as strictly as is asked."""

import json

import click
import pytest
from msgspec.structs import replace

from miro_protocol.frames import TeamFrame, encode
from miro_protocol.pcapng import render
from miro_protocol.stream import write
from miro_protocol.transmission import Transmission
from miro_sim.scenario.file import load
from miro_sim.world.world import World
from mirotwin.commands import main
from mirotwin.recording import reader as recording_reader
from mirotwin.recording import recorder as recording_recorder
from mirotwin.recording.recorder import Recorder, RunSource, source_of
from tests.mirotwin.conftest import SHORT, hex_file
from tests.mirotwin.verify.checks.rig import needs_sdcc, own_image

IDLE_FOR_EVER = b"\x80\xfe"


def rewritten(path, target, change):
    """A recording with something else in its periods."""
    recording = recording_reader.read(path)
    with target.open("wb") as stream, Recorder(stream, recording.source) as recorder:
        for period in recording.periods:
            recorder.write(change(period))
    return target


def test_a_recording_replays_to_the_same_response(mirotwin, finished):
    out = mirotwin.succeeds("replay", finished / "run.mcap")
    assert "team_ask seq=0" in out
    assert "telemetry seq=0 slot=0" in out
    assert "t [s]" in out
    assert "equals the recorded one in all 6 control periods" in out


@pytest.mark.parametrize("name", ["run.mcap", "run.part.mcap"])
def test_the_folder_of_a_run_stands_for_its_recording(mirotwin, finished, tmp_path, name):
    (tmp_path / name).write_bytes((finished / "run.mcap").read_bytes())
    assert "equals the recorded one in all 6 control periods" in mirotwin.succeeds("replay", tmp_path)


def stream_of(folder, count):
    frames = [encode(TeamFrame(0, seq, ((500, 500), (0, 0), (-500, -500))), 3) for seq in range(count)]
    write(folder / "a", [Transmission(index * 800_800, ">", data) for index, data in enumerate(frames)])
    return folder / "a"


def test_the_list_of_frames_is_cut_unless_all_are_asked_for(mirotwin, tmp_path):
    path = stream_of(tmp_path, 25)
    out = mirotwin("replay", path)[1]
    assert "5 more of 25 frames; --all lists them" in out
    assert out.count("team seq=") == 20
    assert mirotwin("replay", path, "--all")[1].count("team seq=") == 25


def test_a_stream_drives_robots_over_an_ideal_link(mirotwin, tmp_path):
    out = mirotwin.succeeds("replay", stream_of(tmp_path, 10))
    rows = [line.split() for line in out.splitlines()[-3:]]
    assert [row[:4] for row in rows] == [[str(slot), "10", "0", "0"] for slot in range(3)]
    assert int(rows[0][5]) > 500
    assert int(rows[1][5]) == 0
    assert int(rows[2][5]) < -500


def test_a_changed_recording_is_a_divergence_with_its_first_place(mirotwin, finished, tmp_path):
    def change(period):
        if period.index < 3:
            return period
        one, robot = period.robots
        left = replace(robot.left, real_position=robot.left.real_position + 1)
        return replace(period, robots=(one, replace(robot, left=left)))

    path = rewritten(finished / "run.mcap", tmp_path / "changed.mcap", change)
    err = mirotwin.ends(4, "replay", path, "-q")
    assert "the replay differs in control period 3, tick 2402400 (0.100100 s), /net0/robot2/lm629 left" in err


def test_other_firmware_is_shown_where_it_answers_otherwise(mirotwin, finished, tmp_path):
    image = hex_file(tmp_path / "idle.ihx", IDLE_FOR_EVER)
    err = mirotwin.ends(4, "replay", finished / "run.mcap", "--firmware", image, "-q")
    assert "the replay differs in control period" in err
    assert "replayed nothing" in err


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"", "offset 0: empty file"),
        (b"\x89PNG\r\n\x1a\n\0\0", "raw bytes without times; --assume-contiguous takes all characters to follow"),
        (b"\xdf\xe4\x77\x05", "raw bytes without times"),
        ("0 > 55\n".encode("utf-16"), ":1:1: byte ffh is not UTF-8; save the file as UTF-8 text"),
        (render([Transmission(0, "<", b"a")]), "no line from host to robot"),
        (b"hello, world\n", "is text in no form that is known; name it with --from-form, or give --from-form raw"),
        (b"55 55 2d d4 7f f1\n", "hex text without times; --assume-contiguous takes all characters to follow"),
        (b"55552dd47ff1\n", "hex text without times"),
        (b"0 > 55\0\n", ":1:5: '55\\x00' is not a character"),
        (b"12 > zz\n", ":1:6: 'zz' is not a character"),
        (b"# only a comment\n", "is text in no form that is known"),
        (b"# mirotwin stream 1\n", "no line from host to robot"),
        (b"0 > 55 # \xff\xfe\n", ":1:10: byte ffh is not UTF-8"),
        *((b"\x89MCAP0\r\n"[:end], "the middle of a record; it was cut short; copy it again") for end in range(1, 8)),
    ],
)  # fmt: skip
def test_a_file_of_another_kind_is_refused_with_its_place(mirotwin, tmp_path, content, expected):
    path = tmp_path / "file"
    path.write_bytes(content)
    err = mirotwin.refuses("replay", path)
    assert err.startswith(str(path))
    assert expected in err


def test_a_recording_cut_short_is_compared_as_far_as_it_goes(mirotwin, finished, tmp_path):
    path, data = tmp_path / "cut.mcap", (finished / "run.mcap").read_bytes()
    for end, periods in ((-1000, "all 6 control periods"), (len(data) // 2, "all")):
        path.write_bytes(data[:end])
        code, out, err = mirotwin("replay", path)
        assert (code, f"equals the recorded one in {periods}" in out) == (0, True)
        assert f"{path}: offset " in err
        assert "it was cut short; copy it again, or record the run again" in err


def test_a_recording_without_a_control_period_is_refused(mirotwin, tmp_path):
    path = tmp_path / "odd.mcap"
    with path.open("wb") as stream, Recorder(stream, RunSource("x", "", 1, b"rubbish", "")):
        pass
    assert "holds no control period" in mirotwin.refuses("replay", path)


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"network": 7}, "tick 96000: network 7 does not exist; there is 1, numbered from 0"),
        ({"tick": 96_000 + 800_800 - 1}, "starts before the transmission of tick 896799 has ended"),
    ],
)
def test_a_recording_whose_characters_no_host_can_have_sent_is_refused(
    mirotwin, finished, tmp_path, change, what
):
    def changed(period):
        if period.index:
            return period
        first, *others = period.wire
        return replace(period, wire=(replace(first, **change), *others))

    path = rewritten(finished / "run.mcap", tmp_path / "odd.mcap", changed)
    err = mirotwin.refuses("replay", path)
    assert err.startswith(f"{path}: ")
    assert what in err


@pytest.fixture(scope="module")
def silent(mirotwin, tmp_path_factory):
    """A recording of a link that loses most frames: the failsafe stops the robot now and then."""
    folder = tmp_path_factory.mktemp("silent")
    scenario = folder / "silent.toml"
    scenario.write_text(SHORT.replace("2e-3", "8e-3").replace("duration_s = 0.2", "duration_s = 1.5"))
    mirotwin.succeeds("run", scenario, "--seed", 5, "--out", folder / "out", "-q", "--no-figure")
    return folder / "out" / "run.mcap"


@pytest.mark.parametrize("kind", ["bits", "bytes", "commands", "wheels"])
def test_a_recording_replays_alike_under_every_rule(mirotwin, silent, kind):
    out = mirotwin.succeeds("replay", silent, "--compare", kind, "-q")
    assert "equals the recorded one in all 45 control periods" in out
    assert ("within" in out) == (kind != "bits")


@pytest.mark.slow
@needs_sdcc
def test_a_build_that_is_only_slower_has_no_difference_under_commands(mirotwin, silent, images):
    slower = images["slower"].path
    assert mirotwin("replay", silent, "--firmware", slower, "-q")[0] == 4
    out = mirotwin.succeeds("replay", silent, "--firmware", slower, "--compare", "commands", "-q")
    assert "(commands, within 0.5 ms)" in out
    strictly = ("--compare", "commands", "--within-ms", "0.001", "-q")
    err = mirotwin.ends(4, "replay", silent, "--firmware", slower, *strictly)
    assert "the code of the two images lies at other addresses" in err


@needs_sdcc
def test_firmware_with_another_constant_is_told_by_instruction_and_c_line(mirotwin, silent, images):
    late = images["late"].path
    sources = late.parent.parent / "firmware"
    other = ("--firmware", late, "--sources", sources)
    code, out, err = mirotwin("replay", silent, *other, "--compare", "commands")
    assert code == 4
    assert "lm629 left command: recorded LTRJ 1Fh 0400 at tick " in err
    changed = next(line for line in err.splitlines() if "the first changed instruction" in line)
    assert "_failsafe_tick+" in changed
    assert "failsafe.c:" in changed
    assert "`if (age == FAILSAFE_STOP_MS) {`: MOV A,#6Eh" in changed
    assert "`if (age == FAILSAFE_STOP_MS + 15) {`: MOV A,#7Dh" in err
    assert "  after it ACC: recorded 110, replayed 125" in err
    assert "they go on at different places after tick " in err
    assert "CJNE A,_age," in err
    assert "/net0/robot0/lm629 right command" in out
    assert "--all lists them" in out


@needs_sdcc
def test_json_holds_the_same_and_nothing_else_is_on_stdout(mirotwin, silent, images):
    command = ("replay", silent, "--firmware", images["late"].path, "--compare", "commands", "--json")
    code, out, _ = mirotwin(*command)
    document = json.loads(out)
    assert (code, document["exit_code"]) == (4, 4)
    assert (document["compare"], document["within_ms"]) == ("commands", 0.5)
    assert document["firmware"]["recorded"] != document["firmware"]["replayed"]
    assert document["periods"] == {"recorded": 45, "replayed": 45}
    assert document["first"]["channel"] == "lm629 left command"
    assert {**document["first"], "count": document["channels"][0]["count"]} == document["channels"][0]
    assert sum(channel["count"] for channel in document["channels"]) == document["count"] > 1
    assert "differences" not in document
    changed = document["instruction"]["changed"]
    assert [place["text"] for place in changed["places"]] == ["MOV A,#6Eh", "MOV A,#7Dh"]
    assert changed["values"] == [{"name": "ACC", "values": [110, 125]}]
    every = json.loads(mirotwin(*command, "--all")[1])
    assert len(every["differences"]) == every["count"] == document["count"]


def shifted(period):
    one, robot = period.robots
    left = replace(robot.left, real_position=robot.left.real_position + 3)
    right = replace(robot.right, status=robot.right.status ^ 1)
    return replace(period, robots=(one, replace(robot, left=left, right=right)))


def test_the_first_of_each_channel_is_listed_and_all_on_request(mirotwin, finished, tmp_path):
    path = rewritten(finished / "run.mcap", tmp_path / "shifted.mcap", shifted)
    code, out, _ = mirotwin("replay", path)
    assert code == 4
    rows = [line.split() for line in out.splitlines() if "/net0/robot2/lm629" in line]
    assert [(row[0], row[-1]) for row in rows] == [("0", "6"), ("0", "6")]
    assert "12 differences in 2 channels; --all lists them" in out
    out = mirotwin("replay", path, "--all")[1]
    assert len([line for line in out.splitlines() if "/net0/robot2/lm629" in line]) == 12


def test_wheels_have_a_tolerance_in_counts(mirotwin, finished, tmp_path):
    path = rewritten(finished / "run.mcap", tmp_path / "shifted.mcap", shifted)
    wheels = ("replay", path, "--compare", "wheels", "-q")
    assert mirotwin(*wheels)[0] == 0
    assert mirotwin(*wheels, "--within-counts", 3)[0] == 0
    err = mirotwin.ends(4, *wheels, "--within-counts", 2)
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
            return replace(period, digest="00" * 32) if period.index == 2 else period

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
    assert "in all 6 control periods" in mirotwin.succeeds("replay", tmp_path / "live.mcap", "-q")
    mirotwin.succeeds("diff", tmp_path / "live.mcap", tmp_path / "live.mcap")


def test_firmware_without_symbols_says_what_is_missing(mirotwin, finished, tmp_path):
    image = hex_file(tmp_path / "idle.ihx", IDLE_FOR_EVER)
    err = mirotwin.ends(4, "replay", finished / "run.mcap", "--firmware", image, "-q")
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
        assert f"recording format '{format}'; this program reads format 4" in mirotwin.refuses(*command)


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("--compare", "bit"), "'bit' is not one of 'bits', 'bytes', 'commands', 'wheels'"),
        (("--within-ms", "1"), "--within-ms: does not apply to --compare bits; give --compare bytes or"),
        (("--compare", "wheels", "--within-ms", "1"), "--within-ms: does not apply to --compare wheels"),
        (("--compare", "bytes", "--within-counts", "1"), "--within-counts: does not apply to --compare bytes"),
        (("--compare", "bytes", "--within-ms", "nan"), "'nan' is not a number"),
        (("--compare", "bytes", "--within-ms", "x"), "'x' is not a number"),
        (("--compare", "bytes", "--within-ms", "-1"), "-1.0 is not in the range"),
        (("--compare", "wheels", "--within-counts", "1.5"), "'1.5' is not a whole number"),
        (("--from", "2s", "--to", "1s"), "the window is empty; --to must be later"),
        (("--to", "0t"), "--to 0t: the window is empty"),
        (("--from", "1h"), "the recording ends at tick 4804800; look earlier"),
        (("--from", "1"), "'1' is not a time; it has no unit: write 1s for seconds, 1t for ticks of the crystal."),
        (("--from", "1s"), "the recording ends at tick 4804800; look earlier"),
        (("--seed", "-1"), "-1 is not in the range"),
        (("--set", "nonsense=1"), "--set nonsense=1: unknown key"),
        (("--sources", "nowhere"), "there is no such folder"),
        (("--force",), "--force needs --out or --port."),
        (("--lines-from", "nowhere.ihx"), "nowhere.ihx: there is no such file"),
    ],
)  # fmt: skip
def test_options_that_cannot_be_meant_are_refused_in_one_line(mirotwin, finished, options, expected):
    assert expected in mirotwin.refuses("replay", finished / "run.mcap", *options)


def test_lines_come_from_a_recorded_image_alone(mirotwin, finished, tmp_path):
    image = hex_file(tmp_path / "idle.ihx", IDLE_FOR_EVER)
    run = finished / "run.mcap"
    for command in (("replay", run), ("diff", run, run)):
        said = mirotwin.refuses(*command, "--lines-from", image)
        assert "--lines-from: is not a recorded image; give one that is, or leave it out" in said


@pytest.mark.parametrize("options", [("--compare", "bytes"), ("--from", "1t"), ("--lines-from", "IMAGE")])
def test_a_text_stream_has_nothing_to_compare_with(mirotwin, tmp_path, options):
    path = tmp_path / "a.stream"
    path.write_text("792000 > 55 55\n")
    image = str(hex_file(tmp_path / "idle.ihx", IDLE_FOR_EVER))
    err = mirotwin.refuses("replay", path, *(image if option == "IMAGE" else option for option in options))
    assert "nothing to compare with; leave it out" in err or "is not a recorded image" in err


def test_the_json_of_a_stream_says_that_nothing_was_recorded(mirotwin, tmp_path):
    path = tmp_path / "a.stream"
    path.write_text("792000 > 55 55\n")
    code, out, _ = mirotwin("replay", path, "--json", "--seed", 9, "--to", "70ms")
    document = json.loads(out)
    assert (code, document["exit_code"], document["seed"]) == (0, 0, 9)
    assert document["periods"] == {"recorded": 0, "replayed": 3}
    assert (document["first"], document["instruction"]) == (None, None)


def test_a_replay_names_the_first_state_that_differs_as_diff_does(mirotwin, finished):
    code, out, err = mirotwin("replay", finished, "--seed", 6, "--json")
    document = json.loads(out)
    assert code == 4
    assert document["state"]["tick"] <= document["first"]["tick"]
    assert f"their states differ from tick {document['state']['tick']} " in err


def test_what_was_changed_in_a_recording_is_in_no_state(mirotwin, finished, tmp_path):
    path = rewritten(finished / "run.mcap", tmp_path / "shifted.mcap", shifted)
    err = mirotwin.ends(4, "replay", path, "-q")
    assert "run again, their states do not differ up to the end of control period 0: what made the" in err


def options_by_command(command, context, words=()):
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            yield from options_by_command(command.get_command(context, name), context, (*words, name))
    else:
        yield words, {max(one.opts, key=len) for one in command.params if isinstance(one, click.Option)}


def test_replay_and_diff_have_few_options_that_no_other_command_has():
    found = dict(options_by_command(main, click.Context(main)))
    own = found.pop(("replay",)) | found.pop(("diff",))
    assert 0 < len(own - set().union(*found.values())) <= 8
