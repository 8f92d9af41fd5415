"""`--set KEY=VALUE` on the commands that take a scenario, and `replay` of streams whose header has one."""

import json
import re

import pytest

from miro_protocol import stream, stream_header
from miro_protocol.frames import TeamFrame, encode
from miro_protocol.transmission import Transmission
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from tests.mirotwin.conftest import SHORT, hex_file

SETTINGS = ("duration_s=0.1", "network.robot.0.start_error_x_cm=3", "network.radio.carrier=on")


def options(settings=SETTINGS):
    return [word for setting in settings for word in ("--set", setting)]


@pytest.fixture(scope="module")
def run(mirotwin, short, tmp_path_factory):
    """The folder of a run of the short scenario with settings."""
    folder = tmp_path_factory.mktemp("set") / "out"
    out = mirotwin.succeeds("run", short, *options(), "--no-figure", "--out", folder)
    assert f"set       {' '.join(SETTINGS)}\n" in out
    return folder


def test_a_run_with_settings_is_the_run_of_the_edited_file(mirotwin, run, tmp_path):
    edited = tmp_path / "edited.toml"
    text = SHORT.replace("duration_s = 0.2", "duration_s = 0.1")
    text = text.replace("start_error_x_cm = 2.0", "start_error_x_cm = 3.0")
    edited.write_text(text.replace("bit_error_rate = 2e-3", 'bit_error_rate = 2e-3\ncarrier = "on"'))
    assert mirotwin("run", edited, "--no-figure", "--out", tmp_path / "out", "-q")[0] == 0
    one, other = (json.loads((folder / "summary.json").read_bytes()) for folder in (run, tmp_path / "out"))
    assert one["digest"] == other["digest"]
    assert tuple(one["set"]) == SETTINGS
    assert "set" not in other


def test_its_recording_replays_to_the_same_response(mirotwin, run):
    out = mirotwin.succeeds("replay", run / "run.mcap", "-q")
    assert "equals the recorded one in all 3 control periods" in out


def test_a_recording_may_be_replayed_with_other_settings(mirotwin, run):
    err = mirotwin.ends(4, "replay", run / "run.mcap", "-q", "--set", "network.robot.1.slot=1")
    assert "the replay differs in control period 0" in err
    err = mirotwin.refuses("replay", run / "run.mcap", "--set", "network.robot.1.slot=7")
    assert "run.mcap: scenario.toml: --set network.robot.1.slot=7: 7 is out of range; must be <= 4" in err


def test_a_stream_runs_in_the_default_scenario_with_its_settings(mirotwin, tmp_path):
    path = tmp_path / "stream.txt"
    path.write_text(f"24000 > {encode(TeamFrame(0, 1, ((256, 256),) * 3), 3).hex(' ')}\n")
    rates = [f"network.radio.bit_error_rate={rate}" for rate in (0, 0.5)]
    heard = [mirotwin("replay", path, "-q", "--set", rate) for rate in rates]
    assert heard[0] == mirotwin("replay", path, "-q")
    assert heard[0] != heard[1]
    err = mirotwin.refuses("replay", path, "--set", "network.radoi.latency_s=0")
    said = "--set network.radoi.latency_s=0: network[0].radoi: unknown key; did you mean radio?"
    assert f"{path}: {said}" in err


def test_show_prints_a_file_that_runs_the_same(mirotwin, run, tmp_path):
    short = tmp_path / "short.toml"
    short.write_text(SHORT)
    out = mirotwin.succeeds("scenarios", "show", short, *options())
    shown = tmp_path / "shown.toml"
    shown.write_text(out)
    assert mirotwin("run", shown, "--no-figure", "--out", tmp_path / "out", "-q")[0] == 0
    one, other = (json.loads((folder / "summary.json").read_bytes()) for folder in (run, tmp_path / "out"))
    assert one["digest"] == other["digest"]


def test_the_commands_that_look_into_a_run_take_settings(mirotwin, short, run):
    shorter = ("--set", "duration_s=0.05")
    one, other = (mirotwin.succeeds("fw", "profile", short, *words) for words in (options(), shorter))
    assert one != other
    mirotwin.succeeds("fw", "profile", run / "run.mcap", *shorter)


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (["run", "fig6", "--set", "duration=1"], "fig6: --set duration=1: unknown key; use duration_s, in seconds"),
        (["run", "fig6", "--set"], "Option '--set' requires an argument"),
        (["scenarios", "show", "fig6", "--set", "x"], "fig6: --set x: is no setting; write KEY=VALUE"),
        (["fw", "trace", "fig6", "--set", "duration_s=-1"], "fig6: --set duration_s=-1: -1 is out of range"),
        (["fw", "trace", "IMAGE", "--set", "duration_s=1"], "an image on the bare processor, --set does not apply"),
        (["scenarios", "show", "fig6", "--set", "title=a\nb\x1b[2J", "--set", "x=1"], "--set x=1: unknown key"),
    ],
)  # fmt: skip
def test_a_setting_that_cannot_be_is_one_line_and_exit_code_2(mirotwin, tmp_path, monkeypatch, command, said):
    image = hex_file(tmp_path / "a.ihx", b"\x80\xfe")
    monkeypatch.chdir(tmp_path)
    assert said in mirotwin.refuses(*(image if word == "IMAGE" else word for word in command))
    assert list(tmp_path.iterdir()) == [image]


