"""`mirotwin scenarios`, and how the command line refuses what it is not meant to get."""

import tomllib

import click
import pytest
from click.testing import CliRunner

from miro_sim.scenario.file import builtin_text, parse
from mirotwin.shell.program import MainGroup

REPORT = "please report this line with the command (MIROTWIN_TRACEBACK=1 shows the place)"


def test_the_built_in_scenarios_are_listed_with_what_they_show(mirotwin):
    out = mirotwin.succeeds("scenarios")
    assert "fig6" in out
    assert "Arc, initial errors (11.20 cm, 28.92 cm, -1.31 rad)" in out
    assert out.endswith("\nwrite one out, to start from: mirotwin scenarios show NAME\n")


@pytest.mark.parametrize("name", ["fig6", "fig10"])
def test_show_prints_the_file_as_it_stands(mirotwin, name):
    assert mirotwin("scenarios", "show", name) == (0, builtin_text(name), "")
    assert tomllib.loads(mirotwin("scenarios", "show", name)[1])["name"] == name


@pytest.mark.parametrize("command", [["scenarios", "show"], ["run"]])
def test_the_help_has_the_three_lines_that_derive_a_scenario(mirotwin, command):
    lines = mirotwin(*command, "--help")[1].splitlines()
    first = next(number for number, line in enumerate(lines) if line.strip() == 'scenario = "fig6"')
    mine = parse("\n".join(lines[first : first + 3]).replace("    ", ""), "mine.toml")
    assert (mine.name, mine.networks[0].robot[0].controller.q1_per_s) == ("mine", 0.3)


OFF_THE_PITCH = "network.robot.reference.heading_deg=180"


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["scenarios", "show", "fig5"], "fig5: no such scenario; did you mean"),
        (["run", "fig5"], "fig5: no such scenario; did you mean"),
        (["run", "absent.toml"], "absent.toml: no such file"),
        (["run", "fig6", "--set", OFF_THE_PITCH], f"fig6: --set {OFF_THE_PITCH}: "),
        (["run", "fig6", "--seed", "-1"], "Invalid value for '--seed': -1 is not in the range"),
        (["run", "fig6", "--seed", str(1 << 63)], "Invalid value for '--seed': 9223372036854775808"),
        (["run", "fig6", "--seed", "one"], "Invalid value for '--seed': 'one' is not a whole number"),
        (["run", "fig6", "--engine", "numba"], "Invalid value for '--engine': 'numba' is not one of"),
        (["run"], "Missing argument 'SCENARIO'"),
        (["run", "fig6", "--sed", "3"], "No such option '--sed'; did you mean --seed?"),
        (["camera", "track", "--colour=x"], "No such option '--colour'; did you mean --colours?"),
        (["run", "fig6", "--zzzzz"], "No such option '--zzzzz'. See `"),
        (["rnu"], "No such command 'rnu'; did you mean run?"),
        (["fw", "trce"], "No such command 'trce'; did you mean trace?"),
        (["scenarios", "fig6"], "No such command 'fig6'; did you mean `scenarios show fig6`?"),
        (["scenarios", "x.toml"], "No such command 'x.toml'; did you mean `scenarios show x.toml`?"),
        (["scenarios", "shwo"], "No such command 'shwo'; did you mean show?"),
        (["xyz"], "No such command 'xyz'; there are run, "),
        (["replay", "absent.mcap"], "absent.mcap: No such file or directory"),
    ],
)
def test_bad_input_is_one_line_on_stderr_and_exit_code_2(mirotwin, arguments, expected):
    assert mirotwin.refuses(*arguments).startswith(expected)


def test_without_a_command_the_help_is_shown(mirotwin):
    assert "Simulate:" in mirotwin.ends(2)


@pytest.mark.parametrize(
    ("raised", "code", "line"),
    [
        (KeyboardInterrupt(), 130, "interrupted"),
        (OSError(28, "No space left on device", "a.mcap"), 2, "error: a.mcap: No space left on device"),
        (ZeroDivisionError(), 70, f"internal error: ZeroDivisionError; {REPORT}"),
    ],
)
def test_what_a_command_raises_is_a_line_and_no_traceback(raised, code, line):
    @click.group(cls=MainGroup)
    def group(): ...

    @group.command()
    def stumble():
        raise raised

    result = CliRunner().invoke(group, ["stumble"])
    assert (result.exit_code, result.stderr.lstrip("\n")) == (code, f"mirotwin: {line}\n")


def test_what_a_setting_leaves_out_is_told_on_stderr(mirotwin, tmp_path):
    settings = ("--set", "camera.kind=geometric", "--set", "duration_s=0.1")
    code, _, err = mirotwin("run", "fig6", *settings, "--out", tmp_path / "out", "--no-figure", "-q")
    left_out = "--set camera.kind=geometric leaves out centroid, window_px, self_calibration"
    assert (code, err) == (0, f"mirotwin: note: {left_out}\n")
