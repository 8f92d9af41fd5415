"""`--set KEY=VALUE` on the commands that take a scenario."""

import json

import pytest

from miro_protocol.frames import TeamFrame, encode
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