FRAMES = [encode(TeamFrame(0, seq, ((500, 500), (0, 0), (-500, -500))), 3) for seq in range(3)]
SENT = [Transmission(100_000 + index * 800_800, ">", data) for index, data in enumerate(FRAMES)]
OTHER = "0123456789abcdef" * 4
V2 = "# mirotwin stream 2\n"


def in_header(scenario):
    """A scenario as the table [scenario] of a header."""
    return "[scenario]\n" + re.sub(r"(\[+)network", r"\1scenario.network", scenario)


def counters(out):
    """Robot, accepted, rejected and stale of the table at the end."""
    lines = [line.split() for line in out.splitlines()]
    head = max(place for place, words in enumerate(lines) if words[:2] == ["robot", "accepted"])
    return [words[:4] for words in lines[head + 1 :] if words]


def test_characters_with_a_bad_stop_bit_reach_the_robot_so(mirotwin, tmp_path):
    flawed = Transmission(SENT[1].tick, ">", FRAMES[1], 0, (22,))
    stream.write(tmp_path / "a.stream", [SENT[0], flawed, SENT[2]])
    out = mirotwin.succeeds("replay", tmp_path / "a.stream")
    assert counters(out) == [[str(slot), "2", "0", "0"] for slot in range(3)]
    assert "23 bytes, bad stop bit" in out


def test_every_network_has_robots_of_its_own(mirotwin, tmp_path):
    five = encode(TeamFrame(0, 9, ((1, 1),) * 5), 5)
    stream.write(tmp_path / "a.stream", [*SENT, Transmission(2_500_000, ">", five, 1)])
    out = mirotwin.succeeds("replay", tmp_path / "a.stream")
    assert [row[1] for row in counters(out)] == ["3"] * 3 + ["1"] * 5


def test_the_scenario_of_the_header_runs_with_its_seed(mirotwin, tmp_path):
    header = stream_header.of_text("seed = 3\n" + in_header(SHORT))
    stream.write(tmp_path / "a.stream", SENT, header)
    assert [row[0] for row in counters(mirotwin.succeeds("replay", tmp_path / "a.stream"))] == ["0", "2"]
    accepted = set()
    for seed in range(6):  # about every second frame is lost
        noisy = in_header(SHORT.replace("2e-3", "5e-3"))
        stream.write(tmp_path / "a.stream", SENT, stream_header.of_text(f"seed = {seed}\n{noisy}"))
        accepted.add(counters(mirotwin("replay", tmp_path / "a.stream")[1])[0][1])
    assert len(accepted) > 1


def test_what_the_header_expects_is_judged(mirotwin, tmp_path):
    met = "[expect]\nacts_within_ms = true\naccepts_only_sent = true\nframes_accepted_min = 3"
    stream.write(tmp_path / "a.stream", SENT, stream_header.of_text(met))
    assert mirotwin("replay", "-q", tmp_path / "a.stream")[::2] == (0, "")
    missed = "[expect]\nacts_within_ms = true\nwheels_within_m_s = {limit_m_s = 0.04}"
    stream.write(tmp_path / "a.stream", SENT[:1], stream_header.of_text(missed))
    err = mirotwin.ends(1, "replay", "-q", tmp_path / "a.stream")
    assert err.startswith("mirotwin: expectation failed: wheels_within_m_s: net0/robot0: tick ")
    assert err.count("wanted orders to a wheel of at most 0.04 m/s, found 0.0439 m/s for the left one") == 1
    mirotwin.succeeds("replay", "-q", tmp_path / "a.stream", "--expect", "wheels_within_m_s=0.05")


def test_a_built_in_scenario_is_taken_by_its_name(mirotwin, tmp_path):
    stream.write(tmp_path / "a.stream", SENT, stream_header.of_text("scenario = 'fig8'"))
    assert [row[0] for row in counters(mirotwin.succeeds("replay", tmp_path / "a.stream"))] == ["0"]


def test_settings_of_the_header_are_made_before_those_of_the_command(mirotwin, tmp_path):
    slots = "set = { network = { robot = { 0 = { slot = 2 } } }, duration_s = 0.5 }"
    stream.write(tmp_path / "a.stream", SENT, stream_header.of_text(f"scenario = 'fig8'\n{slots}"))
    assert [row[0] for row in counters(mirotwin.succeeds("replay", tmp_path / "a.stream"))] == ["2"]
    out = mirotwin("replay", tmp_path / "a.stream", "--set", "network.robot.slot=1")[1]
    assert [row[0] for row in counters(out)] == ["1"]


@pytest.mark.parametrize(
    ("header", "lines", "what"),
    [
        ("scenario = 'fig5'", "", "header: scenario: 'fig5' is no built-in scenario; give one of curve, fig6, "),
        ("[scenario]\nname = 'a'\nduration_s = 0.1\nnetwork = []", "", "header: scenario: network: "),
        (in_header(SHORT).replace("duration_s", "duration_x"), "", "duration_x"),
        (in_header(SHORT), "2000000 >@1 55", "tick 2000000: network 1 does not exist; there is 1"),
        (in_header(SHORT), "4799000 > 55", "tick 4799000: ends at tick 4824000, but the scenario ends at"),
        ("set = {duration_x = 1}", "", "--set duration_x=1: "),
        ("set = {network.robot = 5}", "", "--set network.robot=5: "),
        ("[expect]\nno_fault = 3", "", "--expect no_fault=3: expected true or false, got 3; write no_fault = true"),
        ("expect = {tracks_within_m = 1}", "", "--expect tracks_within_m=1: there is no such check; use tracks_with"),
        (f"firmware_sha256 = '{OTHER}'", "", "header: the stream is for firmware 0123456789ab.., this is"),
        (in_header(SHORT), "2000000 *@0/1 reset 1", "tick 2000000: no robot in slot 1; there is 0, 2"),
        (in_header(SHORT), "4900000 *@0 radio up", "tick 4900000: ends at tick 4900000, but the scenario ends at"),
        (in_header(SHORT), "2000000 *@1 radio up", "tick 2000000: network 1 does not exist; there is 1"),
        ("", "2000000 * P1.0 1", "tick 2000000: P1.0 is of a part or a pin of a board, and robots have none"),
        ("", "1701700 >@31 55\n1800000 >@32 55", "tick 1800000: network 32 does not exist; there are 32"),
        ("", "1701700 >@1 55\n1702000 >@1 55", "tick 1702000: starts before the transmission of tick 1701700"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("command", [["replay"], ["fw", "profile"]])
def test_what_cannot_be_done_is_refused_with_one_line(mirotwin, tmp_path, command, header, lines, what):
    path = tmp_path / "a.stream"
    text = stream.format_stream(SENT, stream_header.of_text(header) if header else None)
    text = text.replace("stream 1", "stream 2") + (lines + "\n" if lines else "")
    path.write_text(text if header else text.replace("\n", "\n#: seed = 1\n", 1))
    err = mirotwin.refuses(*command, path)
    assert err.startswith(f"{path}:")
    assert what in err


def test_another_image_may_be_named(mirotwin, tmp_path):
    own = load_hex(image_path()).sha256
    stream.write(tmp_path / "own.stream", SENT, stream_header.of_text(f'firmware_sha256 = "{own}"'))
    assert mirotwin("replay", tmp_path / "own.stream", "-q")[::2] == (0, "")
    stream.write(tmp_path / "a.stream", SENT, stream_header.of_text(f'firmware_sha256 = "{OTHER}"'))
    err = mirotwin.ends(0, "replay", tmp_path / "a.stream", "-q", "--firmware", image_path())
    assert "the stream is for firmware 0123456789ab.., this is" in err


@pytest.mark.parametrize("command", [["decode"], ["export", "--out", "-", "--as", "pcapng"]])
def test_decoding_and_exporting_refuse_an_event_after_what_came_before(mirotwin, tmp_path, command):
    path = tmp_path / "a.stream"
    path.write_text(f"{V2}5 > 55\n9 *@0 radio down\n99999 > 55\n")
    assert f"{path}:3:1: an action, which this command does not support" in mirotwin.ends(2, *command, path)


def test_a_robot_that_is_reset_counts_anew_and_a_radio_that_is_off_lets_nothing_through(mirotwin, tmp_path):
    (tmp_path / "a.stream").write_text(
        V2
        + f"2 > {FRAMES[0].hex(' ')}\n800000 *@0/1 reset 1\n800100 *@0/1 reset 0\n800200 *@0/2 power 0\n"
        + f"5000000 > {FRAMES[1].hex(' ')}\n6000000 *@0 radio down\n6400000 > {FRAMES[2].hex(' ')}\n"
    )
    assert [row[1] for row in counters(mirotwin.succeeds("replay", tmp_path / "a.stream"))] == ["2", "1", "0"]


def test_an_action_at_a_network_beyond_the_colours_of_teams_is_done(mirotwin, tmp_path):
    (tmp_path / "a.stream").write_text(V2 + "960000 *@5 radio up\n970000 *@5/0 reset 1\n")
    mirotwin.succeeds("replay", tmp_path / "a.stream")
